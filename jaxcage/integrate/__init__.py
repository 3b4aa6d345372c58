"""Integration through diffrax, one revolution at a time.

| module         | responsibility                                                                     |
|----------------|------------------------------------------------------------------------------------|
| `_rosenbrock`  | structured L-stable Rosenbrock methods as diffrax solvers                          |
| `_explicit`    | the classical Runge-Kutta method as a diffrax solver                               |
| `_newmark`     | the paper's Newmark-beta as a diffrax solver                                       |
| `_method`      | solver plus step choice (fixed per revolution, or adaptive), by name               |
| `_lanewise`    | a scalar function in every lane as one compiled loop                               |
| `_kernel`      | a step as such a function, with tangent vectors                                    |
| `_device`      | a revolution as one kernel on a GPU                                                |
| `_strobe`      | the strobe map that everything uses                                                |
| `_lanes`       | strobe maps of many lanes at once                                                  |
| `_simulate`    | time histories, speed ramps                                                        |
| `_results`     | how an integration ended                                                           |
"""

from ._explicit import ClassicalRK4 as ClassicalRK4
from ._lanes import StrobeLanes as StrobeLanes
from ._lanewise import is_lanewise as is_lanewise, lanewise as lanewise
from ._method import (
    REVOLUTION as REVOLUTION,
    AbstractMethod as AbstractMethod,
    AdaptiveSteps as AdaptiveSteps,
    ControlledSteps as ControlledSteps,
    FixedSteps as FixedSteps,
    Stretch as Stretch,
    controlled as controlled,
    method as method,
)
from ._newmark import NewmarkBeta as NewmarkBeta
from ._results import OUTCOMES as OUTCOMES, RESULTS as RESULTS, outcome_code as outcome_code
from ._rosenbrock import (
    RODAS3 as RODAS3,
    RODAS4 as RODAS4,
    Rodas3 as Rodas3,
    Rodas4 as Rodas4,
    RosenbrockTableau as RosenbrockTableau,
    rosenbrock_step as rosenbrock_step,
)
from ._simulate import Trajectory as Trajectory, ramp as ramp, simulate as simulate
from ._strobe import StrobeMap as StrobeMap, strobe_map as strobe_map
