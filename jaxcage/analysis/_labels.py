"""What a lane does, judged from its strobe states and exponents.

Labels are given in this order: `inaccurate`, `failed`, `periodic-k`, `chaotic`, `quasi-periodic`, `undecided`. A lane
that closes while its neighbours part is undecided: its motion is too small for the scale, or it sits on an unstable
orbit.
"""

import numpy as np
from jaxtyping import Float, Int, Shaped

from ..integrate import OUTCOMES


CLOSING_TOLERANCE = 1e-4
"""A strobe orbit counts as closed if it returns to within this fraction of the system's scale (the clearance)."""
LONGEST_PERIOD = 8
CHAOS_THRESHOLD = 0.02
"""Exponent per revolution that must be exceeded by two standard errors."""
TORUS_THRESHOLD = 0.005
FEWEST_REVOLUTIONS = 20
"""With fewer, one error bar in forty is three times too small (256 lanes of Ueda's oscillator)."""


def closing_period(
    strobe: Float[np.ndarray, "*lanes keep dim"], scale: Float[np.ndarray, "*#lanes dim"]
) -> Int[np.ndarray, "*lanes"]:
    """Smallest k <= 8 for which every kept strobe state returns after k revolutions; 0 where there is none.

    A lane that spirals towards an orbit of period j returns after k > j revolutions, if these bring it nearly round,
    before it returns after j: its states move away from where they were j revolutions ago as those of an orbit of
    period k do. But that distance dies out with the one after k revolutions, where an orbit keeps it. Such lanes have
    the period j.

    Coordinates and velocities alike are compared in units of `scale`.
    """
    states = strobe / scale[..., None, :]
    period = np.zeros(strobe.shape[:-2], dtype=np.int64)
    longest = min(LONGEST_PERIOD, strobe.shape[-2] // 2)
    remains = {}
    for k in range(longest, 0, -1):
        apart = np.linalg.norm(states[..., k:, :] - states[..., :-k, :], axis=-1)
        closed = np.all(apart <= CLOSING_TOLERANCE, axis=-1)  # false for NaN
        period, remains[k] = np.where(closed, k, period), _remains(apart)
    for k in range(2, longest + 1):
        closed = period == k
        for j in range(k - 1, 0, -1):
            dies_out = (remains[j] <= 0.95) & (remains[j] <= np.sqrt(np.minimum(remains[k], 1.0)))
            period = np.where(closed & dies_out, j, period)
    return period


def _remains(apart: Float[np.ndarray, "*lanes some"]) -> Float[np.ndarray, "*lanes"]:
    """What is left of distances in the second half of the kept states; 1 where there were none."""
    half = max(apart.shape[-1] // 2, 1)
    before, after = (np.max(x, axis=-1) for x in (apart[..., :half], apart[..., -half:]))
    return np.divide(after, before, out=np.ones_like(after), where=before > 0)


def scatter(blocks: Float[np.ndarray, "..."], axis: int = -1) -> Float[np.ndarray, "..."]:
    """Standard error of the mean of blocks along an axis; infinite for a single one."""
    count = blocks.shape[axis]
    if count < 2:
        return np.full(np.delete(blocks.shape, axis), np.inf)
    return np.std(blocks, axis=axis, ddof=1) / np.sqrt(count)


def label_lanes(
    outcome: Int[np.ndarray, "*lanes"],
    period: Int[np.ndarray, "*lanes"],
    exponent: Float[np.ndarray, "*lanes"],
    standard_error: Float[np.ndarray, "*lanes"],
) -> Shaped[np.ndarray, "*lanes"]:
    """Labels from the code of the outcome, the closing period, and the largest exponent per revolution with its
    standard error."""
    labels = np.full(np.shape(period), "undecided", dtype="<U14")
    labels[np.abs(exponent) <= np.maximum(2 * standard_error, TORUS_THRESHOLD)] = "quasi-periodic"
    parting = exponent - 2 * standard_error > CHAOS_THRESHOLD
    labels[parting] = "chaotic"
    for k in range(1, LONGEST_PERIOD + 1):
        labels[(period == k) & ~parting] = f"periodic-{k}"
    labels[(period > 0) & parting] = "undecided"
    labels[np.asarray(outcome) != 0] = "failed"
    labels[np.asarray(outcome) == OUTCOMES.index("inaccurate")] = "inaccurate"
    return labels


def too_few_revolutions(
    label: Shaped[np.ndarray, "*lanes"],
    exponent: Float[np.ndarray, "*lanes"],
    standard_error: Float[np.ndarray, "*lanes"],
    revolutions: int,
) -> Shaped[np.ndarray, "*lanes"]:
    """Lanes whose label wants more revolutions than were observed: not called chaotic although they may be within two
    standard errors, or judged by an exponent of so few revolutions that its standard error means nothing.
    """
    calm = np.isin(label, ("quasi-periodic", "undecided"))
    doubtful = calm & (exponent + 2 * standard_error > CHAOS_THRESHOLD)
    return doubtful | ((calm | (label == "chaotic")) & (revolutions < FEWEST_REVOLUTIONS))
