"""Integration of many lanes: the law traced in JAX, the loop over steps in machine code, and diffrax beside it.

| module        | responsibility                                                                          |
|---------------|-----------------------------------------------------------------------------------------|
| `program`     | a scalar function traced: its elementary operations                                     |
| `ir`          | such a function as LLVM IR on vectors of lanes                                          |
| `object_code` | compiling, storing and loading LLVM IR                                                  |
| `layout`      | what the loop is given: methods, programs of a model, rows of its working memory        |
| `step_control`| the estimated error of a step, and the size of the next one                             |
| `loop`        | the integration loop: lanes, strobe states, growth of tangents                          |
| `fields`      | a model's programs for that loop; the whole bearing as a loop over its rollers          |
| `engine`      | the engine of a model; lanes, each a design at a speed; histories                       |
| `jax_engine`  | the engine inside JAX, for methods and laws without machine code                        |
| `method`      | methods by name: machine code, a fixed number of steps, or adaptive steps               |
| `solvers`     | diffrax solvers of our own: Rosenbrock, classical Runge-Kutta                           |
| `kernel`      | a step of a method as a scalar function                                                 |
| `xla_call`    | machine code that JAX's programs call                                                   |
| `march`       | equal steps inside JAX's programs: lanes, tangents, derivatives of any order            |
| `strobe_map`  | the strobe map, differentiable; tangents along which the field changes too              |
| `simulate`    | time histories, speed ramps                                                             |
| `outcomes`    | results of a run, and how it ended                                                      |
"""

from .._arguments import check_layer
from .engine import (
    RETRIES as RETRIES,
    SURE as SURE,
    Engine as Engine,
    Lanes as Lanes,
    alike as alike,
    cores as cores,
    engine_of as engine_of,
    errors_of_parts as errors_of_parts,
    histories as histories,
)
from .ir import UnknownOperation as UnknownOperation, say_once as say_once
from .jax_engine import JaxEngine as JaxEngine
from .kernel import REVOLUTION as REVOLUTION
from .layout import PAIRS as PAIRS
from .loop import (
    DIVERGED as DIVERGED,
    FINISHED as FINISHED,
    NOT_FINITE as NOT_FINITE,
    OUTSIDE as OUTSIDE,
    STUCK as STUCK,
    TOO_MANY as TOO_MANY,
)
from .march import march as march, march_with_tangents as march_with_tangents, with_tangents as with_tangents
from .method import (
    DEFAULT_ERROR as DEFAULT_ERROR,
    IMPLICIT as IMPLICIT,
    AbstractMethod as AbstractMethod,
    AdaptiveSteps as AdaptiveSteps,
    FixedSteps as FixedSteps,
    Moved as Moved,
    NativeSteps as NativeSteps,
    Stretch as Stretch,
    method as method,
    native as native,
)
from .outcomes import (
    OUTCOMES as OUTCOMES,
    RESULTS as RESULTS,
    March as March,
    codes_of as codes_of,
    outcome_code as outcome_code,
)
from .simulate import (
    Trajectory as Trajectory,
    ramp as ramp,
    simulate as simulate,
)
from .solvers import (
    ClassicalRK4 as ClassicalRK4,
    Rodas4 as Rodas4,
    rosenbrock_step as rosenbrock_step,
)
from .strobe_map import StrobeMap as StrobeMap, pushed as pushed, strobe_map as strobe_map


check_layer(
    globals(),
    "method native ramp simulate strobe_map",
)
