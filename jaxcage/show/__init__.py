"""Tables, figures and the report: numbers and data sets as people read them, with units converted when they are shown.

| module            | responsibility                                                        |
|-------------------|-----------------------------------------------------------------------|
| `tables`          | columns of numbers with units                                         |
| `style`           | colours, frames, legends; light, dark and print style                 |
| `speed_axes`      | axes of speed: shaft speed, zones, published edges, operating speeds  |
| `diagrams`        | sweeps over speed: orbit diagram, exponents, quantities; comparisons  |
| `history_figures` | one trajectory and its strobe section                                 |
| `orbit_figures`   | branches of periodic orbits, Floquet multipliers                      |
| `maps`            | bifurcation curves, exponents and labels over two parameters          |
| `bearing_figures` | drawing of the whole bearing, slips, spectra, statics                 |
| `design_figures`  | elasticities, searches for better designs, chances of chaos           |
| `sources`         | parameters with their sources                                         |
| `operating`       | operating speeds compared with zones                                  |
| `reproduction`    | the paper's edges, conclusions and diagrams beside the model's        |
| `findings`        | everything that a report shows, computed                              |
| `sections`        | sections of the report                                                |
| `checks`          | tables of checks and settings for the report                          |
| `page`            | the report as HTML                                                    |
"""

from .bearing_figures import (
    bearing_drawing as bearing_drawing,
    bearing_figure as bearing_figure,
    impact_forces as impact_forces,
    load_bars as load_bars,
)
from .design_figures import (
    EDGE_COLOURS as EDGE_COLOURS,
    chance_of_chaos as chance_of_chaos,
    design_figure as design_figure,
    elasticity_bars as elasticity_bars,
    optimum_figure as optimum_figure,
    statistic_bars as statistic_bars,
)
from .diagrams import (
    exponent_strip as exponent_strip,
    orbit_diagram as orbit_diagram,
    quantities_beside as quantities_beside,
    quantity_over_speed as quantity_over_speed,
    ramp_figure as ramp_figure,
    sweep_figure as sweep_figure,
    sweeps_beside as sweeps_beside,
)
from .findings import AllFailed as AllFailed, Findings as Findings, examine as examine, require_some as require_some
from .history_figures import (
    START_COLOURS as START_COLOURS,
    orbit as orbit,
    simulation_figure as simulation_figure,
    strobe_section as strobe_section,
    time_history as time_history,
)
from .maps import map_figure as map_figure, stability_map as stability_map, top_exponent as top_exponent
from .operating import Operating as Operating, Verdict as Verdict, read_operating as read_operating
from .orbit_figures import (
    MARKS as MARKS,
    PERIOD_COLOURS as PERIOD_COLOURS,
    branch_diagram as branch_diagram,
    multiplier_circle as multiplier_circle,
    orbit_diagram_with_branches as orbit_diagram_with_branches,
)
from .page import page as page
from .sections import Section as Section, assess as assess, verdict_table as verdict_table
from .sources import parameters_table as parameters_table
from .speed_axes import (
    add_shaft_axes as add_shaft_axes,
    mark_operating as mark_operating,
    mark_published as mark_published,
    published_edges as published_edges,
    shade_zones as shade_zones,
    zone_strip as zone_strip,
)
from .style import (
    FORCE_COLOURS as FORCE_COLOURS,
    KIND_COLOURS as KIND_COLOURS,
    MOTION_COLOURS as MOTION_COLOURS,
    OWN_COLOURS as OWN_COLOURS,
    STYLES as STYLES,
    Style as Style,
    new_figure as new_figure,
    restyle as restyle,
)
from .tables import Column as Column, Table as Table
