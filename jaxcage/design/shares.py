"""Shares of an objective's variance over whole ranges of parameters, and tolerance budgets of edges and statistics."""

import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import ndtri

from .._arguments import require_at_least
from .._errors import ArgumentError, InputError
from ..analysis import scatter
from ..models import AbstractForcedSystem
from ..orbits import Sensitivity
from .objective import AbstractObjective, DesignSpace
from .slopes import StatisticGradient


NARROW = 0.3
"""Width of an interval [share of the variance] that is narrow enough to tell what matters from what does not."""


@dataclasses.dataclass(frozen=True)
class SobolIndices:
    """Shares of an objective's variance, with 95 % intervals by the bootstrap."""

    first: dict[str, float]
    """Share due to a parameter alone."""
    total: dict[str, float]
    """Share due to a parameter and all its interactions."""
    first_interval: dict[str, tuple[float, float]]
    total_interval: dict[str, tuple[float, float]]
    evaluations: int
    samples: int
    """Base samples."""
    scatter: float = 0.0
    """Share of the variance that is scatter of the motion itself, by the blocks of each run. It belongs to no
    parameter, and total indices contain it. Drift between the blocks counts as scatter."""

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Parameters with an index whose interval lies outside 0 to 1, is wider than the index and `NARROW`, or is NaN
        because so few samples differ that some of the bootstrap's are all alike."""
        rows = [(self.first, self.first_interval), (self.total, self.total_interval)]
        bad = lambda value, pair: not (pair[0] <= 1 and pair[1] >= 0 and pair[1] - pair[0] <= max(abs(value), NARROW))
        return tuple(n for n in self.first if any(bad(value[n], pair[n]) for value, pair in rows))

    @property
    def samples_wanted(self) -> int:
        """Base samples, a power of 2, with which all intervals should be at most `NARROW` wide: widths fall with the
        root of their number. A missing interval is taken as 1 wide. At least twice as many if any is in doubt."""
        least = 2 * self.samples if self.doubtful else self.samples
        widths = [b - a for pairs in (self.first_interval, self.total_interval) for a, b in pairs.values()]
        widest = max(NARROW, *(1.0 if math.isnan(w) else w for w in widths))
        return max(least, 1 << math.ceil(math.log2(self.samples * (widest / NARROW) ** 2)))

    @property
    def warning(self) -> str | None:
        """Warning for indices with wide intervals; None if there are none."""
        if not self.doubtful:
            return None
        return (
            f"Too few samples to believe the indices of {', '.join(self.doubtful)}: shares of a variance lie between 0 "
            f"and 1. With {self.samples_wanted} base samples (now {self.samples}) their intervals would be about "
            f"{NARROW:g} wide."
        )

    def __str__(self) -> str:
        span = lambda pair: f"[{pair[0]:+.2f}, {pair[1]:+.2f}]"
        head = f"Sobol indices from {self.evaluations} designs"
        rows = [
            f"  {n:<24} first {self.first[n]:+.3f} {span(self.first_interval[n])}  "
            f"total {self.total[n]:+.3f} {span(self.total_interval[n])}"
            for n in self.first
        ]
        return "\n".join([head, *rows, *([self.warning] if self.warning else [])])


def global_sensitivity(
    system: AbstractForcedSystem,
    vary: Mapping[str, tuple[float, float]],
    objective: AbstractObjective,
    *,
    samples: int = 64,
    seed: int = 0,
) -> SobolIndices:
    """Sobol indices of an objective, parameters drawn evenly between their bounds (scipy's estimators).

    **Arguments:** design; bounds [SI] by name; objective; base samples, a power of 2: samples (parameters + 2) designs
    are evaluated in one batch.

    **Raises:** `ValueError` for samples that are no power of 2, or an objective that has no value somewhere.
    """
    require_at_least(0, seed=seed)
    space, every = DesignSpace.of(system, vary), []

    def evaluate(x: np.ndarray) -> np.ndarray:
        found = objective.by_block(space, x.T)
        if lost := int(np.sum(~np.isfinite(found).all(axis=1))):
            raise InputError(f"The objective must have a value in all designs, but has none in {lost} of {len(found)}.")
        every.append(found)
        return found.mean(axis=1)[None]

    shares = sobol_of(evaluate, space.names, samples=samples, seed=seed)
    blocks = np.concatenate(every)
    variance = float(np.var(blocks.mean(axis=1)))
    if blocks.shape[1] == 1 or not variance > 0:
        return shares
    return dataclasses.replace(shares, scatter=min(1.0, float(np.mean(scatter(blocks) ** 2)) / variance))


