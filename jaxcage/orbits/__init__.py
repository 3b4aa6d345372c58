"""Periodic orbits of forced systems: found, followed, and differentiated where they bifurcate.

| module         | responsibility                                                                     |
|----------------|------------------------------------------------------------------------------------|
| `_by_name`     | parameters by name                                                                 |
| `_problem`     | the equations of an orbit and their unknowns                                       |
| `_newton`      | damped Newton as an optimistix solver                                              |
| `_implicit`    | roots with derivatives by the implicit function theorem                            |
| `_orbit`       | periodic orbits, their multipliers, and the determinant these must have            |
| `_coexisting`  | all orbits that many starts lead to                                                |
| `_singularity` | matrices and test functions that vanish at bifurcations                            |
| `_walk`        | a bifurcation looked for along the branch of its orbits                            |
| `_point`       | a bifurcation: solved for, met on a branch, or known from elsewhere                |
| `_bifurcation` | bifurcation points solved for                                                      |
| `_astray`      | steps that lead to another curve, told from their ends                             |
| `_arclength`   | pseudo-arclength continuation of many curves at a time                             |
| `_illinois`    | where a function along a curve vanishes                                            |
| `_follower`    | what the lanes of one continuation of orbits share                                 |
| `_located`     | bifurcations between orbits of a branch, every change of stability accounted for   |
| `_normal_form` | super- or subcritical period doublings and Neimark-Sacker bifurcations             |
| `_branch`      | branches of orbits with their bifurcations                                         |
| `_search`      | the synchronous orbits of a speed range, found without a hint                      |
| `_loss`        | synchronous-loss zones and their edges                                             |
| `_mechanism`   | chaotic edges matched with bifurcations and cascade limits                         |
| `_sensitivity` | derivatives and elasticities of an edge, homogeneity                               |
| `_multiplier`  | derivatives of the largest multiplier of an orbit                                  |
| `_curve`       | bifurcation points followed in two parameters                                      |
| `_cascade`     | period-doubling cascades and their limit                                           |
"""

from .._arguments import check_layer
from ._arclength import Steps as Steps
from ._bifurcation import bifurcation as bifurcation
from ._branch import Branch as Branch, branch as branch, branches as branches
from ._by_name import pick as pick
from ._cascade import Cascade as Cascade, cascade as cascade, doubled_branch as doubled_branch
from ._coexisting import coexisting_orbits as coexisting_orbits
from ._curve import CodimensionTwo as CodimensionTwo, Curve as Curve, curve as curve
from ._loss import LossZones as LossZones, loss_zones as loss_zones
from ._mechanism import Explained as Explained, explain as explain
from ._multiplier import LeadingMultiplier as LeadingMultiplier, leading_multiplier as leading_multiplier
from ._normal_form import (
    critical_vectors as critical_vectors,
    criticality as criticality,
    normal_form_coefficient as normal_form_coefficient,
    normal_form_places as normal_form_places,
)
from ._orbit import (
    Guess as Guess,
    NearOrbit as NearOrbit,
    Orbit as Orbit,
    PointGuess as PointGuess,
    StateLike as StateLike,
    periodic_orbit as periodic_orbit,
)
from ._point import Point as Point
from ._search import (
    Stretch as Stretch,
    SynchronousOrbits as SynchronousOrbits,
    synchronous_orbits as synchronous_orbits,
)
from ._sensitivity import (
    Sensitivity as Sensitivity,
    edge_speed as edge_speed,
    limit_sensitivity as limit_sensitivity,
    sensitivities as sensitivities,
    sensitivity as sensitivity,
    width as width,
)


check_layer(
    globals(),
    "bifurcation branch branches cascade coexisting_orbits curve doubled_branch "
    "explain leading_multiplier loss_zones periodic_orbit sensitivities sensitivity synchronous_orbits",
)
