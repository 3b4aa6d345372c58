"""The kernel of every sweep: run a batch of lanes through the strobe map and watch them.

A lane is one speed, start and design. Lanes are the last axis of every array here, tangent vectors the first, so that
the compiled program runs along the lanes.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._types import LaneState
from ..integrate import StrobeLanes, outcome_code


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
    """What a batch of lanes did."""

    strobe: Float[Array | np.ndarray, "keep dim lanes"]
    growth: Float[Array | np.ndarray, "blocks exponents lanes"]  # mean logarithmic growth per revolution in each block
    last: Float[Array | np.ndarray, "dim lanes"]
    peak: Float[Array | np.ndarray, " lanes"]  # largest excursion (for a cage: eps) while observed
    outcome: Int[Array | np.ndarray, " lanes"]


class Lanes(NamedTuple):
    """Where every lane is, how far out it has been, whether it still runs, and how many steps it needed last."""

    y: LaneState
    peak: Float[Array, " lanes"]
    outcome: Int[Array, " lanes"]
    level: Int[Array, " lanes"]


Tangents = tuple[LaneState, ...]
"""One tangent vector of every lane after the other, in units of the state's scale."""

RETRY = 16
"""Once in so many revolutions a lane tries the next smaller number of steps again."""


def orthonormalise(tangents: Tangents) -> tuple[Tangents, Float[Array, "exponents lanes"]]:
    """Gram-Schmidt (QR) of the tangent vectors of every lane.

    **Returns:** orthonormal vectors, and the logarithms of the diagonal of R. Each vector is projected twice, which
    keeps them orthogonal to rounding error.
    """
    done: list[LaneState] = []
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
    return tuple(done), jnp.stack(logs)


def _advance(maps: StrobeLanes, lanes: Lanes, n: Int[Array, ""], tangents: Tangents = ()) -> tuple[Lanes, Tangents]:
    """All lanes through revolution `n`, with their tangent vectors.

    A lane that fails turns to NaN and keeps the code of its first failure.
    """
    # A failed lane runs on from rest, unseen: solvers that check their input would otherwise stop the whole batch.
    runs = lanes.outcome == 0
    level = jnp.where((n + 1) % RETRY == 0, jnp.maximum(lanes.level - 1, 0), lanes.level)
    moved = maps.revolution(
        tuple(jnp.where(runs, c, 0.0) for c in lanes.y),
        tuple(tuple(c * s for c, s in zip(t, maps.scale, strict=True)) for t in tangents),
        jnp.where(runs, level, 0),
    )
    outcome = jnp.where(runs, moved.outcome, lanes.outcome)
    after = Lanes(_blank(moved.y, outcome), jnp.maximum(lanes.peak, moved.peak), outcome, moved.level)
    return after, tuple(tuple(c / s for c, s in zip(t, maps.scale, strict=True)) for t in moved.tangents)


def _blank(y: LaneState, outcome: Int[Array, " lanes"]) -> LaneState:
    return tuple(jnp.where(outcome == 0, c, jnp.nan) for c in y)


def _start_tangents(dimension: int, exponents: int, lanes: int) -> Tangents:
    """Generic directions: no component zero, so that none is orthogonal to a coordinate axis."""
    wave = lambda i, d: jnp.full(lanes, jnp.cos((i + 1.0) * (d + 1) * 1.234 + d))
    return orthonormalise(tuple(tuple(wave(i, d) for d in range(dimension)) for i in range(exponents)))[0]


def settle(maps: StrobeLanes, y0: LaneState, revolutions: Int[Array, ""]) -> Lanes:
    """Run lanes from `y0` without recording anything; a lane that may not start there has failed."""
    count = y0[0].shape[0]
    admitted = maps.map(lambda m, y: outcome_code(m.admit(y)), y0)
    lanes = Lanes(_blank(y0, admitted), jnp.zeros(count), admitted, jnp.zeros(count, jnp.int32))
    return jax.lax.fori_loop(0, revolutions, lambda n, c: _advance(maps, c, n)[0], lanes)


def observe(maps: StrobeLanes, lanes: Lanes, lengths: Lengths, room: Room) -> Observation:
    """Follow lanes that `settle` has left and record strobe states and Lyapunov exponents.

    **Arguments:** strobe maps of the lanes; where they are; how long; what there is room for.

    **Returns:** `Observation`: the last strobe states come last; growth is zero beyond the blocks that were run. A
    failed lane is NaN from the revolution it failed in and carries its outcome code.
    """
    dim, count = len(lanes.y), lanes.y[0].shape[0]
    observed = lengths.block * lengths.blocks
    lanes = lanes._replace(peak=jnp.zeros(count))
    ring = jnp.zeros((room.keep, dim, count))

    def record(ring: Array, n: Array, lanes: Lanes) -> Array:
        return jax.lax.dynamic_update_index_in_dim(ring, jnp.stack(lanes.y), n % room.keep, 0)

    if room.exponents == 0:

        def watch(n: Array, carry: tuple) -> tuple:
            lanes, ring = carry
            lanes, _ = _advance(maps, lanes, n)
            return lanes, record(ring, n, lanes)

        lanes, ring = jax.lax.fori_loop(0, observed, watch, (lanes, ring))
        growth = jnp.zeros((room.blocks, 0, count))
    else:
        zero = jnp.zeros((room.exponents, count))
        sums = jnp.zeros((room.blocks + 1, room.exponents, count))

        def follow(n: Array, carry: tuple) -> tuple:
            # Revolutions n < 0 only align the tangent vectors; their growth goes to the extra row of `sums`.
            lanes, ring, tangents, total, sums = carry
            lanes, moved = _advance(maps, lanes, n, tangents)
            runs = lanes.outcome == 0
            tangents, logs = orthonormalise(jax.tree.map(lambda t: jnp.where(runs, t, 1.0), moved))
            total = total + jnp.where(runs, logs, jnp.nan)
            row = jnp.where(n < 0, room.blocks, n // lengths.block)
            sums = jax.lax.dynamic_update_index_in_dim(sums, total, row, 0)
            total = jnp.where((n + 1) % lengths.block == 0, zero, total)
            return lanes, record(ring, jnp.maximum(n, 0), lanes), tangents, total, sums

        carry = (lanes, ring, _start_tangents(dim, room.exponents, count), zero, sums)
        lanes, ring, _, _, sums = jax.lax.fori_loop(-lengths.align, observed, follow, carry)
        growth = sums[:-1] / lengths.block.astype(float)
    strobe = jnp.roll(ring, -(observed % room.keep), axis=0)
    return Observation(strobe, growth, jnp.stack(lanes.y), lanes.peak, lanes.outcome)
