"""Elastic support between cage and rib, paper eqs. (16) and (20): springs, a cubic term, damping, cross-coupling."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from .._parameters import choice, parameter
from .._pytrees import Scalar
from .law import AbstractForce, AbstractLaw, Force, GuidedCage, Motion


Cross = Literal["circulatory", "as_printed"]
Cubic = Literal["absolute", "dimensionless"]


def spring_force(x: Scalar, y: Scalar, stiffness_x: Scalar, stiffness_y: Scalar, cubic: Scalar) -> tuple[Array, Array]:
    """-(K + K_3 |r|^2) r [N]: our isotropic form of the paper's cubic stiffness, with K_x and K_y of its fig. 6."""
    hardening = cubic * (x * x + y * y)
    return jnp.asarray(-(stiffness_x + hardening) * x), jnp.asarray(-(stiffness_y + hardening) * y)


def cross_force(cross: Cross, x: Scalar, y: Scalar, linear: Scalar, cubic: Scalar) -> tuple[Array, Array]:
    """Cross-coupling force [N].

    `circulatory`: K_xy (-y, x), which pumps energy into whirl. `as_printed` in (20): -K_xy (y, x) - K'_xy (y^3, x^3),
    whose linear part is conservative.
    """
    if cross == "circulatory":
        return jnp.asarray(-linear * y), jnp.asarray(linear * x)
    return jnp.asarray(-(linear * y + cubic * y**3)), jnp.asarray(-(linear * x + cubic * x**3))


def cubic_stiffness(reading: Cubic, absolute: Scalar, relative: Scalar, stiffness: Scalar, clearance: Scalar) -> Array:
    """K_3 [N/m^3]: given as such, or as alpha K_s / c^2 with a dimensionless alpha, so that a larger gap softens it."""
    return jnp.asarray(absolute if reading == "absolute" else relative * stiffness / clearance**2)


class Support(AbstractLaw):
    """Stiffness and damping between cage and rib; none of the values is printed in the paper."""

    law_name = "support"

    stiffness_x: Scalar = parameter(
        "N/m",
        0.0,
        1e9,
        "support stiffness K_x",
        within=(1e4, 1e6),
        source="tap the cage on its rib: the frequency it answers with",
    )
    stiffness_y: Scalar = parameter(
        "N/m",
        0.0,
        1e9,
        "support stiffness K_y",
        within=(1e4, 1e6),
        source="tap the cage on its rib: the frequency it answers with",
    )
    damping: Scalar = parameter(
        "N s/m",
        0.0,
        1e5,
        "support damping B_s",
        within=(0.3, 30.0),
        source="tap the cage on its rib: how fast the answer decays",
    )
    cubic_stiffness: Scalar = parameter(
        "N/m^3",
        0.0,
        1e18,
        "cubic stiffness K_3, for cubic = absolute",
        within=(1e11, 1e14),
        source="push the cage on its rib: force over way, far out",
        default=0.0,
    )
    cubic_ratio: Scalar = parameter(
        "1",
        0.0,
        1e4,
        "alpha in K_3 = alpha K_s / c^2, for cubic = dimensionless",
        within=(0.1, 100.0),
        source="push the cage on its rib: force over way, far out",
        default=0.0,
    )
    cross_stiffness: Scalar = parameter(
        "N/m",
        -1e8,
        1e8,
        "cross-coupling stiffness K_xy",
        within=(-5e3, 5e3),
        source="whirl frequency and its growth, from two probes at the cage",
        default=0.0,
    )
    cross_cubic: Scalar = parameter(
        "N/m^3",
        -1e18,
        1e18,
        "cubic cross-coupling K'_xy, for cross = as_printed",
        within=(-1e13, 1e13),
        source="whirl frequency and its growth, from two probes at the cage",
        default=0.0,
    )
    cross: Cross = choice("circulatory", "as_printed", text="form of the cross-coupling", default="circulatory")
    cubic: Cubic = choice("absolute", "dimensionless", text="how the cubic stiffness is given", default="absolute")

    def at(self, cage: GuidedCage, speed: Scalar) -> "SupportForce":
        """The support of `cage`."""
        stiffness = (self.stiffness_x + self.stiffness_y) / 2
        cubic = cubic_stiffness(self.cubic, self.cubic_stiffness, self.cubic_ratio, stiffness, cage.clearance)
        springs = (self.stiffness_x, self.stiffness_y, cubic, self.cross_stiffness, self.cross_cubic)
        return SupportForce(*springs, self.damping, self.cross)


class SupportForce(AbstractForce):
    """Springs, cross-coupling and damping."""

    stiffness_x: Scalar
    stiffness_y: Scalar
    cubic: Scalar
    """K_3 [N/m^3]."""
    cross_stiffness: Scalar
    cross_cubic: Scalar
    damping: Scalar
    cross: Cross = eqx.field(static=True)

    def force(self, motion: Motion) -> Force:
        x, y, b = motion.x, motion.y, self.damping
        spring = spring_force(x, y, self.stiffness_x, self.stiffness_y, self.cubic)
        cross = cross_force(self.cross, x, y, self.cross_stiffness, self.cross_cubic)
        return spring[0] + cross[0] - b * motion.vx, spring[1] + cross[1] - b * motion.vy, 0.0
