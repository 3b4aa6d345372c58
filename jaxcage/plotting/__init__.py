"""Figures: free functions, axes in and axes out; matplotlib is imported here and nowhere else.

| module           | responsibility                                                          |
|------------------|-------------------------------------------------------------------------|
| `_style`         | colours, frames, light, dark and print style, no global state           |
| `_shaft`         | the shaft's speed beneath the cage's                                    |
| `_marks`         | zones shaded and published edges marked on a speed axis                 |
| `_orbit_diagram` | orbit diagram, zoomed diagram, exponents beneath it                     |
| `_section`       | strobe section                                                          |
| `_history`       | time history, orbit in the clearance circle, each force                 |
| `_bearing`       | the whole bearing: drawing, slips around it, whirl, spectra             |
| `_statics`       | load of every roller, impact of one on a cage bar                       |
| `_branches`      | branches of periodic orbits over speed, alone or over an orbit diagram  |
| `_multipliers`   | Floquet multipliers in the complex plane                                |
| `_elasticities`  | elasticities of edges, and of a whole bearing's statistics, as bars     |
| `_zone_strip`    | zones of both kinds and operating speeds as bars                        |
| `_chance`        | chance of chaos over speed with its error bars                          |
| `_compare`       | two designs beside each other on one scale                              |
| `_ramp`          | run-up and run-down                                                     |
| `_design`        | a search for a better design or whole bearing, and what came of it      |
| `_stability_map` | bifurcation curves in two parameters over the largest exponent          |
"""

from ._bearing import (
    bearing_figure as bearing_figure,
    bearing_map_figure as bearing_map_figure,
    bearing_ramp_figure as bearing_ramp_figure,
    bearing_sweep_figure as bearing_sweep_figure,
    bearings_beside as bearings_beside,
    over_shaft_speed as over_shaft_speed,
)
from ._branches import (
    MARKS as MARKS,
    PERIOD_COLOURS as PERIOD_COLOURS,
    branch_diagram as branch_diagram,
    move_apart as move_apart,
    orbit_diagram_with_branches as orbit_diagram_with_branches,
)
from ._chance import chance_of_chaos as chance_of_chaos
from ._compare import over_speed as over_speed, sweeps_beside as sweeps_beside
from ._design import (
    bearing_design_figure as bearing_design_figure,
    design_figure as design_figure,
)
from ._elasticities import (
    EDGE_COLOURS as EDGE_COLOURS,
    elasticity_bars as elasticity_bars,
    statistic_bars as statistic_bars,
)
from ._history import (
    orbit as orbit,
    simulation_figure as simulation_figure,
    time_history as time_history,
)
from ._marks import (
    mark_operating as mark_operating,
    mark_published as mark_published,
    published_edges as published_edges,
    shade_zones as shade_zones,
)
from ._multipliers import multiplier_circle as multiplier_circle
from ._orbit_diagram import (
    exponent_strip as exponent_strip,
    orbit_diagram as orbit_diagram,
    sweep_figure as sweep_figure,
    zoomed_diagram as zoomed_diagram,
)
from ._ramp import ramp_figure as ramp_figure
from ._section import START_COLOURS as START_COLOURS, strobe_section as strobe_section
from ._shaft import add_shaft_axes as add_shaft_axes
from ._stability_map import stability_map as stability_map
from ._statics import impact_forces as impact_forces, load_bars as load_bars
from ._style import (
    BLACK as BLACK,
    BLUE as BLUE,
    FORCE_COLOURS as FORCE_COLOURS,
    GREY as GREY,
    KIND_COLOURS as KIND_COLOURS,
    ORANGE as ORANGE,
    OWN_COLOURS as OWN_COLOURS,
    PAPER as PAPER,
    STYLES as STYLES,
    ZONE as ZONE,
    Halo as Halo,
    Style as Style,
    enlarge_dots as enlarge_dots,
    lighter as lighter,
    new_figure as new_figure,
    restyle as restyle,
)
from ._zone_strip import zone_strip as zone_strip
