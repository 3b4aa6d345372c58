"""Strobe maps of many lanes at once, with what is the same in every lane kept as scalars.

Where the step can be one kernel (`_kernel`), a revolution is a loop of such kernels over all lanes; elsewhere it is
the strobe map under `vmap`. A kernel reads some thirty numbers per lane. Those that do not depend on the speed are the
same for all lanes: as scalars they stay in registers, and what follows from them alone is worked out once.
"""

import itertools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.extend as jex
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from .._types import LaneState, Scalar, State
from ..models import ESCAPE, AbstractForcedSystem
from ._kernel import Lane, Split, can_be_kernel, run_steps, runs_lanewise, split, start_lane
from ._method import REVOLUTION, AbstractMethod, EqualSteps, judge
from ._results import outcome_code
from ._strobe import StrobeMap, strobe_map


def depends_on_input(f: Callable[..., PyTree[Array]], *x: Array) -> PyTree[bool]:
    """For each array that f(*x) returns, whether it depends on x."""
    traced, shape = jax.make_jaxpr(f, return_shape=True)(*x)
    touched = set(traced.jaxpr.invars)
    reached = lambda v: not isinstance(v, jex.core.Literal) and v in touched
    for equation in traced.jaxpr.eqns:
        if any(map(reached, equation.invars)):
            touched.update(equation.outvars)
    return jax.tree.unflatten(jax.tree.structure(shape), list(map(reached, traced.jaxpr.outvars)))


class Moved(NamedTuple):
    """Lanes after a revolution."""

    y: LaneState
    tangents: tuple[LaneState, ...]
    peak: Float[Array, " lanes"]  # largest excursion on the way
    outcome: Int[Array, " lanes"]
    level: Int[Array, " lanes"]  # which of the method's step counts the lane needed


class StrobeLanes(eqx.Module):
    """The strobe maps of lanes that share a system and differ in speed."""

    own: StrobeMap  # arrays that differ from lane to lane, the lane axis first; None elsewhere
    shared: StrobeMap  # the rest
    scale: LaneState

    @classmethod
    def of(
        cls,
        systems: AbstractForcedSystem,
        method: AbstractMethod,
        speed: Float[Array, " lanes"],
        which: Int[Array, " lanes"] | None = None,
    ) -> "StrobeLanes":
        """One lane per speed [rad/s].

        With `which`, the arrays of `systems` have an axis of designs in front, and it says which of them a lane has.
        """
        if which is None:
            make, args = (lambda s: strobe_map(systems, s, method)), (speed,)
        else:
            design = lambda w: jax.tree.map(lambda x: x[w] if eqx.is_array(x) else x, systems)
            make, args = (lambda s, w: strobe_map(design(w), s, method)), (speed, which)
        first = tuple(x[0] for x in args)
        differs = depends_on_input(lambda *x: eqx.filter(make(*x), eqx.is_array), *first)
        stacked = eqx.filter(eqx.filter_vmap(make)(*args), eqx.is_array)
        alike, static = eqx.partition(make(*first), eqx.is_array)
        own = jax.tree.map(lambda varies, x: x if varies else None, differs, stacked)
        shared = eqx.combine(jax.tree.map(lambda varies, x: None if varies else x, differs, alike), static)
        scale = tuple(jnp.broadcast_to(c, speed.shape) for c in stacked.scale)
        return cls(own, shared, scale)

    def map(self, f: Callable[[StrobeMap, Any], Any], y: LaneState) -> Any:
        """f(strobe map, state) in every lane."""
        return eqx.filter_vmap(lambda own, state: f(eqx.combine(own, self.shared), state))(self.own, y)

    def revolution(
        self, y: LaneState, tangents: tuple[LaneState, ...] = (), level: Int[Array, " lanes"] | None = None
    ) -> Moved:
        """All lanes one revolution on, with their tangent vectors (in units of the state).

        `level` is where a method with several step counts begins, by default with its smallest.
        """
        level = jnp.zeros(y[0].shape, jnp.int32) if level is None else level
        method, pieces = self.shared.method, self._pieces()
        if isinstance(method, EqualSteps) and all(can_be_kernel(rung.solver) for rung in method.rungs):
            solvers: dict[Any, None] = dict.fromkeys(rung.solver for rung in method.rungs)
            if all(runs_lanewise(solver, pieces, y) for solver in solvers):
                return _by_kernels(method, pieces, y, tangents, level)
        return self._by_maps(y, tangents, level)

    def _pieces(self) -> Split:
        pick = lambda strobe: (strobe.field, strobe.system, strobe.scale)
        return split(pick(self.shared), pick(self.own))

    def _by_maps(self, y: LaneState, tangents: tuple[LaneState, ...], level: Int[Array, " lanes"]) -> Moved:
        def move(y: LaneState) -> tuple[LaneState, tuple[Array, Array]]:
            moved, *rest = self.map(_coded, y)
            return moved, tuple(rest)

        if not tangents:
            after, (peak, code) = move(y)
            return Moved(after, (), peak, code, level)
        along = lambda t: jax.jvp(move, (y,), (t,), has_aux=True)
        if len(tangents) == 1:  # without the extra axis the compiled loops are nearly twice as fast
            after, moved, (peak, code) = along(tangents[0])
            return Moved(after, (moved,), peak, code, level)
        stacked = tuple(jnp.stack(c) for c in zip(*tangents, strict=True))
        after, moved, (peak, code) = jax.vmap(along, out_axes=(None, 0, None))(stacked)
        return Moved(after, tuple(zip(*moved, strict=True)), peak, code, level)


