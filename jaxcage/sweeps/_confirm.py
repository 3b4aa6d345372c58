"""Labels are confirmed before they are believed: lanes run again from the same start by steps at most half as long.

Confirmed are all lanes that are neither periodic nor failed, their neighbours in speed, and a tenth of the periodic
ones, for false calm is the dangerous error. A label that changes, or an exponent that moves by more than its error, is
replaced by that of the finer steps, which is confirmed in turn. In a chaotic transient the finer run is another one,
and may well have ended when the first has not: such changes say nothing of the steps, and how long transients last is
asked apart (`_lasting`).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int, Shaped

from ..analysis import Confirmation


CONFIRMATIONS = 2
"""How often steps are refined where labels change."""
SHARE = 0.1
"""Share of the periodic lanes that are confirmed without a cause."""
SEED = 0


class Labelled(NamedTuple):
    """What lanes are called, with the largest exponent and its standard error."""

    label: Shaped[np.ndarray, " lanes"]
    exponent: np.ndarray
    error: np.ndarray

    def at(self, lanes: np.ndarray) -> "Labelled":
        """Some of them."""
        return Labelled(*(x[lanes] for x in self))


def doubtful(label: Shaped[np.ndarray, "*systems speeds starts"]) -> Int[np.ndarray, " lanes"]:
    """Lanes to be confirmed, by their place in the raveled labels."""
    periodic = np.char.startswith(label, "periodic")
    failed = np.isin(label, ("failed", "inaccurate"))
    near = ~periodic & ~failed
    beside = near.copy()
    beside[..., 1:, :] |= near[..., :-1, :]
    beside[..., :-1, :] |= near[..., 1:, :]
    drawn = np.random.default_rng(SEED).random(label.shape) < SHARE
    return np.flatnonzero((beside | drawn) & ~failed)


def confirm(
    lanes: Int[np.ndarray, " some"],
    labelled: Labelled,
    again: Callable[[Int[np.ndarray, " some"], int], Labelled],
) -> tuple[Confirmation, ...]:
    """Run `lanes` again with finer and finer steps, as long as what they are called changes.

    **Arguments:** lanes; what is thought of them; `again(lanes, times)` runs them by steps that are refined so many
    times, puts what it finds in place of what was there, and returns it.
    """
    rounds = []
    before = labelled.at(lanes)
    for times in range(1, CONFIRMATIONS + 1):
        if not lanes.size:
            break
        after = again(lanes, times)
        changed = before.label != after.label
        moved = ~changed & ~_agree(before, after)
        rounds.append(Confirmation(lanes.size, int(np.sum(changed)), int(np.sum(moved))))
        doubted = changed | moved
        lanes, before = lanes[doubted], after.at(doubted)
    return tuple(rounds)


def _agree(a: Labelled, b: Labelled) -> Bool[np.ndarray, " lanes"]:
    """Exponents within three standard errors; a failed lane has none, and agrees."""
    apart = np.abs(a.exponent - b.exponent)
    return ~(apart > np.maximum(3 * np.hypot(a.error, b.error), 0.01))
