"""Integration through diffrax, one revolution at a time.

| module         | responsibility                                                                     |
|----------------|------------------------------------------------------------------------------------|
| `_rosenbrock`  | structured L-stable Rosenbrock methods as diffrax solvers                          |
| `_explicit`    | the classical Runge-Kutta method as a diffrax solver; stages of explicit methods   |
| `_newmark`     | the paper's Newmark-beta as a diffrax solver                                       |
| `_method`      | solver plus step choice (fixed per revolution, or adaptive), by name               |
| `_controlled`  | as many steps as a revolution needs, and its error                                 |
| `_native`      | machine code with error control: the method of sweeps                              |
| `_kernel`      | a step of a method as a scalar function                                            |
| `_strobe`      | the strobe map that everything uses                                                |
| `_revolution`  | a revolution with tangent vectors, each lane by as many steps as it needs          |
| `_simulate`    | time histories, speed ramps                                                        |
| `_lanes`       | the whole bearing over a stretch of angle or time, many lanes at once              |
| `_arrow`       | the whole bearing's Jacobian, and its solution                                     |
| `_implicit`    | an implicit step of the whole bearing                                              |
| `_bearing`     | time histories of the whole bearing                                                |
| `_bearing_pace`| how far it is followed before it is compared with the same by longer steps         |
| `_results`     | how an integration ended                                                           |
"""

from .._arguments import check_layer
from ._arrow import Parts as Parts, arrow as arrow, factors as factors
from ._bearing import (
    BearingRun as BearingRun,
    bearing_over_time as bearing_over_time,
    simulate_bearing as simulate_bearing,
)
from ._bearing_pace import (
    SAMPLES as SAMPLES,
    SPACING as SPACING,
    STALLED as STALLED,
    comparable as comparable,
    limits_of as limits_of,
    slowness as slowness,
)
from ._controlled import (
    DEFAULT_ERROR as DEFAULT_ERROR,
    SURE as SURE,
    ControlledSteps as ControlledSteps,
    controlled as controlled,
    finer as finer,
    stated as stated,
)
from ._explicit import ClassicalRK4 as ClassicalRK4
from ._implicit import implicit_step as implicit_step
from ._method import (
    REVOLUTION as REVOLUTION,
    AbstractMethod as AbstractMethod,
    AdaptiveSteps as AdaptiveSteps,
    FixedSteps as FixedSteps,
    Moved as Moved,
    Stretch as Stretch,
    method as method,
)
from ._native import NativeSteps as NativeSteps, native as native, refined as refined
from ._newmark import NewmarkBeta as NewmarkBeta
from ._results import OUTCOMES as OUTCOMES, RESULTS as RESULTS, outcome_code as outcome_code
from ._revolution import BLOCK as BLOCK, pushed as pushed, revolution as revolution
from ._rosenbrock import (
    RODAS4 as RODAS4,
    Rodas3 as Rodas3,
    Rodas4 as Rodas4,
    rosenbrock_step as rosenbrock_step,
)
from ._simulate import Trajectory as Trajectory, ramp as ramp, simulate as simulate
from ._strobe import StrobeMap as StrobeMap, strobe_map as strobe_map


check_layer(
    globals(),
    "controlled method ramp simulate strobe_map",
)
