"""Runs lanes in chunks on all cores.

Each chunk of lanes is one call of one compiled program; a pool of threads takes the chunks in turn, which keeps every
core busy without asking the user to split devices, and lets slow chunks overlap fast ones. A chunk is padded to the
full size, so that the arithmetic of a lane does not depend on how many neighbours it has.
"""

import concurrent.futures
import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._errors import ArgumentError
from .._form import compiled
from .._types import State
from ..analysis import Lane, Lengths, Observation, Plan, Room, observe, settle
from ..integrate import AbstractMethod, NativeSteps, StrobeMap, stated, strobe_map
from ..models import ESCAPE, AbstractForcedSystem
from ._native import Lanes, observe_native


CHUNKS = (16, 32, 64, 128, 256, 384, 512)
"""Lanes per call on a CPU: few sizes, as each is compiled."""
CALL = 32
"""What a call costs beside its lanes, in lanes."""


Progress = Callable[[int, int], None]
"""Called with lanes done and lanes in all."""


@compiled
def _settle_chunk(
    designs: "Designs", method: AbstractMethod, revolutions: Array, limit: Array, part: "Part", *left: Array
) -> Lane:
    def one(lane: Part, *left: Array) -> Lane:
        return settle(designs.strobe(method, lane), Lane(lane.y, jnp.zeros(()), *left), revolutions, limit)

    return over_lanes(one, part, *left)


@compiled
def _observe_chunk(
    designs: "Designs", method: AbstractMethod, lengths: Lengths, room: Room, part: "Part", *left: Array
) -> Observation:
    def one(lane: Part, *left: Array) -> Observation:
        return observe(designs.strobe(method, lane), Lane(lane.y, jnp.zeros(()), *left), lengths, room)

    return over_lanes(one, part, *left)


def over_lanes(f: Callable[..., Any], *parts: Any) -> Any:
    """f in every lane, the axis of lanes last."""
    return jax.vmap(f, out_axes=-1)(*parts)


class Part(NamedTuple):
    """Lanes of a chunk, or one of them."""

    speed: Float[Array, "*lanes"]
    which: Int[Array, "*lanes"]
    y: State


class Designs(eqx.Module):
    """Systems of one structure: a single one, or several with their arrays stacked."""

    systems: AbstractForcedSystem
    count: int = eqx.field(static=True)

    @classmethod
    def of(cls, systems: Sequence[AbstractForcedSystem]) -> "Designs":
        """**Raises:** `ValueError` for systems that differ in more than their numbers."""
        if len(systems) == 1:
            return cls(systems[0], 1)
        stacked = lambda *x: jnp.stack(x) if eqx.is_array(x[0]) else x[0]
        return cls(jax.tree.map(stacked, *alike(systems, "systems", "systems")), len(systems))

    def strobe(self, method: AbstractMethod, lane: Part) -> StrobeMap:
        """The strobe map of a lane."""
        systems = self.systems
        if self.count > 1:
            systems = jax.tree.map(lambda x: x[lane.which] if eqx.is_array(x) else x, systems)
        return strobe_map(systems, lane.speed, stated(method))


def alike(designs: Sequence[Any], name: str, kind: str) -> list[Any]:
    """Designs with all numbers as arrays: a parameter may be a Python number in one and an array in another.

    **Raises:** `ValueError` for designs that differ in more than their numbers.
    """
    number = lambda x: jnp.asarray(x, dtype=float) if eqx.is_inexact_array_like(x) else x
    found = [jax.tree.map(number, design) for design in designs]
    rests = [eqx.filter(design, eqx.is_array, inverse=True) for design in found]
    if any(not eqx.tree_equal(rest, rests[0]) for rest in rests):
        raise ArgumentError(name, said=f"must hold {kind} that differ in their numbers only.")
    return found


