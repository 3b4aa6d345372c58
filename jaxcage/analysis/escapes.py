"""Times at which lanes left chaos for good, from their growth in blocks of revolutions and how they end.

`survival` estimates a mean life from the escape times of a batch of lanes.

Limits. A lane that leaves one chaotic set for another has not escaped here, and one in a laminar phase at its very end
may seem to have. Weak chaos needs long blocks.
"""

import numpy as np
from jaxtyping import Bool, Float

from .._errors import ArgumentError
from .labels import CHAOS_THRESHOLD, TORUS_THRESHOLD, closing_period, scatter


CONFIRM = 8
"""Blocks at the end of a run in which a lane must be calm if it is to have escaped."""


def calm_threshold(block: int) -> float:
    """Largest mean growth per revolution of a calm block of so many revolutions.

    On a periodic orbit or a torus the length of a tangent vector goes up and down by a factor that does not depend on
    how long the block is; e^2 is allowed for, a mean growth of 2/block. Chaos of exponent lambda grows by lambda, with
    a scatter: it shows in most blocks where lambda * block exceeds 4. Where it is weaker, blocks must be longer.
    """
    return max(CHAOS_THRESHOLD, 2 / block)


def calm_at_the_end(
    strobe: Float[np.ndarray, "lanes keep dim"],
    scale: Float[np.ndarray, "*#lanes dim"],
    growth: Float[np.ndarray, "lanes blocks"],
    block: int,
    confirm: int = CONFIRM,
) -> Bool[np.ndarray, " lanes"]:
    """Lanes that end on a periodic orbit or a torus, or on their way to one.

    A lane is calm at the end if its last strobe states close with a period up to 8, or if the exponent of its last
    blocks is zero or below within its error: two standard errors, and what blocks of that length cannot tell.

    **Arguments:** the last strobe states; characteristic magnitudes of the state; mean growth per revolution of each
    block; revolutions per block; number of blocks that are the end.
    """
    end = growth[:, -confirm:]
    exponent = np.mean(end, axis=1)
    error = scatter(end, axis=1) if end.shape[1] > 1 else np.zeros(exponent.shape)
    unknown = max(TORUS_THRESHOLD, 1 / (block * end.shape[1]))
    return (closing_period(strobe, scale) > 0) | (exponent <= np.maximum(2 * error, unknown))  # false for NaN


def escape_times(
    growth: Float[np.ndarray, "lanes blocks"],
    calm_end: Bool[np.ndarray, " lanes"],
    block: int,
    *,
    failed: Bool[np.ndarray, " lanes"] | None = None,
    confirm: int = CONFIRM,
    threshold: float | int | None = None,
) -> tuple[Float[np.ndarray, " lanes"], int]:
    """After how many revolutions each lane stays calm to the end of the run.

    Chaos dips: with an exponent of 0.15 and a scatter of 0.1 between blocks of 25 revolutions one block in four cannot
    be told from calm. So a lane escapes after the last block that is not calm, and only if it is calm at the end by its
    label too, and in the last `confirm` blocks. A chaotic lane of which a share p of the blocks dips passes for escaped
    with a probability of p**confirm at most; `confirm` must be chosen so that this times the number of lanes is small.
    Where p comes near 1, chaos is too weak for the blocks, and lanes seem calm long before they are.

    What happens in those last blocks is not judged: the time to which lanes are followed, the horizon, ends before
    them. A lane that escapes later was still chaotic at the horizon.

    **Arguments:**

    - `growth`: mean logarithmic growth per revolution (the windowed exponent) of each block.
    - `calm_end`: lanes that end on a periodic orbit or a torus (`calm_at_the_end`).
    - `block`: revolutions per block.
    - `failed`: lanes that did not finish; those with growth that is not finite have failed, too.
    - `confirm`: blocks at the end that must be calm.
    - `threshold`: largest growth of a calm block, by default `calm_threshold(block)`.

    **Returns:** for each lane the revolutions after which it is calm, counted from the first block, a multiple of
    `block`: 0 for one that always is, infinity for one that is chaotic at the horizon, NaN for one that failed; and the
    horizon [revolutions].

    **Raises:** `ValueError` where the blocks are not more than those to confirm with.
    """
    lanes, blocks = growth.shape
    if not 1 <= confirm < blocks:
        raise ArgumentError("confirm", said=f"must lie between 1 and the {blocks - 1} blocks before, but is {confirm}.")
    lost = ~np.all(np.isfinite(growth), axis=1) | (np.zeros(lanes, dtype=bool) if failed is None else failed)
    restless = growth > (calm_threshold(block) if threshold is None else threshold)
    last = np.max(np.where(restless, np.arange(1, blocks + 1), 0), axis=1)
    escaped = calm_end & (last <= blocks - confirm)
    times = np.where(escaped, last * float(block), np.inf)
    return np.where(lost, np.nan, times), (blocks - confirm) * block
