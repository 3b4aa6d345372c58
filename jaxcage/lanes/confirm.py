"""Labels are confirmed by finer steps before they are reported.

Run again, from the same initial states and with steps at most half as long, are all lanes that are neither periodic nor
failed, their neighbours in speed, and a tenth of the periodic ones, since false calm is the dangerous error. A label
that changes, or an exponent that moves by more than its error, is replaced by that of the finer steps, which is
confirmed in turn. A chaotic transient may end in one run and not in the other: such changes say nothing of the steps,
and how long transients last is a question of its own (`horizon`).
"""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int, Shaped


CONFIRMATIONS = 2
"""Number of times that steps are refined where labels change."""
SHARE = 0.1
"""Share of the periodic lanes that are confirmed without a cause."""
SEED = 0


class Confirmation(NamedTuple):
    """Counts of one round of lanes that were run again with finer steps."""

    lanes: int
    changed: int
    """Lanes whose label is another one."""
    moved: int
    """Lanes of the same label whose exponent differs by more than its error."""

    def __str__(self) -> str:
        moved = f", {self.moved} exponents moved" if self.moved else ""
        return f"{self.changed} of {self.lanes} labels changed{moved}"


@dataclasses.dataclass(frozen=True)
class Labelled:
    """Labels of lanes, with the largest exponent and its standard error."""

    label: Shaped[np.ndarray, " lanes"]
    exponent: np.ndarray
    error: np.ndarray

    def at(self, lanes: np.ndarray) -> "Labelled":
        """Some of them."""
        return Labelled(self.label[lanes], self.exponent[lanes], self.error[lanes])


def doubtful(label: Shaped[np.ndarray, "*designs speeds starts"]) -> Int[np.ndarray, " lanes"]:
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
    lanes: Int[np.ndarray, " some"], labelled: Labelled, again: Callable[[Int[np.ndarray, " some"], int], Labelled]
) -> tuple[Confirmation, ...]:
    """Run `lanes` again with finer and finer steps, as long as their labels change.

    **Arguments:** lanes; labels of all; `again(lanes, times)` runs them with steps refined so many times, puts the
    results in place of those before, and returns the labels of these lanes.
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
