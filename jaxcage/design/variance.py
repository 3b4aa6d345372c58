"""Sobol indices: shares of the variance of a value over ranges of parameters, with bootstrap intervals."""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from .._arguments import require_at_least
from .._errors import ArgumentError, InputError
from ..analysis import scatter
from ..lanes import sobol
from ..models import AbstractForcedSystem
from .design_space import Bounds, DesignSpace, Models


NARROW = 0.3
"""Width of an interval [share of the variance] that is narrow enough to rank the parameters."""
RESAMPLES, TAIL = 2000, 2.5
"""Samples of the bootstrap, and the percentage on each side of an interval."""


@dataclasses.dataclass(frozen=True)
class SobolIndices:
    """First-order and total Sobol indices with 95 % bootstrap intervals, and the number of evaluations.
    `scatter` is the share of the motion itself, from the blocks of each run: it belongs to no parameter, but total
    indices contain it. Drift between the blocks counts as scatter."""

    first: dict[str, float]
    total: dict[str, float]
    first_interval: dict[str, tuple[float, float]]
    total_interval: dict[str, tuple[float, float]]
    evaluations: int
    scatter: float = 0.0

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Parameters with an index whose interval lies outside 0 to 1, or is wider than the index and than `NARROW`."""
        rows = [(self.first, self.first_interval), (self.total, self.total_interval)]
        bad = lambda value, pair: not (pair[0] <= 1 and pair[1] >= 0 and pair[1] - pair[0] <= max(abs(value), NARROW))
        return tuple(n for n in self.first if any(bad(value[n], pair[n]) for value, pair in rows))

    def __str__(self) -> str:
        span = lambda pair: f"[{pair[0]:+.2f}, {pair[1]:+.2f}]"
        rows = [
            f"  {n:<24} first {self.first[n]:+.3f} {span(self.first_interval[n])}  "
            f"total {self.total[n]:+.3f} {span(self.total_interval[n])}"
            for n in self.first
        ]
        return "\n".join([f"Sobol indices from {self.evaluations} designs", *rows])


def global_sensitivity(
    system: AbstractForcedSystem,
    vary: Bounds,
    values: Callable[[Models], Float[np.ndarray, " designs"] | Float[np.ndarray, "designs blocks"]],
    *,
    samples: int = 64,
    seed: int = 0,
) -> SobolIndices:
    """Sobol indices of a value of designs, with parameters uniformly distributed between bounds.

    The estimators are (b) and (f) of table 2 in Saltelli et al., Comput. Phys. Commun. 181 (2010) 259. Indices of a
    parameter without any effect are 0.

    **Arguments:** design; bounds [SI] by name; function of a list of designs that returns their values, or those of
    each block of their runs; base samples, a power of 2: samples (parameters + 2) designs are evaluated in one batch.

    **Raises:** `ValueError` for unknown parameters, samples that are no power of 2, or a design without a value.
    """
    require_at_least(0, seed=seed)
    space = DesignSpace.of(system, vary)
    if samples < 2 or samples & (samples - 1):
        raise ArgumentError("samples", said=f"must be a power of 2, but {samples} was given.")
    n = len(vary)
    a, b = np.split(sobol(2 * n, samples, seed), 2, axis=1)
    mixed = [np.where(np.arange(n) == i, b, a) for i in range(n)]
    places = np.concatenate([a, b, *mixed])
    by_block = np.asarray(values(space.models(places))).reshape(len(places), -1)
    if lost := int(np.sum(~np.isfinite(by_block).all(axis=1))):
        raise InputError(f"All designs must have a value, but {lost} of {len(places)} have none.")
    f = by_block.mean(axis=1).reshape(n + 2, samples)
    f = f - f[:2].mean()  # a large mean would be multiplied by the noise of the first-order estimator

    def shares(f: np.ndarray) -> np.ndarray:
        """First-order and total indices from values at both sample sets, and at the first with one column swapped."""
        variance = np.var(f[:2], axis=(0, -1))
        change = f[2:] - f[0]
        both = np.stack([np.mean(f[1] * change, axis=-1), 0.5 * np.mean(change**2, axis=-1)])
        return both / np.where(variance > 0, variance, np.inf)

    rows = np.random.default_rng(seed).integers(samples, size=(RESAMPLES, samples))
    ends = np.percentile(shares(f[:, rows]), [TAIL, 100 - TAIL], axis=-1)
    first, total = (dict(zip(vary, row, strict=True)) for row in shares(f).tolist())
    interval = lambda k: dict(zip(vary, zip(*ends[:, k].tolist(), strict=True), strict=True))
    variance, noise = float(np.var(f)), 0.0
    if by_block.shape[1] > 1 and variance > 0:
        noise = min(1.0, float(np.mean(scatter(by_block) ** 2)) / variance)
    return SobolIndices(first, total, interval(0), interval(1), f.size, noise)
