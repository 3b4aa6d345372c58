"""State of the whole bearing, and what its rates are made of."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._types import Scalar


class Rollers(NamedTuple):
    """Rollers, each a number of an array."""

    lag: Float[Array, " rollers"]
    """beta, angle of the centre beyond that of its pocket [rad]."""
    spin: Float[Array, " rollers"]
    """Absolute speed of rotation [rad/s]."""
    radius: Float[Array, " rollers"]
    """Distance from the outer ring's centre [m]."""
    radial: Float[Array, " rollers"]
    """Its rate [m/s]."""
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


class BearingState(NamedTuple):
    """Everything that moves. Two arrays, so that a step works on few."""

    rollers: Float[Array, "5 rollers"]
    """Rows as in `Rollers`."""
    bodies: Float[Array, " 9"]
    """As in `Bodies`."""
    clock: Float[Array, " 2"]
    """Angle of the cage [rad] and time [s]: one of them is what is integrated over, the other a quadrature."""

    @classmethod
    def of(cls, rollers: Rollers, bodies: Bodies, angle: Scalar = 0.0, time: Scalar = 0.0) -> "BearingState":
        """Pack numbers."""
        pack = lambda parts: jnp.stack([jnp.asarray(part, dtype=float) for part in parts])
        return cls(pack(rollers), pack(bodies), pack((angle, time)))


LEDGER = (
    "input",
    "traction",
    "raceway_damping",
    "pocket_friction",
    "pocket_damping",
    "film",
    "land_contact",
    "drag",
    "mounting",
)
"""Powers that are integrated: what the shaft (or whoever turns the outer ring or holds the cage) puts in [W], and what
each kind of contact takes out."""
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
)
"""Other quantities that are integrated over time: moment of all outer forces on the cage about the outer ring's centre
[N m], sum of the pocket forces [N], eccentricity ratio, angular speed of the cage's centre about the land's [rad/s],
cage speed [rad/s], mean spin of the rollers [rad/s], torque that holds the cage's speed [N m]; load times sliding speed
of all pockets and of the land [W], which is what wears them; the whole force of the land on the cage [N];
and the force of all rollers on the cage times cosine and sine of the cage's angle [N], for its first harmonic."""
PEAKS = ("pocket_force", "land_force", "roller_slip", "ring_imbalance", "eccentricity")
"""Largest values that are followed: of a pocket force [N], of the land's whole force on the cage [N], of the slip of a
roller's spin against pure rolling, of the force by which a quasi-static ring is out of balance [N], and of the
eccentricity ratio, the last."""


class Rates(NamedTuple):
    """Rates over time."""

    state: BearingState
    integrals: Float[Array, " integrals"]
    """As in `LEDGER` and `MEANS`."""
    peaks: Float[Array, " peaks"]
    """Values, not rates, as in `PEAKS`."""
