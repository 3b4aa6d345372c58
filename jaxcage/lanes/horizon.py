"""Continuation of lanes that have not settled, up to a horizon, to find out how long their chaos lasts.

Lanes that leave chaos for good before the horizon were on a chaotic transient, whose mean life follows from the times
of these escapes (`analysis.survival`). Lanes that settle early can also be stopped early.
"""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from ..analysis import (
    CONFIRM,
    LIFE_BLOCK,
    calm_at_the_end,
    calm_threshold,
    closing_period,
    escape_times,
    on_torus,
    scatter,
)
from .observe import Observation
from .settings import Run


STAGE = 12
"""Number of blocks between two checks for lanes that have settled."""
CALM = -1.0
"""Placeholder for the growth of a lane that has settled and is not run any further."""
Onward = Callable[[Run, Int[np.ndarray, " some"], Float[np.ndarray, "some dim"] | None], Observation]
"""Function that runs some lanes with given settings, from given states or from their initial states."""


def follow(
    label: Shaped[np.ndarray, " lanes"],
    seen: Observation,
    run: Run,
    scale: Float[np.ndarray, "lanes dim"],
    onward: Onward,
) -> tuple[Float[np.ndarray, " lanes"], int]:
    """Follow the chaotic and undecided lanes, and update their last states and errors in `seen`.

    Lanes are run in stages of `STAGE` blocks. At the end of a stage those that are closed and have been calm for
    `CONFIRM` blocks are stopped, and undecided ones that are now on a torus. The exponents of lanes that were undecided
    are replaced by those of the longer run.

    **Arguments:** labels; observations and their settings; scale of each lane's state; function that runs lanes.

    **Returns:** revolutions of the whole run after which a lane is calm, infinity for chaos at the horizon, NaN for a
    failure; the horizon, in whole blocks.
    """
    early = _coarse(seen.growth[:, :, 0], run.block)
    observed = run.discard + run.revolutions
    blocks = -(-(run.horizon - observed) // LIFE_BLOCK) + CONFIRM  # up to the horizon, and to confirm an escape
    late, ran = np.full((label.size, blocks), CALM), np.zeros(label.size, dtype=int)
    undecided = label == "undecided"
    calm = np.ones(label.size, dtype=bool)
    active = np.flatnonzero(np.isin(label, ("chaotic", "undecided")))
    for first in range(0, blocks, STAGE):
        if not active.size:
            break
        last = min(first + STAGE, blocks)
        keep = min(run.keep, LIFE_BLOCK * (last - first))
        stage = dataclasses.replace(
            run, discard=0, revolutions=LIFE_BLOCK * (last - first), blocks=last - first, keep=keep, exponents=1
        )
        new = onward(stage, active, seen.last[active])
        _go_on(seen, active, new, undecided[active])
        late[active, first:last], ran[active] = new.growth[:, :, 0], last
        end = late[active, :last]
        calm[active] = calm_at_the_end(new.strobe, scale[active], end, LIFE_BLOCK)
        closed = closing_period(new.strobe, scale[active]) > 0
        still = np.all(end[:, -CONFIRM:] <= calm_threshold(LIFE_BLOCK), axis=1)
        torus = np.zeros(active.size, dtype=bool)
        if (parts := _aligned(end, run.blocks)).shape[1]:
            torus = undecided[active] & on_torus(new.strobe, scale[active], parts.mean(axis=1), scatter(parts, axis=1))
        active = active[~(closed & still) & ~torus & (new.outcome == 0)]
    for lane in np.flatnonzero(undecided & (ran > 0) & (seen.outcome == 0)):
        if (parts := _aligned(late[None, lane, : ran[lane]], run.blocks)).shape[1]:
            seen.growth[lane, :, 0] = parts[0]
    times, end = escape_times(np.concatenate([early, late], axis=1), calm, LIFE_BLOCK, failed=seen.outcome != 0)
    begin = run.discard + run.revolutions % LIFE_BLOCK
    return begin + times, begin + end


def _aligned(late: Float[np.ndarray, "lanes ran"], count: int) -> Float[np.ndarray, "lanes parts"]:
    """Growth in `count` equal parts, without the first block of each stage, in which tangent vectors still align."""
    blocks = late[:, np.arange(late.shape[1]) % STAGE > 0]
    size = blocks.shape[1] // count
    if size == 0:
        return blocks[:, :0]
    return blocks[:, blocks.shape[1] - size * count :].reshape(len(late), count, size).mean(axis=2)


def _go_on(
    seen: Observation, lanes: Int[np.ndarray, " some"], new: Observation, shown: Bool[np.ndarray, " some"]
) -> None:
    """Update `seen` by a later part of the run of some lanes, with NaN where it fails, and with its strobe states for
    lanes that are `shown`."""
    seen.last[lanes], seen.outcome[lanes] = new.last, new.outcome
    seen.error[lanes] = np.fmax(seen.error[lanes], new.error)
    every = np.concatenate([seen.strobe[lanes[shown]], new.strobe[shown]], axis=1)
    seen.strobe[lanes[shown]] = every[:, new.strobe.shape[1] :]
    lost = lanes[new.outcome != 0]
    seen.strobe[lost] = seen.growth[lost] = np.nan


def _coarse(growth: Float[np.ndarray, "lanes blocks"], block: int) -> Float[np.ndarray, "lanes coarse"]:
    """Mean growth over as many whole blocks of `LIFE_BLOCK` revolutions as fit in those observed, the last ones."""
    every = np.repeat(growth, block, axis=1)
    count = every.shape[1] // LIFE_BLOCK
    return every[:, every.shape[1] - count * LIFE_BLOCK :].reshape(len(growth), count, LIFE_BLOCK).mean(axis=2)


def run_unsettled(seen: Observation, run: Run, scale: Float[np.ndarray, "lanes dim"], onward: Onward) -> Observation:
    """Observe pending lanes, but stop those that are periodic after `run.settled` revolutions, or after all that are
    discarded, before tangent vectors are followed: their exponents are NaN."""
    lanes, done = np.arange(len(scale)), 0
    for until in sorted({run.settled, run.discard}):
        if not lanes.size:
            break
        short = min(run.keep, until - done)
        look = dataclasses.replace(
            run, discard=until - done - short, revolutions=short, blocks=1, keep=short, exponents=0
        )
        new = onward(look, lanes, seen.last[lanes] if done else None)
        _go_on(seen, lanes, new, np.ones(lanes.size, dtype=bool))
        seen.peak[lanes], seen.steps[lanes] = new.peak, new.steps
        closed = closing_period(new.strobe, scale[lanes]) > 0
        lanes, done = lanes[~closed & (new.outcome == 0)], until
    if lanes.size:
        align = min(run.block, run.discard) if run.exponents else 0
        new = onward(dataclasses.replace(run, discard=align), lanes, seen.last[lanes])
        seen.put(lanes, new._replace(error=np.fmax(seen.error[lanes], new.error)))
    return seen
