"""Numbers of this package beside numbers that others printed, or that follow from a closed form or another program.

| module            | responsibility                                                         |
|-------------------|------------------------------------------------------------------------|
| `_comparison`     | one number beside another, with the tolerance that its source supports |
| `_literature`     | numbers that others found, each once: the page and the tests read them |
| `_film`           | oil film: closed forms, printed tables of finite bearings              |
| `_finite_volumes` | a bearing of finite length a second time, in SciPy                     |
| `_statics`        | loads of the rollers, kinematics                                       |
| `_contact`        | restitution and impact                                                 |
| `_exponents`      | Lyapunov exponents of well-known systems                               |
| `_bifurcations`   | periodic orbits and their bifurcations                                 |
| `_shooting`       | doublings and exponents of oscillators a second time, in SciPy         |
| `_cage`           | the cage: unbalance response, whirl, another integration               |
| `_page`           | all of it as one page of Markdown                                      |
"""

from collections.abc import Callable, Mapping

from ._bifurcations import bifurcation_comparisons, pendulum_comparisons as pendulum_comparisons
from ._cage import cage_comparisons
from ._comparison import Comparison as Comparison
from ._contact import contact_comparisons
from ._exponents import exponent_comparisons
from ._film import (
    FULL_BEARINGS as FULL_BEARINGS,
    film_comparisons,
    full_bearing_comparisons as full_bearing_comparisons,
    grooved_whirl as grooved_whirl,
    lund_thomsen_comparisons as lund_thomsen_comparisons,
    nicholas_comparisons as nicholas_comparisons,
)
from ._finite_volumes import (
    film_equations as film_equations,
    film_pressure as film_pressure,
    full_bearing as full_bearing,
)
from ._literature import (
    DUFFING_DOUBLINGS as DUFFING_DOUBLINGS,
    DUFFING_FOLDS as DUFFING_FOLDS,
    DUFFING_SLOPES as DUFFING_SLOPES,
    EXPONENTS as EXPONENTS,
    FEIGENBAUM as FEIGENBAUM,
    LORENZ as LORENZ,
    LORENZ_DIMENSION as LORENZ_DIMENSION,
    ROESSLER as ROESSLER,
    SHORT_BEARING as SHORT_BEARING,
    VAN_DER_POL_LET_GO as VAN_DER_POL_LET_GO,
    Number as Number,
)
from ._page import page as page
from ._shooting import (
    UEDA as UEDA,
    doubling as doubling,
    duffing as duffing,
    largest_exponent as largest_exponent,
    pendulum as pendulum,
)
from ._statics import load_integral as load_integral, loads_by_scipy as loads_by_scipy, statics_comparisons


TOPICS: Mapping[str, Callable[[], list[Comparison]]] = {
    "film": film_comparisons,
    "statics": statics_comparisons,
    "contact": contact_comparisons,
    "exponents": exponent_comparisons,
    "bifurcations": bifurcation_comparisons,
    "cage": cage_comparisons,
}
"""Topic -> what makes its comparisons; each takes seconds to a minute, most of it compiling."""
