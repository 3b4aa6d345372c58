"""Designs: calm operation by exact gradients; statistics, sensitivities, Sobol indices, unknown parameters.

| module          | responsibility                                                                     |
|-----------------|------------------------------------------------------------------------------------|
| `design_space`  | a design with the parameters that may change and their bounds                      |
| `requirements`  | limits that a design must keep, what it costs, tolerances of manufacture           |
| `operating`     | edges and orbits of an operating range, with exact derivatives by the design       |
| `optimiser`     | the cheapest design that keeps its requirements over an operating range            |
| `statistics`    | chaotic speeds, quantities and loads of designs from one sweep; comparisons        |
| `slopes`        | derivatives of statistics by paired designs; tolerance budgets                     |
| `survival_edges`| edges of lasting chaos with slopes by survival regression; widths of zones         |
| `variance`      | Sobol indices                                                                      |
| `surrogate`     | search for a better design by a Gaussian process                                   |
| `unknowns`      | chances of chaos with unknown parameters; ranges narrowed by measurements          |
| `verdict`       | margins of a design, what to change first, simulations from many initial states    |
"""

from .._arguments import check_layer
from .design_space import DesignSpace as DesignSpace, Value as Value
from .operating import REACH as REACH, OperatingRange as OperatingRange
from .optimiser import SEARCHES as SEARCHES, Design as Design, design_for as design_for
from .requirements import (
    Price as Price,
    Requirement as Requirement,
    Requirements as Requirements,
    Tolerance as Tolerance,
    cost_function as cost_function,
)
from .slopes import (
    DIRECTIONS as DIRECTIONS,
    MeanGradient as MeanGradient,
    Slopes as Slopes,
    ToleranceBudget as ToleranceBudget,
    gradient_of_pairs as gradient_of_pairs,
    mean_gradient as mean_gradient,
    tolerance_budget as tolerance_budget,
)
from .statistics import (
    BALANCE as BALANCE,
    BEARING_MEASURES as BEARING_MEASURES,
    CAGE_PARAMETERS as CAGE_PARAMETERS,
    COMPARED as COMPARED,
    OBJECTIVE as OBJECTIVE,
    TERMS as TERMS,
    BeforeAfter as BeforeAfter,
    Runs as Runs,
    bearing_objective as bearing_objective,
    before_and_after as before_and_after,
    chaotic_width as chaotic_width,
    drawn_states as drawn_states,
    statistic as statistic,
)
from .surrogate import Optimum as Optimum, SurrogateSearch as SurrogateSearch, surrogate_search as surrogate_search
from .survival_edges import (
    LastingEdge as LastingEdge,
    SolvedEdge as SolvedEdge,
    ZoneWidth as ZoneWidth,
    lasting_edge as lasting_edge,
    lasting_edges as lasting_edges,
    zone_width as zone_width,
)
from .unknowns import (
    RANGE_SPEEDS as RANGE_SPEEDS,
    Chance as Chance,
    Ensemble as Ensemble,
    Index as Index,
    Narrowed as Narrowed,
    ensemble as ensemble,
    indices as indices,
    misses as misses,
    narrow as narrow,
    range_chance as range_chance,
)
from .variance import SobolIndices as SobolIndices, global_sensitivity as global_sensitivity
from .verdict import Checked as Checked, Margins as Margins, check_design as check_design, margins as margins


check_layer(globals(), "design_for global_sensitivity mean_gradient surrogate_search tolerance_budget")
