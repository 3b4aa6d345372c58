"""Derivatives of values by parameters of the design, with standard errors, and tolerance budgets.

Derivatives of statistics come from designs scattered around the given one in mirrored pairs and run from the same
initial states. Half the difference of a pair is free of curvature; least squares over all pairs gives the derivatives,
with errors that allow for any scatter (HC3: J. G. MacKinnon and H. White, J. Econometrics 29 (1985) 305).
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from .._arguments import require_at_least
from .._errors import ArgumentError, InputError
from .._parameters import parameters, replace
from ..analysis import scatter
from ..models import AbstractForcedSystem
from ..orbits import Sensitivity
from ..quantities import notebook_html
from .statistics import STATISTICS, Runs, Statistic, statistics_of


DIRECTIONS = (
    "guidance_gap",
    "pocket_clearance",
    "radial_clearance",
    "eccentricity",
    "cage_mass+cage_inertia",
    "land_width",
    "viscosity_1+viscosity_2",
)
"""Parameters of a whole bearing that a designer changes; those joined by + change together, by the same factor."""
DESIGNS, SPREAD = 64, 0.05


@dataclasses.dataclass(frozen=True)
class Slopes:
    """A value and its derivatives by the logarithms of parameters, or of several that change together [unit], with the
    covariance of value and derivatives, 0 where they are exact."""

    name: str
    unit: str
    value: float
    directions: tuple[str, ...]
    by_relative_change: Float[np.ndarray, " n"]
    covariance: Float[np.ndarray, "1+n 1+n"]

    @classmethod
    def of(cls, edge: "Sensitivity | Slopes") -> "Slopes":
        """Slopes of an exact edge; its error is the change of its speed [rpm] with half the number of steps."""
        if isinstance(edge, Slopes):
            return edge
        covariance = np.zeros((1 + len(edge.elasticity),) * 2)
        covariance[0, 0] = edge.error_rpm**2
        by = edge.value_rpm * np.array(list(edge.elasticity.values()))
        return cls(edge.name, "rpm", edge.value_rpm, tuple(edge.elasticity), by, covariance)

    @property
    def value_error(self) -> float:
        """Standard error of the value."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def elasticity(self) -> Float[np.ndarray, " n"]:
        """Relative change of the value by that of each parameter; NaN if the value is 0."""
        return self.by_relative_change / (self.value or math.nan)

    @property
    def elasticity_error(self) -> Float[np.ndarray, " n"]:
        """Standard errors of the elasticities."""
        return np.array([self.elasticity_of(name)[1] for name in self.directions])

    def change(self, *names: str) -> tuple[float, float]:
        """Derivative, and its error, when parameters change together, such as gap and eccentricity at a fixed ratio.

        **Raises:** `ValueError` for a parameter without a derivative.
        """
        chosen = self._chosen(names)
        return float(chosen @ self.by_relative_change), _deviation(chosen, self.covariance[1:, 1:])

    def elasticity_of(self, *names: str) -> tuple[float, float]:
        """Elasticity, and its error, when parameters change together."""
        (by, _), value = self.change(*names), self.value or math.nan
        weight = np.append(-by / value, self._chosen(names)) / value
        return by / value, _deviation(weight, self.covariance)

    def __str__(self) -> str:
        rows = zip(self.directions, self.elasticity, self.elasticity_error, strict=True)
        head = f"{self.name} {self.value:.4g} ± {self.value_error:.2g} {self.unit}"
        return "\n".join([head, *(f"  {name:<28} {value:+.3f} ± {error:.3f}" for name, value, error in rows)])

    _repr_html_ = notebook_html

    def _chosen(self, names: Sequence[str]) -> Float[np.ndarray, " n"]:
        if unknown := [name for name in names if name not in self.directions]:
            raise ArgumentError("names", said=f"must be among {', '.join(self.directions)}, but has '{unknown[0]}'.")
        return np.array([float(n in names) for n in self.directions])


def _deviation(weight: np.ndarray, covariance: np.ndarray) -> float:
    """Standard deviation of a weighted sum."""
    return float(np.sqrt(np.maximum(weight @ covariance @ weight, 0.0)))


@dataclasses.dataclass(frozen=True)
class StatisticGradient(Slopes):
    """Slopes of a statistic, the mean over all designs and initial states; `drift`, the last block's mean minus the
    first's, and its error, NaN for one block."""

    drift: float
    drift_error: float

    @property
    def settled(self) -> bool:
        """True if the drift is at most twice its error, or 1 % of the value."""
        return abs(self.drift) <= max(2 * self.drift_error, 0.01 * abs(self.value))


