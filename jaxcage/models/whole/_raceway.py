"""Rollers on raceways, and what a contact has stored: line contacts with the damping of Hunt and Crossley.

Q = K p^(10/9) (1 + (3/2) alpha delta'), never below zero, where p is the overlap delta cut off smoothly at zero. alpha
is the slope of the coefficient of restitution over the approach speed: K. H. Hunt and F. R. E. Crossley, J. Appl. Mech.
42 (1975) 440.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..._parameters import parameter
from ..._types import Scalar
from ...forces import contact_force, power_10_9, smooth_plus


class Raceways(eqx.Module):
    """The contacts of rollers and raceways beyond their stiffness, which the bearing knows."""

    raceway_damping: Scalar = parameter(
        "s/m", 0.0, 10.0, "alpha: loss of restitution over approach speed of the raceway contacts", default=0.1
    )
    raceway_smoothing: Scalar = parameter(
        "m", 1e-12, 1e-6, "half width over which a raceway contact sets in", default=1e-8
    )


def hunt_crossley(restitution_slope: Scalar) -> Scalar:
    """The factor of the approach speed in Q [s/m]: (3/2) alpha."""
    return 1.5 * restitution_slope


def line_load(overlap: Scalar, rate: Scalar, stiffness: Scalar, damping: Scalar, width: Scalar) -> tuple[Array, Array]:
    """Load of a line contact, and its elastic part [N].

    **Arguments:** overlap (negative: apart) [m] and its rate [m/s]; stiffness [N/m^(10/9)], damping [s/m], and the
    length over which contact sets in [m].
    """
    pressed = smooth_plus(overlap, width)
    return contact_force(pressed, rate, stiffness, damping), stiffness * power_10_9(pressed)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


def contact_energy(overlap: Scalar, width: Scalar, exponent: Scalar = 10 / 9) -> Array:
    """Integral of p^exponent over the overlap, p being the overlap cut off smoothly: the energy stored over stiffness.

    Closed form beyond `width`, a quadrature before it.
    """
    within = jnp.clip((overlap + width) / (2 * width), 0.0, 1.0)  # the part of [-width, width] that is covered
    nodes, weights = 0.5 * (1 + _NODES), 0.5 * _WEIGHTS
    onset = jnp.zeros_like(within)
    for node, weight in zip(nodes, weights, strict=True):
        # Nodes gather where contact begins: t = within u^2, as the integrand goes like t^(4 exponent).
        t = within * node * node
        onset = onset + weight * 2 * node * within * (t**4 * (t * (t - 3) + 2.5)) ** exponent
    more = jnp.maximum(overlap, width) ** (exponent + 1) - width ** (exponent + 1)
    return (2 * width) ** (exponent + 1) * onset + more / (exponent + 1)
