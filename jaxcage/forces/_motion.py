"""What a force law sees of the cage, and what it returns.

A law is a module with one method, `force(motion)`. Laws whose constants depend on the bearing or on the speed are
declared by a module of parameters that has `at(cage, speed)`, which works these constants out once for all steps.
"""

import abc
from typing import Any, NamedTuple, Protocol, runtime_checkable

import equinox as eqx
import jax

from .._types import Scalar
from ._land import Land, Place


Force = tuple[Scalar, Scalar, Scalar]
"""(F_x, F_y, moment) on the cage [N, N, N m], the moment about its centre and counter-clockwise.

The cage turns at a speed that is given: moments do not change its motion. They are reported
(`jaxcage.analysis.cage_moments`), and times the speed they are the power that drives the cage.
"""
Rows = tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]
"""A 2 x 2 matrix, e.g. of the derivatives of (F_x, F_y)."""


class Motion(NamedTuple):
    """How the cage moves, relative to the land that guides it."""

    phase: Scalar
    """Angle of the cage [rad]; what depends on it must repeat with every turn."""
    x: Scalar
    """Position of its centre [m]."""
    y: Scalar
    vx: Scalar
    """Velocity of its centre [m/s]."""
    vy: Scalar
    cage_speed: Scalar
    """Speed of rotation [rad/s]."""
    land_speed: Scalar
    """That of the land [rad/s]: 0 for a rib of the ring that stands still."""
    shaft_speed: Scalar
    """That of the shaft [rad/s], at which rollers that roll without slip turn the cage so fast."""
    land: Land
    """The guide's clearance."""

    @property
    def place(self) -> Place:
        """Where the cage is in its clearance circle."""
        return self.land.place(self.x, self.y, self.vx, self.vy)


@runtime_checkable
class GuidedCage(Protocol):
    """What the laws ask of a cage."""

    bearing: Any
    lubricant: Any
    load: Scalar

    @property
    def clearance(self) -> Any:
        """Radial clearance of the guide [m]."""

    @property
    def land_radius(self) -> Any:
        """Radius of the cage's guiding land [m]."""


class AbstractForce(eqx.Module):
    """A force between land and cage: an elastic rib feels its opposite.

    Numbers of a law are fields: declared with `jaxcage.forces.parameter`, with unit, range and words; or plain ones,
    `coefficient: float`, parameters as well but of unknown unit. What is no parameter is a static field.

    !!! example
        class ViscousDrag(jc.forces.AbstractForce):
            coefficient: float

            def force(self, motion):
                return -self.coefficient * motion.vx, -self.coefficient * motion.vy, 0.0

        model = jc.CageModel(..., extra=(ViscousDrag(3.0),))
    """

    @property
    def harmonics(self) -> int:
        """The highest harmonic of the phase in the force, a static number: no step is longer than half its period."""
        return 1

    @abc.abstractmethod
    def force(self, motion: Motion) -> Force:
        """(F_x, F_y, moment) on the cage, scalars made with `jax.numpy` or plain arithmetic."""

    def slopes(self, motion: Motion) -> tuple[Rows, Rows] | None:
        """Derivatives of (F_x, F_y) with respect to position and velocity, as rows; None if they cost too much.

        By forward differentiation unless a law knows better.
        """
        q, v = (motion.x, motion.y), (motion.vx, motion.vy)

        def held(q: Any, v: Any) -> tuple[Scalar, Scalar]:
            return self.force(motion._replace(x=q[0], y=q[1], vx=v[0], vy=v[1]))[:2]

        one, zero = jax.numpy.ones_like(motion.x), jax.numpy.zeros_like(motion.x)
        along = [(one, zero), (zero, one)]
        still = (zero, zero)
        of_q = [jax.jvp(held, (q, v), (e, still))[1] for e in along]
        of_v = [jax.jvp(held, (q, v), (still, e))[1] for e in along]
        rows = lambda columns: ((columns[0][0], columns[1][0]), (columns[0][1], columns[1][1]))
        return rows(of_q), rows(of_v)


class AbstractForcing(AbstractForce):
    """A force that the phase alone decides; it does not react on the rib."""

    def slopes(self, motion: Motion) -> tuple[Rows, Rows]:
        none = ((0.0, 0.0), (0.0, 0.0))
        return none, none
