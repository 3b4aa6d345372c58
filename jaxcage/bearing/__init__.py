"""The bearing itself: geometry, oil, kinematics, statics, published data.

| module | responsibility |
|---|---|
| `geometry` | the `Bearing`: dimensions, masses, raceway and cage speeds, the design rule T > C_r > G_r |
| `line_contact` | load and approach of a roller between two raceways: (3), (4), (10) |
| `oil` | viscosity of the oil at its temperature (ASTM D341), oils by grade |
| `oil_drag` | drag of the oil on rollers, rolling resistance |
| `statics` | load distribution, loaded zone, static cage displacement: (1), (2), (5), (6) |
| `cage_body` | shape of a cage estimated from the dimensions of its bearing, stiffness and stress of its bars |
| `catalogue` | bearings by designation with ratings and minimum loads; the published cases and figure axes |
"""

from .._bearing_data import (
    CageMaterial as CageMaterial,
    cage_material as cage_material,
    cage_materials as cage_materials,
)
from .cage_body import (
    CageBody as CageBody,
    bar_stiffness as bar_stiffness,
    bar_stress as bar_stress,
    cage_body as cage_body,
    pocket_stiffness as pocket_stiffness,
)
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
    design_rule_violations as design_rule_violations,
)
from .line_contact import (
    PALMGREN_CONSTANT as PALMGREN_CONSTANT,
    line_contact_approach as line_contact_approach,
    line_contact_load as line_contact_load,
    line_contact_stiffness as line_contact_stiffness,
    raceway_loads_of_all as raceway_loads_of_all,
)
from .oil import Lubricant as Lubricant, vg as vg
from .oil_drag import (
    LOAD_POWER as LOAD_POWER,
    STARVATION as STARVATION,
    cylinder_drag_coefficient as cylinder_drag_coefficient,
    rolling_couple as rolling_couple,
    rolling_factors as rolling_factors,
    rolling_moment as rolling_moment,
)
from .statics import (
    LoadDistribution as LoadDistribution,
    load_distribution as load_distribution,
    static_cage_displacements as static_cage_displacements,
)
