"""What was found of a design, as tables and as one page.

| module           | responsibility                                                              |
|------------------|-----------------------------------------------------------------------------|
| `_table`         | tables of texts                                                             |
| `_zone_tables`   | chaotic zones beside published ones                                         |
| `_orbit_tables`  | bifurcations, stable stretches, synchronous-loss zones                      |
| `_slopes`        | how exact edges, and slip, wear and power of a whole bearing, answer to the design |
| `_lasting`       | how edges of lasting chaos answer to the design, with error bars           |
| `_bearing_page`  | the page of a whole bearing                                                 |
| `_contact`       | exact edges whose orbit touches the land                                    |
| `_map`           | edges in two parameters, exponents over both                                |
| `_statics`       | statics and the impact of a roller as tables                                |
| `_operating`     | operating speeds against zones                                              |
| `_sources`       | every parameter with its unit and where its value comes from, readings      |
| `_findings`      | everything that a page shows, computed                                      |
| `_figures`       | the page's figures as SVG, for light and dark screens                       |
| `_chances`       | chances of chaos, and ranges that measurements narrowed                     |
| `_compare`       | two designs side by side                                                    |
| `_design_tables` | designs before and after a search, and their tolerances                     |
| `_reproduce`     | the paper's edges, conclusions and orbit diagrams beside ours               |
| `_page_tables`   | tables that no command prints                                               |
| `_page`          | the page                                                                    |
"""

from ._bearing_page import (
    Section as Section,
    bearing_page as bearing_page,
    bearing_parameters_table as bearing_parameters_table,
)
from ._chances import (
    chances_document as chances_document,
    chances_notes as chances_notes,
    chances_table as chances_table,
    chances_tables as chances_tables,
    measured_table as measured_table,
    measures as measures,
    narrowed_document as narrowed_document,
    narrowed_table as narrowed_table,
    operating_chances as operating_chances,
    verdict_table as verdict_table,
)
from ._compare import (
    Compared as Compared,
    at_speeds_compared as at_speeds_compared,
    compared_document as compared_document,
    compared_zones_table as compared_zones_table,
    differences as differences,
    differences_table as differences_table,
    overall_table as overall_table,
)
from ._contact import contact_notes as contact_notes, touching as touching
from ._design_tables import (
    bearing_budget_table as bearing_budget_table,
    before_and_after_table as before_and_after_table,
    before_and_after_tables as before_and_after_tables,
    budget_table as budget_table,
    changed_parameters_table as changed_parameters_table,
    optima_table as optima_table,
    parameters_table as parameters_table,
    sobol_document as sobol_document,
    sobol_table as sobol_table,
)
from ._findings import (
    AllFailed as AllFailed,
    Findings as Findings,
    Map as Map,
    examine as examine,
    require_some as require_some,
)
from ._lasting import (
    lasting_document as lasting_document,
    lasting_table as lasting_table,
    width_documents as width_documents,
    width_table as width_table,
    widths_of as widths_of,
)
from ._map import (
    RPM as RPM,
    SPEED as SPEED,
    Axis as Axis,
    Exponents as Exponents,
    Say as Say,
    follow_edges as follow_edges,
    largest_exponents as largest_exponents,
    parameter_axis as parameter_axis,
    speed_axis as speed_axis,
)
from ._operating import (
    Operating as Operating,
    Verdict as Verdict,
    chaotic_verdict as chaotic_verdict,
    loss_verdict as loss_verdict,
    read_operating as read_operating,
)
from ._orbit_tables import (
    coexisting_notes as coexisting_notes,
    edge_table as edge_table,
    error_cell as error_cell,
    loss_table as loss_table,
    orbits_document as orbits_document,
    stretch_table as stretch_table,
    unsettled_notes as unsettled_notes,
)
from ._page import Assessed as Assessed, assess as assess, calmest as calmest, page as page
from ._reproduce import (
    CONCLUSIONS as CONCLUSIONS,
    LASTING as LASTING,
    Conclusion as Conclusion,
    Runs as Runs,
    compare_edges as compare_edges,
    paper_diagrams as paper_diagrams,
    reproduction as reproduction,
    run_all as run_all,
    wide_zones as wide_zones,
)
from ._slopes import (
    EXIT as EXIT,
    FIRST as FIRST,
    ONSET as ONSET,
    bearing_gradient_document as bearing_gradient_document,
    bearing_gradient_table as bearing_gradient_table,
    edge_slopes as edge_slopes,
    elasticities_table as elasticities_table,
    gradient_document as gradient_document,
    gradient_table as gradient_table,
    homogeneity_notes as homogeneity_notes,
    missing_notes as missing_notes,
    not_fixed as not_fixed,
    slopes_document as slopes_document,
    source_document as source_document,
    source_notes as source_notes,
    to_be_turned as to_be_turned,
)
from ._sources import (
    parameter_rows as parameter_rows,
    readings_document as readings_document,
    readings_words as readings_words,
    short_readings as short_readings,
)
from ._statics import (
    displacements as displacements,
    impact_document as impact_document,
    impact_table as impact_table,
    statics_table as statics_table,
)
from ._table import (
    Speeds as Speeds,
    Table as Table,
    chosen as chosen,
    number as number,
    shares_table as shares_table,
    shown_unit as shown_unit,
    with_shaft as with_shaft,
)
from ._zone_tables import (
    transient_tables as transient_tables,
    zone_document as zone_document,
    zones_document as zones_document,
    zones_table as zones_table,
)
