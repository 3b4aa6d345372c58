"""Drag of the oil and air in the bearing on its rollers, and their churning moment.

F = -(1/2) C_d rho D l |v| v on a roller's centre and M = -(1/2) C_n rho (D/2)^4 l |s| s on its spin, rho the density of
the mixture. Forms and coefficients: J. H. Rumbarger, E. G. Filetti and D. Gubernick, J. Lubr. Technol. 95 (1973) 401.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._parameters import parameter
from ..._types import Scalar


class RollerDrag(eqx.Module):
    """Drag and churning by coefficient; none by default."""

    drag_coefficient: Scalar = parameter("1", 0.0, 10.0, "drag coefficient C_d of a roller's centre", default=0.0)
    churning_coefficient: Scalar = parameter("1", 0.0, 10.0, "churning coefficient C_n of its spin", default=0.0)
    oil_share: Scalar = parameter("1", 0.0, 1.0, "share of oil in the volume between the rings", default=0.02)


def quadratic(velocity: Float[Array, "*n"], speed: Float[Array, "*n"], coefficient: Scalar) -> Float[Array, "*n"]:
    """-k |v| v along one direction [N], or of a spin [N m]."""
    return -coefficient * speed * velocity


def magnitude(x: Float[Array, "*n"], y: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Length of a vector, differentiable at zero."""
    return jnp.sqrt(x * x + y * y + 1e-24)
