"""One revolution with tangent vectors, by as many steps as each lane needs.

Written for one lane. Where `jax.vmap` makes many of it, lanes that ask for the same number of steps are packed
together, so that the work is that of the lanes which ask for it, whatever their neighbours need.
"""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.custom_batching import custom_vmap
from jaxtyping import Array, Bool, Float, Int

from .._form import split
from .._types import Scalar, State
from ..models import ESCAPE
from ._controlled import ControlledSteps, Levels, climb, nowhere, run_level
from ._kernel import can_be_kernel, steps_through
from ._method import FixedSteps, Moved, Stretch, Tangents, moved_by, result_at
from ._results import outcome_code
from ._strobe import StrobeMap


BLOCK = 8
"""Lanes packed together on a CPU, as many as an instruction takes: larger blocks run more lanes for nothing."""
BLOCK_ON_GPU = 1 << 14

LaneState = tuple[Float[Array, " lanes"], ...]


def revolution(strobe: StrobeMap, y: State, tangents: Tangents, level: Int[Array, ""]) -> Moved:
    """A lane one revolution on, with its tangent vectors (in units of the state).

    `level` is where a method with several step counts begins.
    """
    if isinstance(strobe.method, ControlledSteps):
        return _controlled(strobe, y, tangents, level)
    return moved_by(strobe, y, tangents)


Drift = Sequence[Scalar | None]
"""Tangents of the numbers of a field, in the order of its leaves; None where there is none."""


def pushed(strobe: StrobeMap, y: State, tangents: Tangents, drifts: Sequence[Drift | None]) -> Moved:
    """A lane one revolution on, with tangent vectors along which the field changes too.

    **Arguments:** strobe map; state; tangent vectors (in units of the state), and for each of them the tangents of the
    field's numbers, None where there are none.
    """
    method = strobe.method
    if not (isinstance(method, FixedSteps) and can_be_kernel(method.solver)):
        return _pushed_from_outside(strobe, y, tangents, drifts)
    pieces = (strobe.field, strobe.system, strobe.scale)
    y, peak, result, after = steps_through(method.solver, method.steps, pieces, y, tangents, drifts)
    code = outcome_code(result_at(result, y, peak, ESCAPE))
    return Moved(y, after, peak, code, jnp.zeros((), jnp.int32), jnp.asarray(jnp.nan), ())


def _pushed_from_outside(strobe: StrobeMap, y: State, tangents: Tangents, drifts: Sequence[Drift | None]) -> Moved:
    """The same by a method that is no plain formula, whatever it does."""
    form, row = split(strobe.field, eqx.is_inexact_array)

    def advance(start: tuple[State, list[Any]]) -> Stretch:
        y, row = start
        return eqx.tree_at(lambda s: s.field, strobe, form.filled(row))(y)

    zero = list(map(jnp.zeros_like, row))
    filled = [[z if d is None else d for z, d in zip(zero, drift or zero, strict=True)] for drift in drifts]
    return moved_by(advance, (y, row), list(zip(tangents, filled, strict=True)))


def _controlled(strobe: StrobeMap, y: State, tangents: Tangents, level: Any) -> Moved:
    """A lane one revolution on; under `jax.vmap`, lanes that ask for the same level are packed together."""
    form, row = split(strobe, eqx.is_array)

    @custom_vmap
    def run(row: list[Any], y: Any, tangents: Any, level: Any) -> Moved:
        lane = jax.tree.map(lambda x: x[None], (y, tangents, level))
        return jax.tree.map(lambda x: x[0], _lanes(form.filled, row, [False] * len(row), *lane))

    @run.def_vmap
    def rule(size: int, batched: Any, row: list[Any], y: Any, tangents: Any, level: Any) -> Any:
        spread = lambda x, is_lanes: x if is_lanes else jnp.broadcast_to(x, (size, *x.shape))
        lanes = jax.tree.map(spread, (y, tangents, level), tuple(batched[1:]))
        moved = _lanes(form.filled, row, batched[0], *lanes)
        return moved, jax.tree.map(lambda _: True, moved)

    return run(row, *jax.tree.map(jnp.asarray, (y, tangents, level)))


def _lanes(
    remake: Callable[[Sequence[Array]], StrobeMap],
    row: Sequence[Array],
    own: Sequence[bool],
    y: LaneState,
    tangents: tuple[LaneState, ...],
    level: Int[Array, " lanes"],
) -> Moved:
    alike = remake(row)  # of its arrays, those of the method are the same in all lanes
    method, harmonics = alike.method, alike.system.harmonics
    assert isinstance(method, ControlledSteps)

    def attempt(levels: Levels, i: Array, mine: Bool[Array, " lanes"]) -> Moved:
        def one(row: Sequence[Any], y: State, tangents: Tangents) -> Moved:
            strobe = remake(row)
            pieces = (strobe.field, strobe.system, strobe.scale)
            return moved_by(run_level(method, levels, i, pieces), y, tangents)

        return _packed(one, mine, row, own, y, tangents)

    each = [0 if o else None for o in own]
    scale = jax.vmap(lambda row, _: remake(row).scale, in_axes=(each, 0))(list(row), level)
    return climb(method, level, nowhere(y, tangents), scale, attempt, harmonics)


def _packed(
    one: Callable[..., Moved],
    mine: Bool[Array, " lanes"],
    row: Sequence[Array],
    own: Sequence[bool],
    y: LaneState,
    tangents: tuple[LaneState, ...],
) -> Moved:
    """`one` in the lanes that are `mine`, packed into blocks; what becomes of the others is of no account."""
    lanes = mine.shape[0]
    block, search = (BLOCK, "compare_all") if jax.default_backend() == "cpu" else (BLOCK_ON_GPU, "scan")
    block = min(lanes, block)
    place = jnp.cumsum(mine) - 1  # of each lane that is mine, among them
    count = place[-1] + 1
    given = ([x for x, o in zip(row, own, strict=True) if o], y, tangents)
    over = jax.vmap(one, in_axes=([0 if o else None for o in own], 0, 0))

    def run_block(i: Array, done: Moved) -> Moved:
        first = jnp.minimum(i * block, lanes - block)  # the last block begins earlier where it must
        places = jnp.minimum(first + jnp.arange(block), count - 1)  # and is filled up with its last lane
        which = jnp.searchsorted(place, places, method=search)
        each, y, tangents = jax.tree.map(lambda x: x[which], given)
        each = iter(each)
        moved = over([next(each) if o else x for x, o in zip(row, own, strict=True)], y, tangents)
        return jax.tree.map(lambda x, new: jax.lax.dynamic_update_slice_in_dim(x, new, first, 0), done, moved)

    nothing = nowhere(y, tangents)._replace(half=())
    done = jax.lax.fori_loop(0, (count + block - 1) // block, run_block, nothing)
    return jax.tree.map(lambda x: x[jnp.maximum(place, 0)], done)
