"""Shape of the cage of a bearing, estimated from the bearing's dimensions, and the stiffness of its bars.

The cage is a ring on the land that guides it, with a rectangular pocket for each roller. Three proportions are
those of the NU2310 (a ring from 75 to 91.65 mm): the estimate is within 5 % of the 0.25 kg of its brass cage. Cages of
other bearings and makers differ by a third or so: a weighed mass is better.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array

from .._pytrees import Scalar
from .geometry import Bearing
from .line_contact import line_contact_stiffness


HEIGHT = 0.52
"""Radial height of the cage over the roller diameter."""
FLANGE = 0.65
"""Width of the ring beside the pockets over the room beside the rollers."""

APPROACH = 1e-6
"""Approach at which the contact of roller and bar is linearised [m]."""


class CageBody(NamedTuple):
    """Dimensions of a cage [m], its volume [m^3] and the square of its radius of inertia about its axis [m^2]."""

    bar_length: Array
    bar_thickness: Array
    """Along the pitch circle; nearer to the axis a bar is thinner, since the sides of a pocket are parallel."""
    bar_height: Array
    volume: Array
    gyration: Array


def cage_body(bearing: Bearing, guidance_gap: Scalar, inner_land: Scalar | None = None) -> CageBody:
    """Estimate the shape of a cage with a guidance gap [m], below the ribs of the outer ring or, if its diameter [m] is
    given, on a land of the inner ring."""
    b = bearing
    pocket, height = b.roller_diameter + b.pocket_clearance, jnp.asarray(HEIGHT * b.roller_diameter)
    outer = (b.rib_diameter - guidance_gap) / 2 if inner_land is None else (inner_land + guidance_gap) / 2 + height
    inner = outer - height
    width = b.roller_length + 2 * FLANGE * b.land_width_limit
    volume = jnp.pi * (outer**2 - inner**2) * width - b.n_rollers * pocket * b.roller_length * height
    thickness = jnp.pi * b.pitch_diameter / b.n_rollers - pocket
    return CageBody(jnp.asarray(b.roller_length), thickness, height, volume, (outer**2 + inner**2) / 2)


def bar_stress(body: CageBody, force: Scalar) -> Array:
    """Largest bending stress [Pa] of a bar that is clamped at both ends, under a force [N] spread evenly over it: the
    moment F l/12 at its ends over the section modulus height thickness^2/6."""
    return force * body.bar_length / (2 * body.bar_height * body.bar_thickness**2)


def pocket_stiffness(bearing: Bearing, guidance_gap: Scalar, youngs_modulus: Scalar) -> Array:
    """Stiffness of a bar under a roller [N/m]: bending, shear and line contact in series.

    Shear adds q l^2/(8 k G A) to the sag of the bar, with k = 5/6 and G = E/2.6. The contact is that of Palmgren, whose
    constant is in proportion to the common modulus of both bodies, linearised at an approach of 1 um; at 0.1 and 10 um
    it is a quarter softer and stiffer.

    **Arguments:** bearing; guidance gap [m]; Young's modulus of the cage [Pa].
    """
    length, thickness, height, *_ = cage_body(bearing, guidance_gap)
    shear = 8 * (5 / 6) * youngs_modulus / 2.6 * height * thickness / length
    both = 2 * youngs_modulus / (youngs_modulus + bearing.roller_material.youngs_modulus)
    contact = line_contact_stiffness(both * bearing.palmgren_constant, length) * APPROACH ** (1 / 9)
    return bar_stiffness(youngs_modulus, length, thickness, height, 1 / (1 / shear + 1 / contact))


def bar_stiffness(
    youngs_modulus: Scalar, length: Scalar, thickness: Scalar, height: Scalar, contact_stiffness: Scalar = jnp.inf
) -> Array:
    """Stiffness of a bar that is clamped at both ends and loaded evenly, in series with its contact.

    At mid-span 384 E I/l^3 with I = height thickness^3/12 (S. Timoshenko, *Strength of Materials*, part I).

    **Arguments:** modulus [Pa]; free length, thickness along the circumference and radial height [m]; secant stiffness
    of the line contact [N/m].

    **Returns:** stiffness [N/m].
    """
    bending = 32 * youngs_modulus * height * (thickness / length) ** 3
    return jnp.asarray(1 / (1 / bending + 1 / contact_stiffness))