def _coded(strobe: StrobeMap, y: State) -> tuple[State, Array, Array]:
    stretch = strobe(y)
    return stretch.y, jnp.asarray(stretch.peak), outcome_code(stretch.result)


def _code(y: State, peak: Scalar) -> Int[Array, ""]:
    return outcome_code(judge(dfx.RESULTS.successful, y, peak, ESCAPE))


BLOCK = 16
"""Lanes packed together on a CPU: smaller blocks cost more calls, larger ones run more lanes for nothing."""


def _by_kernels(
    method: EqualSteps, numbers: Split, y: LaneState, tangents: tuple[LaneState, ...], level: Int[Array, " lanes"]
) -> Moved:
    """Each rung in turn, for the lanes that ask for it: those whose error is too large ask for the next."""
    rungs = method.rungs
    last = len(rungs) - 1
    if last == 0:
        solver: Any = rungs[0].solver
        count = rungs[0].steps
        after = run_steps(solver, numbers, start_lane(solver, y, tangents), REVOLUTION / count, count, divisor=count)
        return Moved(after.y, after.tangents, after.peak, jax.vmap(_code)(after.y, after.peak), level)

    def attempts(solver: Any, first: int, steps: list[int], carry: Moved) -> Moved:
        counts, divisor = jnp.asarray(steps), math.gcd(*steps)

        def attempt(i: Array, carry: Moved) -> Moved:
            mine = carry.level == first + i
            tried = _run_those(mine, solver, counts[i], divisor, numbers, start_lane(solver, y, tangents))
            code = jax.vmap(_code)(tried.y, tried.peak)
            new = Moved(tried.y, tried.tangents, tried.peak, code, carry.level)
            kept = jax.tree.map(lambda a, b: jnp.where(mine, a, b), new, carry)
            poor = mine & ~((tried.error <= method.accepted) & (code == 0)) & (first + i < last)
            return kept._replace(level=jnp.where(poor, carry.level + 1, carry.level))

        return jax.lax.fori_loop(0, len(steps), attempt, carry)

    moved = Moved(y, tangents, jnp.zeros_like(y[0]), jnp.zeros_like(level), level)
    for solver, group in itertools.groupby(enumerate(rungs), key=lambda pair: pair[1].solver):
        places = list(group)
        moved = attempts(solver, places[0][0], [rung.steps for _, rung in places], moved)
    return moved


def _run_those(
    mine: Bool[Array, " lanes"], solver: Any, count: Array, divisor: int, numbers: Split, start: Lane
) -> Lane:
    """A revolution of the lanes that are `mine`; what becomes of the others is of no account.

    On a CPU those lanes are packed into blocks, so that the work is that of the lanes which ask for it, whatever their
    neighbours need. On a GPU each block of the grid looks for itself whether it is asked for.
    """
    h, lanes = REVOLUTION / count.astype(float), mine.shape[0]
    run = lambda own, lane, mine: run_steps(solver, numbers._replace(own=own), lane, h, count, True, mine, divisor)
    if jax.default_backend() != "cpu" or lanes <= BLOCK:
        return run(numbers.own, start, mine)
    order = jnp.argsort(~mine, stable=True)
    own, packed = jax.tree.map(lambda x: x[order], (numbers.own, start))

    def run_block(i: Array, lane: Lane) -> Lane:
        first = jnp.minimum(i * BLOCK, lanes - BLOCK)  # the last block begins earlier where it must
        cut = lambda x: jax.lax.dynamic_slice_in_dim(x, first, BLOCK)
        moved = run(tuple(map(cut, own)), jax.tree.map(cut, packed), None)
        return jax.tree.map(lambda x, new: jax.lax.dynamic_update_slice_in_dim(x, new, first, 0), lane, moved)

    moved = jax.lax.fori_loop(0, (jnp.sum(mine) + BLOCK - 1) // BLOCK, run_block, packed)
    back = jnp.argsort(order)
    return jax.tree.map(lambda x: x[back], moved)
