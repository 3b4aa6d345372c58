"""Cages with parameters known only within ranges: chances of chaos, and ranges narrowed by measurements.

Each draw is a design with values from the ranges; it runs once at every speed, from the conventional initial state.
Draws are independent at one speed, so that their chaotic share has a binomial error bar, but not from speed to speed.

Ranges are narrowed by approximate Bayesian computation with rejection (S. A. Sisson, Y. Fan and M. A. Beaumont,
Handbook of Approximate Bayesian Computation (2018)): uniform draws from the ranges run at the measured speeds, and a
draw is accepted if it meets every measurement within its tolerance. If few are, the ranges close around the best draws,
with a margin, and are drawn from again. A box loses correlations: values that only matter together stay wide. The true
values may lie outside the narrowed ranges.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float, Shaped

from .._arguments import require_at_least
from .._errors import ArgumentError
from .._parameters import parameter_info, replace
from ..analysis import failed, motions, restless
from ..files import Measurement, Range, Unknown, check_together
from ..lanes import sobol
from ..models import CageModel
from ..solve import native
from .statistics import Runs


REVOLUTIONS = 100
"""Revolutions discarded, and observed; few suffice, since one draw is only a sample of a chance."""
SETTLED = 64
"""Revolutions after which periodic draws, three in five, are stopped."""
ERROR = 1e-2
"""Largest accepted error of a revolution [clearances]; with the default, a quarter of the draws would fail."""
RARE = 0.05
"""Largest share of the draws that may disagree with a verdict."""
RANGE_SPEEDS = 32
"""Number of speeds of an operating range at which draws are simulated."""
FEWEST = 29
"""Least number of draws for a verdict and for indices: at a chance of 10 %, this many contain no chaotic one in 5 % of
cases."""
BINS = 4
"""Number of parts of a range whose chances are compared, to estimate how much an unknown explains."""
KEPT = 0.25
"""Share of the draws of a stage around which the ranges close; if as many are accepted, the stage is the last."""
RESAMPLED = 400
"""Number of bootstrap samples for the error of an index."""
FAR = 5.0
"""Saturation of a miss [tolerances], and the miss of a cage that wrongly rattles or is calm. Saturation is gradual, so
that a tight tolerance still distinguishes near from far draws."""
FEW = 8
"""Number of accepted draws below which even the last stage closes around the best ones, accepted or not."""
WHOLE = 0.9
"""Share of a range above which it is not narrowed."""


def _run_draws(
    model: CageModel, unknowns: Sequence[Unknown], place: np.ndarray, speeds: Any, **more: Any
) -> tuple[list[CageModel], xr.Dataset]:
    """Designs with the values at `place` in the ranges, and their sweep, each from its own conventional initial state:
    the cage of one design, at rest on its rib, would penetrate that of another."""
    models = []
    for row in place:
        values = {name: float(u.range.at(p)) for u, p in zip(unknowns, row, strict=True) for name in u.names}
        models.append(replace(model, **values))
        check_together(models[-1])
    given: dict[str, Any] = {"discard": REVOLUTIONS, "revolutions": REVOLUTIONS, "blocks": 20, "keep": 32} | more
    given["method"] = given.get("method") or native(error=ERROR)
    settled = SETTLED if given["discard"] >= SETTLED else 0
    return models, Runs(speeds, settled=settled, **given).run(models)


def _require_some(unknowns: Sequence[Unknown]) -> None:
    if not unknowns:
        raise ArgumentError("unknowns", said="must hold at least one range, but it is empty.")


# --- chances --------------------------------------------------------------------------------------------------------

State = Literal["calm", "rattles", "not decided"]


class Chance(NamedTuple):
    """Numbers of draws that are chaotic, at one speed or anywhere in a range, of those for which this is known, and of
    all."""

    chaotic: int
    known: int
    draws: int

    @property
    def share(self) -> float:
        """Share of the known draws that are calm; NaN if none is known."""
        return 1 - self.chaotic / self.known if self.known else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the calm share (Clopper and Pearson), whatever the failed draws would do."""
        from scipy.stats import beta  # takes half a second to load

        least, most = self.known - self.chaotic, self.draws - self.chaotic
        low = beta.ppf(0.025, least, self.draws - least + 1) if least else 0.0
        high = beta.ppf(0.975, most + 1, self.draws - most) if most < self.draws else 1.0
        return float(low), float(high)

    @property
    def state(self) -> State:
        """`calm` or `rattles` if at least 95 % of the draws agree, whatever the failed ones would do, else `not
        decided`."""
        if self.known >= FEWEST:
            if self.draws - (self.known - self.chaotic) <= RARE * self.draws:
                return "calm"
            if self.chaotic >= (1 - RARE) * self.draws:
                return "rattles"
        return "not decided"


