"""Integration through diffrax, one revolution at a time.

| module         | responsibility                                                                     |
|----------------|------------------------------------------------------------------------------------|
| `_rosenbrock`  | structured L-stable Rosenbrock methods as diffrax solvers                          |
| `_explicit`    | the classical Runge-Kutta method as a diffrax solver; stages of explicit methods   |
| `_newmark`     | the paper's Newmark-beta as a diffrax solver                                       |
| `_method`      | solver plus step choice (fixed per revolution, or adaptive), by name               |
| `_native`      | machine code with error control: the method of sweeps                              |
| `_kernel`      | a step of a method as a scalar function                                            |
| `_strobe`      | the strobe map that everything uses                                                |
| `_revolution`  | a revolution with tangent vectors along which the field changes too                |
| `_engine`      | lanes, and what runs them                                                          |
| `_in_jax`      | the strobe map of many lanes inside JAX                                            |
| `_simulate`    | time histories, speed ramps                                                        |
| `_lanes`       | the whole bearing over a stretch of angle or time, many lanes at once              |
| `_arrow`       | the whole bearing's Jacobian, and its solution                                     |
| `_implicit`    | an implicit step of the whole bearing                                              |
| `_bearing`     | time histories of the whole bearing                                                |
| `_bearing_pace`| limits of its steps, and the stretch over which two runs are compared             |
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
from ._engine import (
    RETRIES as RETRIES,
    SURE as SURE,
    Lanes as Lanes,
    alike as alike,
    cores as cores,
    engine_of as engine_of,
    histories as histories,
)
from ._explicit import ClassicalRK4 as ClassicalRK4
from ._implicit import implicit_step as implicit_step
from ._in_jax import EngineInJax as EngineInJax
from ._method import (
    REVOLUTION as REVOLUTION,
    AbstractMethod as AbstractMethod,
    AdaptiveSteps as AdaptiveSteps,
    FixedSteps as FixedSteps,
    Moved as Moved,
    Stretch as Stretch,
    method as method,
)
from ._native import DEFAULT_ERROR as DEFAULT_ERROR, IMPLICIT as IMPLICIT, NativeSteps as NativeSteps, native as native
from ._newmark import NewmarkBeta as NewmarkBeta
from ._results import OUTCOMES as OUTCOMES, RESULTS as RESULTS, codes_of as codes_of, outcome_code as outcome_code
from ._revolution import pushed as pushed
from ._rosenbrock import Rodas3 as Rodas3, Rodas4 as Rodas4
from ._simulate import Trajectory as Trajectory, ramp as ramp, simulate as simulate
from ._strobe import StrobeMap as StrobeMap, strobe_map as strobe_map


check_layer(
    globals(),
    "method native ramp simulate strobe_map",
)
