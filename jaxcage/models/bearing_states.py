"""State of the whole bearing, by name and as one row of numbers, and what is integrated and recorded beside it.

A row holds the rollers one after the other, five numbers each, and then the nine of cage and inner ring.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from .._pytrees import Scalar


class Rollers(NamedTuple):
    """Rollers, each a number of an array."""

    lag: Float[Array, " rollers"]
    """beta, angle of the centre beyond that of its pocket [rad]."""
    spin: Float[Array, " rollers"]
    """Absolute speed of rotation [rad/s]."""
    radius: Float[Array, " rollers"]
    """Distance from the outer ring's centre [m]."""
    radial: Float[Array, " rollers"]
    """Rate of the radius [m/s]."""
    orbit: Float[Array, " rollers"]
    """Absolute angular speed psi' about the outer ring's centre [rad/s]."""


class Bodies(NamedTuple):
    """Cage and inner ring: places from the outer ring's centre [m], velocities [m/s]."""

    x: Scalar
    y: Scalar
    vx: Scalar
    vy: Scalar
    cage_speed: Scalar
    """Absolute speed of rotation of the cage [rad/s]."""
    ring_x: Scalar
    ring_y: Scalar
    ring_vx: Scalar
    ring_vy: Scalar


OF_ROLLER, OF_BODIES = len(Rollers._fields), len(Bodies._fields)


class BearingState(NamedTuple):
    """Everything that moves, as arrays of SI numbers."""

    rollers: Float[Array, "5 rollers"]
    """Rows as in `Rollers`."""
    bodies: Float[Array, " 9"]
    """Coordinates, in the order of `Bodies`."""
    clock: Float[Array, " 2"]
    """Angle of the cage [rad] and time [s]."""

    @classmethod
    def of(cls, rollers: Rollers, bodies: Bodies, angle: Scalar = 0.0, time: Scalar = 0.0) -> "BearingState":
        """Pack numbers."""
        pack = lambda parts: jnp.stack([jnp.asarray(part, dtype=float) for part in parts])
        return cls(pack(rollers), pack(bodies), pack((angle, time)))

    @property
    def row(self) -> Float[Array, "*lanes dim"]:
        """The state without its clock as one row, which is the state that the solvers integrate."""
        rollers = jnp.swapaxes(jnp.asarray(self.rollers), -1, -2)
        return jnp.concatenate([rollers.reshape(*rollers.shape[:-2], -1), jnp.asarray(self.bodies)], axis=-1)


def rollers_of(row: Any) -> Any:
    """Rollers (..., 5, rollers) of rows of states (..., dim)."""
    rollers = row[..., :-OF_BODIES]
    return rollers.reshape(*rollers.shape[:-1], -1, OF_ROLLER).swapaxes(-1, -2)


def bodies_of(row: Any) -> Any:
    """Cage and inner ring (..., 9) of rows of states (..., dim)."""
    return row[..., -OF_BODIES:]


LOSSES = {
    "traction": "traction on the raceways",
    "raceway_damping": "damping of the raceway contacts",
    "pocket_friction": "friction in the pockets",
    "pocket_damping": "damping of the pocket contacts",
    "film": "the film of the guiding land",
    "land_contact": "contact of cage and land",
    "drag": "drag, churning and rolling resistance",
    "mounting": "damping of the inner ring's mounting",
}
"""Kinds of power that is lost, by the names of their integrals."""
LEDGER = ("input", *LOSSES)
"""Powers that are integrated [W]: that of the shaft (and of whoever turns the outer ring or holds the cage), losses.
"""
MEANS = (
    "cage_moment",
    "pocket_force",
    "eccentricity",
    "whirl",
    "cage_speed",
    "roller_spin",
    "hold_torque",
    "pocket_rubbing",
    "land_rubbing",
    "land_force",
    "pocket_x_cos",
    "pocket_x_sin",
    "pocket_y_cos",
    "pocket_y_sin",
    "eccentricity_squared",
)
"""Other quantities that are integrated over time: moment of all outer forces on the cage about the outer ring's centre
[N m], sum of the pocket forces [N], eccentricity ratio, angular speed of the cage's centre about the land's [rad/s],
cage speed [rad/s], mean spin of the rollers [rad/s], torque that holds the cage's speed [N m]; load times sliding speed
of all pockets and of the land [W], which wears them; the whole force of the land on the cage [N]; the force of all
rollers on the cage times cosine and sine of the cage's angle [N], for its first harmonic; and the square of the
eccentricity ratio."""
INTEGRATED = (*LEDGER, *MEANS)
BESIDE = ("angle", "time", *INTEGRATED)
"""Quantities that are integrated beside the state: the cage's angle [rad], time [s], and the integrals over time."""
WATCHED = ("lost", "pocket_force", "land_force", "roller_slip", "eccentricity")
"""Quantities whose largest values are recorded. The first is the eccentricity ratio, or `LOST` where the cage hardly
turns; then a pocket force [N], the whole force of the land on the cage [N],
the slip of a roller's spin against pure rolling, and the eccentricity ratio."""
LOST = 3.0


class Rates(NamedTuple):
    """Rates over time, and the quantities that are recorded."""

    state: BearingState
    integrals: Float[Array, " integrals"]
    """Integrals, in the order of `INTEGRATED`."""
    watched: Float[Array, " watched"]
    """Largest values, in the order of `WATCHED`."""
