"""The paper's six cases as models, with a set of constants for what the paper does not print."""

from .._checks import require_x64
from ..bearing import nu2310, published_case, vg
from ..forces import LandContact, RibFilm, Support, SynchronousImpact
from ._cage import CageModel
from ._constants import constants as constants_named


def case(name: str, constants: str = "identified") -> CageModel:
    """The published case `name`, one of 1a, 1b, 2a, 2b, 3a, 3b (Table 2).

    **Arguments:** name; which set of the constants that the paper does not give (`jaxcage.models.CONSTANTS`).

    **Raises:** `ValueError` for an unknown name, `RuntimeError` without double precision.
    """
    require_x64()
    published, found = published_case(name), constants_named(constants)
    gap = published.guidance_gap_mm * 1e-3
    return CageModel(
        bearing=nu2310(),
        lubricant=vg(published.viscosity_grade),
        film=RibFilm(land_width=found.land_width),
        contact=LandContact(
            stiffness=found.contact_stiffness_in(gap), onset=found.contact_onset, restitution=found.restitution
        ),
        support=Support(
            stiffness_x=found.support_stiffness,
            stiffness_y=found.support_stiffness,
            damping=found.support_damping,
            cubic_stiffness=found.support_cubic,
            cross_stiffness=found.support_cross,
        ),
        impact=SynchronousImpact(amplitude=found.impact_amplitude, exponent=found.impact_exponent),
        cage_mass=found.cage_mass,
        guidance_gap=gap,
        eccentricity=published.eccentricity_um * 1e-6,
        gravity=found.gravity,
        clearance_reading="as_printed",
        unbalance=found.unbalance,
    )
