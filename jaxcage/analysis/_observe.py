"""The kernel of every sweep: run a batch of lanes through the strobe map and watch them.

A lane is one speed, start and design. Lanes are the last axis of every array here, tangent vectors the first, so that
the compiled program runs along the lanes.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._types import LaneState, State
from ..integrate import StrobeMap, outcome_code
from ._lanes import StrobeLanes


class Plan(NamedTuple):
    """How long to run and what to watch; all static."""

    discard: int  # revolutions before anything is recorded
    block: int  # revolutions per block of the exponents' error estimate
    blocks: int  # number of blocks; block * blocks revolutions are observed
    keep: int  # strobe states kept, the last ones
    exponents: int  # number of Lyapunov exponents, from the largest down


class Observation(NamedTuple):
    """What a batch of lanes did."""

    strobe: Float[Array | np.ndarray, "keep dim lanes"]
    growth: Float[Array | np.ndarray, "blocks exponents lanes"]  # mean logarithmic growth per revolution in each block
    last: Float[Array | np.ndarray, "dim lanes"]
    peak: Float[Array | np.ndarray, " lanes"]  # largest excursion (for a cage: eps) while observed
    outcome: Int[Array | np.ndarray, " lanes"]


class Lanes(NamedTuple):
    """Where every lane is, how far out it has been, and whether it still runs."""

    y: LaneState
    peak: Float[Array, " lanes"]
    outcome: Int[Array, " lanes"]


Tangents = tuple[Float[Array, "exponents lanes"], ...]


def orthonormalise(tangents: Tangents) -> tuple[Tangents, Float[Array, "exponents lanes"]]:
    """Gram-Schmidt (QR) of the tangent vectors of every lane.

    **Returns:** orthonormal vectors, and the logarithms of the diagonal of R. Each vector is projected twice, which
    keeps them orthogonal to rounding error.
    """
    k = tangents[0].shape[0]
    done: list[list[Array]] = []
    logs = []
    for i in range(k):
        u = [t[i] for t in tangents]
        for _ in range(2):
            for w in done:
                along = sum(a * b for a, b in zip(u, w, strict=True))
                u = [a - along * b for a, b in zip(u, w, strict=True)]
        norm = jnp.sqrt(sum(a * a for a in u))
        done.append([a / norm for a in u])
        logs.append(jnp.log(norm))
    return tuple(jnp.stack([u[d] for u in done]) for d in range(len(tangents))), jnp.stack(logs)


def _advance(maps: StrobeLanes, lanes: Lanes) -> Lanes:
    """All lanes one revolution on; a lane that fails turns to NaN and keeps the code of its first failure."""
    # A failed lane runs on from rest, unseen: solvers that check their input would otherwise stop the whole batch.
    running = tuple(jnp.where(lanes.outcome == 0, c, 0.0) for c in lanes.y)
    y, peak, code = maps.map(_coded, running)
    outcome = jnp.where(lanes.outcome == 0, code, lanes.outcome)
    return Lanes(_blank(y, outcome), jnp.maximum(lanes.peak, peak), outcome)


def _coded(strobe: StrobeMap, y: State) -> tuple[State, Array, Array]:
    stretch = strobe(y)
    return stretch.y, jnp.asarray(stretch.peak), outcome_code(stretch.result)


def _blank(y: LaneState, outcome: Int[Array, " lanes"]) -> LaneState:
    return tuple(jnp.where(outcome == 0, c, jnp.nan) for c in y)


def _push(maps: StrobeLanes, lanes: Lanes, tangents: Tangents) -> tuple[Lanes, Tangents]:
    """All lanes one revolution on, with their tangent vectors (in units of the state's scale)."""

    def step(y: LaneState) -> tuple[LaneState, tuple[Array, Array]]:
        moved = _advance(maps, lanes._replace(y=y))
        return moved.y, (moved.peak, moved.outcome)

    def along(tangent: LaneState) -> tuple[LaneState, LaneState, tuple[Array, Array]]:
        y, moved, aux = jax.jvp(step, (lanes.y,), (tangent,), has_aux=True)
        return y, moved, aux

    scaled = tuple(t * s[None, :] for t, s in zip(tangents, maps.scale, strict=True))
    if tangents[0].shape[0] == 1:  # without the extra axis the compiled loops are nearly twice as fast
        y, moved, aux = along(tuple(t[0] for t in scaled))
        moved = tuple(t[None, :] for t in moved)
    else:
        y, moved, aux = jax.vmap(along, out_axes=(None, 0, None))(scaled)
    return Lanes(y, *aux), tuple(t / s[None, :] for t, s in zip(moved, maps.scale, strict=True))


def _start_tangents(dimension: int, exponents: int, lanes: int) -> Tangents:
    """Generic directions: no component zero, so that none is orthogonal to a coordinate axis."""
    row = jnp.arange(1.0, exponents + 1)[:, None]
    raw = tuple(jnp.cos(row * (d + 1) * 1.234 + d) * jnp.ones((1, lanes)) for d in range(dimension))
    return orthonormalise(raw)[0]


def observe(maps: StrobeLanes, y0: LaneState, plan: Plan) -> Observation:
    """Run lanes from `y0` and record strobe states and Lyapunov exponents.

    **Arguments:** strobe maps of the lanes; initial states, each of shape `(lanes,)`; plan.

    **Returns:** `Observation`. A failed lane is NaN from the revolution it failed in and carries its outcome code.
    """
    dim, count = len(y0), y0[0].shape[0]
    observed = plan.block * plan.blocks
    align = min(plan.block, plan.discard) if plan.exponents else 0
    admitted = maps.map(lambda m, y: outcome_code(m.admit(y)), y0)
    lanes = Lanes(_blank(y0, admitted), jnp.zeros(count), admitted)
    lanes = jax.lax.fori_loop(0, plan.discard - align, lambda _, c: _advance(maps, c), lanes)
    ring = jnp.zeros((plan.keep, dim, count))

    def record(ring: Array, n: Array, lanes: Lanes) -> Array:
        return jax.lax.dynamic_update_index_in_dim(ring, jnp.stack(lanes.y), n % plan.keep, 0)

    if plan.exponents == 0:

        def watch(n: Array, carry: tuple) -> tuple:
            lanes, ring = carry
            lanes = _advance(maps, lanes)
            return lanes, record(ring, n, lanes)

        lanes, ring = jax.lax.fori_loop(0, observed, watch, (lanes._replace(peak=jnp.zeros(count)), ring))
        growth = jnp.zeros((plan.blocks, 0, count))
    else:
        zero = jnp.zeros((plan.exponents, count))
        sums = jnp.zeros((plan.blocks + 1, plan.exponents, count))

        def follow(n: Array, carry: tuple) -> tuple:
            # Revolutions n < 0 only align the tangent vectors; their growth goes to the extra row of `sums`.
            lanes, ring, tangents, total, sums = carry
            lanes, moved = _push(maps, lanes, tangents)
            runs = lanes.outcome[None, :] == 0
            tangents, logs = orthonormalise(tuple(jnp.where(runs, t, 1.0) for t in moved))
            total = total + jnp.where(runs, logs, jnp.nan)
            row = jnp.where(n < 0, plan.blocks, n // plan.block)
            sums = jax.lax.dynamic_update_index_in_dim(sums, total, row, 0)
            total = jnp.where((n + 1) % plan.block == 0, zero, total)
            return lanes, record(ring, jnp.maximum(n, 0), lanes), tangents, total, sums

        tangents = _start_tangents(dim, plan.exponents, count)
        carry = (lanes._replace(peak=jnp.zeros(count)), ring, tangents, zero, sums)
        lanes, ring, _, _, sums = jax.lax.fori_loop(-align, observed, follow, carry)
        growth = sums[:-1] / plan.block
    strobe = jnp.roll(ring, -(observed % plan.keep), axis=0)
    return Observation(strobe, growth, jnp.stack(lanes.y), lanes.peak, lanes.outcome)
