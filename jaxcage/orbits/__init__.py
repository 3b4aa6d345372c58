"""Periodic orbits of forced systems: found, followed, and differentiated where they bifurcate.

| module         | responsibility                                                                     |
|----------------|------------------------------------------------------------------------------------|
| `_problem`     | the equations of an orbit, their unknowns, and parameters by name                  |
| `_steps`       | how many steps a revolution takes                                                  |
| `_implicit`    | roots by damped Newton's method, with derivatives by the implicit function theorem |
| `_orbit`       | periodic orbits, their multipliers, and the determinant these must have            |
| `_singularity` | matrices and test functions that vanish at bifurcations                            |
| `_point`       | a bifurcation: solved for, met on a branch, or known from elsewhere                |
| `_arclength`   | pseudo-arclength continuation of many curves at a time                             |
| `_follower`    | what the lanes of one continuation of orbits share                                 |
| `_located`     | bifurcations between orbits of a branch, every change of stability accounted for   |
| `_branch`      | branches of orbits with their bifurcations                                         |
| `_bifurcation` | bifurcation points solved for                                                      |
| `_curve`       | bifurcation points followed in two parameters                                      |
| `_cascade`     | period-doubling cascades and their limit                                           |
| `_search`      | orbits found without a hint of where they are                                      |
| `_loss`        | synchronous-loss zones; chaotic edges matched with bifurcations                    |
| `_sensitivity` | derivatives and elasticities of edges, derivatives of the largest multiplier       |
"""

from .._arguments import check_layer
from ._arclength import Steps as Steps
from ._bifurcation import bifurcation as bifurcation
from ._branch import Branch as Branch, branch as branch
from ._cascade import Cascade as Cascade, cascade as cascade, doubled_branch as doubled_branch
from ._curve import Curve as Curve, curve as curve
from ._loss import Explained as Explained, LossZones as LossZones, explain as explain, loss_zones as loss_zones
from ._orbit import (
    Guess as Guess,
    NearOrbit as NearOrbit,
    Orbit as Orbit,
    PointGuess as PointGuess,
    StateLike as StateLike,
    periodic_orbit as periodic_orbit,
)
from ._point import Point as Point
from ._problem import pick as pick
from ._search import (
    Stretch as Stretch,
    SynchronousOrbits as SynchronousOrbits,
    coexisting_orbits as coexisting_orbits,
    synchronous_orbits as synchronous_orbits,
)
from ._sensitivity import (
    LeadingMultiplier as LeadingMultiplier,
    Sensitivity as Sensitivity,
    edge_speed as edge_speed,
    leading_multiplier as leading_multiplier,
    limit_sensitivity as limit_sensitivity,
    sensitivities as sensitivities,
    sensitivity as sensitivity,
    width as width,
)


check_layer(
    globals(),
    "bifurcation branch cascade coexisting_orbits curve doubled_branch "
    "explain leading_multiplier loss_zones periodic_orbit sensitivities sensitivity synchronous_orbits",
)
