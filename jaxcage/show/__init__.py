"""Tables, figures and the report: numbers and data sets as people read them, with units converted when they are shown.

| module            | responsibility                                                        |
|-------------------|-----------------------------------------------------------------------|
| `tables`          | columns of numbers with units                                         |
| `columns`         | time histories, strobe points and branches as CSV                     |
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
| `zone_tables`     | zones found in a sweep or by a search                                 |
| `orbit_tables`    | bifurcations, stable stretches, zones without a synchronous orbit     |
| `gradient_tables` | derivatives of edges, of lasting chaos, of means                      |
| `quantity_tables` | quantities over speed and of one run, statics, two designs compared   |
| `design_tables`   | designs before and after a search, shares of variance, tolerances     |
| `chance_tables`   | chances of chaos, ranges that measurements narrowed                   |
| `parameter_axes`  | axes of a stability map, bifurcations followed over them              |
| `page`            | the report as HTML                                                    |
"""

from .bearing_figures import (
    bearing_drawing as bearing_drawing,
    bearing_figure as bearing_figure,
    impact_forces as impact_forces,
    load_bars as load_bars,
)
from .chance_tables import (
    chances_answer as chances_answer,
    chances_document as chances_document,
    chances_notes as chances_notes,
    chances_tables as chances_tables,
    measured_table as measured_table,
    measures_words as measures_words,
    narrowed_table as narrowed_table,
    operating_chances as operating_chances,
    range_words as range_words,
    unknowns_table as unknowns_table,
)
from .columns import (
    branch_columns as branch_columns,
    curve_columns as curve_columns,
    read_columns as read_columns,
    roller_columns as roller_columns,
    strobe_columns as strobe_columns,
    trajectory_columns as trajectory_columns,
    write_columns as write_columns,
)
from .design_figures import (
    EDGE_COLOURS as EDGE_COLOURS,
    chance_of_chaos as chance_of_chaos,
    elasticity_bars as elasticity_bars,
    optimum_figure as optimum_figure,
    statistic_bars as statistic_bars,
)
from .design_tables import (
    before_and_after_table as before_and_after_table,
    budget_table as budget_table,
    changed_table as changed_table,
    sobol_table as sobol_table,
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
from .gradient_tables import (
    FIRST as FIRST,
    edge_slopes as edge_slopes,
    elasticities_table as elasticities_table,
    gradient_table as gradient_table,
    lasting_table as lasting_table,
    mean_gradient_tables as mean_gradient_tables,
    missing_notes as missing_notes,
    not_fixed as not_fixed,
    slope_record as slope_record,
    source_notes as source_notes,
    to_be_turned as to_be_turned,
    width_table as width_table,
)
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
from .orbit_tables import (
    coexisting_notes as coexisting_notes,
    contact_notes as contact_notes,
    edge_table as edge_table,
    loss_table as loss_table,
    orbits_document as orbits_document,
    point_record as point_record,
    stretch_table as stretch_table,
    unsettled_notes as unsettled_notes,
)
from .page import page as page
from .parameter_axes import (
    SPEED as SPEED,
    Axis as Axis,
    curves_table as curves_table,
    follow_edges as follow_edges,
    parameter_axis as parameter_axis,
)
from .quantity_tables import (
    circumference_table as circumference_table,
    differences as differences,
    differences_table as differences_table,
    displacements as displacements,
    head_of as head_of,
    impact_table as impact_table,
    line_tables as line_tables,
    mean_over_starts as mean_over_starts,
    measures_table as measures_table,
    quantities_table as quantities_table,
    quantity_beside as quantity_beside,
    statics_table as statics_table,
    unit_of as unit_of,
)
from .sections import Section as Section, assess as assess, verdict_table as verdict_table
from .sources import readings_words as readings_words, sources_table as sources_table
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
from .tables import (
    Column as Column,
    Scaled as Scaled,
    Table as Table,
    chosen as chosen,
    number as number,
    rows_table as rows_table,
    shares_table as shares_table,
    speed_columns as speed_columns,
    value_table as value_table,
)
from .zone_tables import (
    beside_published as beside_published,
    published_zones as published_zones,
    stretches_table as stretches_table,
    transient_tables as transient_tables,
    zone_details as zone_details,
    zone_record as zone_record,
    zone_span as zone_span,
    zone_words as zone_words,
    zones_table as zones_table,
)