class Index(NamedTuple):
    """First-order index of an unknown value: the share of the variance of an outcome that it explains alone, with its
    standard error; how to measure it."""

    label: str
    share: float
    error: float
    source: str

    @property
    def telling(self) -> bool:
        """True if the index differs from zero by more than twice its error."""
        return self.share > 2 * self.error > 0


@dataclasses.dataclass(frozen=True)
class Ensemble:
    """Chaos of designs drawn from ranges: unknowns with their `sources`, how to measure each, and SI `units`; place of
    each draw in each range, 0 to 1; speeds [rad/s]; True where a draw is chaotic while observed, or failed."""

    unknowns: tuple[Unknown, ...]
    sources: tuple[str, ...]
    place: Float[np.ndarray, "draws unknowns"]
    speed: Float[np.ndarray, " speeds"]
    chaotic: Bool[np.ndarray, "draws speeds"]
    failed: Bool[np.ndarray, "draws speeds"]
    discard: int
    revolutions: int
    units: tuple[str, ...] = ()

    @property
    def rpm(self) -> Float[np.ndarray, " speeds"]:
        """Cage speeds [rpm]."""
        return self.speed * 30 / np.pi

    @property
    def chances(self) -> list[Chance]:
        """Chances at each speed alone."""
        counts = np.sum(self.chaotic & ~self.failed, axis=0), np.sum(~self.failed, axis=0)
        return [Chance(int(k), int(n), len(self.place)) for k, n in zip(*counts, strict=True)]

    @property
    def chance_of_chaos(self) -> Float[np.ndarray, "speeds 3"]:
        """Share of the draws that are chaotic at each speed, NaN where none finished, and its 95 % bounds."""
        return np.array([[1 - calm for calm in (each.share, *each.interval[::-1])] for each in self.chances])


Draws = Bool[np.ndarray, " draws"]


def range_chance(found: Ensemble, low_rpm: float, high_rpm: float) -> tuple[Chance, Draws, Draws]:
    """Chance that a draw is calm at all speeds of a range [rpm]; True for draws that are chaotic in it, and for those
    of which this is known. If there is no speed in the range, that nearest to its lower end counts."""
    which = (found.rpm >= low_rpm) & (found.rpm <= high_rpm)
    if not which.any():
        which[np.argmin(np.abs(found.rpm - low_rpm))] = True
    chaotic = np.any(found.chaotic[:, which] & ~found.failed[:, which], axis=1)
    known = chaotic | ~np.any(found.failed[:, which], axis=1)
    return Chance(int(chaotic.sum()), int(known.sum()), len(chaotic)), chaotic, known


def indices(found: Ensemble, outcome: Shaped[np.ndarray, " draws"], known: Bool[np.ndarray, " draws"]) -> list[Index]:
    """First-order indices of all unknown values for an outcome of each draw, such as chaos in a range, over the known
    draws, largest first; empty if all of these agree or there are fewer than `FEWEST`."""
    y, rows = np.asarray(outcome, dtype=float)[known], []
    if y.size < FEWEST or not np.any(y != y[:1]):
        return []
    picks = np.random.default_rng(0).integers(len(y), size=(RESAMPLED, len(y)))
    for unknown, place, source in zip(found.unknowns, found.place[known].T, found.sources, strict=True):
        error = float(np.std([_explained(place[p], y[p]) for p in picks]))
        rows.append(Index(unknown.label, _explained(place, y), error, source))
    return sorted(rows, key=lambda row: -row.share)


