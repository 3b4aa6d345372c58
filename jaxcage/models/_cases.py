"""The paper's six cases as models, with the preliminary constants for what the paper does not print.

The constants were found by a blind search of an independent code over the unprinted values, on the sign of the largest
Lyapunov exponent in the published zones: a start, not a result (see README, Limits). Readings: clearance as printed
(c = C_r), speed axis as cage speed relative to the rib, fixed half film, synchronous impact, rigid rib, circulatory
cross-coupling, eccentricity in micrometres.
"""

from .._checks import require_x64
from ..bearing import nu2310, published_case, vg
from ..forces import LandContact, RibFilm, Support, SynchronousImpact
from ._cage import CageModel


CAGE_MASS = 0.212227  # [kg]
SUPPORT_STIFFNESS = 37402.4  # [N/m]
SUPPORT_CUBIC = 1.0732e13  # [N/m^3]
SUPPORT_DAMPING = 3.3136  # [N s/m]
SUPPORT_CROSS = -36.654  # [N/m]
LAND_WIDTH = 4.2679e-3  # [m], each of two lands
IMPACT_AMPLITUDE = 109.9051  # [N] at 1000 rad/s
IMPACT_EXPONENT = 1.5091
CONTACT_ONSET = 0.97
CONTACT_FORCE = 68992.2  # [N] at a penetration of one clearance
PRELIMINARY_GRAVITY = 9.81  # [m/s^2]


def case(name: str) -> CageModel:
    """The published case `name`, one of 1a, 1b, 2a, 2b, 3a, 3b (Table 2), with preliminary constants.

    **Raises:** `ValueError` for an unknown name, `RuntimeError` without double precision.
    """
    require_x64()
    published = published_case(name)
    gap = published.guidance_gap_mm * 1e-3
    return CageModel(
        bearing=nu2310(),
        lubricant=vg(published.viscosity_grade),
        film=RibFilm(land_width=LAND_WIDTH),
        contact=LandContact(stiffness=CONTACT_FORCE / gap ** (10 / 9), onset=CONTACT_ONSET),
        support=Support(
            stiffness_x=SUPPORT_STIFFNESS,
            stiffness_y=SUPPORT_STIFFNESS,
            damping=SUPPORT_DAMPING,
            cubic_stiffness=SUPPORT_CUBIC,
            cross_stiffness=SUPPORT_CROSS,
        ),
        impact=SynchronousImpact(amplitude=IMPACT_AMPLITUDE, exponent=IMPACT_EXPONENT),
        cage_mass=CAGE_MASS,
        guidance_gap=gap,
        eccentricity=published.eccentricity_um * 1e-6,
        gravity=PRELIMINARY_GRAVITY,
    )
