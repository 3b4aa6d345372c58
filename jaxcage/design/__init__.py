"""Constants and designs chosen by what they do to the zones.

| module      | responsibility                                                               |
|-------------|------------------------------------------------------------------------------|
| `_unknowns` | constants to be found: bounds, scales, the models that they make              |
| `_measured` | edges from a test rig or a publication                                        |
| `_screen`   | the global stage of identification: chaos where it was measured               |
| `_tracked`  | exact edges and their derivatives as functions of the unknowns                |
| `_fit`      | the local stage: least squares on exact edges, what the data do and do not fix |
| `_objective`| design space, objectives that add up, any differentiable function of a design |
| `_smooth`   | manufacturing cost, measures of regular motion                                |
| `_margin`   | how far the synchronous orbit is from losing its stability                    |
| `_edges`    | widths of zones and distances from edges, exact                               |
| `_width`    | widths between edges of any kind, and how they answer to the design           |
| `_lasting`  | edges of lasting chaos with their gradients, by survival regression          |
| `_chaos`    | chaotic widths and shares, statistical                                        |
| `_bearing_gradient` | slip, impulses, wear and power of the whole bearing by its parameters |
| `_bearing_sensitivity` | Sobol indices and tolerance budgets of its measures               |
| `_bearing_design` | the whole bearing's wear, forces, power and slip as an objective, before and after |
| `_land`     | wear load and peak force of the guiding land, statistical                     |
| `_robust`   | the mean or the worst over manufacturing scatter                              |
| `_optimise` | designs made better by gradient                                               |
| `_surrogate` | designs made better without slopes, by a Gaussian process of what was found |
| `_judged`   | what a search saw as its best, chosen anew by a finer objective              |
| `_kept`     | the state of a search in a file                                              |
| `_trade_off`| several objectives at once: designs that no other beats in everything        |
| `_scatter`  | Sobol indices, tolerance budgets, Pareto fronts                               |
"""

from .._arguments import check_layer
from ._bearing_design import (
    CAGE_PARAMETERS as CAGE_PARAMETERS,
    COMPARED as COMPARED,
    TERMS as TERMS,
    BearingObjective as BearingObjective,
    BearingRuns as BearingRuns,
    BeforeAfter as BeforeAfter,
    balance_grade as balance_grade,
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
    EdgeSum as EdgeSum,
    FollowedEdges as FollowedEdges,
    zone_width as zone_width,
)
from ._fit import (
    Combination as Combination,
    Fit as Fit,
    FittedEdge as FittedEdge,
    determined as determined,
    fit_edges as fit_edges,
)
from ._judged import UNCONFIRMED as UNCONFIRMED, judged as judged, unchanged as unchanged
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
from ._margin import StabilityMargin as StabilityMargin
from ._measured import MeasuredEdge as MeasuredEdge, inside_zones as inside_zones, matched as matched
from ._objective import (
    AbstractObjective as AbstractObjective,
    DesignSpace as DesignSpace,
    Measured as Measured,
    Smooth as Smooth,
)
from ._optimise import Optimised as Optimised, Optimum as Optimum, optimise as optimise, walk as walk
from ._robust import Robust as Robust, Scatter as Scatter, rayleigh as rayleigh, uniform as uniform
from ._scatter import (
    ParetoPoint as ParetoPoint,
    SobolIndices as SobolIndices,
    ToleranceBudget as ToleranceBudget,
    global_sensitivity as global_sensitivity,
    pareto_front as pareto_front,
    sobol_of as sobol_of,
    tolerance_budget as tolerance_budget,
)
from ._screen import Candidate as Candidate, screen as screen
from ._smooth import COSTS as COSTS, Price as Price, cost as cost, regular_motion as regular_motion
from ._surrogate import SurrogateSearch as SurrogateSearch, surrogate_search as surrogate_search
from ._tracked import TrackedEdges as TrackedEdges
from ._trade_off import TradeOff as TradeOff, trade_off as trade_off
from ._unknowns import Unknown as Unknown
from ._width import SolvedEdge as SolvedEdge, ZoneWidth as ZoneWidth


check_layer(
    globals(),
    "bearing_gradient fit_edges global_sensitivity optimise pareto_front screen tolerance_budget trade_off",
)
