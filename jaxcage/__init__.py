"""Differentiable dynamics of rolling-bearing cages.

| layer      | responsibility                                                                       |
|------------|--------------------------------------------------------------------------------------|
| `bearing`  | geometry, materials, lubricant, kinematics, statics, catalogue, published cases       |
| `forces`   | rib film, land contact, pocket impact, support, unbalance, gravity: one law a file    |
| `models`   | the forced-system protocol; the cage in its rib, the whole bearing, oscillators       |
| `files`    | TOML in and out, units, safe writing                                                 |
| `solve`    | integration in machine code or by diffrax; time histories, the strobe (Poincaré) map  |
| `analysis` | exponents, labels, zones, spectra, survival of chaos, stability, measures             |
| `lanes`    | the trajectories (lanes) of sweeps, studies and maps, and their data sets             |
| `orbits`   | periodic orbits, branches, bifurcation points and their derivatives                  |
| `design`   | objectives, statistics with gradients, optimisation, tolerances, identified constants |
| `show`     | figures, tables, columns of numbers, the HTML page                                   |
| `cli`      | the `jaxcage` command                                                                |

SI units inside, always; y points up and rotation is positive counter-clockwise.
"""

import importlib as _importlib
import os as _os
from typing import TYPE_CHECKING as _TYPE_CHECKING, Any as _Any


# XLA logs an error for every cached program on processors for which it has tuning flags of its own. Genuine errors are
# raised as exceptions. JAX sets the variable to 1, also for child processes; set it to 0 to see XLA's log.
if _os.environ.get("TF_CPP_MIN_LOG_LEVEL", "1") == "1":
    _os.environ["TF_CPP_MIN_LOG_LEVEL"] = "3"

from ._cache import keep_compiled_programs as keep_compiled_programs


if _TYPE_CHECKING:
    from ._public import *  # noqa: F403


__version__ = "0.1.0"


def __getattr__(name: str) -> _Any:
    """Import the library on first access to a public name, so that `jaxcage --help` works without JAX."""
    if not name.startswith("_"):
        public = _importlib.import_module("._public", __name__)
        globals().update({n: value for n, value in vars(public).items() if not n.startswith("_")})
        if name in globals():  # a name, or a layer that was loaded with them
            return globals()[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    __getattr__("case")
    return sorted(globals())
