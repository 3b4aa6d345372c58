"""Run-up and run-down: the state is carried from one speed to the next, which shows hysteresis."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Array, Float

from .._checks import require_x64
from .._errors import ArgumentError
from .._types import State
from ..analysis import Sweep
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..solve import native
from ._engine import Progress, run_lanes
from ._speed import assemble, checked_speeds, initial_states, make_plan, settings_of


@dataclasses.dataclass(frozen=True)
class Hysteresis:
    """The same speeds gone through upwards and downwards, the state carried along."""

    up: Sweep
    down: Sweep

    @property
    def apart(self) -> Float[np.ndarray, " speeds"]:
        """Largest distance between the mean strobe states of the two, in units of the scale; NaN after a failure."""
        means = [np.mean(s.strobe[:, 0], axis=1) / s.scale for s in (self.up, self.down)]
        return np.max(np.abs(means[0] - means[1]), axis=-1)


def run_up_down(
    system: AbstractForcedSystem,
    speeds: Float[Array, " speeds"] | Float[np.ndarray, " speeds"],
    *,
    start: State | None = None,
    discard: int = 100,
    revolutions: int = 60,
    exponents: int = 1,
    blocks: int = 10,
    keep: int = 48,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> Hysteresis:
    """Sweep up and down in speed, each speed starting from the final state of the one before.

    After a failure the next speed begins from the initial state again, so that one failure does not spoil the rest.

    **Arguments:** as for `sweep`, with a single start.

    **Returns:** `Hysteresis`, two sweeps of one start each.
    """
    options = dict(discard=discard, revolutions=revolutions, exponents=exponents, blocks=blocks, keep=keep)
    return run_up_down_designs([system], speeds, start=start, method=method, progress=progress, **options)[0]


def run_up_down_designs(
    systems: Sequence[AbstractForcedSystem],
    speeds: Float[Array, " speeds"] | Float[np.ndarray, " speeds"],
    *,
    start: State | None = None,
    discard: int = 100,
    revolutions: int = 60,
    exponents: int = 1,
    blocks: int = 10,
    keep: int = 48,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> list[Hysteresis]:
    """`run_up_down` for several designs or cases at once: both directions of all of them are lanes of one batch.

    **Arguments:** systems that differ in their numbers only; the rest as for `run_up_down`.

    **Returns:** a `Hysteresis` for each system.
    """
    require_x64()
    speed = checked_speeds(speeds)
    chosen = native() if method is None else method
    if not systems:
        raise ArgumentError("systems", said="must hold at least one system, but it is empty.")
    plan = make_plan(discard, revolutions, blocks, keep, exponents, systems[0].dimension)
    starts = None if start is None else [start]
    fresh = np.stack([initial_states(s, speed, starts)[:, 0] for s in systems])  # systems, speeds, dim
    which = np.repeat(np.arange(len(systems)), 2)  # up and down of the first, of the second, ...
    state, seen = None, []
    for n in range(speed.size):
        place = np.tile([n, speed.size - 1 - n], len(systems))
        start_here = fresh[which, place]
        state = start_here if state is None else np.where(np.isfinite(state), state, start_here)
        seen.append(run_lanes(systems, chosen, plan, speed[place], state, which=which))
        state = np.asarray(seen[-1].last).T
        if progress is not None:
            progress(n + 1, speed.size)
    parts, how = [np.stack(column, axis=-1) for column in zip(*seen, strict=True)], settings_of(chosen)

    def one_way(i: int, lane: int, order: int) -> Sweep:
        mine = tuple(x[..., lane, ::order] for x in parts)
        return assemble(systems[i], speed, how, plan, mine, (speed.size, 1))

    return [Hysteresis(one_way(i, 2 * i, 1), one_way(i, 2 * i + 1, -1)) for i in range(len(systems))]
