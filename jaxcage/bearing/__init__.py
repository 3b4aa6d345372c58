"""The bearing itself: geometry, oil, kinematics, statics, published data.

| module | responsibility |
|---|---|
| `geometry` | the `Bearing`: dimensions, masses, raceway and cage speeds, the design rule T > C_r > G_r |
| `line_contact` | load and approach of a roller between two raceways: (3), (4), (10) |
| `oil` | viscosity of the oil at its temperature (ASTM D341), oils by grade |
| `statics` | load distribution, loaded zone, static cage displacement: (1), (2), (5), (6) |
| `catalogue` | bearings by designation with ratings and minimum loads; the published cases and figure axes |
"""

from .._arguments import check_layer
from .catalogue import (
    PUBLISHED_CASES as PUBLISHED_CASES,
    PUBLISHED_SPEED_RANGE_RPM as PUBLISHED_SPEED_RANGE_RPM,
    Listed as Listed,
    PublishedCase as PublishedCase,
    catalogue as catalogue,
    listed as listed,
    listed_like as listed_like,
    nu2310 as nu2310,
    published_case as published_case,
    static_load_rating as static_load_rating,
)
from .geometry import (
    Bearing as Bearing,
    Material as Material,
    bearing_steel as bearing_steel,
    brass as brass,
    cage_speed as cage_speed,
    design_rule_violations as design_rule_violations,
    raceway_surface_speed as raceway_surface_speed,
)
from .line_contact import (
    PALMGREN_CONSTANT as PALMGREN_CONSTANT,
    line_contact_approach as line_contact_approach,
    line_contact_load as line_contact_load,
    line_contact_stiffness as line_contact_stiffness,
    raceway_loads as raceway_loads,
    raceway_loads_of_all as raceway_loads_of_all,
    series_stiffness as series_stiffness,
)
from .oil import Lubricant as Lubricant, vg as vg, walther_viscosity as walther_viscosity
from .statics import (
    Guidance as Guidance,
    LoadDistribution as LoadDistribution,
    load_distribution as load_distribution,
    loaded_half_angle as loaded_half_angle,
    roller_angles as roller_angles,
    static_cage_displacement as static_cage_displacement,
)


check_layer(
    globals(),
    "cage_speed design_rule_violations line_contact_approach line_contact_load line_contact_stiffness "
    "load_distribution loaded_half_angle published_case raceway_loads raceway_surface_speed roller_angles "
    "series_stiffness static_cage_displacement vg walther_viscosity",
)