def _explained(place: np.ndarray, y: np.ndarray) -> float:
    """Share of the variance of y between quarters of `place`, less what chance alone would give."""
    parts = np.array_split(y[np.argsort(place)], BINS)
    between = sum(part.size * (part.mean() - y.mean()) ** 2 for part in parts)
    within = sum(((part - part.mean()) ** 2).sum() for part in parts)
    noise = (BINS - 1) * within / max(y.size - BINS, 1)
    return float(max(between - noise, 0.0) / (between + within or 1.0))


def ensemble(
    model: CageModel,
    unknowns: Sequence[Unknown],
    speeds: Float[np.ndarray, " speeds"],
    *,
    draws: int = 64,
    seed: int = 0,
    **settings: Any,
) -> Ensemble:
    """Run `draws` designs, spread evenly over the ranges, over speed.

    **Arguments:** design; its unknowns; ascending speeds [rad/s]; number and seed of the draws (scrambled Sobol
    points); settings of `Runs`, by default with 100 revolutions discarded and 100 observed.

    **Raises:** `ValueError` if nothing is unknown, nothing is drawn, or values from the ranges are not compatible.
    """
    _require_some(unknowns)
    require_at_least(1, draws=draws)
    place, info = sobol(len(unknowns), draws, seed), parameter_info(model)
    _, found = _run_draws(model, unknowns, place, speeds, **settings)
    place = place[: found.sizes["design"]]  # fewer after a stop
    rough, lost, at = restless(found), failed(found)[..., 0], np.asarray(speeds, dtype=float)
    sources, units = zip(*((info[u.names[0]].source, info[u.names[0]].unit) for u in unknowns), strict=True)
    length = found.attrs["discard"], found.attrs["revolutions"]
    return Ensemble(tuple(unknowns), sources, place, at, rough, lost, *length, units)


# --- measurements ---------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Narrowed:
    """Ranges narrowed by measurements: `lower` and `upper` ends of each new range in the old one, 0 to 1, and `middle`,
    the median of the draws kept; draws `accepted` in the last stage, of `draws` in each; number of `stages`; distance
    of the best draw from each measurement, in tolerances."""

    unknowns: tuple[Unknown, ...]
    lower: Float[np.ndarray, " unknowns"]
    upper: Float[np.ndarray, " unknowns"]
    middle: Float[np.ndarray, " unknowns"]
    accepted: int
    draws: int
    stages: int
    nearest: Float[np.ndarray, " measurements"]

    @property
    def share(self) -> Float[np.ndarray, " unknowns"]:
        """Width of each range relative to the old one."""
        return self.upper - self.lower

    @property
    def narrowed(self) -> Bool[np.ndarray, " unknowns"]:
        """True for ranges that shrink by more than 10 %."""
        return self.share < WHOLE

    @property
    def ranges(self) -> tuple[Range, ...]:
        """New ranges; unchanged if they are not narrowed."""
        return tuple(
            Range(float(u.range.at(a)), float(u.range.at(b)), float(u.range.at(m))) if worth else u.range
            for u, a, b, m, worth in zip(self.unknowns, self.lower, self.upper, self.middle, self.narrowed, strict=True)
        )


Misses = Callable[[Float[np.ndarray, "draws unknowns"]], Float[np.ndarray, "draws measurements"]]
"""Function of places in the ranges: distance of each draw from each measurement, in tolerances."""


def narrow(
    unknowns: Sequence[Unknown], misses: Misses, *, draws: int = 128, stages: int = 4, seed: int = 0
) -> Narrowed:
    """Close ranges around the draws that meet the measurements.

    **Arguments:** ranges; function of places in them, such as `misses`, that returns the distances of draws from the
    measurements; draws of each stage; largest number of stages; seed.

    **Raises:** `ValueError` if nothing is unknown, or for fewer than 16 draws.
    """
    _require_some(unknowns)
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
    """Bounds of these places, with a margin of twice their mean spacing and 2 % of the old range; a range that would
    keep most of its width stays whole, since nothing was learned of it."""
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
    **settings: Any,
) -> Float[np.ndarray, "draws measurements"]:
    """Distance of each draw from each measurement, in tolerances; NaN where it failed. For the motions `rattles`
    (chaos) and `calm` it is 0 if the draw agrees, else `FAR`. Settings are those of `Runs`."""
    rpm = np.unique([m.cage_rpm for m in measured])
    models, found = _run_draws(model, unknowns, place, rpm * np.pi / 30, **settings)
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
