"""How long chaos lasts: lanes that are not settled are followed to a horizon, block by block.

Before the horizon some leave chaos for good: what they were on is a transient, whose mean life the escapes tell.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from ..analysis import (
    CONFIRM,
    LIFE_BLOCK,
    Observation,
    Plan,
    calm_at_the_end,
    calm_threshold,
    closing_period,
    escape_times,
    on_torus,
    scatter,
)


STAGE = 12
"""Blocks after which lanes that have settled are left where they are."""
CALM = -1.0
"""Growth that stands for that of a lane which has settled on a periodic orbit, and is not followed."""


def follow(
    label: Shaped[np.ndarray, " lanes"],
    seen: Observation,
    plan: Plan,
    scale: Float[np.ndarray, "lanes dim"],
    horizon: int,
    run: Callable[[Plan, Int[np.ndarray, " some"], Float[np.ndarray, "some dim"]], Observation],
) -> tuple[Float[np.ndarray, " lanes"], int]:
    """Follow the lanes that are not settled, and put where they end in place of what was `seen` of them.

    They are run on in stages of `STAGE` blocks. One that has closed on a periodic orbit by the end of a stage, its
    growth calm for as long as an escape takes to be confirmed, stays there and is not run any further; nor is one that
    was undecided and is seen to be on a torus. Exponents of lanes that were undecided are those of the longer run.

    **Arguments:** labels; what was seen by which plan; scale of each lane's state; horizon [revolutions of the whole
    run]; `run(plan, lanes, states)` runs lanes on from their states.

    **Returns:** revolutions of the whole run after which a lane is calm, infinity for chaos at the horizon, NaN for a
    failure; the horizon, in whole blocks.
    """
    early = _coarse(np.asarray(seen.growth)[:, 0], plan.block)
    observed = plan.discard + plan.block * plan.blocks
    blocks = -(-(horizon - observed) // LIFE_BLOCK) + CONFIRM  # to the horizon, and those that confirm an escape
    late, ran = np.full((blocks, label.size), CALM), np.zeros(label.size, dtype=int)
    undecided = label == "undecided"
    calm = np.ones(label.size, dtype=bool)
    active = np.flatnonzero(np.isin(label, ("chaotic", "undecided")))
    for first in range(0, blocks, STAGE):
        if not active.size:
            break
        stage = slice(first, min(first + STAGE, blocks))
        new = run(Plan(0, LIFE_BLOCK, stage.stop - first, plan.keep, 1), active, np.asarray(seen.last).T[active])
        kept = np.asarray(new.strobe)[-min(plan.keep, LIFE_BLOCK * (stage.stop - first)) :]  # a stage may be shorter
        _put(seen, active, new, kept, undecided[active])
        late[stage, active], ran[active] = new.growth[:, 0], stage.stop
        strobe = np.moveaxis(kept, -1, 0)
        end = late[: stage.stop, active].T
        calm[active] = calm_at_the_end(strobe, scale[active], end, LIFE_BLOCK)
        closed = closing_period(strobe, scale[active]) > 0
        still = np.all(end[:, -CONFIRM:] <= calm_threshold(LIFE_BLOCK), axis=1)
        torus = np.zeros(active.size, dtype=bool)
        if len(rows := _aligned(end.T, plan.blocks)):
            torus = undecided[active] & on_torus(strobe, scale[active], np.mean(rows, axis=0), scatter(rows, axis=0))
        active = active[~(closed & still) & ~torus & (new.outcome == 0)]
    for lane in np.flatnonzero(undecided & (ran > 0) & (np.asarray(seen.outcome) == 0)):
        if len(rows := _aligned(late[: ran[lane], lane], plan.blocks)):
            seen.growth[:, 0, lane] = rows  # pyright: ignore
    failed = np.asarray(seen.outcome) != 0
    times, end = escape_times(np.concatenate([early, late]).T, calm, LIFE_BLOCK, failed=failed)
    begin = plan.discard + plan.block * plan.blocks % LIFE_BLOCK
    return begin + times, begin + end


def _aligned(late: Float[np.ndarray, "ran ..."], count: int) -> Float[np.ndarray, "rows ..."]:
    """Growth in `count` equal parts of the run, the first block of each stage left out: tangent vectors still turn to
    their direction there. Empty where there are fewer blocks."""
    blocks = late[np.arange(len(late)) % STAGE > 0]
    size = len(blocks) // count
    if size == 0:
        return blocks[:0]
    return blocks[len(blocks) - size * count :].reshape(count, size, *late.shape[1:]).mean(axis=1)


def _put(
    seen: Observation,
    lanes: Int[np.ndarray, " some"],
    new: Observation,
    strobe: Float[np.ndarray, "ran dim some"],
    open_: Bool[np.ndarray, " some"],
) -> None:
    """Where lanes are later, NaN where one fails; the last strobe states of those that are `open_`, which may close."""
    seen.last[:, lanes] = new.last
    seen.error[lanes] = np.fmax(seen.error[lanes], new.error)
    seen.outcome[lanes] = new.outcome
    every = np.concatenate([seen.strobe[..., lanes[open_]], strobe[..., open_]])
    seen.strobe[..., lanes[open_]] = every[len(strobe) :]
    lost = lanes[np.asarray(new.outcome) != 0]
    seen.strobe[..., lost] = seen.growth[..., lost] = np.nan


def _coarse(growth: Float[np.ndarray, "blocks lanes"], block: int) -> Float[np.ndarray, "coarse lanes"]:
    """Mean growth over whole blocks of `LIFE_BLOCK` revolutions, the last ones of those observed."""
    every = np.repeat(growth, block, axis=0)
    count, lanes = every.shape[0] // LIFE_BLOCK, growth.shape[1]
    return np.mean(every[every.shape[0] - count * LIFE_BLOCK :].reshape(count, LIFE_BLOCK, lanes), axis=1)
