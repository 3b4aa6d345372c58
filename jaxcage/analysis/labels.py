"""Labels of lanes: periodic, chaotic, quasi-periodic, undecided, failed or inaccurate; thresholds are constants.

The rule, in this order: `inaccurate` and `failed` by the outcome; `periodic-k` if the strobe orbit closes after k
revolutions; `chaotic` if the largest exponent is above 0.02 by two standard errors; `quasi-periodic` if it is zero
within 0.005, two standard errors are below 0.005, and the strobe orbit neither shrinks nor grows; else `undecided`. A
lane that closes although neighbouring trajectories diverge is undecided: its motion is too small for the scale, or it
is on an unstable orbit. `lanes.dataset` makes a chaotic lane `transient` if it calms down before the horizon.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from ..solve import OUTCOMES


CLOSING_TOLERANCE = 1e-4
"""Distance, as a fraction of the size of the motion, within which a strobe orbit must return to count as closed."""
SMALLEST_MOTION = 1e-6
"""Size of motion, as a fraction of the system's scale, below which motion is not distinguished from a fixed point."""
LONGEST_PERIOD = 8
CHAOS_THRESHOLD = 0.02
"""Exponent per revolution that chaos must exceed by two standard errors."""
TORUS_THRESHOLD = 0.005
"""Largest modulus of an exponent per revolution, and of two standard errors of it, that count as zero."""
RANK_TOLERANCE = 1e-3
"""Smallest singular value, relative to the largest, that is kept in the linear model of a strobe orbit."""


def motion_size(
    strobe: Float[np.ndarray, "*lanes keep dim"], scale: Float[np.ndarray, "*#lanes dim"]
) -> Float[np.ndarray, "*lanes"]:
    """Size of the motion in units of the system's scale: the largest norm of a strobe state."""
    return np.asarray(np.max(np.linalg.norm(strobe / scale[..., None, :], axis=-1), axis=-1))


def closing_tolerance(
    strobe: Float[np.ndarray, "*lanes keep dim"], scale: Float[np.ndarray, "*#lanes dim"]
) -> Float[np.ndarray, "*lanes"]:
    """Distance within which a strobe orbit must return [scale]: 1e-4 of the size of its motion, within 1e-6 to 1."""
    return np.asarray(CLOSING_TOLERANCE * np.clip(motion_size(strobe, scale), SMALLEST_MOTION, 1.0))