@dataclasses.dataclass(frozen=True)
class MeanGradient:
    """Gradients of statistics around a design with some values [SI]: `pairs` of designs that finished, designs that
    `failed`, which are left out with their partners, and `inaccurate` lanes, which are included."""

    statistics: dict[str, StatisticGradient]
    values: dict[str, float]
    pairs: int
    failed: int
    inaccurate: int

    def slope(self, statistic: str, parameter: str) -> tuple[float, float]:
        """Derivative by one parameter alone [unit of the statistic per SI unit], with its error."""
        slope, error = self.statistics[statistic].change(parameter)
        return slope / self.values[parameter], error / abs(self.values[parameter])

    def __str__(self) -> str:
        return "\n".join([f"Elasticities from {self.pairs} pairs of designs", *map(str, self.statistics.values())])

    _repr_html_ = notebook_html


def mean_gradient(
    model: AbstractForcedSystem,
    runs: Runs,
    statistics: Sequence[str] | Mapping[str, Statistic] = STATISTICS,
    *,
    directions: Sequence[str] = DIRECTIONS,
    designs: int = DESIGNS,
    spread: float = SPREAD,
    seed: int = 0,
) -> MeanGradient:
    """Gradients of statistics by parameters of the design, with standard errors.

    **Arguments:** design; settings of the runs, in two blocks to see a drift; statistics, by name or as a mapping;

    - `directions`: parameters that are not 0; those joined by `+` change by the same factor.
    - `designs`: number of designs, even; each parameter is moved up in half of them and down in the others, by half of
        `spread` to all of it. Errors fall with the root of their number, and with a larger spread.
    - `spread`: relative half width of the box of designs, above 0 and at most 0.3. Finer structure is smoothed away;
        the error of the slope is at most a sixth of spread^2 times the third derivative.

    **Returns:** `MeanGradient`. Standard errors come from the scatter of the designs around the fit, and include chaos,
    coexisting motions and third-order curvature. Slopes of the largest exponent, which need not be smooth, are means
    over the box.

    **Raises:** `ValueError` for parameters that are unknown or 0, a box beyond a parameter's range, impossible counts,
    and too few designs that finish.
    """
    require_at_least(0, seed=seed)
    chosen = statistics_of(model, statistics)
    values = moved_parameters(model, [name for d in directions for name in d.split("+")], "directions")
    least = 2 * (len(directions) + 2)
    if designs % 2 or designs < least:
        said = f"must be an even number from {least} on, for so many directions, but {designs} was given."
        raise ArgumentError("designs", said=said)
    if not 0 < spread <= 0.3:
        raise ArgumentError("spread", said=f"must be above 0 and at most 0.3, but {spread:g} was given.")
    moved = spread * _moves(designs // 2, len(directions), seed)
    boxed = moved_designs(model, values, np.concatenate([moved, -moved]), directions)
    swept = runs.run(boxed)
    found = {name: each.samples(boxed, swept).mean(axis=(1, 2)) for name, each in chosen.items()}
    failed = ~np.all([np.isfinite(blocks).all(axis=1) for blocks in found.values()], axis=0)
    whole = ~failed.reshape(2, -1).any(axis=0)
    if whole.sum() <= len(directions) + 1:
        said = f"must be more: only {whole.sum()} pairs came to their ends, for {len(directions)} slopes."
        raise ArgumentError("designs", said=said)
    pairs = {name: blocks.reshape(2, designs // 2, -1)[:, whole] for name, blocks in found.items()}
    about = int(whole.sum()), int(failed.sum()), int((swept["outcome"] == "inaccurate").sum())
    fit = lambda name: gradient_of_pairs(name, chosen[name].unit, tuple(directions), moved[whole], pairs[name])
    return MeanGradient({name: fit(name) for name in chosen}, values, *about)


def moved_parameters(model: AbstractForcedSystem, names: Sequence[str], argument: str) -> dict[str, float]:
    """Values [SI] of parameters to vary. **Raises:** `ValueError` for none, or one that is unknown, 0 or repeated."""
    known = parameters(model)
    if not names:
        raise ArgumentError(argument, said="must hold at least one parameter, but it is empty.")
    for name in names:
        if name not in known or not float(known[name]):
            said = f"must hold parameters of the design that are not 0, but has '{name}'."
            raise ArgumentError(argument, said=said)
        if names.count(name) > 1:
            raise ArgumentError(argument, said=f"must name each parameter once, but has '{name}' twice.")
    return {name: float(known[name]) for name in names}


def moved_designs(
    model: AbstractForcedSystem,
    values: Mapping[str, float],
    moved: Float[np.ndarray, "designs n"],
    directions: Sequence[str] | None = None,
) -> list[AbstractForcedSystem]:
    """Designs with relative changes of parameters; those joined by + change together."""
    names = directions or tuple(values)
    changed = lambda row: {n: values[n] * (1 + by) for d, by in zip(names, row, strict=True) for n in d.split("+")}
    return [replace(model, **changed(row)) for row in moved.tolist()]


def _moves(pairs: int, directions: int, seed: int) -> Float[np.ndarray, "pairs directions"]:
    """Random changes of size 0.5 to 1, half of them positive in each column, in random order; of full rank."""
    rng, even = np.random.default_rng(seed), np.resize([1.0, -1.0], pairs)
    while True:
        found = np.stack([rng.permutation(even) * rng.uniform(0.5, 1.0, pairs) for _ in range(directions)], axis=-1)
        if np.linalg.matrix_rank(found) == directions:
            return found


def gradient_of_pairs(
    name: str,
    unit: str,
    directions: tuple[str, ...],
    moved: Float[np.ndarray, "pairs n"],
    blocks: Float[np.ndarray, "2 pairs blocks"],
) -> StatisticGradient:
    """Slopes of a statistic by least squares, from mirrored pairs of designs.

    **Arguments:** name and unit of the statistic; names of the directions; relative changes of the first design of each
    pair, those of the second being the opposite; the statistic of the first and of the second designs in each block.
    """
    both = blocks.mean(axis=-1)
    half = (both[0] - both[1]) / 2
    drift = (blocks[..., -1] - blocks[..., 0]).mean(axis=0) if blocks.shape[-1] > 1 else np.full(len(half), np.nan)
    bread = np.linalg.inv(moved.T @ moved) @ moved.T
    slopes = bread @ half
    left = half - moved @ slopes
    weighted = bread * (left / (1 - np.einsum("ij,ji->i", moved, bread)))  # HC3
    each = both.mean(axis=0)
    covariance = np.zeros((1 + slopes.size,) * 2)
    covariance[0, 0], covariance[1:, 1:] = scatter(each) ** 2, weighted @ weighted.T
    known = float(each.mean()), directions, slopes, covariance
    return StatisticGradient(name, unit, *known, float(drift.mean()), float(scatter(drift)))


@dataclasses.dataclass(frozen=True)
class ToleranceBudget:
    """First-order scatter of an edge or a statistic due to that of parameters: standard `deviation` for each parameter
    alone, or for several that change together, and its standard `error` [unit]."""

    name: str
    unit: str
    value: float
    deviation: dict[str, float]
    error: dict[str, float]

    @property
    def total(self) -> float:
        """Standard deviation due to all parameters, taken as independent."""
        return math.hypot(*self.deviation.values())

    def __str__(self) -> str:
        order = sorted(self.deviation.items(), key=lambda item: -item[1])
        total = self.total or 1.0  # avoids 0/0 without any scatter
        size = lambda d: f"{d:.3g} {self.unit}"
        rows = [f"  {n:<24} {size(d)}, {100 * (d / total) ** 2:.0f} % of the variance" for n, d in order]
        head = f"{self.name} {self.value:.6g} {self.unit}: standard deviation {size(self.total)}"
        return "\n".join([head, *rows])


def tolerance_budget(of: Sensitivity | Slopes, deviation: Mapping[str, float]) -> ToleranceBudget:
    """First-order scatter of an edge from its exact derivatives, or of a statistic from its slopes.

    **Arguments:** edge or statistic; standard deviation of each parameter over its value (t/sqrt(3) for a uniform ±t).

    **Raises:** `ValueError` for a parameter without a derivative, or a negative deviation.
    """
    slopes = Slopes.of(of)
    for name, d in deviation.items():
        if name not in slopes.directions:
            raise InputError(f"Tolerance of `{name}` must be of one of {', '.join(slopes.directions)}.")
        if not d >= 0:
            raise InputError(f"Tolerance of `{name}` must not be negative, but {d} was given.")
    by, error = ({n: abs(slopes.change(n)[k]) * d for n, d in deviation.items()} for k in (0, 1))
    return ToleranceBudget(slopes.name, slopes.unit, slopes.value, by, error)