def sobol_of(
    evaluate: Callable[[np.ndarray], np.ndarray], names: Sequence[str], *, samples: int, seed: int = 0
) -> SobolIndices:
    """Sobol indices of a function of places between 0 and 1, of shape (names, designs), with one row of values.

    Index and interval of a parameter that changes nothing in any sample are 0.

    **Raises:** `ValueError` for samples that are no power of 2.
    """
    if samples < 2 or samples & (samples - 1):
        raise ArgumentError("samples", said=f"must be a power of 2, but {samples} was given.")
    from scipy.stats import DegenerateDataWarning, bootstrap, sobol_indices, uniform  # takes half a second to load

    values: list[np.ndarray] = []

    def indices(f_A: np.ndarray, f_B: np.ndarray, f_AB: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values[:] = f_A, f_B, f_AB
        found = _shares(f_A, f_B, f_AB)
        # Of one parameter SciPy would squeeze them to plain numbers, which it cannot go on with.
        return found if len(names) > 1 else (np.repeat(found[0], 2, axis=0), np.repeat(found[1], 2, axis=0))

    number = samples * (len(names) + 2)
    how: Any = dict(n=samples, dists=[uniform()] * len(names), method=indices, rng=seed)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = sobol_indices(func=evaluate, **how)
        if all(np.all(v == values[0].flat[0]) for v in values):
            none, nowhere = dict.fromkeys(names, 0.0), dict.fromkeys(names, (0.0, 0.0))
            return SobolIndices(none, none, nowhere, nowhere, number, samples)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DegenerateDataWarning)  # of what has hardly any influence
            drawn = lambda rows: np.stack(_shares(*(v[..., rows] for v in values)))[..., 0]
            spread = bootstrap([np.arange(samples)], drawn, vectorized=False, rng=seed).confidence_interval
    idle = np.all(values[2] == values[0], axis=(1, 2))  # parameters that change nothing in any sample
    named = lambda row: dict(zip(names, np.ravel(row)[: len(names)].tolist(), strict=True))
    ends = lambda k: (np.where(idle, 0.0, end[k]).tolist() for end in (spread.low, spread.high))
    pairs = lambda k: dict(zip(names, zip(*ends(k), strict=True), strict=True))
    return SobolIndices(named(found.first_order), named(found.total_order), pairs(0), pairs(1), number, samples)


def _shares(a: np.ndarray, b: np.ndarray, mixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and total indices by the estimators (b) and (f) of table 2 in Saltelli et al., Comput. Phys. Commun. 181
    (2010) 259: of values at two sets of samples, shape (1, samples), and at the first with one column of the second,
    shape (names, 1, samples). SciPy's own bootstrap of them cannot be seeded."""
    variance = np.var([a, b], axis=(0, -1))
    return np.mean(b * (mixed - a), axis=-1) / variance, 0.5 * np.mean((a - mixed) ** 2, axis=-1) / variance


@dataclasses.dataclass(frozen=True)
class ToleranceBudget:
    """Scatter of an edge or a statistic that the scatter of parameters causes, to first order."""

    name: str
    unit: str
    value: float
    deviation: dict[str, float]
    """Standard deviation due to each parameter, or several that change together, alone [unit]."""
    error: dict[str, float]
    """Standard error of each; 0 of an exact edge."""
    elasticity: dict[str, float]

    @property
    def total(self) -> float:
        """Standard deviation due to all of them, taken as independent."""
        return math.hypot(*self.deviation.values())

    @property
    def unclear(self) -> tuple[str, ...]:
        """Parameters whose deviation has an error, and is within twice of it."""
        return tuple(name for name, x in self.deviation.items() if x <= 2 * self.error[name] > 0)

    def __str__(self) -> str:
        order = sorted(self.deviation.items(), key=lambda item: -item[1])
        total = self.total or 1.0  # without any scatter, nothing is a part of it
        rows = [f"  {n:<24} +-{d:.3g} {self.unit}, {100 * (d / total) ** 2:.0f} % of the variance" for n, d in order]
        half = ndtri(0.975) * self.total
        return "\n".join([f"{self.name} {self.value:.6g} {self.unit}: +-{half:.3g} {self.unit} (95 %)", *rows])


def tolerance_budget(of: Sensitivity | StatisticGradient, deviation: Mapping[str, float]) -> ToleranceBudget:
    """Scatter of an edge from its exact derivatives, or of a statistic from its slopes.

    **Arguments:** edge or statistic; standard deviation of each parameter relative to its value (a tolerance of +-t,
    evenly used, has t/sqrt(3)).

    **Raises:** `ValueError` for a parameter without a derivative, or a negative deviation.
    """
    if isinstance(of, StatisticGradient):
        names, value, unit = of.directions, of.value, of.unit
        slope, error, elasticity = of.by_relative_change, of.by_relative_change_error, of.elasticity
    else:
        names, value, unit = tuple(of.elasticity), of.value_rpm, "rpm"
        elasticity = np.array(list(of.elasticity.values()))
        slope, error = elasticity * value, np.zeros(len(names))
    for name, d in deviation.items():
        if name not in names:
            raise InputError(f"Tolerance of `{name}` must be of one of {', '.join(names)}.")
        if not d >= 0:
            raise InputError(f"Tolerance of `{name}` must not be negative, but {d} was given.")
    at = {name: names.index(name) for name in deviation}
    return ToleranceBudget(
        of.name,
        unit,
        value,
        {n: float(abs(slope[i]) * deviation[n]) for n, i in at.items()},
        {n: float(error[i] * deviation[n]) for n, i in at.items()},
        {n: float(elasticity[i]) for n, i in at.items()},
    )
