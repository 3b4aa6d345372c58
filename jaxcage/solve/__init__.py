"""Integration of many lanes in machine code: the law traced in JAX, the loop over steps in LLVM.

| module       | responsibility                                                                   |
|--------------|----------------------------------------------------------------------------------|
| `program`    | a scalar function traced: its elementary operations                              |
| `ir`         | such a function as LLVM IR on vectors of lanes                                   |
| `object_code`| compiling, keeping and loading LLVM IR                                           |
| `loop`       | the integration loop: step control, strobe states, growth of tangents            |
| `machine`    | tracing a system for that loop, and calling it                                   |
| `bearing`    | the whole bearing for that loop: a loop over its rollers                         |
| `rosenbrock` | a step of an implicit method, for stiff laws                                     |
| `call`       | machine code that JAX's programs call                                            |
| `steps`      | equal steps inside JAX's programs: lanes, tangents, derivatives of any order     |
"""

from .bearing import (
    INTEGRATED as INTEGRATED,
    WATCHED as WATCHED,
    BearingLimits as BearingLimits,
    Bearings as Bearings,
)
from .ir import UnknownOperation as UnknownOperation, say_once as say_once
from .loop import (
    DIVERGED as DIVERGED,
    FINISHED as FINISHED,
    NOT_FINITE as NOT_FINITE,
    OUTSIDE as OUTSIDE,
    PAIRS as PAIRS,
    STUCK as STUCK,
    TOO_MANY as TOO_MANY,
)
from .machine import FIRST_STEP as FIRST_STEP, Engine as Engine, March as March, room_for as room_for
from .program import Numbers as Numbers
from .rosenbrock import (
    RODAS3 as RODAS3,
    RODAS4 as RODAS4,
    RosenbrockTableau as RosenbrockTableau,
    combine as combine,
    rosenbrock_step as rosenbrock_step,
)
from .steps import (
    lanewise as lanewise,
    march as march,
    march_with_tangents as march_with_tangents,
    with_tangents as with_tangents,
)
