"""Weight of a body; y points up."""

import jax.numpy as jnp
from jaxtyping import Array

from .._types import Scalar
from ._motion import AbstractForcing, Force, Motion


def weight(mass: Scalar, gravity: Scalar) -> tuple[Array, Array]:
    """-M g along y [N], with mass [kg] and gravity [m/s^2]."""
    force = jnp.asarray(mass * gravity)
    return jnp.zeros_like(force), -force


class WeightForce(AbstractForcing):
    """Weight of the cage."""

    weight: Scalar
    """M g [N]."""

    def force(self, motion: Motion) -> Force:
        return 0.0, -self.weight, 0.0
