"""Mass of the cage from its shape; the paper prints neither the shape nor the mass."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from .._arguments import require_above_zero
from .._checks import require_x64
from .._parameters import parameter
from .._types import Scalar
from ._geometry import Bearing
from ._kinematics import guiding_radius
from ._materials import Material, brass


class CageGeometry(eqx.Module):
    """What Table 1 leaves open about the cage; the default sizes are plausible, not published.

    Inner diameters of 72-76 mm and widths of 34-36 mm fit between the raceways and side faces of an
    NU2310 and give 0.22-0.32 kg; the defaults give 0.255 kg at C_r = 0.45 mm.
    """

    inner_diameter: Scalar = parameter("m", 1e-3, 4.0, "inner diameter of the cage", kind="drawing", default=75e-3)
    cage_width: Scalar = parameter("m", 1e-3, 1.0, "axial width of the cage", kind="drawing", default=35e-3)
    material: Material = eqx.field(default_factory=brass)


def _masked_arccos(x: Scalar) -> Array:
    """arccos, constant (0 or pi) outside [-1, 1], with a zero and not a NaN gradient there."""
    x = jnp.asarray(x)
    inside = jnp.abs(x) < 1
    return jnp.where(inside, jnp.arccos(jnp.where(inside, x, 0.0)), jnp.where(x >= 1, 0.0, jnp.pi))


def _overlap(radius: Scalar, other: Scalar, distance: Scalar) -> Array:
    """Area that two circles with centres `distance` apart share [m^2]."""
    angle_1 = _masked_arccos((distance**2 + radius**2 - other**2) / (2 * distance * radius))
    angle_2 = _masked_arccos((distance**2 + other**2 - radius**2) / (2 * distance * other))
    sectors = jnp.square(radius) * (angle_1 - jnp.sin(2 * angle_1) / 2)
    return sectors + jnp.square(other) * (angle_2 - jnp.sin(2 * angle_2) / 2)


def clipped_pocket_area(
    inner_radius: Scalar, outer_radius: Scalar, pocket_radius: Scalar, pitch_radius: Scalar
) -> Array:
    """Area of a round pocket, centred on the pitch circle, as far as it lies in the cage's ring.

    **Arguments:** radii of the cage, of the pocket and of the pitch circle [m].

    **Returns:** area [m^2].
    """
    require_above_zero(
        pocket_radius=pocket_radius, pitch_radius=pitch_radius, inner_radius=inner_radius, outer_radius=outer_radius
    )
    whole = _overlap(outer_radius, pocket_radius, pitch_radius)
    return whole - _overlap(inner_radius, pocket_radius, pitch_radius)


def cage_mass(bearing: Bearing, guidance_gap: Scalar, cage: CageGeometry | None = None) -> Array:
    """Mass of a machined cage: a ring less Z bored pockets.

    The ring reaches from `inner_diameter` to d_g - C_r, (12). A pocket is a bore along the axis, of
    diameter d_w + T and length l + T, centred on the pitch circle and clipped by the ring.

    **Arguments:** the bearing, the guidance gap C_r [m] as printed (diametral), and the cage
    (default sizes if None).

    **Returns:** mass [kg].
    """
    require_x64()
    require_above_zero(guidance_gap=guidance_gap)
    cage = CageGeometry() if cage is None else cage
    inner, outer = cage.inner_diameter / 2, guiding_radius(bearing.rib_diameter, guidance_gap)
    pocket = (bearing.roller_diameter + bearing.pocket_clearance) / 2
    area = clipped_pocket_area(inner, outer, pocket, bearing.pitch_diameter / 2)
    ring = jnp.pi * (outer**2 - inner**2) * cage.cage_width
    pockets = bearing.n_rollers * area * (bearing.roller_length + bearing.pocket_clearance)
    return jnp.asarray(cage.material.density * (ring - pockets))
