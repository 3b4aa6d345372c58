"""The bearing itself: geometry, materials, oil, kinematics, statics, published data.

| module | responsible for |
|---|---|
| `_validate` | positive numbers at the entry points, concrete or traced |
| `_materials` | density and elasticity of brass and bearing steel |
| `_lubricant` | viscosity of the oil at its temperature (ASTM D341), oils by grade |
| `_kinematics` | raceway and cage speeds, centrifugal force, guidance gap: (7)-(9), (11)-(13) |
| `_geometry` | the `Bearing`: dimensions, derived sizes and masses, the design rule T > C_r > G_r |
| `_cage_mass` | mass of the cage from its shape |
| `_line_contact` | load and approach of a roller between two raceways: (3), (4), (10) |
| `_statics` | load distribution, loaded zone, static cage displacement: (1), (2), (5), (6) |
| `_catalogue` | ready-made bearings and their catalogue ratings |
| `_cases` | the six published cases and the axis limits of the published figures |
"""

from .._arguments import check_layer
from ._cage_mass import (
    CageGeometry as CageGeometry,
    cage_mass as cage_mass,
    clipped_pocket_area as clipped_pocket_area,
)
from ._cases import (
    PUBLISHED_CASES as PUBLISHED_CASES,
    PUBLISHED_SPEED_RANGE_RPM as PUBLISHED_SPEED_RANGE_RPM,
    PublishedCase as PublishedCase,
    published_case as published_case,
)
from ._catalogue import (
    BEARINGS as BEARINGS,
    NU2310_RATINGS as NU2310_RATINGS,
    nu2310 as nu2310,
)
from ._geometry import Bearing as Bearing, design_rule_violations as design_rule_violations
from ._kinematics import (
    cage_speed as cage_speed,
    cage_speed_ratio as cage_speed_ratio,
    centrifugal_force as centrifugal_force,
    guidance_gap as guidance_gap,
    guiding_radius as guiding_radius,
    raceway_surface_speed as raceway_surface_speed,
)
from ._line_contact import (
    PALMGREN_CONSTANT as PALMGREN_CONSTANT,
    line_contact_approach as line_contact_approach,
    line_contact_load as line_contact_load,
    line_contact_stiffness as line_contact_stiffness,
    raceway_loads as raceway_loads,
    series_stiffness as series_stiffness,
)
from ._lubricant import (
    Lubricant as Lubricant,
    vg as vg,
    walther_viscosity as walther_viscosity,
)
from ._materials import (
    Material as Material,
    bearing_steel as bearing_steel,
    brass as brass,
)
from ._statics import (
    Guidance as Guidance,
    LoadDistribution as LoadDistribution,
    load_distribution as load_distribution,
    loaded_half_angle as loaded_half_angle,
    roller_angles as roller_angles,
    static_cage_displacement as static_cage_displacement,
)
from ._validate import checked_before as checked_before, is_concrete as is_concrete


check_layer(
    globals(),
    "cage_mass cage_speed cage_speed_ratio centrifugal_force clipped_pocket_area "
    "design_rule_violations guidance_gap guiding_radius line_contact_approach line_contact_load "
    "line_contact_stiffness load_distribution loaded_half_angle published_case raceway_loads "
    "raceway_surface_speed roller_angles "
    "series_stiffness static_cage_displacement vg walther_viscosity",
)
