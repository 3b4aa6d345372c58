"""Weight of a body; y points up."""

import jax.numpy as jnp
from jaxtyping import Array

from .._types import Scalar


def weight(mass: Scalar, gravity: Scalar) -> tuple[Array, Array]:
    """-M g along y [N], with mass [kg] and gravity [m/s^2]."""
    force = jnp.asarray(mass * gravity)
    return jnp.zeros_like(force), -force
