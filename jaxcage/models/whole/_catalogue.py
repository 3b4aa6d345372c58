"""Ready-made whole bearings, with the source of every number."""

from collections.abc import Callable

from ..._checks import require_x64
from ..._errors import ArgumentError
from ...bearing import brass, nu2310, vg
from ...forces import LandContact, RibFilm
from ._model import BearingModel
from ._pockets import Pockets, bar_stiffness


def nu2310_bearing() -> BearingModel:
    """NU2310 with the brass cage of the published case 1a, guided by the outer ring's ribs.

    Published (L. Chen et al., Shock and Vibration 2016, 9120505): dimensions, Z = 13, G_r = 40 um, T = 0.3 mm,
    C_r = 0.45 mm, e = 23 um, oil of 56 mm^2/s. Worked out from the drawing: cage of 0.25 kg, a ring from 75 to 91.65 mm
    with J_G = M (r_1^2 + r_2^2)/2; bars 3 mm thick, 8.3 mm high and 27 mm long (`bar_stiffness`); two lands of 4 mm
    (6.5 mm fit). From handbooks: traction of a mineral oil, .05 at 1 m/s and .036 far beyond (P. K. Gupta 1984);
    restitution slopes of steel and brass near 0.1 s/m (K. H. Hunt and F. R. E. Crossley 1975); friction of oiled brass
    on steel .05 in the pocket, .1 on the land. Chosen: inner ring with 2 kg of the shaft, damping of its mounting, land
    stiffness, load 4450 N.
    """
    mass, inner, outer = 0.25, 37.5e-3, 45.825e-3
    return BearingModel(
        bearing=nu2310(),
        lubricant=vg(56.0),
        film=RibFilm(land_width=4e-3),
        contact=LandContact(stiffness=1e9, onset=0.97, restitution=0.9),
        pockets=Pockets(pocket_stiffness=bar_stiffness(brass().youngs_modulus, 27e-3, 3e-3, 8.3e-3)),
        cage_mass=mass,
        cage_inertia=mass * (inner**2 + outer**2) / 2,
        guidance_gap=0.45e-3,
        eccentricity=23e-6,
    )


WHOLE_BEARINGS: dict[str, Callable[[], BearingModel]] = {"nu2310": nu2310_bearing}
"""Whole bearings by name."""


def whole_bearing(name: str) -> BearingModel:
    """The whole bearing `name`: rollers, cage, land and inner ring, with the source of every number in its function.

    **Raises:** `ValueError` for an unknown name, `RuntimeError` without double precision.
    """
    require_x64()
    if name.lower() not in WHOLE_BEARINGS:
        known = ", ".join(WHOLE_BEARINGS)
        raise ArgumentError("name", said=f"must be one of {known}, but '{name}' was given.")
    return WHOLE_BEARINGS[name.lower()]()
