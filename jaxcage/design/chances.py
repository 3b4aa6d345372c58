"""Chances of chaos of a cage of which some values are known within ranges only.

Each draw is a design with values from the ranges; it runs once at every speed, from the conventional start. At a speed
the draws are independent, so that their chaotic share has the error bar of a binomial count; speeds are not.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from .._arguments import require_at_least
from .._errors import ArgumentError
from .._parameters import parameter_info, replace
from ..analysis import failed, restless
from ..files import Unknown, check_together
from ..lanes import Progress, sobol, sweep
from ..models import CageModel
from ..solve import AbstractMethod, native


DRAWS = 64
REVOLUTIONS = 100
"""Revolutions left out, and observed: one lane is an example of a chance, and need not be known to three digits."""
SETTLED = 64
"""Revolutions after which a draw that is periodic is not run any further, which are three in five."""
ERROR = 1e-2
"""Error of a revolution [clearances] up to which a lane counts; with the default, a quarter of the draws fail."""
RARE = 0.05
"""Chance below which a speed is called calm, and above one less which it is called chaotic."""
FEWEST = 29
"""Draws without which nothing is called calm: if 10 % were chaotic, none of so many would be once in 20 times."""
CONFIDENCE = 0.95
BINS = 4
"""Parts of a range whose chances are compared, to tell how much an unknown explains."""

Verdict = Literal["calm", "chaotic", "calm as computed", "chaotic as computed", "not decided", "too few draws"]


class Clue(NamedTuple):
    """Share of the variance of the chaotic share that is due to an unknown alone, and `source`, how to measure it."""

    label: str
    share: float
    source: str


@dataclasses.dataclass(frozen=True)
class Ensemble:
    """Chaos of designs that are drawn from ranges."""

    unknowns: tuple[Unknown, ...]
    sources: tuple[str, ...]
    """How to measure each unknown."""
    place: Float[np.ndarray, "draws unknowns"]
    """Place of each draw in each range, 0 to 1."""
    speed: Float[np.ndarray, " speeds"]
    """[rad/s]."""
    chaotic: Bool[np.ndarray, "draws speeds"]
    """True where a draw is chaotic while observed."""
    failed: Bool[np.ndarray, "draws speeds"]
    discard: int
    revolutions: int
    units: tuple[str, ...] = ()
    """SI units of the unknowns."""

    @property
    def rpm(self) -> Float[np.ndarray, " speeds"]:
        """Cage speeds in revolutions per minute."""
        return self.speed * 30 / np.pi

    @property
    def counts(self) -> tuple[np.ndarray, np.ndarray]:
        """Chaotic draws, and draws that finished, at each speed."""
        return np.sum(self.chaotic & ~self.failed, axis=0), np.sum(~self.failed, axis=0)

    @property
    def chance(self) -> Float[np.ndarray, " speeds"]:
        """Share of the draws that are chaotic at each speed; NaN where none finished."""
        chaotic, of = self.counts
        return np.where(of > 0, chaotic / np.maximum(of, 1), np.nan)

    @property
    def interval(self) -> tuple[Float[np.ndarray, " speeds"], Float[np.ndarray, " speeds"]]:
        """Bounds of the chance with 95 % confidence, by Clopper and Pearson: the lower one as if all that failed were
        calm, the upper one as if all were chaotic."""
        (chaotic, of), draws = self.counts, len(self.place)
        return binomial_interval(chaotic, draws)[0], binomial_interval(chaotic + draws - of, draws)[1]

    @property
    def verdict(self) -> list[Verdict]:
        """Meaning of the chance at each speed, see `verdict_of`."""
        return [verdict_of(int(k), int(n), len(self.place)) for k, n in zip(*self.counts, strict=True)]

    @property
    def undecided(self) -> Bool[np.ndarray, " speeds"]:
        """Speeds at which the ranges are too wide to decide."""
        return np.array([v == "not decided" for v in self.verdict], dtype=bool)

    def clues(self, which: Bool[np.ndarray, " speeds"] | None = None) -> list[Clue]:
        """Influence of each unknown on the chaotic share of the speeds `which`, by default all undecided ones, the
        largest first; empty where there is nothing to decide."""
        chosen = self.undecided if which is None else which
        y = np.mean(self.chaotic[:, chosen], axis=1) if np.any(chosen) else np.zeros(len(self.chaotic))
        if np.ptp(y) == 0:
            return []
        each = zip(self.unknowns, self.place.T, self.sources, strict=True)
        return sorted((Clue(u.label, explained(at, y), of) for u, at, of in each), key=lambda clue: -clue.share)

    def between(self, low_rpm: float, high_rpm: float) -> Bool[np.ndarray, " speeds"]:
        """Speeds in a range, or the one that is nearest to it."""
        inside = (self.rpm >= low_rpm) & (self.rpm <= high_rpm)
        return inside if np.any(inside) else np.arange(self.rpm.size) == np.argmin(np.abs(self.rpm - low_rpm))


def verdict_of(chaotic: int, finished: int, draws: int) -> Verdict:
    """Meaning of `chaotic` draws among `finished` of `draws`.

    `calm` and `chaotic` hold whatever the draws that failed would do: at most 5 %, or at least 95 %, of all draws are
    chaotic then. `calm as computed` and `chaotic as computed` are about the draws that finished; those that failed are
    often the ones that hit the land hardest, and others drawn in their place would not be like them.
    """
    if finished < FEWEST:
        return "too few draws"
    if chaotic + draws - finished <= RARE * draws:
        return "calm"
    if chaotic >= (1 - RARE) * draws:
        return "chaotic"
    if chaotic <= RARE * finished:
        return "calm as computed"
    return "chaotic as computed" if chaotic >= (1 - RARE) * finished else "not decided"


def binomial_interval(
    hits: np.ndarray | Sequence[int] | int, of: np.ndarray | Sequence[int] | int
) -> tuple[np.ndarray, np.ndarray]:
    """Clopper and Pearson's bounds of a share, from `hits` among `of`."""
    from scipy.stats import beta  # takes half a second to load

    k, n, tail = np.asarray(hits, dtype=float), np.asarray(of, dtype=float), (1 - CONFIDENCE) / 2
    low = np.where(k > 0, beta.ppf(tail, np.maximum(k, 1e-9), n - k + 1), 0.0)
    high = np.where(k < n, beta.ppf(1 - tail, k + 1, np.maximum(n - k, 1e-9)), 1.0)
    return low, high


