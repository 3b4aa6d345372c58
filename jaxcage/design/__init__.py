"""Designs chosen by what they do to the zones.

| module      | responsibility                                                               |
|-------------|------------------------------------------------------------------------------|
| `_objective`| design space, objectives that add up, manufacturing scatter                   |
| `_smooth`   | manufacturing cost, measures of regular motion                                |
| `_edges`    | exact objectives: widths of zones, distances from edges, margins of stability |
| `_width`    | widths between edges of any kind, and how they answer to the design           |
| `_lasting`  | edges of lasting chaos with their gradients, by survival regression          |
| `_chaos`    | chaotic widths and shares                                                     |
| `_bearing_gradient` | slip, impulses, wear and power of the whole bearing by its parameters |
| `_bearing_sensitivity` | Sobol indices and tolerance budgets of its measures               |
| `_bearing_design` | the whole bearing's wear, forces, power and slip as an objective, before and after |
| `_land`     | wear load and peak force of the guiding land                                  |
| `_optimise` | designs made better by gradient                                               |
| `_surrogate` | designs made better without slopes, by a Gaussian process; the best judged anew |
| `_kept`     | the state of a search in a file                                              |
| `_scatter`  | Sobol indices, tolerance budgets                                              |
"""

from .._arguments import check_layer
from ._bearing_design import (
    CAGE_PARAMETERS as CAGE_PARAMETERS,
    COMPARED as COMPARED,
    OBJECTIVE as OBJECTIVE,
    TERMS as TERMS,
    BearingObjective as BearingObjective,
    BearingRuns as BearingRuns,
    BeforeAfter as BeforeAfter,
    bearing_objective as bearing_objective,
    before_and_after as before_and_after,
    usual_bounds as usual_bounds,
)
from ._bearing_gradient import (
    DIRECTIONS as DIRECTIONS,
    STATISTICS as STATISTICS,
    BearingGradient as BearingGradient,
    StatisticGradient as StatisticGradient,
    bearing_gradient as bearing_gradient,
    gradient_of_pairs as gradient_of_pairs,
)
from ._bearing_sensitivity import (
    BEARING_MEASURES as BEARING_MEASURES,
    BearingBudget as BearingBudget,
    bearing_budget as bearing_budget,
    bearing_measure as bearing_measure,
    bearing_sensitivity as bearing_sensitivity,
)
from ._chaos import ChaosMeasure as ChaosMeasure, chaotic_share as chaotic_share, chaotic_width as chaotic_width
from ._edges import (
    EdgeClearance as EdgeClearance,
    FollowedEdges as FollowedEdges,
    StabilityMargin as StabilityMargin,
    zone_width as zone_width,
)
from ._land import (
    MEASURES as MEASURES,
    LandMeasure as LandMeasure,
    land_loads as land_loads,
    negligible_load as negligible_load,
)
from ._lasting import (
    LastingEdge as LastingEdge,
    lasting_edge as lasting_edge,
    lasting_edges as lasting_edges,
)
from ._objective import (
    AbstractObjective as AbstractObjective,
    DesignSpace as DesignSpace,
    Measured as Measured,
    Robust as Robust,
    Scatter as Scatter,
    Smooth as Smooth,
    rayleigh as rayleigh,
    uniform as uniform,
)
from ._optimise import Optimised as Optimised, optimise as optimise
from ._scatter import (
    SobolIndices as SobolIndices,
    ToleranceBudget as ToleranceBudget,
    global_sensitivity as global_sensitivity,
    sobol_of as sobol_of,
    tolerance_budget as tolerance_budget,
)
from ._smooth import COSTS as COSTS, Price as Price, cost as cost, regular_motion as regular_motion
from ._surrogate import (
    UNCONFIRMED as UNCONFIRMED,
    SurrogateSearch as SurrogateSearch,
    judged as judged,
    surrogate_search as surrogate_search,
    unchanged as unchanged,
)
from ._width import SolvedEdge as SolvedEdge, ZoneWidth as ZoneWidth


check_layer(globals(), "bearing_gradient global_sensitivity optimise tolerance_budget")
