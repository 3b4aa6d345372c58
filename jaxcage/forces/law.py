"""Laws of forces on the cage: what a law sees of its motion, and what it returns.

`AbstractLaw` holds the parameters of a force. Its method `at(cage, speed)` works out, once for all steps, whatever
depends on the bearing and on the speed, and returns an `AbstractForce`, whose method `force(motion)` gives the force.
A law without such constants, as a user writes it, is an `AbstractForce` from the beginning.
"""

import abc
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import equinox as eqx

from .._pytrees import Scalar
from .elementary import smooth_norm, smooth_plus


Force = tuple[Scalar, Scalar, Scalar]
"""(F_x, F_y, moment) on the cage [N, N, N m], the moment about its centre and counter-clockwise.

The speed of the cage is prescribed: moments do not change its motion. Times the
speed they are the power that drives the cage: that of the film is the power that its shear costs.
"""


class Place(NamedTuple):
    """Position of the cage in its clearance circle, lengths over clearance."""

    x: Scalar
    y: Scalar
    vx: Scalar
    """Velocities over clearance [1/s]."""
    vy: Scalar
    eps: Scalar
    """Eccentricity ratio."""
    per_eps: Scalar
    nx: Scalar
    """Line of centres: a unit vector, rounded off at the centre."""
    ny: Scalar
    gap: Scalar
    """Distance of eps from the onset of contact, negative before it."""
    excess: Scalar
    """The same distance, smoothly cut off at 0."""


class Land(eqx.Module):
    """The guide's clearance, and over it the lengths that keep its forces smooth.

    Divisions and roots dominate the cost of a step: constants are inverted once, the eccentricity once.
    """

    clearance: Scalar
    per_clearance: Scalar
    onset: Scalar
    """Eccentricity ratio at which contact begins."""
    onset_width: Scalar
    centre_width: Scalar

    def place(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> Place:
        """Place of a cage whose centre is at (x, y) [m] and moves at (vx, vy) [m/s]."""
        per_c = self.per_clearance
        x, y, vx, vy = x * per_c, y * per_c, vx * per_c, vy * per_c
        eps = smooth_norm(x, y, self.centre_width)
        per_eps, gap = 1 / eps, eps - self.onset
        excess = smooth_plus(gap, self.onset_width)
        return Place(x, y, vx, vy, eps, per_eps, x * per_eps, y * per_eps, gap, excess)


class Motion(NamedTuple):
    """Motion of the cage, relative to the land that guides it."""

    phase: Scalar
    """Angle of the cage [rad]; forces must repeat after every revolution."""
    x: Scalar
    """Position of its centre [m]."""
    y: Scalar
    vx: Scalar
    """Velocity of its centre [m/s]."""
    vy: Scalar
    cage_speed: Scalar
    """Speed of rotation [rad/s]."""
    land_speed: Scalar
    """Speed of rotation of the land [rad/s]: 0 for a rib of the ring that stands still."""
    shaft_speed: Scalar
    """Speed of the shaft [rad/s] at which rollers without slip turn the cage at `cage_speed`."""
    land: Land
    """The guide's clearance."""

    @property
    def place(self) -> Place:
        """Place of the cage in its clearance circle."""
        return self.land.place(self.x, self.y, self.vx, self.vy)


@runtime_checkable
class GuidedCage(Protocol):
    """What the laws read from a cage."""

    bearing: Any
    lubricant: Any
    load: Scalar

    @property
    def clearance(self) -> Any:
        """Radial clearance of the guide [m]."""

    @property
    def land_radius(self) -> Any:
        """Radius of the cage's guiding land [m]."""


class AbstractLaw(eqx.Module):
    """Parameters of a force on the cage.

    Numbers of a law are fields: declared with `jaxcage.forces.parameter`, with unit, range and description; or plain
    ones, `coefficient: float`, parameters as well but of unknown unit. What is no parameter is a static field.
    """

    law_name: ClassVar[str] = ""
    """Name of the law in `jaxcage.forces.LAWS`: its table in a configuration file, its attribute of a model, and its
    force in results. Laws of a user have none and are named after their class."""
    kind: ClassVar[str] = ""
    """`kind` in a configuration file that chooses between laws of one name."""

    def highest_harmonic(self, cage: GuidedCage) -> int:
        """The highest harmonic of the phase in the force, a static number: no step is longer than half its period."""
        return 1

    @abc.abstractmethod
    def at(self, cage: GuidedCage, speed: Scalar) -> "AbstractForce":
        """The force on `cage` at cage speed `speed` [rad/s]."""


class AbstractForce(AbstractLaw):
    """A force between land and cage: an elastic rib feels its opposite.

    !!! example
        class ViscousDrag(jc.forces.AbstractForce):
            coefficient: float

            def force(self, motion):
                return -self.coefficient * motion.vx, -self.coefficient * motion.vy, 0.0

        model = jc.replace(jc.case("1a"), extra=(ViscousDrag(3.0),))
    """

    @property
    def harmonics(self) -> int:
        """The highest harmonic of the phase in the force, 1 by default."""
        return 1

    def highest_harmonic(self, cage: GuidedCage) -> int:
        return self.harmonics

    def at(self, cage: GuidedCage, speed: Scalar) -> "AbstractForce":
        return self

    @abc.abstractmethod
    def force(self, motion: Motion) -> Force:
        """(F_x, F_y, moment) on the cage, scalars made with `jax.numpy` or plain arithmetic."""


class AbstractForcing(AbstractForce):
    """A force that depends on the phase alone; it does not react on the rib."""
