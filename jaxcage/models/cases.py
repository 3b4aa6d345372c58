"""The six cases of the paper as models, with sets of constants for what the paper does not print.

`preliminary`: a blind search of an independent code, whose film was some twenty times too weak, on the sign of the
largest exponent in the published zones. `identified`: found with this package, by chaos seen after 300 revolutions
(an earlier version of `experiments/identify_nu2310.py`). Both read the clearance as printed (c = C_r), the speed axis
as cage speed relative to the rib, eccentricities in micrometres; with the fixed half film, the synchronous impact, a
rigid rib and circulatory cross-coupling.
"""

from typing import Any

from .._arguments import require_x64
from .._errors import ArgumentError
from ..bearing import nu2310, published_case, vg
from ..forces import LandContact, RibFilm, Support, SynchronousImpact
from .cage import CageModel


CONSTANTS: dict[str, dict[str, Any]] = {
    "preliminary": {
        "cage_mass": 0.212227,
        "stiffness": 37402.4,
        "cubic_stiffness": 1.0732e13,
        "damping": 3.3136,
        "cross_stiffness": -36.654,
        "land_width": 4.2679e-3,
        "amplitude": 109.9051,
        "exponent": 1.5091,
        "contact_force": 68992.2,
        "restitution": 1.0,
        "unbalance": "physical",
    },
    "identified": {
        "cage_mass": 0.252088,
        "stiffness": 139446.0,
        "cubic_stiffness": 11262400000000.0,
        "damping": 1.66072,
        "cross_stiffness": 1762.43,
        "land_width": 0.00145461,
        "amplitude": 121.292,
        "exponent": 1.48297,
        "contact_stiffness": 2407540000.0,
        "restitution": 0.999142,
        "unbalance": "as_printed",
    },
}
"""The sets by name: values of the model's parameters in SI units, those of the support and of one of two lands. Instead
of a stiffness of the contact its force at a penetration of one clearance may be given [N]."""


def case(name: str, constants: str = "identified") -> CageModel:
    """The published case `name`, one of 1a, 1b, 2a, 2b, 3a, 3b (Table 2).

    **Arguments:** name; the set of constants that the paper does not print (`jaxcage.models.CONSTANTS`).

    **Returns:** `CageModel`. **Raises:** `ValueError` for an unknown name, `RuntimeError` without double precision.
    """
    require_x64()
    if constants not in CONSTANTS:
        raise ArgumentError("constants", said=f"must be one of {', '.join(CONSTANTS)}, but '{constants}' was given.")
    published, found = published_case(name), CONSTANTS[constants]
    gap = published.guidance_gap_mm * 1e-3
    contact = found.get("contact_stiffness") or found["contact_force"] / gap ** (10 / 9)
    return CageModel(
        bearing=nu2310(),
        lubricant=vg(published.viscosity_grade),
        forces=(
            RibFilm(land_width=found["land_width"]),
            LandContact(stiffness=contact, onset=0.97, restitution=found["restitution"]),
            Support(
                stiffness_x=found["stiffness"],
                stiffness_y=found["stiffness"],
                damping=found["damping"],
                cubic_stiffness=found["cubic_stiffness"],
                cross_stiffness=found["cross_stiffness"],
            ),
            SynchronousImpact(amplitude=found["amplitude"], exponent=found["exponent"]),
        ),
        cage_mass=found["cage_mass"],
        guidance_gap=gap,
        eccentricity=published.eccentricity_um * 1e-6,
        clearance_reading="as_printed",
        unbalance=found["unbalance"],
    )