def explained(place: np.ndarray, y: np.ndarray) -> float:
    """Share of the variance of y between quarters of `place`, less what chance alone would put there."""
    parts = np.array_split(y[np.argsort(place)], BINS)
    between = sum(part.size * (part.mean() - y.mean()) ** 2 for part in parts)
    within = sum(((part - part.mean()) ** 2).sum() for part in parts)
    noise = (BINS - 1) * within / max(y.size - BINS, 1)
    return float(max(between - noise, 0.0) / (between + within))


def run_draws(
    model: CageModel,
    unknowns: Sequence[Unknown],
    place: Float[np.ndarray, "draws unknowns"],
    speeds: Float[np.ndarray, " speeds"],
    *,
    discard: int = REVOLUTIONS,
    revolutions: int = REVOLUTIONS,
    blocks: int = 20,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> tuple[list[CageModel], xr.Dataset]:
    """Designs with the values at `place` in the ranges, and their sweep, each from its own conventional initial state:
    a state in which the cage of one design rests on its rib would press that of another into it.

    **Raises:** `ValueError` for values that do not go together.
    """
    models = []
    for row in place:
        values = {name: float(u.range.at(p)) for u, p in zip(unknowns, row, strict=True) for name in u.names}
        models.append(replace(model, **values))
        check_together(models[-1])
    length: Any = dict(discard=discard, revolutions=revolutions, blocks=blocks, confirm=False, horizon=0, keep=32)
    settled, method = SETTLED if discard >= SETTLED else 0, native(error=ERROR) if method is None else method
    return models, sweep(models, speeds, starts=1, settled=settled, method=method, progress=progress, **length)


def ensemble(
    model: CageModel,
    unknowns: Sequence[Unknown],
    speeds: Float[np.ndarray, " speeds"],
    *,
    draws: int = DRAWS,
    seed: int = 0,
    discard: int = REVOLUTIONS,
    revolutions: int = REVOLUTIONS,
    blocks: int = 20,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> Ensemble:
    """Run `draws` designs, spread evenly over the ranges, over speed.

    **Arguments:** design; what is unknown of it; ascending speeds [rad/s]; number and seed of the draws (scrambled
    Sobol points); revolutions left out and observed in `blocks` blocks; method and progress as in `sweep`.

    **Raises:** `ValueError` if nothing is unknown, nothing is drawn, or values from the ranges do not go together.
    """
    if not unknowns:
        raise ArgumentError("unknowns", said="must hold at least one range, but it is empty.")
    require_at_least(1, draws=draws)
    place, info = sobol(len(unknowns), draws, seed), parameter_info(model)
    length: Any = dict(discard=discard, revolutions=revolutions, blocks=blocks)
    _, found = run_draws(model, unknowns, place, speeds, method=method, progress=progress, **length)
    rough, lost, at = restless(found), failed(found)[..., 0], np.asarray(speeds, dtype=float)
    sources, units = zip(*((info[u.names[0]].source, info[u.names[0]].unit) for u in unknowns), strict=True)
    return Ensemble(tuple(unknowns), sources, place, at, rough, lost, discard, revolutions, units)
