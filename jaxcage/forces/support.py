"""Elastic support between cage and rib, paper eqs. (16) and (20): springs, a cubic term, damping, cross-coupling; and
the guiding rib, rigid or a mass on its own elastic support."""

from typing import ClassVar, Literal

import equinox as eqx

from .._parameters import choice, parameter
from .._pytrees import Scalar
from .law import AbstractForce, AbstractLaw, Force, GuidedCage, Motion


Cross = Literal["circulatory", "as_printed"]
Cubic = Literal["absolute", "dimensionless"]
_SPRING = "tap the cage on its rib: the frequency it answers with"
_CUBIC = "push the cage on its rib: force over way, far out"
_WHIRL = "whirl frequency and its growth, from two probes at the cage"


class Support(AbstractLaw):
    """Stiffness and damping between cage and rib; none of the values is printed in the paper."""

    law_name = "support"

    stiffness_x: Scalar = parameter("N/m", 0.0, 1e9, "support stiffness K_x", source=_SPRING)
    stiffness_y: Scalar = parameter("N/m", 0.0, 1e9, "support stiffness K_y", source=_SPRING)
    damping: Scalar = parameter(
        "N s/m", 0.0, 1e5, "support damping B_s", source="tap the cage on its rib: how fast the answer decays"
    )
    cubic_stiffness: Scalar = parameter(
        "N/m^3", 0.0, 1e18, "cubic stiffness K_3, for cubic = absolute", source=_CUBIC, default=0.0
    )
    cubic_ratio: Scalar = parameter(
        "1", 0.0, 1e4, "alpha in K_3 = alpha K_s / c^2, for cubic = dimensionless", source=_CUBIC, default=0.0
    )
    cross_stiffness: Scalar = parameter("N/m", -1e8, 1e8, "cross-coupling stiffness K_xy", source=_WHIRL, default=0.0)
    cross_cubic: Scalar = parameter(
        "N/m^3", -1e18, 1e18, "cubic cross-coupling K'_xy, for cross = as_printed", source=_WHIRL, default=0.0
    )
    cross: Cross = choice("circulatory", "as_printed", text="form of the cross-coupling", default="circulatory")
    cubic: Cubic = choice("absolute", "dimensionless", text="how the cubic stiffness is given", default="absolute")

    def at(self, cage: GuidedCage, speed: Scalar) -> "SupportForce":
        """Support force of `cage`; a dimensionless cubic term softens as the clearance grows."""
        cubic = self.cubic_stiffness
        if self.cubic == "dimensionless":
            cubic = self.cubic_ratio * ((self.stiffness_x + self.stiffness_y) / 2) / cage.clearance**2
        springs = (self.stiffness_x, self.stiffness_y, cubic, self.cross_stiffness, self.cross_cubic)
        return SupportForce(*springs, self.damping, self.cross)


class SupportForce(AbstractForce):
    """Force of springs, cross-coupling and damping.

    The spring force is -(K + K_3 |r|^2) r, an isotropic form of the paper's cubic stiffness with K_x and K_y of its
    fig. 6. Cross-coupling is `circulatory`, K_xy (-y, x), which feeds energy into whirl; or `as_printed` in (20), -K_xy
    (y, x) - K'_xy (y^3, x^3), whose linear part is conservative.
    """

    stiffness_x: Scalar
    stiffness_y: Scalar
    cubic: Scalar
    """K_3 [N/m^3]."""
    cross_stiffness: Scalar
    cross_cubic: Scalar
    damping: Scalar
    cross: Cross = eqx.field(static=True)

    def force(self, motion: Motion) -> Force:
        x, y, across = motion.x, motion.y, self.cross_stiffness
        hardening = self.cubic * (x * x + y * y)
        spring_x, spring_y = -(self.stiffness_x + hardening) * x, -(self.stiffness_y + hardening) * y
        if self.cross == "circulatory":
            cross_x, cross_y = -across * y, across * x
        else:
            cross_x, cross_y = -(across * y + self.cross_cubic * y**3), -(across * x + self.cross_cubic * x**3)
        return spring_x + cross_x - self.damping * motion.vx, spring_y + cross_y - self.damping * motion.vy, 0.0


class RigidRib(eqx.Module):
    """Fixed rib: the cage has two coordinates."""

    kind: ClassVar[str] = "rigid"


class ElasticRib(eqx.Module):
    """Rib of finite mass on a nonlinear spring and a damper: cage and rib have four coordinates together."""

    kind: ClassVar[str] = "elastic"

    mass: Scalar = parameter("kg", 1e-3, 100.0, "rib mass M_O", kind="drawing")
    stiffness: Scalar = parameter(
        "N/m", 1.0, 1e12, "rib stiffness K_O", source="tap the outer ring in its seat: the frequency it answers with"
    )
    damping: Scalar = parameter(
        "N s/m", 0.0, 1e8, "rib damping B_O", source="tap the outer ring in its seat: how fast the answer decays"
    )
    cubic_stiffness: Scalar = parameter(
        "N/m^3",
        0.0,
        1e24,
        "cubic rib stiffness K_O3",
        source="push the outer ring in its seat: force over way",
        default=0.0,
    )

    def holding_force(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> tuple[Scalar, Scalar]:
        """Force that holds the rib in place, -(K_O + K_O3 |r|^2) r - B_O r' [N]."""
        hardening = self.stiffness + self.cubic_stiffness * (x * x + y * y)
        return -hardening * x - self.damping * vx, -hardening * y - self.damping * vy
