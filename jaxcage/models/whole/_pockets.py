"""Pockets of the cage: straight bars that a roller meets on either side."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..._parameters import choice, parameter
from ..._types import Scalar
from ...forces import inverse_root, smooth_plus


class Pockets(eqx.Module):
    """The contact of rollers and cage bars; their clearance is the bearing's."""

    pocket_stiffness: Scalar = parameter("N/m", 0.0, 1e12, "stiffness K_p of a bar under a roller")
    pocket_damping: Scalar = parameter(
        "s/m", 0.0, 100.0, "alpha: loss of restitution over approach speed of the pocket contacts", default=0.1
    )
    pocket_friction: Scalar = parameter("1", 0.0, 1.0, "friction coefficient of rollers on bars", default=0.05)
    saturation_speed: Scalar = parameter(
        "m/s", 1e-6, 10.0, "sliding speed at which dry friction has 0.7 of its limit", default=0.02
    )
    pocket_smoothing: Scalar = parameter(
        "m", 1e-12, 1e-5, "half width over which a pocket contact sets in", default=1e-7
    )
    pocket_exponent: Scalar = parameter("1", 1.0, 2.0, "exponent of the overlap with `power`", default=10 / 9)
    pocket_reference: Scalar = parameter(
        "m", 1e-9, 1e-3, "overlap at which `power` is as stiff as `linear`", default=1e-6
    )
    pocket_law: str = choice(
        "linear", "power", text="force of a bar: linear in the overlap or a power", default="linear"
    )

    def elastic(self, overlap: Scalar) -> Array:
        """Elastic force [N] at an overlap (negative: apart) [m]."""
        pressed = smooth_plus(overlap, self.pocket_smoothing)
        if self.pocket_law == "linear":
            return self.pocket_stiffness * pressed
        touching = pressed > 0
        ratio = jnp.where(touching, pressed, self.pocket_reference) / self.pocket_reference
        return self.pocket_stiffness * pressed * ratio ** (self.pocket_exponent - 1)


def saturated(sliding: Scalar, speed: Scalar) -> Array:
    """Odd and smooth stand-in for the sign of a sliding speed [m/s]: its slope at rest is 1/`speed`."""
    return sliding * inverse_root(sliding * sliding + speed * speed)


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
