"""Run-up and run-down: the state is carried from one speed to the next, which shows hysteresis."""

import dataclasses

import numpy as np
from jaxtyping import Array, Float

from .._checks import require_x64
from .._types import State
from ..analysis import Sweep
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod, Lanes, native
from ._lanes import Progress, run_lanes
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
    require_x64()
    speed = checked_speeds(speeds)
    chosen = native() if method is None else method
    plan = make_plan(discard, revolutions, blocks, keep, exponents, system.dimension)
    fresh = initial_states(system, speed, None if start is None else [start])[:, 0]
    state, seen = None, []
    for n in range(speed.size):  # one lane goes up, one comes down
        place = np.array([n, speed.size - 1 - n])
        state = fresh[place] if state is None else np.where(np.isfinite(state), state, fresh[place])
        seen.append(run_lanes(Lanes.of([system], speed[place]), chosen, plan, state))
        state = np.asarray(seen[-1].last).T
        if progress is not None:
            progress(n + 1, speed.size)
    parts, how = [np.stack(column, axis=-1) for column in zip(*seen, strict=True)], settings_of(chosen)

    def one_way(lane: int, order: int) -> Sweep:
        mine = tuple(x[..., lane, ::order] for x in parts)
        return assemble(system, speed, how, plan, mine, (speed.size, 1))

    return Hysteresis(one_way(0, 1), one_way(1, -1))
