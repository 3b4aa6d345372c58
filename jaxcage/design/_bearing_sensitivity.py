"""What parameters of its cage do to a measure of the whole bearing: over ranges, and within tolerances."""

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from .._errors import ArgumentError, InputError
from ..analysis import STATISTIC_UNITS
from ..models import BearingModel
from ._bearing_design import COMPARED, TERMS, BearingObjective, BearingRuns
from ._bearing_gradient import BearingGradient
from ._objective import DesignSpace
from ._scatter import SobolIndices, sobol_of


BEARING_MEASURES: Mapping[str, tuple[str, ...]] = {
    **{name: sums[0] for name, sums in TERMS.items() if len(sums) == 1 and sums[0][0] in COMPARED},
    **{name: (name,) for name in COMPARED},
}
"""Measure -> statistics that it is the sum of."""


def bearing_measure(name: str) -> tuple[str, ...]:
    """Statistics that a measure is the sum of.

    **Raises:** `ValueError` for a measure that there is not.
    """
    if name not in BEARING_MEASURES:
        raise ArgumentError("measure", said=f"must be one of {', '.join(BEARING_MEASURES)}, but '{name}' was given.")
    return BEARING_MEASURES[name]


def bearing_sensitivity(
    model: BearingModel,
    vary: Mapping[str, tuple[float, float]],
    runs: BearingRuns,
    measure: str = "wear",
    *,
    samples: int = 32,
    seed: int = 0,
) -> tuple[SobolIndices, float]:
    """Sobol indices of a measure of the whole bearing, parameters drawn evenly between their bounds.

    **Arguments:** bearing; bounds [SI] by name; how designs are run, all from the same drawn starts; one of
    `BEARING_MEASURES`; base samples, a power of 2: samples (parameters + 2) designs are run; their seed.

    **Returns:** the indices, and the share of the variance that is scatter of the motion itself, by the two halves of
    each run: so much belongs to no parameter, and total indices contain it. Drift between the halves counts as scatter.

    **Raises:** `ValueError` for samples that are no power of 2, a measure that there is not, designs that fail.
    """
    space = DesignSpace.of(model, vary)
    objective = BearingObjective(runs, dict.fromkeys(bearing_measure(measure), 1.0))
    halves: list[np.ndarray] = []

    def evaluate(places: np.ndarray) -> np.ndarray:
        found = objective.halves(space, places.T)
        if lost := int(np.sum(~np.isfinite(found).all(axis=1))):
            raise InputError(f"The {measure} could not be had in {lost} of {len(found)} designs: a run failed there.")
        halves.append(found)
        return found.mean(axis=1)[None]

    shares = sobol_of(evaluate, space.names, samples=samples, seed=seed)
    every = np.concatenate(halves)
    variance = float(np.var(every.mean(axis=1)))
    scatter = float(np.mean(np.diff(every, axis=1) ** 2)) / 4
    return shares, min(1.0, scatter / variance) if variance > 0 else 0.0


@dataclasses.dataclass(frozen=True)
class BearingBudget:
    """Scatter of a measure of the whole bearing that tolerances of its parameters cause, to first order."""

    measure: str
    unit: str
    value: float
    """In the mean over the designs around this one."""
    deviation: dict[str, float]
    """Standard deviation due to each parameter, or several that change together, alone."""
    error: dict[str, float]
    """Standard error of each."""
    elasticity: dict[str, float]

    @property
    def total(self) -> float:
        """Standard deviation due to all of them, taken as independent."""
        return math.hypot(*self.deviation.values())

    @property
    def unclear(self) -> tuple[str, ...]:
        """Parameters whose deviation is within twice its error."""
        return tuple(name for name, x in self.deviation.items() if x <= 2 * self.error[name])


def bearing_budget(found: BearingGradient, measure: str, relative: float) -> BearingBudget:
    """Scatter of a measure from the slopes of `bearing_gradient`.

    **Arguments:** gradient, with the statistics of the measure; one of `BEARING_MEASURES`; standard deviation of each
    parameter relative to its value (a tolerance of +-t, evenly used, has t/sqrt(3)).

    **Returns:** `BearingBudget`. Errors of a sum of statistics are added, and so are at most that.

    **Raises:** `ValueError` for a deviation that is negative, or a gradient without these statistics.
    """
    if not relative >= 0:
        raise ArgumentError("relative", said=f"must be at least 0, but {relative:g} was given.")
    summed = bearing_measure(measure)
    if missing := [name for name in summed if name not in found.statistics]:
        raise ArgumentError("found", said=f"must have the statistic {missing[0]}.")
    parts, unit = [found.statistics[name] for name in summed], STATISTIC_UNITS[summed[0]]
    value, names = sum(part.value for part in parts), parts[0].directions
    slope = np.sum([part.by_relative_change for part in parts], axis=0)
    error = np.sum([part.by_relative_change_error for part in parts], axis=0)
    named = lambda row: dict(zip(names, row.tolist(), strict=True))
    elasticity = slope / value if value else np.full(len(names), np.nan)
    deviation = named(relative * np.abs(slope))
    return BearingBudget(measure, unit, value, deviation, named(relative * error), named(elasticity))
