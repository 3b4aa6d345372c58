"""Designs: objectives, statistics, slopes and searches, chances and identification of unknown parameters.

| module           | responsibility                                                                          |
|------------------|-----------------------------------------------------------------------------------------|
| `objective`      | design space, objectives that add up, manufacturing scatter                             |
| `statistics`     | chaotic speeds, quantities, loads of designs, read off one sweep; two designs compared  |
| `loads`          | loads of the guiding land, size and whirl of the motion                                 |
| `edges`          | exact objectives: edges that are followed, margins of stability                         |
| `lasting`        | edges of lasting chaos with their gradients, by survival regression                     |
| `widths`         | widths of zones between edges of any kind                                               |
| `slopes`         | slopes of statistics by paired designs                                                  |
| `shares`         | Sobol indices, tolerance budgets                                                        |
| `optimisation`   | searches by gradient and by a Gaussian process                                          |
| `checkpoint`     | the state of a search in a file                                                         |
| `chances`        | chances of chaos of a cage that is known within ranges only                             |
| `identification` | ranges narrowed by measurements                                                         |
"""

from .._arguments import check_layer
from .chances import (
    REVOLUTIONS as REVOLUTIONS,
    Band as Band,
    Clue as Clue,
    Ensemble as Ensemble,
    binomial_interval as binomial_interval,
    chaotic_shares as chaotic_shares,
    draw as draw,
    ensemble as ensemble,
    verdict_of as verdict_of,
)
from .identification import Narrowed as Narrowed, identify as identify, misses as misses, narrow as narrow
from .lasting import LastingEdge as LastingEdge, lasting_edge as lasting_edge, lasting_edges as lasting_edges
from .loads import (
    LAND_LOADS as LAND_LOADS,
    Motion as Motion,
    averages as averages,
    land_loads as land_loads,
    motions as motions,
)
from .objective import (
    COSTS as COSTS,
    AbstractObjective as AbstractObjective,
    DesignSpace as DesignSpace,
    Measured as Measured,
    Price as Price,
    Robust as Robust,
    Scatter as Scatter,
    Smooth as Smooth,
    cost as cost,
    rayleigh as rayleigh,
    uniform as uniform,
)
from .optimisation import (
    Optimised as Optimised,
    Optimum as Optimum,
    SurrogateSearch as SurrogateSearch,
    confirmed as confirmed,
    optimise as optimise,
    surrogate_search as surrogate_search,
)
from .shares import (
    SobolIndices as SobolIndices,
    ToleranceBudget as ToleranceBudget,
    global_sensitivity as global_sensitivity,
    sobol_of as sobol_of,
    tolerance_budget as tolerance_budget,
)
from .slopes import (
    DIRECTIONS as DIRECTIONS,
    MeanGradient as MeanGradient,
    StatisticGradient as StatisticGradient,
    gradient_of_pairs as gradient_of_pairs,
    mean_gradient as mean_gradient,
)
from .statistics import (
    BALANCE as BALANCE,
    BEARING_MEASURES as BEARING_MEASURES,
    CAGE_PARAMETERS as CAGE_PARAMETERS,
    COMPARED as COMPARED,
    OBJECTIVE as OBJECTIVE,
    STATISTICS as STATISTICS,
    BeforeAfter as BeforeAfter,
    Chaos as Chaos,
    LandLoad as LandLoad,
    Mean as Mean,
    Runs as Runs,
    bearing_objective as bearing_objective,
    before_and_after as before_and_after,
    chaotic_share as chaotic_share,
    chaotic_width as chaotic_width,
    measure as measure,
    relative as relative,
    statistic as statistic,
)
from .widths import SolvedEdge as SolvedEdge, ZoneWidth as ZoneWidth, zone_width as zone_width


check_layer(globals(), "global_sensitivity mean_gradient optimise tolerance_budget")
