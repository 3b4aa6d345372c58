"""Ranges of parameters narrowed by measurements on a machine.

Approximate Bayesian computation by rejection (S. A. Sisson, Y. Fan and M. A. Beaumont, Handbook of Approximate Bayesian
Computation (2018)): even draws from the ranges run at the measured speeds, and a draw is accepted if every measurement
is met within its tolerance. Where few are, the ranges close around the best of them, with a margin, and are drawn from
again. A box holds less than what was learned: values that only matter together stay wide. What is left out may have
held the truth.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float

from .._arguments import require_at_least
from .._errors import ArgumentError
from ..analysis import failed, restless
from ..files import Measurement, Range, Unknown
from ..lanes import Progress, sobol
from ..models import CageModel
from ..solve import AbstractMethod, native
from .chances import ERROR, run_draws
from .loads import motions


DRAWS = 128
STAGES = 4
KEPT = 0.25
"""Share of the draws of a stage around which the ranges close; with as many accepted the stage is the last."""
FAR = 5.0
"""Largest count of a miss [tolerances], also of a cage that rattles and should not. The larger of two misses counts
more, so that a tight tolerance tells near draws from far ones."""
FEW = 8
"""Accepted draws without which even the last stage closes around the best ones, met or not."""
WHOLE = 0.9
"""Share of a range above which it is left whole."""


@dataclasses.dataclass(frozen=True)
class Narrowed:
    """Ranges that are narrowed by measurements."""

    unknowns: tuple[Unknown, ...]
    """The ranges before."""
    lower: Float[np.ndarray, " unknowns"]
    """Place of each new range in the old one, 0 to 1."""
    upper: Float[np.ndarray, " unknowns"]
    middle: Float[np.ndarray, " unknowns"]
    """Median of the accepted draws."""
    accepted: int
    """Draws of the last stage that meet all measurements."""
    draws: int
    """Draws of each stage."""
    stages: int
    nearest: Float[np.ndarray, " measurements"]
    """How far the best draw is from each measurement, in tolerances."""

    @property
    def share(self) -> Float[np.ndarray, " unknowns"]:
        """Share of each range that is left."""
        return self.upper - self.lower

    @property
    def narrowed(self) -> Bool[np.ndarray, " unknowns"]:
        """True for ranges that become shorter by more than a tenth."""
        return self.share < WHOLE

    @property
    def ranges(self) -> tuple[Range, ...]:
        """New ranges; those that are not narrowed as they were."""
        return tuple(
            Range(float(u.range.at(a)), float(u.range.at(b)), float(u.range.at(m))) if worth else u.range
            for u, a, b, m, worth in zip(self.unknowns, self.lower, self.upper, self.middle, self.narrowed, strict=True)
        )


Misses = Callable[[Float[np.ndarray, "draws unknowns"]], Float[np.ndarray, "draws measurements"]]
"""Places in the ranges -> how far each draw is from each measurement, in tolerances."""


def narrow(
    unknowns: Sequence[Unknown], misses: Misses, *, draws: int = DRAWS, stages: int = STAGES, seed: int = 0
) -> Narrowed:
    """Close ranges around the draws that meet the measurements.

    **Arguments:** ranges; function of places in them, such as `misses`, that tells how far draws are from the
    measurements; draws of each stage; largest number of stages; seed.

    **Raises:** `ValueError` if nothing is unknown, or for fewer than 16 draws.
    """
    if not unknowns:
        raise ArgumentError("unknowns", said="must hold at least one range, but it is empty.")
    require_at_least(16, draws=draws)
    require_at_least(1, stages=stages)
    lower, upper, stage = np.zeros(len(unknowns)), np.ones(len(unknowns)), 0
    while True:
        stage += 1
        place = lower + (upper - lower) * sobol(len(unknowns), draws, seed + stage)
        missed = np.where(np.isnan(far := misses(place)), math.inf, far)
        met = np.all(missed <= 1.0, axis=1)
        far_off = np.mean(FAR * (1 - 1 / (1 + missed / FAR)), axis=1)  # a miss counts at most FAR
        enough = met.sum() >= KEPT * draws
        last = enough or stage == stages
        worst_kept = np.sort(far_off)[math.ceil(KEPT * draws) - 1]
        chosen = met if last and (enough or met.sum() >= FEW) else far_off <= worst_kept
        lower, upper = _closed(place[chosen], lower, upper)
        if last:
            best = missed[np.argmin(far_off)]
            middle = np.median(place[chosen], axis=0)
            return Narrowed(tuple(unknowns), lower, upper, middle, int(met.sum()), draws, stage, best)


def _closed(place: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends around these places, some distances of even draws beyond the outermost; a range of which they leave most
    stays whole, since nothing was learned of it."""
    low, high = place.min(axis=0), place.max(axis=0)
    margin = 2.0 * (high - low) / (len(place) - 1) + 0.02 * (upper - lower)
    low, high = np.maximum(low - margin, lower), np.minimum(high + margin, upper)
    whole = high - low > WHOLE * (upper - lower)
    return np.where(whole, lower, low), np.where(whole, upper, high)


def misses(
    model: CageModel,
    unknowns: Sequence[Unknown],
    measured: Sequence[Measurement],
    place: Float[np.ndarray, "draws unknowns"],
    *,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> Float[np.ndarray, "draws measurements"]:
    """Distance of each draw from each measurement, in tolerances; NaN where it failed. A cage that is chaotic rattles:
    its distance is 0 if that is right, else `FAR`."""
    rpm = np.unique([m.cage_rpm for m in measured])
    models, found = run_draws(model, unknowns, place, rpm * np.pi / 30, method=method, progress=progress)
    size, order = motions(models, found, method=native(error=ERROR))
    columns = []
    for m in measured:
        i = int(np.argmin(np.abs(rpm - m.cage_rpm)))
        if m.quantity in ("rattles", "calm"):
            right = restless(found)[:, i] == (m.quantity == "rattles")
            columns.append(np.where(failed(found)[:, i, 0], np.nan, np.where(right, 0.0, FAR)))
            continue
        whirl = m.quantity == "whirl frequency"
        value = np.abs(order[:, i, 0]) * m.cage_rpm / 60 if whirl else size[:, i, 0]
        columns.append(np.abs(value - m.value) / m.tolerance)
    return np.stack(columns, axis=1)
