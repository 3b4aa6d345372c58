"""How long chaos lasts: lanes that are not settled are followed to a horizon, block by block.

Before the horizon some leave chaos for good: what they were on is a transient, whose mean life the escapes tell.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Shaped

from ..analysis import CONFIRM, LIFE_BLOCK, Observation, calm_at_the_end, escape_times


CALM = -1.0
"""Growth that stands for that of a lane which has settled on a periodic orbit, and is not followed."""


class Lasting(NamedTuple):
    """What became of lanes by the horizon."""

    escape: Float[np.ndarray, " lanes"]
    """Revolutions of the whole run after which a lane is calm: infinity for chaos at the horizon, NaN for a failure."""
    horizon: int


def blocks_to(horizon: int, after: int) -> int:
    """Blocks from the end of the observed revolutions to the horizon, and those that confirm an escape."""
    return -(-max(horizon - after, 0) // LIFE_BLOCK) + CONFIRM


def unsettled(label: Shaped[np.ndarray, " lanes"]) -> Int[np.ndarray, " some"]:
    """Lanes that must be followed: chaotic ones, and those of which nothing is known."""
    return np.flatnonzero(np.isin(label, ("chaotic", "undecided")))


def follow(
    label: Shaped[np.ndarray, " lanes"],
    growth: Float[np.ndarray, "blocks lanes"],
    block: int,
    discard: int,
    scale: Float[np.ndarray, "lanes dim"],
    blocks: int,
    run: Callable[[Int[np.ndarray, " some"]], Observation],
) -> tuple[Int[np.ndarray, " some"], Observation | None, Lasting]:
    """Follow the lanes that are not settled.

    **Arguments:** labels; growth of the largest exponent in the observed blocks of so many revolutions, after those
    that were discarded; scale of each lane's state; blocks of `LIFE_BLOCK` to follow; `run(lanes)` follows lanes from
    where they are.

    **Returns:** the lanes that were followed, what was seen of them, and when lanes escaped.
    """
    lanes = unsettled(label)
    early = _coarse(growth, block)
    late = np.full((blocks, label.size), CALM)
    calm = np.ones(label.size, dtype=bool)
    failed = np.isin(label, ("failed", "inaccurate"))
    seen = None
    if lanes.size:
        seen = run(lanes)
        late[:, lanes] = seen.growth[:, 0]
        calm[lanes] = calm_at_the_end(
            np.moveaxis(np.asarray(seen.strobe), -1, 0), scale[lanes], late[:, lanes].T, LIFE_BLOCK
        )
        failed[lanes] = seen.outcome != 0
    times, horizon = escape_times(np.concatenate([early, late]).T, calm, LIFE_BLOCK, failed=failed)
    begin = discard + growth.shape[0] * block % LIFE_BLOCK
    return lanes, seen, Lasting(begin + times, begin + horizon)


def _coarse(growth: Float[np.ndarray, "blocks lanes"], block: int) -> Float[np.ndarray, "coarse lanes"]:
    """Mean growth over whole blocks of `LIFE_BLOCK` revolutions, the last ones of those observed."""
    every = np.repeat(growth, block, axis=0)
    count, lanes = every.shape[0] // LIFE_BLOCK, growth.shape[1]
    return np.mean(every[every.shape[0] - count * LIFE_BLOCK :].reshape(count, LIFE_BLOCK, lanes), axis=1)
