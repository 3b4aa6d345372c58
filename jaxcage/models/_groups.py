"""Dimensionless groups of the cage model.

Those the paper prints in (23) are not dimensionless under any reading; these are.
"""

from jaxtyping import Array

from .._checks import require_x64
from .._types import Scalar
from ._cage import CageModel
from ._cage_at_speed import CageAtSpeed


def dimensionless_groups(model: CageModel, speed: Scalar) -> dict[str, Array]:
    """The groups that decide the motion, at cage speed `speed` [rad/s].

    **Returns:** by name: e/c, omega sqrt(c/g), load number W c^2/(mu omega R L^3) of all lands together,
    K_s/(M omega^2), B_s/(M omega), K_3 c^2/(M omega^2), and for a synchronous impact A/(M c omega^2).
    """
    require_x64()
    cage: CageAtSpeed = model.cage_at(speed)
    c, inertia = cage.clearance, cage.mass * speed**2
    groups = {
        "eccentricity": cage.eccentricity / c,
        "speed": speed * (c / cage.gravity) ** 0.5,
        "load_number": cage.mass * cage.gravity / (cage.film_scale * speed),
        "stiffness": (cage.stiffness_x + cage.stiffness_y) / 2 / inertia,
        "damping": cage.support_damping / (cage.mass * speed),
        "cubic_stiffness": cage.cubic_stiffness * c**2 / inertia,
    }
    if isinstance(cage.impact, Array):
        groups["impact"] = cage.impact / (inertia * c)
    return groups
