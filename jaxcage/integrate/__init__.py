"""Integration through diffrax, one revolution at a time.

| module         | responsibility                                                                     |
|----------------|------------------------------------------------------------------------------------|
| `_rosenbrock`  | structured L-stable Rosenbrock methods as diffrax solvers                          |
| `_newmark`     | the paper's Newmark-beta as a diffrax solver                                       |
| `_method`      | solver plus step choice (fixed per revolution, or adaptive), by name               |
| `_strobe`      | the strobe map that everything uses                                                |
| `_simulate`    | time histories, speed ramps                                                        |
| `_results`     | how an integration ended                                                           |
"""

from ._method import (
    AbstractMethod as AbstractMethod,
    AdaptiveSteps as AdaptiveSteps,
    FixedSteps as FixedSteps,
    method as method,
    REVOLUTION as REVOLUTION,
    Stretch as Stretch,
)
from ._newmark import NewmarkBeta as NewmarkBeta
from ._results import outcome_code as outcome_code, OUTCOMES as OUTCOMES, RESULTS as RESULTS
from ._rosenbrock import (
    RODAS3 as RODAS3,
    Rodas3 as Rodas3,
    RODAS4 as RODAS4,
    Rodas4 as Rodas4,
    rosenbrock_step as rosenbrock_step,
    RosenbrockTableau as RosenbrockTableau,
)
from ._simulate import ramp as ramp, simulate as simulate, Trajectory as Trajectory
from ._strobe import strobe_map as strobe_map, StrobeMap as StrobeMap
