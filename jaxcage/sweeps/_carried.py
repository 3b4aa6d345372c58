"""Run-up and run-down: the state is carried from one speed to the next, which shows hysteresis."""

import dataclasses

import numpy as np
from jaxtyping import Array, Float

from .._checks import require_x64
from .._types import State
from ..analysis import Sweep
from ..integrate import AbstractMethod, method as make_method
from ..models import AbstractForcedSystem
from ._engine import Progress, run_lanes
from ._speed import assemble, checked_speeds, initial_states, make_plan


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
    """Sweep up and down in speed, each speed beginning with the state in which the last one ended.

    Both directions run as two lanes of one batch. Where the carried state has failed, the next speed begins from the
    start again, so that one failure does not spoil the rest.

    **Arguments:** as for `sweep`, with a single start.

    **Returns:** `Hysteresis`, two sweeps of one start each.
    """
    require_x64()
    speed = checked_speeds(speeds)
    chosen = make_method() if method is None else method
    plan = make_plan(discard, revolutions, blocks, keep, exponents, system.dimension)
    fresh = initial_states(system, speed, None if start is None else [start])[:, 0]
    pairs = list(zip(range(speed.size), reversed(range(speed.size)), strict=True))
    state = fresh[list(pairs[0])]
    seen = []
    for n, pair in enumerate(pairs):
        state = np.where(np.isfinite(state), state, fresh[list(pair)])
        seen.append(run_lanes(system, chosen, plan, speed[list(pair)], state))
        state = np.asarray(seen[-1].last).T
        if progress is not None:
            progress(n + 1, speed.size)
    up, down = (_stacked([tuple(x[..., i] for x in o) for o in seen]) for i in (0, 1))
    make = lambda parts: assemble(system, speed, chosen, plan, parts, (speed.size, 1))
    return Hysteresis(make(up), make(tuple(x[..., ::-1] for x in down)))


def _stacked(rows: list[tuple[np.ndarray, ...]]) -> tuple[np.ndarray, ...]:
    return tuple(np.stack(column, axis=-1) for column in zip(*rows, strict=True))
