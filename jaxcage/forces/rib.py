"""The rib that guides the cage: rigid, or a mass on its own elastic support."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from .._parameters import parameter
from .._pytrees import Scalar


def rib_force(
    x: Scalar, y: Scalar, vx: Scalar, vy: Scalar, stiffness: Scalar, damping: Scalar, cubic: Scalar
) -> tuple[Array, Array]:
    """-(K_O + K_O3 |r|^2) r - B_O r' [N]: the force that holds an elastic rib in place."""
    hardening = stiffness + cubic * (x * x + y * y)
    return jnp.asarray(-hardening * x - damping * vx), jnp.asarray(-hardening * y - damping * vy)


class RigidRib(eqx.Module):
    """A rib that does not move: the cage has two coordinates."""

    kind: ClassVar[str] = "rigid"


class ElasticRib(eqx.Module):
    """A rib of finite mass on a nonlinear spring and a damper: cage and rib have four coordinates together."""

    kind: ClassVar[str] = "elastic"

    mass: Scalar = parameter("kg", 1e-3, 100.0, "rib mass M_O", kind="drawing")
    stiffness: Scalar = parameter(
        "N/m",
        1.0,
        1e12,
        "rib stiffness K_O",
        within=(5e6, 5e8),
        source="tap the outer ring in its seat: the frequency it answers with",
    )
    damping: Scalar = parameter(
        "N s/m",
        0.0,
        1e8,
        "rib damping B_O",
        within=(50.0, 5e3),
        source="tap the outer ring in its seat: how fast the answer decays",
    )
    cubic_stiffness: Scalar = parameter(
        "N/m^3",
        0.0,
        1e24,
        "cubic rib stiffness K_O3",
        within=(0.0, 1e16),
        source="push the outer ring in its seat: force over way",
        default=0.0,
    )
