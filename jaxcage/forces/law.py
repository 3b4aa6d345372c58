"""Base classes of the force laws on the cage, and the motion on which forces depend.

`AbstractLaw` holds the parameters of a force. Its method `at(cage, speed)` evaluates, once for all steps, whatever
depends on the bearing and on the speed, and returns an `AbstractForce`, whose method `force(motion)` gives the force. A
user's law without such constants is an `AbstractForce` itself.
"""

import abc
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import equinox as eqx

from .._pytrees import Scalar
from .elementary import smooth_norm, smooth_plus


Force = tuple[Scalar, Scalar, Scalar]
"""(F_x, F_y, moment) on the cage [N, N, N m], the moment about its centre and counter-clockwise.

The speed of the cage is prescribed: moments do not change its motion, and moment times speed is the power that drives
the cage, for the film the power lost by its shear.
"""


class Place(NamedTuple):
    """Position of the cage in its clearance circle, lengths divided by the clearance."""

    x: Scalar
    y: Scalar
    vx: Scalar
    """Velocity over clearance [1/s]."""
    vy: Scalar
    eps: Scalar
    """Eccentricity ratio."""
    per_eps: Scalar
    nx: Scalar
    """Unit vector along the line of centres, smoothed at the centre."""
    ny: Scalar
    gap: Scalar
    """Distance of eps from the onset of contact, negative before it."""
    excess: Scalar
    """`gap`, smoothly cut off at 0."""


class Land(eqx.Module):
    """Clearance of the guide, and its smoothing lengths divided by the clearance.

    Inverses are computed once, since divisions and roots dominate the cost of a step.
    """

    clearance: Scalar
    per_clearance: Scalar
    onset: Scalar
    """Eccentricity ratio at which contact begins."""
    onset_width: Scalar
    centre_width: Scalar

    def place(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> Place:
        """`Place` of a cage whose centre is at (x, y) [m] and moves at (vx, vy) [m/s]."""
        per_c = self.per_clearance
        x, y, vx, vy = x * per_c, y * per_c, vx * per_c, vy * per_c
        eps = smooth_norm(x, y, self.centre_width)
        per_eps, gap = 1 / eps, eps - self.onset
        excess = smooth_plus(gap, self.onset_width)
        return Place(x, y, vx, vy, eps, per_eps, x * per_eps, y * per_eps, gap, excess)


class Motion(NamedTuple):
    """Motion of the cage, relative to the land that guides it."""

    phase: Scalar
    """Rotation angle of the cage [rad]; forces must have the period of one revolution."""
    x: Scalar
    """Position of the cage centre [m]."""
    y: Scalar
    vx: Scalar
    """Velocity of the cage centre [m/s]."""
    vy: Scalar
    cage_speed: Scalar
    """Rotation speed of the cage [rad/s]."""
    land_speed: Scalar
    """Rotation speed of the land [rad/s]; 0 for a rib of the stationary ring."""
    shaft_speed: Scalar
    """Shaft speed [rad/s] at which rollers without slip turn the cage at `cage_speed`."""
    land: Land

    @property
    def place(self) -> Place:
        """Place of the cage in its clearance circle."""
        return self.land.place(self.x, self.y, self.vx, self.vy)


@runtime_checkable
class GuidedCage(Protocol):
    """Attributes of a cage that force laws use."""

    bearing: Any
    lubricant: Any
    load: Scalar
    cage_mass: Scalar
    guidance_gap: Scalar

    @property
    def clearance(self) -> Any:
        """Radial clearance of the guide [m]."""

    @property
    def land_radius(self) -> Any:
        """Radius of the cage's guiding land [m]."""


class AbstractLaw(eqx.Module):
    """Base class for the parameters of a force on the cage.

    Parameters are fields: declared with `jaxcage.forces.parameter`, with unit, range and description, or plain,
    `coefficient: float`, with unknown unit. All other fields are static.
    """

    law_name: ClassVar[str] = ""
    """Name of a built-in law (`jaxcage.forces.LAWS`): its table in a configuration file, its attribute of a model, and
    its force in results. A user's law has none and goes by its class name."""
    kind: ClassVar[str] = ""
    """`kind` in a configuration file, which selects between laws of the same name."""

    def highest_harmonic(self, cage: GuidedCage) -> int:
        """Highest harmonic of the phase in the force, static: steps are at most half its period."""
        return 1

    @abc.abstractmethod
    def at(self, cage: GuidedCage, speed: Scalar) -> "AbstractForce":
        """Force on `cage` at cage speed `speed` [rad/s]."""


class AbstractForce(AbstractLaw):
    """Base class for a force between land and cage; an elastic rib receives the opposite force.

    !!! example
        class ViscousDrag(jc.forces.AbstractForce):
            coefficient: float

            def force(self, motion):
                return -self.coefficient * motion.vx, -self.coefficient * motion.vy, 0.0

        model = jc.replace(jc.case("1a"), extra=(ViscousDrag(3.0),))
    """

    @property
    def harmonics(self) -> int:
        """Highest harmonic of the phase in the force, 1 by default."""
        return 1

    def highest_harmonic(self, cage: GuidedCage) -> int:
        return self.harmonics

    def at(self, cage: GuidedCage, speed: Scalar) -> "AbstractForce":
        return self

    @abc.abstractmethod
    def force(self, motion: Motion) -> Force:
        """Return (F_x, F_y, moment) on the cage, scalars made with `jax.numpy` or plain arithmetic."""


class AbstractForcing(AbstractForce):
    """Base class for a force that depends on the phase alone and does not act on the rib."""
