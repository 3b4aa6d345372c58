"""Integration of many lanes (trajectories), in machine code generated from laws traced in JAX, or by diffrax.

| module         | responsibility                                                                         |
|----------------|----------------------------------------------------------------------------------------|
| `program`      | a traced scalar function: its elementary operations                                    |
| `ir`           | such a function as LLVM IR on vectors of lanes                                         |
| `object_code`  | compiling, storing and loading LLVM IR; its call from JAX's programs                   |
| `layout`       | inputs of the loop: methods, programs of a model, rows of its working memory           |
| `loop`         | the integration loop: lanes, strobe states, growth of tangent vectors                  |
| `step_control` | error of a step and size of the next one                                               |
| `fields`       | a model's programs for that loop; the whole bearing as a loop over its rollers         |
| `engine`       | the engine of a model; lanes, each a design at a speed; histories                      |
| `method`       | methods by name: machine code, a fixed number of steps, or adaptive steps              |
| `kernel`       | a step of a method as a scalar function                                                |
| `strobe_map`   | the return map of one revolution                                                       |
| `march`        | equal steps inside JAX's programs: lanes, tangents, derivatives of any order           |
| `simulate`     | time histories, speed ramps                                                            |
| `outcomes`     | results of a run, and how it ended                                                     |
"""

from .._arguments import check_layer
from .engine import (
    RETRIES as RETRIES,
    SURE as SURE,
    WIDTH as WIDTH,
    Engine as Engine,
    JaxEngine as JaxEngine,
    Lanes as Lanes,
    cores as cores,
    engine_of as engine_of,
    errors_of_parts as errors_of_parts,
    histories as histories,
)
from .ir import say_once as say_once
from .kernel import REVOLUTION as REVOLUTION, rosenbrock_step as rosenbrock_step
from .march import march as march
from .method import (
    IMPLICIT as IMPLICIT,
    AbstractMethod as AbstractMethod,
    FixedSteps as FixedSteps,
    NativeSteps as NativeSteps,
    method as method,
    native as native,
)
from .outcomes import (
    FINISHED as FINISHED,
    INACCURATE as INACCURATE,
    NOT_FINITE as NOT_FINITE,
    OUTCOMES as OUTCOMES,
    OUTSIDE as OUTSIDE,
    STUCK as STUCK,
    TOO_MANY as TOO_MANY,
    March as March,
)
from .program import depends as depends
from .simulate import Trajectory as Trajectory, ramp as ramp, simulate as simulate
from .strobe_map import StrobeMap as StrobeMap, strobe_map as strobe_map


check_layer(globals(), "method native ramp simulate strobe_map")
