"""Labels are confirmed by finer steps before they are reported.

Run again, from the same initial states and with steps at most half as long, are all lanes that are neither periodic nor
failed, their neighbours in speed, and a tenth of the periodic ones, since false calm is the dangerous error. A label
that changes, or an exponent that moves by more than its error, is replaced by that of the finer steps, which is
confirmed in turn. A chaotic transient may end in one run and not in the other: such changes say nothing of the steps,
and how long transients last is a question of its own (`horizon`).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Int, Shaped


CONFIRMATIONS = 2
"""Number of times that steps are refined where labels change."""
SHARE = 0.1
"""Share of the periodic lanes that are confirmed without a cause."""
SEED = 0


class Labelled(NamedTuple):
    """Labels of lanes, with the largest exponent and its standard error."""

    label: Shaped[np.ndarray, " lanes"]
    exponent: np.ndarray
    error: np.ndarray

    def at(self, lanes: np.ndarray) -> "Labelled":
        """Some of them."""
        return Labelled(*(x[lanes] for x in self))


def confirm(
    labelled: Labelled, shape: tuple[int, ...], again: Callable[[Int[np.ndarray, " some"], int], Labelled]
) -> list[tuple[int, int, int]]:
    """Run the doubtful lanes again with finer and finer steps, as long as their labels change.

    **Arguments:** labels of all lanes; how lanes are laid out, speeds and initial states last; `again(lanes, times)`
    runs some of them with steps refined so many times, puts the results in place of those before, and returns their
    labels.

    **Returns:** of each round the number of lanes that were run again, that of labels that changed, and that of
    exponents that moved by more than their error under the same label.
    """
    rounds = []
    lanes = _doubtful(labelled.label.reshape(shape))
    before = labelled.at(lanes)
    for times in range(1, CONFIRMATIONS + 1):
        if not lanes.size:
            break
        after = again(lanes, times)
        changed = before.label != after.label
        apart = np.abs(before.exponent - after.exponent)  # NaN of a failed lane is not apart
        moved = ~changed & (apart > np.maximum(3 * np.hypot(before.error, after.error), 0.01))
        rounds.append((lanes.size, int(np.sum(changed)), int(np.sum(moved))))
        lanes, before = lanes[changed | moved], after.at(changed | moved)
    return rounds


def _doubtful(label: Shaped[np.ndarray, "*designs speeds initial_states"]) -> Int[np.ndarray, " lanes"]:
    """Lanes to be confirmed, by their place in the raveled labels."""
    failed = np.isin(label, ("failed", "inaccurate"))
    near = ~np.char.startswith(label, "periodic") & ~failed
    beside = near.copy()
    beside[..., 1:, :] |= near[..., :-1, :]
    beside[..., :-1, :] |= near[..., 1:, :]
    drawn = np.random.default_rng(SEED).random(label.shape) < SHARE
    return np.flatnonzero((beside | drawn) & ~failed)