def closing_period(
    strobe: Float[np.ndarray, "*lanes keep dim"], scale: Float[np.ndarray, "*#lanes dim"]
) -> Int[np.ndarray, "*lanes"]:
    """Smallest k <= 8 for which every kept strobe state returns after k revolutions; 0 where there is none.

    A lane that spirals towards an orbit of period j may return to within the tolerance after k > j revolutions, if k is
    nearly a full turn of the spiral, before it does after j. Unlike on an orbit of period k, its distance after j
    revolutions decays together with that after k: such lanes have the period j.

    Coordinates and velocities are compared in units of `scale`, to within `closing_tolerance`.
    """
    states = strobe / scale[..., None, :]
    tolerance = closing_tolerance(strobe, scale)[..., None]
    period = np.zeros(strobe.shape[:-2], dtype=np.int64)
    longest = min(LONGEST_PERIOD, strobe.shape[-2] // 2)
    remains = {}
    for k in range(longest, 0, -1):
        apart = np.linalg.norm(states[..., k:, :] - states[..., :-k, :], axis=-1)
        closed = np.all(apart <= tolerance, axis=-1)  # false for NaN
        period, remains[k] = np.where(closed, k, period), _remains(apart)
    for k in range(2, longest + 1):
        closed = period == k
        for j in range(k - 1, 0, -1):
            dies_out = (remains[j] <= 0.95) & (remains[j] <= np.sqrt(np.minimum(remains[k], 1.0)))
            period = np.where(closed & dies_out, j, period)
    return period


def _remains(apart: Float[np.ndarray, "*lanes some"]) -> Float[np.ndarray, "*lanes"]:
    """Largest distance in the second half of the kept states over that in the first; 1 where the latter is zero."""
    half = max(apart.shape[-1] // 2, 1)
    before, after = (np.max(x, axis=-1) for x in (apart[..., :half], apart[..., -half:]))
    return np.divide(after, before, out=np.ones_like(after), where=before > 0)


def decay(states: Float[np.ndarray, "keep dim"]) -> tuple[float, float]:
    """Factor by which a strobe orbit shrinks per revolution, and its error: 1 within the error for a torus.

    A linear model x[n+1] = A x[n] of the steps from state to state, with delayed steps as further components, is fitted
    by least squares on the leading singular vectors (dynamic mode decomposition, P. J. Schmid, J. Fluid Mech. 656,
    2010). The factor is the modulus of the eigenvalue of its largest mode; the error is a quarter of the relative
    residual of the fit plus 1e-4.

    **Arguments:** strobe states in units of the scale, twelve or more; with fewer the error is infinite.
    """
    steps = np.diff(states, axis=0)
    count, dim = steps.shape
    if count < 11 or not np.any(steps):
        return 1.0, np.inf
    delays = max(1, count // (4 * dim))
    stacked = np.concatenate([steps[i : count - delays + 1 + i] for i in range(delays)], axis=1)
    before, after = stacked[:-1].T, stacked[1:].T
    left, size, right = np.linalg.svd(before, full_matrices=False)
    rank = min(int(np.sum(size > RANK_TOLERANCE * size[0])), before.shape[1] // 2)
    left, size, right = left[:, :rank], size[:rank], right[:rank]
    model = left.T @ after @ right.T / size
    residual = np.linalg.norm(after - left @ (model @ (left.T @ before))) / np.linalg.norm(after)
    multipliers, modes = np.linalg.eig(model)
    weights = np.linalg.lstsq(modes, left.T @ before, rcond=None)[0]
    largest = np.argmax(np.linalg.norm(weights, axis=1))
    return float(abs(multipliers[largest])), float(1e-4 + residual / 4)


def scatter(blocks: Float[np.ndarray, "..."], axis: int = -1) -> Float[np.ndarray, "..."]:
    """Standard error of the mean of blocks along an axis; infinite for a single block."""
    count = blocks.shape[axis]
    if count < 2:
        return np.full(np.delete(blocks.shape, axis), np.inf)
    return np.asarray(np.std(blocks, axis=axis, ddof=1) / np.sqrt(count))


def label_lanes(
    outcome: Int[np.ndarray, "*lanes"],
    strobe: Float[np.ndarray, "*lanes keep dim"],
    scale: Float[np.ndarray, "*#lanes dim"],
    exponent: Float[np.ndarray, "*lanes"],
    standard_error: Float[np.ndarray, "*lanes"],
) -> Shaped[np.ndarray, "*lanes"]:
    """Labels of lanes by the rule at the top of this file.

    **Arguments:** codes of the outcomes; last strobe states, and the scale of each component; largest exponents per
    revolution and their standard errors, NaN where none was computed.
    """
    period = closing_period(strobe, scale)
    labels = np.full(np.shape(period), "undecided", dtype="<U14")
    labels[on_torus(strobe, scale, exponent, standard_error)] = "quasi-periodic"
    parting = exponent - 2 * standard_error > CHAOS_THRESHOLD
    labels[parting] = "chaotic"
    for k in range(1, LONGEST_PERIOD + 1):
        labels[(period == k) & ~parting] = f"periodic-{k}"
    labels[(period > 0) & parting] = "undecided"
    labels[np.asarray(outcome) != 0] = "failed"
    labels[np.asarray(outcome) == OUTCOMES.index("inaccurate")] = "inaccurate"
    return labels


def on_torus(
    strobe: Float[np.ndarray, "*lanes keep dim"],
    scale: Float[np.ndarray, "*#lanes dim"],
    exponent: Float[np.ndarray, "*lanes"],
    standard_error: Float[np.ndarray, "*lanes"],
) -> Bool[np.ndarray, "*lanes"]:
    """True for lanes whose exponent is resolved as zero, and whose strobe orbit neither shrinks nor grows."""
    states = strobe / scale[..., None, :]
    resolved = (np.abs(exponent) <= TORUS_THRESHOLD) & (2 * standard_error <= TORUS_THRESHOLD)
    found = np.zeros(resolved.shape, dtype=bool)
    for lane in zip(*np.nonzero(resolved & np.all(np.isfinite(states), axis=(-2, -1))), strict=True):
        factor, error = decay(states[lane])
        found[lane] = abs(factor - 1) <= error < np.inf
    return found


def revolutions_to_decide(
    strobe: Float[np.ndarray, "keep dim"],
    scale: Float[np.ndarray, " dim"],
    exponent: float,
    standard_error: float,
    revolutions: int,
) -> float:
    """Estimated number of revolutions that must be observed to label an undecided lane; infinite without an estimate.

    A strobe orbit that shrinks closes when its steps have shrunk to the tolerance. Otherwise the exponent decides: its
    standard error falls as the inverse square root of the number of revolutions. An orbit whose period exceeds eight
    revolutions, with a negative exponent although it does not shrink, never gets a label.
    """
    factor, error = decay(strobe / scale)
    apart = np.linalg.norm(np.diff(strobe[-LONGEST_PERIOD:] / scale, axis=0), axis=-1).max()
    tolerance = float(closing_tolerance(strobe, scale))
    if error < 1 - factor < 1 and apart > tolerance:
        return revolutions + float(np.log(tolerance / apart) / np.log(factor))
    if exponent + 2 * standard_error < -TORUS_THRESHOLD:
        return np.inf
    gap = exponent - CHAOS_THRESHOLD if exponent > CHAOS_THRESHOLD + TORUS_THRESHOLD else TORUS_THRESHOLD
    ratio = 2 * standard_error / gap
    return revolutions * max(ratio**2, 2.0) if np.isfinite(ratio) else np.inf


CIRCULAR, REPEATING = 0.1, 0.1
"""Largest variation of the eccentricity relative to its mean for `circular` motion; largest mean distance in
clearances between positions one revolution apart for `locally_periodic` motion."""
MOTIONS = ("circular", "locally_periodic", "disordered")
PARTS = 8
"""Largest number of parts of a record from which the standard error of a statistic is estimated."""


def motion_label(place: Float[np.ndarray, "n 2"], samples: int) -> str:
    """Name of the motion of a cage's centre, in the terms of the literature on cage stability.

    `circular`: the centre whirls at least once in ten revolutions of the cage (and once in all), and its eccentricity
    varies (standard deviation over mean) by less than `CIRCULAR`. `locally_periodic`: otherwise, if the mean distance
    of positions one revolution apart is below `REPEATING` clearances. `disordered`: neither. `undecided`: a statistic
    that decides is within two standard errors of its limit. `failed`: not finite.

    **Arguments:** position over clearance, at equal angles of the cage; samples per revolution.
    """
    if not np.all(np.isfinite(place)):
        return "failed"
    eps = np.hypot(*place.T)
    turns = abs(np.diff(np.unwrap(np.arctan2(place[:, 1], place[:, 0]))).sum()) / (2 * np.pi)
    revolutions = (len(place) - 1) / samples
    away = np.hypot(*(place[samples:] - place[:-samples]).T)
    repeats = _below(REPEATING, away, np.mean, samples)
    if turns >= max(1.0, revolutions / 10):
        steady = _below(CIRCULAR, eps, lambda x: np.std(x) / np.mean(x), samples)
        if steady:
            return "circular"
        repeats = None if steady is None and not repeats else repeats
    return {True: "locally_periodic", False: "disordered", None: "undecided"}[repeats]


def _below(limit: float, x: Float[np.ndarray, " n"], statistic: Callable[..., Any], samples: int) -> bool | None:
    """Return True if a statistic of a record is below a limit, and None if it is within two standard errors of it.

    The error is that of the jackknife, which leaves out one part of the record, of a revolution or more, at a time.
    """
    count = min(PARTS, len(x) // samples)
    if count < 2:
        return None
    parts = np.array_split(x, count)
    value, without = statistic(x), [statistic(np.concatenate(parts[:i] + parts[i + 1 :])) for i in range(count)]
    error = np.sqrt(count - 1) * np.std(without)
    return None if abs(value - limit) <= 2 * error else bool(value < limit)


LABELS = (
    "failed",
    *(f"periodic-{k}" for k in range(1, LONGEST_PERIOD + 1)),
    "chaotic",
    "quasi-periodic",
    "undecided",
    "inaccurate",
    "transient",
    *MOTIONS,
)
"""Labels in the order of the codes by which they are stored."""
