"""Tables, figures and the report: results for people to read, with units converted for display.

| module             | responsibility                                                        |
|--------------------|-----------------------------------------------------------------------|
| `tables`           | records and columns with units                                        |
| `columns`          | time histories, strobe points and branches as CSV                     |
| `style`            | colours, frames, legends, figures, axes                               |
| `diagrams`         | sweeps over speed: orbits, exponents, quantities, zones; comparisons  |
| `run_figures`      | one run of a cage or of a bearing with its rollers, roller loads      |
| `orbit_figures`    | branches of periodic orbits, Floquet multipliers                      |
| `maps`             | bifurcation curves, exponents and labels over speed and a parameter   |
| `design_figures`   | elasticities, searches for better designs, chances of chaos           |
| `zone_tables`      | zones found in a sweep or by a search, bifurcations, stable ranges    |
| `slope_tables`     | derivatives of edges, of lasting chaos, of means                      |
| `quantity_tables`  | quantities over speed and of one run, statics                         |
| `parameter_tables` | parameters with their sources, two designs compared                   |
| `design_tables`    | designs before and after a search, shares of variance, tolerances     |
| `chance_tables`    | chances of chaos, ranges that measurements narrowed                   |
| `verdict_tables`   | the verdict for an operating range, its margins, what to change first |
| `report`           | answers of commands as one page of HTML                               |
"""

from .chance_tables import (
    chances_notes as chances_notes,
    chances_table as chances_table,
    measured_table as measured_table,
    narrowed_table as narrowed_table,
    unknowns_notes as unknowns_notes,
)
from .columns import (
    branch_columns as branch_columns,
    curve_columns as curve_columns,
    roller_columns as roller_columns,
    strobe_columns as strobe_columns,
    trajectory_columns as trajectory_columns,
    write_columns as write_columns,
)
from .design_figures import (
    calm_figure as calm_figure,
    chance_of_chaos as chance_of_chaos,
    elasticity_bars as elasticity_bars,
    optimum_figure as optimum_figure,
    statistic_bars as statistic_bars,
)
from .design_tables import (
    before_and_after_table as before_and_after_table,
    broken_words as broken_words,
    budget_of_tolerances_table as budget_of_tolerances_table,
    budget_table as budget_table,
    changed_table as changed_table,
    requirement_table as requirement_table,
    sobol_table as sobol_table,
    stricter as stricter,
)
from .diagrams import (
    add_shaft_axes as add_shaft_axes,
    exponent_strip as exponent_strip,
    mark_published as mark_published,
    orbit_diagram as orbit_diagram,
    published_edges as published_edges,
    quantities_beside as quantities_beside,
    sweep_figure as sweep_figure,
)
from .maps import (
    Axis as Axis,
    curves_table as curves_table,
    follow_edges as follow_edges,
    map_figure as map_figure,
    parameter_axis as parameter_axis,
    stability_map as stability_map,
    top_exponent as top_exponent,
)
from .orbit_figures import (
    multiplier_circle as multiplier_circle,
    orbit_diagram_with_branches as orbit_diagram_with_branches,
)
from .parameter_tables import (
    differences as differences,
    differences_table as differences_table,
    readings_words as readings_words,
    sources_table as sources_table,
    values_words as values_words,
)
from .quantity_tables import (
    displacements as displacements,
    mean_over_starts as mean_over_starts,
    means_table as means_table,
    quantities_table as quantities_table,
    quantity_words as quantity_words,
    run_tables as run_tables,
    statics_table as statics_table,
)
from .report import PAPER as PAPER, Section as Section, page as page, settings_table as settings_table
from .run_figures import (
    load_bars as load_bars,
    rollers_of as rollers_of,
    run_figure as run_figure,
    strobe_section as strobe_section,
)
from .slope_tables import (
    FIRST as FIRST,
    direction_words as direction_words,
    edge_slopes as edge_slopes,
    elasticities_table as elasticities_table,
    gradient_table as gradient_table,
    lasting_table as lasting_table,
    mean_gradient_tables as mean_gradient_tables,
    source_notes as source_notes,
    to_be_turned as to_be_turned,
    width_table as width_table,
)
from .style import drawn as drawn, legend_below as legend_below, new_figure as new_figure
from .tables import Column as Column, Table as Table, counted as counted, shares_table as shares_table, table as table
from .verdict_tables import (
    BY_CAGE_MODEL as BY_CAGE_MODEL,
    MOTION_WORDS as MOTION_WORDS,
    MOTIONS as MOTIONS,
    cage_verdict as cage_verdict,
    changes_table as changes_table,
    forces_note as forces_note,
    forces_table as forces_table,
    indices_note as indices_note,
    indices_table as indices_table,
    limiting_speed_notes as limiting_speed_notes,
    margin_sentence as margin_sentence,
    margins_table as margins_table,
    minimum_load_notes as minimum_load_notes,
    motion_sentence as motion_sentence,
    motion_table as motion_table,
    motion_words as motion_words,
    range_sentence as range_sentence,
)
from .zone_tables import (
    coexisting_notes as coexisting_notes,
    edge_table as edge_table,
    motion_tables as motion_tables,
    point_record as point_record,
    require_some as require_some,
    stretch_table as stretch_table,
    unsettled_notes as unsettled_notes,
    unstable_table as unstable_table,
    zone_span as zone_span,
    zone_words as zone_words,
)
