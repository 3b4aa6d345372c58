"""The Jacobian of the whole bearing, which has the shape of an arrow, and its solution.

Rollers meet cage and inner ring only. So a matrix shift - J has a block of each roller by itself, one row and one
column of blocks that join it to the bodies, and a block of the bodies: with the rollers eliminated, what is left is a
small system, and the cost grows with the number of rollers, not with its cube.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Scalar
from ..models.whole import BearingAtSpeed, Bodies, Passed, Rollers


OF_BODIES = len(Bodies._fields) + 1
"""Cage, inner ring, and the cage's angle."""


class Parts(NamedTuple):
    """A state of the bearing, its rates or a change of it, as an arrow takes them."""

    rollers: Float[Array, "rollers 5"]
    """Columns as in `jaxcage.models.whole.Rollers`."""
    bodies: Float[Array, " 10"]
    """As in `jaxcage.models.whole.Bodies`, and the cage's angle."""


class Arrow(NamedTuple):
    """Blocks of the Jacobian; below those of the bodies, rows of what is integrated beside the state."""

    own: Float[Array, "rollers 5 5"]
    """Of each roller by itself."""
    by_bodies: Float[Array, "rollers 5 10"]
    on_bodies: Float[Array, "rollers 10+beside 5"]
    bodies: Float[Array, "10+beside 10"]

    def beside(self, u: Parts) -> Float[Array, " beside"]:
        """How the rates of what is integrated beside the state change with it."""
        own = jnp.einsum("jik,jk->i", self.on_bodies[:, OF_BODIES:], u.rollers)
        return own + self.bodies[OF_BODIES:] @ u.bodies


class Factors(NamedTuple):
    """Of shift - J, the rollers eliminated."""

    own: Float[Array, "rollers 5 5"]
    """Inverse of each roller's block."""
    by_bodies: Float[Array, "rollers 5 10"]
    """It times the block beside it."""
    on_bodies: Float[Array, "rollers 10 5"]
    bodies: Float[Array, "10 10"]
    """Inverse of what is left of the bodies' block."""

    def solve(self, f: Parts) -> Parts:
        """u of (shift - J) u = f."""
        alone = jnp.einsum("jik,jk->ji", self.own, f.rollers)
        bodies = self.bodies @ (f.bodies + jnp.einsum("jik,jk->i", self.on_bodies, alone))
        return Parts(alone + self.by_bodies @ bodies, bodies)


def arrow(at: BearingAtSpeed, y: Parts, over_angle: bool) -> Arrow:
    """The Jacobian of the rates at a state: 15 directional derivatives of each roller, and 26 of the bodies.

    **Arguments:** laws, of a bearing whose inner ring moves by its own inertia; state; whether rates are over the
    cage's angle, counted in its sense, or else over time. Beside the state, time and then what `LEDGER` and `MEANS`
    name are integrated.
    """

    def roller(w: Array, b: Array, cos: Scalar, sin: Scalar) -> tuple[Array, Array]:
        rollers, cage = Rollers(*w), Bodies(*b[:-1])
        pocket = jnp.cos(b[-1]), jnp.sin(b[-1])
        forces = at.on_roller(rollers, cage, pocket[0] * cos - pocket[1] * sin, pocket[1] * cos + pocket[0] * sin)
        rates, passed = at.roller_rates(rollers, cage, forces)
        return _paced(jnp.stack(rates), cage, over_angle), jnp.stack(passed)

    def bodies(b: Array, sums: Array) -> Array:
        cage = Bodies(*b[:-1])
        rates, beside, _ = at.body_rates(cage, (jnp.cos(b[-1]), jnp.sin(b[-1])), Passed(*sums), at.on_land(cage))
        return _paced(jnp.stack([*rates, cage.cage_speed, jnp.ones(()), *beside]), cage, over_angle)

    of_each = lambda f: jax.vmap(f, (0, None, 0, 0))
    given = y.rollers, y.bodies, jnp.cos(at.places), jnp.sin(at.places)
    (own, by_bodies), (passing, passed) = of_each(jax.jacfwd(roller, (0, 1)))(*given)
    sums = of_each(roller)(*given)[1].sum(axis=0)
    by_b, by_sums = jax.jacfwd(bodies, (0, 1))(y.bodies, sums)
    return Arrow(own, by_bodies, by_sums[None] @ passing, by_b + by_sums @ passed.sum(axis=0))


def factors(blocks: Arrow, shift: Scalar) -> Factors:
    """Eliminate the rollers from shift - J."""
    own = jnp.linalg.inv(shift * jnp.eye(5)[None] - blocks.own)
    by_bodies = own @ blocks.by_bodies
    on_bodies = blocks.on_bodies[:, :OF_BODIES]
    left = shift * jnp.eye(OF_BODIES) - blocks.bodies[:OF_BODIES] - jnp.sum(on_bodies @ by_bodies, axis=0)
    return Factors(own, by_bodies, on_bodies, jnp.linalg.inv(left))


def _paced(rates: Array, cage: Bodies, over_angle: bool) -> Array:
    return rates / jnp.abs(cage.cage_speed) if over_angle else rates
