"""What every sweep does with a lane, one speed, start and design: run it through the strobe map and watch it.

Written for one lane; the engine makes lanes of it with `jax.vmap`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._types import State
from ..integrate import StrobeMap, outcome_code, revolution
from ..models import divide, multiply


class Plan(NamedTuple):
    """How long to run and what to watch."""

    discard: int  # revolutions before anything is recorded
    block: int  # revolutions per block of the exponents' error estimate
    blocks: int  # number of blocks; block * blocks revolutions are observed
    keep: int  # strobe states kept, the last ones
    exponents: int  # number of Lyapunov exponents, from the largest down

    @property
    def align(self) -> int:
        """The last of the discarded revolutions, in which the tangent vectors turn to their directions."""
        return min(self.block, self.discard) if self.exponents else 0


class Lengths(NamedTuple):
    """A plan's lengths as arrays: one program serves them all."""

    align: Int[Array, ""]
    block: Int[Array, ""]
    blocks: Int[Array, ""]


class Room(NamedTuple):
    """Sizes of what is recorded, which are a program's own; a plan may need less of the first two."""

    keep: int
    blocks: int
    exponents: int


class Observation(NamedTuple):
    """What lanes did, their axis last."""

    strobe: Float[Array | np.ndarray, "keep dim *lanes"]
    growth: Float[Array | np.ndarray, "blocks exponents *lanes"]  # mean logarithmic growth per revolution in each block
    last: Float[Array | np.ndarray, " dim *lanes"]
    peak: Float[Array | np.ndarray, "*lanes"]  # largest excursion (for a cage: eps) while observed
    outcome: Int[Array | np.ndarray, "*lanes"]
    error: Float[Array | np.ndarray, "*lanes"]  # largest error of a revolution from the start on, in units of the scale
    doubt: Float[Array | np.ndarray, " exponents *lanes"]  # change of the mean growth with half as many steps


class Lane(NamedTuple):
    """Where a lane is, how far out it has been, whether it still runs, how many steps it needed last, and its error."""

    y: State
    peak: Float[Array, ""]
    outcome: Int[Array, ""]
    level: Int[Array, ""]
    error: Float[Array, ""]


Tangents = tuple[State, ...]
"""One tangent vector after the other, in units of the state's scale."""


def orthonormalise(tangents: Tangents) -> tuple[Tangents, Float[Array, " exponents"]]:
    """Gram-Schmidt (QR) of tangent vectors.

    **Returns:** orthonormal vectors, and the logarithms of the diagonal of R. Each vector is projected twice, which
    keeps them orthogonal to rounding error.
    """
    done: list[State] = []
    logs = []
    for tangent in tangents:
        u = tangent
        for _ in range(2):
            for w in done:
                along = sum(a * b for a, b in zip(u, w, strict=True))
                u = tuple(a - along * b for a, b in zip(u, w, strict=True))
        norm = jnp.sqrt(sum(a * a for a in u))
        done.append(tuple(a / norm for a in u))
        logs.append(jnp.log(norm))
    return tuple(done), jnp.stack(logs) if logs else jnp.zeros(0)


def _advance(strobe: StrobeMap, lane: Lane, tangents: Tangents = ()) -> tuple[Lane, Tangents, Tangents]:
    """A lane through a revolution, with its tangent vectors, and these by half as many steps.

    A lane that fails turns to NaN and keeps the code of its first failure.
    """
    # A failed lane is not run any further. What stands for its state is finite, since it may fill up a block of lanes
    # that run, and solvers that check their input would stop them all.
    runs = lane.outcome == 0
    moved = revolution(
        strobe,
        tuple(jnp.where(runs, c, 0.0) for c in lane.y),
        tuple(multiply(t, strobe.scale) for t in tangents),
        jnp.where(runs, lane.level, -1),
    )
    outcome = jnp.where(runs, moved.outcome, lane.outcome)
    error = jnp.where(runs, jnp.maximum(lane.error, moved.error), lane.error)
    after = Lane(_blank(moved.y, outcome), jnp.maximum(lane.peak, moved.peak), outcome, moved.level, error)
    scaled = lambda tangents: tuple(divide(t, strobe.scale) for t in tangents)
    return after, scaled(moved.tangents), scaled(moved.half)


def _blank(y: State, outcome: Int[Array, ""]) -> State:
    return tuple(jnp.where(outcome == 0, c, jnp.nan) for c in y)


def start_tangents(dimension: int, exponents: int) -> Tangents:
    """Generic directions: no component zero, so that none is orthogonal to a coordinate axis."""
    wave = lambda i, d: jnp.cos(jnp.asarray((i + 1.0) * (d + 1) * 1.234 + d))
    return orthonormalise(tuple(tuple(wave(i, d) for d in range(dimension)) for i in range(exponents)))[0]


def settle(strobe: StrobeMap, lane: Lane, revolutions: Int[Array, ""], limit: Float[Array, ""]) -> Lane:
    """Run a lane without recording anything; one that starts further out than `limit` has failed."""
    outcome = jnp.where(lane.outcome == 0, outcome_code(strobe.admit(lane.y, limit)), lane.outcome)
    lane = lane._replace(y=_blank(lane.y, outcome), outcome=outcome)
    return jax.lax.fori_loop(0, revolutions, lambda _, c: _advance(strobe, c)[0], lane)


def observe(strobe: StrobeMap, lane: Lane, lengths: Lengths, room: Room) -> Observation:
    """Follow a lane that `settle` has left and record strobe states and Lyapunov exponents.

    **Arguments:** its strobe map; where it is; how long; what there is room for.

    **Returns:** `Observation`: the last strobe states come last; growth is zero beyond the blocks that were run. A
    failed lane is NaN from the revolution it failed in and carries its outcome code.
    """
    dim = len(lane.y)
    observed = lengths.block * lengths.blocks
    lane = lane._replace(peak=jnp.asarray(strobe.system.excursion(lane.y), dtype=float))
    ring, zero = jnp.zeros((room.keep, dim)), jnp.zeros(room.exponents)
    sums = jnp.zeros((room.blocks + 1, room.exponents))

    def follow(n: Array, carry: tuple) -> tuple:
        # Revolutions n < 0 only align the tangent vectors; their growth goes to the extra row of `sums`.
        lane, ring, tangents, total, doubt, sums = carry
        lane, *pushed = _advance(strobe, lane, tangents)
        runs = lane.outcome == 0
        (tangents, logs), (_, rough) = (
            orthonormalise(jax.tree.map(lambda t: jnp.where(runs, t, 1.0), each)) for each in pushed
        )
        total = total + jnp.where(runs, logs, jnp.nan)
        doubt = doubt + jnp.where(n < 0, 0.0, logs - rough)
        row = jnp.where(n < 0, room.blocks, n // lengths.block)
        sums = jax.lax.dynamic_update_index_in_dim(sums, total, row, 0)
        total = jnp.where((n + 1) % lengths.block == 0, zero, total)
        ring = jax.lax.dynamic_update_index_in_dim(ring, jnp.stack(lane.y), jnp.maximum(n, 0) % room.keep, 0)
        return lane, ring, tangents, total, doubt, sums

    carry = (lane, ring, start_tangents(dim, room.exponents), zero, zero, sums)
    lane, ring, _, _, doubt, sums = jax.lax.fori_loop(-lengths.align, observed, follow, carry)
    growth, doubt = sums[:-1] / lengths.block.astype(float), doubt / observed.astype(float)
    strobe_states = jnp.roll(ring, -(observed % room.keep), axis=0)
    return Observation(strobe_states, growth, jnp.stack(lane.y), lane.peak, lane.outcome, lane.error, doubt)
