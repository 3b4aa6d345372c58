"""Periodic orbits of forced systems, their branches and bifurcation points, and derivatives of all of these.

| module            | responsibility                                                                      |
|-------------------|-------------------------------------------------------------------------------------|
| `problem`         | the return map, its unknowns, and how many steps a revolution takes                 |
| `newton`          | Newton's method for orbits, damped; derivatives by the implicit function theorem    |
| `orbit`           | periodic orbits, their multipliers, and the determinant these must have             |
| `point`           | bifurcation points: kinds, and matrices and functions that vanish there             |
| `step_length`     | step control of continuation: predictions, accepted and rejected steps              |
| `continuation`    | pseudo-arclength continuation, an iterator with step control and events             |
| `location`        | bifurcations between orbits of a branch, compared with every change of stability    |
| `branch`          | branches of orbits with their bifurcations                                          |
| `bifurcation`     | Newton's method for bifurcation points                                              |
| `curves`          | curves of bifurcation points in two parameters; edges from one design to another    |
| `search`          | search for synchronous orbits over a range of speed, without an initial guess       |
| `unstable`        | unstable ranges of the synchronous orbit; mechanisms of chaotic edges               |
| `gradient`        | derivatives and elasticities of edges, derivatives of orbits and multipliers        |
"""

from .._arguments import check_layer
from .bifurcation import bifurcation as bifurcation
from .branch import Branch as Branch, branch as branch
from .curves import Curve as Curve, Followed as Followed, curve as curve, follow as follow, follow_all as follow_all
from .gradient import (
    OrbitSlopes as OrbitSlopes,
    Sensitivity as Sensitivity,
    orbit_slopes as orbit_slopes,
    sensitivities as sensitivities,
    sensitivity as sensitivity,
    width as width,
)
from .orbit import Orbit as Orbit, periodic_orbit as periodic_orbit
from .point import Point as Point
from .search import (
    StableRange as StableRange,
    SynchronousOrbits as SynchronousOrbits,
    stable_range as stable_range,
    synchronous_orbits as synchronous_orbits,
)
from .step_length import StepControl as StepControl
from .unstable import (
    Explained as Explained,
    UnstableRanges as UnstableRanges,
    explain as explain,
    unstable_ranges as unstable_ranges,
)


check_layer(
    globals(),
    "bifurcation branch curve "
    "explain follow unstable_ranges periodic_orbit sensitivities sensitivity stable_range synchronous_orbits",
)
