"""Confirmation of labels with smaller steps, before they are reported.

All lanes that are neither periodic nor failed, their neighbours in speed, and a tenth of the periodic ones (to miss
chaos is the dangerous error) are run again from the same initial states with steps at most half as long. A label that
changes, or an exponent that moves by more than its error, is replaced by the new one, which is confirmed in turn. A
chaotic transient may end in one run and not in the other; such a change is not an error of the steps (see `horizon` for
the life of transients).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Int, Shaped


CONFIRMATIONS = 2
"""Maximum number of times that steps are refined."""
SHARE = 0.1
"""Fraction of the periodic lanes, drawn at random, that are confirmed."""
SEED = 0


class Labelled(NamedTuple):
    """Labels of lanes, with the largest exponent and its standard error."""

    label: Shaped[np.ndarray, " lanes"]
    exponent: np.ndarray
    error: np.ndarray

    def at(self, lanes: np.ndarray) -> "Labelled":
        return Labelled(*(x[lanes] for x in self))


def confirm(
    labelled: Labelled, shape: tuple[int, ...], again: Callable[[Int[np.ndarray, " some"], int], Labelled]
) -> list[tuple[int, int, int]]:
    """Run the doubtful lanes again with smaller and smaller steps, as long as their labels or exponents change.

    **Arguments:** labels of all lanes; shape of their layout, with speeds and initial states last; `again(lanes,
    times)`, which runs some of them with steps refined `times` times, replaces their results, and returns their labels.

    **Returns:** for each round the numbers of lanes run again, of labels that changed, and of exponents that moved by
    more than their error under the same label.
    """
    rounds = []
    lanes = _doubtful(labelled.label.reshape(shape))
    before = labelled.at(lanes)
    for times in range(1, CONFIRMATIONS + 1):
        if not lanes.size:
            break
        after = again(lanes, times)
        changed = before.label != after.label
        apart = np.abs(before.exponent - after.exponent)  # NaN of a failed lane does not count as moved
        moved = ~changed & (apart > np.maximum(3 * np.hypot(before.error, after.error), 0.01))
        rounds.append((lanes.size, int(np.sum(changed)), int(np.sum(moved))))
        lanes, before = lanes[changed | moved], after.at(changed | moved)
    return rounds


def _doubtful(label: Shaped[np.ndarray, "*designs speeds initial_states"]) -> Int[np.ndarray, " lanes"]:
    """Indices into the ravelled labels of the lanes to be confirmed."""
    failed = np.isin(label, ("failed", "inaccurate"))
    near = ~np.char.startswith(label, "periodic") & ~failed
    beside = near.copy()
    beside[..., 1:, :] |= near[..., :-1, :]
    beside[..., :-1, :] |= near[..., 1:, :]
    drawn = np.random.default_rng(SEED).random(label.shape) < SHARE
    return np.flatnonzero((beside | drawn) & ~failed)
