"""The six cases of the paper as models, with constants for what the paper does not print.

The constants were found with this package, by chaos seen after 300 revolutions (an earlier version of
`experiments/identify_nu2310.py`). They read the clearance as printed (c = C_r), the speed axis as cage speed relative
to the rib, eccentricities in micrometres; with the fixed half film, the synchronous impact, a rigid rib and circulatory
cross-coupling.
"""

from .._arguments import require_x64
from ..bearing import nu2310, published_case, vg
from ..forces import LandContact, RibFilm, Support, SynchronousImpact
from .cage import CageModel


def case(name: str) -> CageModel:
    """Build the model of a published case, one of 1a, 1b, 2a, 2b, 3a, 3b (Table 2), with two lands.

    **Returns:** `CageModel`. **Raises:** `ValueError` for an unknown name, `RuntimeError` without double precision.
    """
    require_x64()
    published = published_case(name)
    return CageModel(
        bearing=nu2310(),
        lubricant=vg(published.viscosity_grade),
        forces=(
            RibFilm(land_width=0.00145461),
            LandContact(stiffness=2407540000.0, onset=0.97, restitution=0.999142),
            Support(
                stiffness_x=139446.0,
                stiffness_y=139446.0,
                damping=1.66072,
                cubic_stiffness=11262400000000.0,
                cross_stiffness=1762.43,
            ),
            SynchronousImpact(amplitude=121.292, exponent=1.48297),
        ),
        cage_mass=0.252088,
        guidance_gap=published.guidance_gap_mm * 1e-3,
        eccentricity=published.eccentricity_um * 1e-6,
        clearance_reading="as_printed",
        unbalance="as_printed",
    )
