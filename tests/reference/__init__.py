"""The cage model written a second time, in plain Python, and integrated by SciPy.

| module        | responsibility                                                               |
|---------------|------------------------------------------------------------------------------|
| `_land`       | film and contact of the lands, in polar coordinates                          |
| `_statics`    | viscosity, loaded zone, restitution: what is worked out once                 |
| `_pulses`     | the impact of a roller on a bar, and the train of all of them                |
| `_field`      | the equations of motion of a dictionary of numbers, cage alone or with a rib |
| `_integrate`  | revolutions and the growth of a tangent vector                               |
| `_shooting`   | orbits and bifurcations by Newton's method                                   |
| `_random`     | random legal models by seed                                                  |
| `_whole`      | the whole bearing: rollers, cage and ring as free bodies                     |

Formulas come from the physics page and, where that leaves a detail open, from the package's docstrings; none of its
code is used but what makes a model and lists its numbers. Shared by the tests and
`benchmarks.truth`.
"""

from ._field import Field as Field, field as field, numbers_of as numbers_of
from ._integrate import (
    ESCAPE as ESCAPE,
    Outside as Outside,
    TooLong as TooLong,
    confirmed as confirmed,
    growth as growth,
    revolutions as revolutions,
    sampled as sampled,
)
from ._pulses import pulse as pulse
from ._random import (
    SPEEDS as SPEEDS,
    random_model as random_model,
    random_speeds as random_speeds,
    random_state as random_state,
)
from ._shooting import bifurcation as bifurcation
from ._whole import WholeBearing as WholeBearing, gupta as gupta