def cores() -> int:
    """Processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def workers() -> int:
    """Chunks that run at a time."""
    return cores() if jax.default_backend() == "cpu" else 1


def _padded(lanes: np.ndarray, size: int) -> np.ndarray:
    """Lanes up to `size`: -1 stands for one of which nothing is asked."""
    return np.pad(lanes, (0, size - lanes.size), constant_values=-1)


def _in_chunks(
    work: Callable[[np.ndarray], Any], lanes: int, size: int, report: Callable[[int], None] = lambda _: None
) -> tuple[np.ndarray, ...]:
    """`work` on the numbers of lanes, chunk by chunk on all cores; results in the order of the lanes."""
    parts = np.split(np.arange(lanes), range(size, lanes, size))
    run = lambda part: [np.asarray(x)[..., : part.size] for x in work(_padded(part, size))]
    results = []
    with concurrent.futures.ThreadPoolExecutor(workers()) as pool:
        try:
            for part, found in zip(parts, pool.map(run, parts), strict=True):
                results.append(found)
                report(part.size)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return tuple(np.concatenate(column, axis=-1) for column in zip(*results, strict=True))


def run_parts(
    work: Callable[[Part], tuple[Any, ...]],
    speed: Float[np.ndarray, " lanes"],
    which: Int[np.ndarray, " lanes"],
    y0: Float[np.ndarray, "lanes dim"],
) -> tuple[np.ndarray, ...]:
    """`work` on all lanes, chunk by chunk on all cores: results with the lanes first, NaN where one begins nowhere."""
    alive = np.all(np.isfinite(y0), axis=1)
    y0 = np.where(alive[:, None], y0, 0.0)
    begin = lambda lane: work(_part(speed, which, y0, lane))
    found = _in_chunks(begin, speed.size, chunk_size(speed.size))
    each = lambda x: alive.reshape(-1, *[1] * (x.ndim - 1))
    return tuple(np.where(each(x), np.moveaxis(x, -1, 0), np.nan) for x in found)


def _part(speed: np.ndarray, which: np.ndarray, y: np.ndarray, lane: np.ndarray) -> Part:
    return Part(jnp.asarray(speed[lane]), jnp.asarray(which[lane]), tuple(map(jnp.asarray, y[lane].T)))


def chunk_size(lanes: int) -> int:
    """The size with which all cores are done first, each taking one chunk after the other."""
    if jax.default_backend() != "cpu":
        return lanes
    rounds = lambda size: -(-lanes // (size * cores()))
    return min(CHUNKS, key=lambda size: (rounds(size) * (size + CALL), size))


def _room(count: int) -> int:
    """The next of a few sizes, so that few programs serve all counts."""
    return 1 << max(5, (count - 1).bit_length())


def _run_native(
    systems: Sequence[AbstractForcedSystem] | Designs,
    method: NativeSteps,
    plan: Plan,
    speed: Float[np.ndarray, " lanes"],
    y0: Float[np.ndarray, "lanes dim"],
    progress: Progress | None,
    which: Int[np.ndarray, " lanes"] | None,
    onward: bool,
) -> Observation:
    """Lanes in machine code; those that need an implicit method, or all where a law cannot be translated, by JAX."""
    designs = systems if isinstance(systems, Designs) else Designs.of(systems)
    which = np.zeros(speed.size, int) if which is None else which
    plan = Plan(*map(int, plan))
    each, done = plan.discard + plan.block * plan.blocks, 0.0

    def report(revolutions: int) -> None:
        nonlocal done
        done += revolutions / max(each, 1)
        if progress is not None:
            progress(min(int(done + 1e-9), speed.size), speed.size)

    def otherwise(lanes: Int[np.ndarray, " some"]) -> Observation:
        return run_lanes(designs, method.instead, plan, speed[lanes], y0[lanes], None, which[lanes], onward)

    lanes = Lanes(designs.systems, designs.count, which, speed, cores())
    seen = observe_native(lanes, method, plan, y0, ESCAPE if onward else 1.0, report, otherwise)
    return run_lanes(designs, method.instead, plan, speed, y0, progress, which, onward) if seen is None else seen


def run_lanes(
    systems: AbstractForcedSystem | Sequence[AbstractForcedSystem] | Designs,
    method: AbstractMethod,
    plan: Plan,
    speed: Float[np.ndarray, " lanes"],
    y0: Float[np.ndarray, "lanes dim"],
    progress: Progress | None = None,
    which: Int[np.ndarray, " lanes"] | None = None,
    onward: bool = False,
    size: int | None = None,
) -> Observation:
    """Observe lanes given by their speeds [rad/s] and initial states, and with several systems by which they have.

    Lanes that go `onward`, from where another run left them, may be as far out as lanes come on their way.

    Runs that name the same `size` of their chunks share their programs.

    **Returns:** `Observation` of NumPy arrays with the lanes last.
    """
    lanes, dim = y0.shape
    systems = systems if isinstance(systems, Sequence | Designs) else [systems]
    if isinstance(method, NativeSteps):
        return _run_native(systems, method, plan, speed, y0, progress, which, onward)
    designs = systems if isinstance(systems, Designs) else Designs.of(systems)
    which = np.zeros(lanes, int) if which is None else which
    size = chunk_size(lanes) if size is None else size
    plan = Plan(*map(int, plan))
    settling, watched = plan.discard - plan.align, plan.align + plan.block * plan.blocks
    lengths = Lengths(*map(jnp.asarray, (plan.align, plan.block, plan.blocks)))
    room = Room(_room(plan.keep), _room(plan.blocks), plan.exponents)
    done = 0.0

    def report(revolutions: int) -> Callable[[int], None]:
        def add(count: int) -> None:
            nonlocal done
            done += count * revolutions / (settling + watched)
            if progress is not None:
                progress(int(done + 1e-9), lanes)

        return add

    y, limit = y0, jnp.asarray(ESCAPE if onward else 1.0)
    outcome, level, error = np.zeros(lanes, np.int32), np.zeros(lanes, np.int32), np.zeros(lanes)

    def given(lane: np.ndarray) -> list[Any]:
        """Lanes of a chunk as far as they are; what fills it up is not run."""
        left = (np.where(lane < 0, 1, outcome[lane]), level[lane], error[lane])
        return [_part(speed, which, y, lane), *map(jnp.asarray, left)]

    def begin(lane: np.ndarray) -> tuple[Any, ...]:
        got = _settle_chunk(designs, method, jnp.asarray(settling), limit, *given(lane))
        return *got.y, got.outcome, got.level, got.error

    *columns, outcome, level, error = _in_chunks(begin, lanes, size, report(settling))
    y = np.stack(columns, axis=-1).reshape(lanes, dim)
    follow = lambda lane: _observe_chunk(designs, method, lengths, room, *given(lane))
    seen = Observation(*_in_chunks(follow, lanes, size, report(watched)))
    return seen._replace(strobe=seen.strobe[room.keep - plan.keep :], growth=seen.growth[: plan.blocks])
