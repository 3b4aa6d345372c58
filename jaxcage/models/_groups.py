"""Dimensionless groups of the cage model.

Those the paper prints in (23) are not dimensionless under any reading; these are.
"""

from jaxtyping import Array

from .._checks import require_x64
from .._types import Scalar
from ..forces import SynchronousForce
from ._cage import CageModel


def dimensionless_groups(model: CageModel, speed: Scalar) -> dict[str, Array]:
    """The groups that decide the motion, at cage speed `speed` [rad/s]; those of the model's `extra` come on top.

    **Returns:** by name: e/c, omega sqrt(c/g), load number W c^2/(mu omega R L^3) of all lands together,
    K_s/(M omega^2), B_s/(M omega), K_3 c^2/(M omega^2), and for a synchronous impact A/(M c omega^2).
    """
    require_x64()
    cage = model.cage_at(speed)
    film, support, unbalance, impact = (cage.law(name) for name in ("film", "support", "unbalance", "impact"))
    c, mass, law = model.clearance, cage.mass, model.support
    inertia = mass * speed**2
    groups = {
        "eccentricity": unbalance.unbalance / (mass * c),
        "speed": speed * (c / model.gravity) ** 0.5,
        "load_number": mass * model.gravity / (film.scale * speed),
        "stiffness": (law.stiffness_x + law.stiffness_y) / 2 / inertia,
        "damping": law.damping / (mass * speed),
        "cubic_stiffness": support.cubic * c**2 / inertia,
    }
    if isinstance(impact, SynchronousForce):
        groups["impact"] = impact.amplitude / (inertia * c)
    return groups
