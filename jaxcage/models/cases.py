"""The six cases of the paper as models, with sets of constants for what the paper does not print.

`preliminary`: a blind search of an independent code, whose film was some twenty times too weak, on the sign of the
largest exponent in the published zones. `identified`: found with this package, by chaos seen after 300 revolutions
(an earlier version of `experiments/identify_nu2310.py`). Both read the clearance as printed (c = C_r), the speed axis
as cage speed relative to the rib, eccentricities in micrometres; with the fixed half film, the synchronous impact, a
rigid rib and circulatory cross-coupling.
"""

import dataclasses

from .._arguments import require_x64
from .._errors import ArgumentError
from ..bearing import nu2310, published_case, vg
from ..forces import LandContact, RibFilm, Support, SynchronousImpact, UnbalanceReading
from .cage import CageModel


@dataclasses.dataclass(frozen=True)
class Constants:
    """Constants that the paper does not print, in SI units."""

    cage_mass: float
    support_stiffness: float
    support_cubic: float
    support_damping: float
    support_cross: float
    land_width: float
    """Width of each of two lands."""
    impact_amplitude: float
    """Amplitude at a cage speed of 1000 rad/s."""
    impact_exponent: float
    contact_stiffness: float | None = None
    """[N/m^(10/9)]; where it is not given it follows from the force."""
    contact_force: float = 0.0
    """Force at a penetration of one clearance [N]."""
    restitution: float = 1.0
    unbalance: UnbalanceReading = "physical"


CONSTANTS: dict[str, Constants] = {
    "preliminary": Constants(
        cage_mass=0.212227,
        support_stiffness=37402.4,
        support_cubic=1.0732e13,
        support_damping=3.3136,
        support_cross=-36.654,
        land_width=4.2679e-3,
        impact_amplitude=109.9051,
        impact_exponent=1.5091,
        contact_force=68992.2,
    ),
    "identified": Constants(
        cage_mass=0.252088,
        support_stiffness=139446.0,
        support_cubic=11262400000000.0,
        support_damping=1.66072,
        support_cross=1762.43,
        land_width=0.00145461,
        impact_amplitude=121.292,
        impact_exponent=1.48297,
        contact_stiffness=2407540000.0,
        restitution=0.999142,
        unbalance="as_printed",
    ),
}
"""The sets by name."""


def case(name: str, constants: str = "identified") -> CageModel:
    """The published case `name`, one of 1a, 1b, 2a, 2b, 3a, 3b (Table 2).

    **Arguments:** name; the set of constants that the paper does not print (`jaxcage.models.CONSTANTS`).

    **Raises:** `ValueError` for an unknown name, `RuntimeError` without double precision.
    """
    require_x64()
    if constants not in CONSTANTS:
        raise ArgumentError("constants", said=f"must be one of {', '.join(CONSTANTS)}, but '{constants}' was given.")
    published, found = published_case(name), CONSTANTS[constants]
    gap = published.guidance_gap_mm * 1e-3
    return CageModel(
        bearing=nu2310(),
        lubricant=vg(published.viscosity_grade),
        forces=(
            RibFilm(land_width=found.land_width),
            LandContact(
                stiffness=found.contact_stiffness or found.contact_force / gap ** (10 / 9),
                onset=0.97,
                restitution=found.restitution,
            ),
            Support(
                stiffness_x=found.support_stiffness,
                stiffness_y=found.support_stiffness,
                damping=found.support_damping,
                cubic_stiffness=found.support_cubic,
                cross_stiffness=found.support_cross,
            ),
            SynchronousImpact(amplitude=found.impact_amplitude, exponent=found.impact_exponent),
        ),
        cage_mass=found.cage_mass,
        guidance_gap=gap,
        eccentricity=published.eccentricity_um * 1e-6,
        clearance_reading="as_printed",
        unbalance=found.unbalance,
    )
