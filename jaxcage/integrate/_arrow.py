"""The Jacobian of the whole bearing, which has the shape of an arrow, and its solution.

Rollers meet cage and inner ring only. So a matrix shift - J has a block of each roller by itself, one row and one
column of blocks that join it to the bodies, and a block of the bodies: with the rollers eliminated, what is left is a
small system, and the cost grows with the number of rollers, not with its cube.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Scalar
from ..forces import cos_sin
from ..models.whole import BearingAtSpeed, Bodies, Passed, Rollers
from ..solve import lanewise


OF_ROLLER, PASSED = len(Rollers._fields), len(Passed._fields)
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
    """The Jacobian of the rates at a state: 15 directional derivatives of each roller, and 25 of the bodies.

    **Arguments:** laws, of a bearing whose inner ring moves by its own inertia; state; whether rates are over the
    cage's angle, counted in its sense, or else over time. Beside the state, time and then what `LEDGER` and `MEANS`
    name are integrated.

    Each direction is a lane of machine code: XLA by itself works out a contact again for every number that hangs on it.
    """
    n, ways = at.n_rollers, OF_ROLLER + OF_BODIES
    each = lambda x: jnp.repeat(x, ways)
    bodies = jnp.repeat(y.bodies[:, None], n * ways, axis=1)
    places = [each(jnp.cos(at.places)), each(jnp.sin(at.places))]
    given = [*map(each, y.rollers.T), *bodies]
    rates, changes = _changes(_of_roller(over_angle), at, places, given, jnp.tile(jnp.arange(ways), n))
    apart = lambda rows: jnp.stack(rows).reshape(-1, n, ways).swapaxes(0, 1)
    sums = jnp.sum(apart(rates[OF_ROLLER:])[:, :, 0], axis=0)
    moved, passed = apart(changes[:OF_ROLLER]), apart(changes[OF_ROLLER:])

    ways = OF_BODIES + PASSED
    given = jnp.repeat(jnp.append(y.bodies, sums)[:, None], ways, axis=1)
    by_all = jnp.stack(_changes(_of_bodies(over_angle), at, [], list(given), jnp.arange(ways))[1])
    by_b, by_sums = by_all[:, :OF_BODIES], by_all[:, OF_BODIES:]
    on_bodies = by_sums[None] @ passed[:, :, :OF_ROLLER]
    among = by_b + by_sums @ jnp.sum(passed[:, :, OF_ROLLER:], axis=0)
    return Arrow(moved[:, :, :OF_ROLLER], moved[:, :, OF_ROLLER:], on_bodies, among)


Law = Callable[[BearingAtSpeed, Sequence[Any], Sequence[Any]], list[Any]]
"""(laws, numbers that stand, numbers that move) -> rates."""


def _changes(
    f: Law, at: BearingAtSpeed, standing: Sequence[Array], given: Sequence[Array], way: Array
) -> tuple[list[Array], list[Array]]:
    """Values of `f`, and its derivatives, in each lane by the number that moves whose place is its `way`."""
    leaves, tree = jax.tree.flatten(at)
    laws = [jnp.asarray(x, dtype=float) for x in leaves]
    results = len(jax.eval_shape(lambda x, y: f(at, x, y), *(tuple(x[0] for x in row) for row in (standing, given))))

    def kernel(laws: Sequence[Any], lane: Sequence[Any]) -> list[Any]:
        it = iter(lane)
        take = lambda rows: tuple(next(it) for _ in rows)
        way, at, standing_here = next(it), jax.tree.unflatten(tree, laws), take(standing)
        along = tuple(jnp.where(way == i, 1.0, 0.0) for i in range(len(given)))
        values, changes = jax.jvp(lambda *y: f(at, standing_here, y), take(given), along)
        return [*values, *changes]

    found = lanewise(kernel, 2 * results, laws, [way.astype(float), *standing, *given])
    return list(found[:results]), list(found[results:])


def _of_roller(over_angle: bool) -> Law:
    """Rates of one roller, and what it passes on, by itself and the bodies."""

    def f(at: BearingAtSpeed, place: Sequence[Any], y: Sequence[Any]) -> list[Any]:
        (cos, sin), rollers, cage = place, Rollers(*y[:OF_ROLLER]), Bodies(*y[OF_ROLLER:-1])
        pocket_cos, pocket_sin = cos_sin(y[-1])
        forces = at.on_roller(rollers, cage, pocket_cos * cos - pocket_sin * sin, pocket_sin * cos + pocket_cos * sin)
        rates, passed = at.roller_rates(rollers, cage, forces)
        return [*_paced(rates, cage, over_angle), *map(jnp.asarray, passed)]

    return f


def _of_bodies(over_angle: bool) -> Law:
    """Rates of the bodies and of what is integrated beside them, by themselves and what all rollers pass on."""

    def f(at: BearingAtSpeed, none: Sequence[Any], y: Sequence[Any]) -> list[Any]:
        cage, sums = Bodies(*y[: OF_BODIES - 1]), Passed(*y[OF_BODIES:])
        rates, beside, *_ = at.body_rates(cage, cos_sin(y[OF_BODIES - 1]), sums, at.on_land(cage))
        return _paced([*rates, cage.cage_speed, jnp.ones_like(cage.cage_speed), *beside], cage, over_angle)

    return f


def factors(blocks: Arrow, shift: Scalar) -> Factors:
    """Eliminate the rollers from shift - J."""
    own = jnp.linalg.inv(shift * jnp.eye(5)[None] - blocks.own)
    by_bodies = own @ blocks.by_bodies
    on_bodies = blocks.on_bodies[:, :OF_BODIES]
    left = shift * jnp.eye(OF_BODIES) - blocks.bodies[:OF_BODIES] - jnp.sum(on_bodies @ by_bodies, axis=0)
    return Factors(own, by_bodies, on_bodies, jnp.linalg.inv(left))


def _paced(rates: Sequence[Any], cage: Bodies, over_angle: bool) -> list[Any]:
    return [x / jnp.abs(cage.cage_speed) if over_angle else jnp.asarray(x) for x in rates]
