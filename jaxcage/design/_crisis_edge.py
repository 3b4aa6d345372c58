"""Edges with error bars from lanes: what all of them tell, and those that a crisis makes."""

import abc
import dataclasses
import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from .._errors import ArgumentError
from .._notebook import notebook_html
from ..analysis import Crisis


LIKELY = 0.001
"""Probability below which a law does not fit."""
STEEPEST = 5.0
"""A larger power cannot be told from an exponential, which diverges nowhere."""
ENOUGH = 20
"""Escapes from which a law is still fitted."""


@dataclasses.dataclass(frozen=True)
class AbstractStatisticalEdge(abc.ABC):
    """An edge told by many lanes of many designs, and how it moves with parameters."""

    speed_rpm: float
    names: tuple[str, ...]
    elasticity: Float[np.ndarray, " n"]
    """Relative change of the edge by that of each parameter."""
    covariance: Float[np.ndarray, "1+n 1+n"]
    """Of the speed [rpm], then of the elasticities."""
    values: Float[np.ndarray, " n"]
    """Of the parameters [SI]."""

    @property
    @abc.abstractmethod
    def status(self) -> str:
        """`converged`, or why the numbers should not be used."""

    @property
    def slope(self) -> Float[np.ndarray, " n"]:
        """[rpm per unit of the parameter]."""
        return self.elasticity * self.speed_rpm / self.values

    @property
    def standard_error_rpm(self) -> float:
        """Of the speed."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def elasticity_error(self) -> Float[np.ndarray, " n"]:
        """Standard error of each elasticity."""
        return np.sqrt(np.diag(self.covariance)[1:])

    def sum_of(self, *names: str) -> tuple[float, float]:
        """Elasticity by several parameters that change together, such as gap and eccentricity at a fixed ratio, with
        its standard error.

        **Raises:** `ValueError` for a parameter that the edge was not asked about.
        """
        if unknown := [name for name in names if name not in self.names]:
            raise ArgumentError("names", said=f"must be among {', '.join(self.names)}, but has '{unknown[0]}'.")
        weight = np.array([0.0, *(float(n in names) for n in self.names)])
        return float(weight[1:] @ self.elasticity), math.sqrt(weight @ self.covariance @ weight)

    def _rows(self) -> list[str]:
        each = zip(self.names, self.elasticity, self.elasticity_error, strict=True)
        return [f"  {name:<28} {value:+.3f} +- {error:.3f}" for name, value, error in each]


@dataclasses.dataclass(frozen=True)
class CrisisEdge(AbstractStatisticalEdge):
    """Where the mean life of chaos diverges, extrapolated by a power law; no horizon enters into it.

    The law holds near the crisis, and how near nobody knows: it is fitted again to the lanes with the nearer half of
    the escapes. By how much the answers differ counts in all errors, and the interval holds those of both fits.
    """

    interval_rpm: tuple[float, float]
    """Of 95 %, for the speed; not symmetric."""
    reach_rpm: float
    """Half the range of the speeds of the lanes."""
    fit: Crisis
    nearer: Crisis
    """Of the lanes that count, and of those with the nearer half of the escapes."""

    @property
    def status(self) -> str:
        if min(self.fit.p_value, self.nearer.p_value) < LIKELY:
            return "no power law: the escapes do not follow one here"
        if self.fit.power > STEEPEST:
            return "no power law: the mean life grows as fast as an exponential"
        if not np.ptp(self.interval_rpm) < self.reach_rpm:
            return "not told: where the mean life diverges is as uncertain as the lanes reach"
        return "converged"

    def __str__(self) -> str:
        low, high = self.interval_rpm
        power = f"mean life ~ distance^-({self.fit.power:.2f} +- {self.fit.power_error:.2f})"
        counted = f"{self.fit.escapes} of {self.fit.lanes} chaotic lanes escaped, p = {self.fit.p_value:.2g}"
        head = f"crisis at {self.speed_rpm:.0f} ({low:.0f} to {high:.0f}) rpm, {power}, elasticities ({counted}"
        return "\n".join([f"{head}; {self.status})", *self._rows()])

    _repr_html_ = notebook_html


def crisis_edge(
    fit_of: Callable[[Bool[np.ndarray, " lanes"]], Crisis],
    away: Float[np.ndarray, " lanes"],
    escaped: Bool[np.ndarray, " lanes"],
    names: tuple[str, ...],
    values: Float[np.ndarray, " n"],
    reach_rpm: float,
) -> CrisisEdge:
    """The edge of a crisis from the lanes nearest to it: the half with the farther escapes is left out as long as the
    law does not fit, and enough of them stay.

    **Arguments:** the law of some of the lanes, with slopes by relative changes of the parameters; how far each lane is
    on the side of the transients; which escaped; the parameters; half the range of the lanes' speeds.
    """
    counted = np.ones(away.size, dtype=bool)
    fit = fit_of(counted)
    while True:
        half = away <= np.median(away[counted & escaped])
        nearer = fit_of(half)
        if fit.p_value >= LIKELY or nearer.escapes < 2 * ENOUGH:
            break
        fit, counted = nearer, half
    elasticity, other = fit.slope / fit.speed, nearer.slope / nearer.speed
    jacobian = np.eye(1 + len(names))
    jacobian[1:, 0], jacobian[1:, 1:] = -elasticity / fit.speed, np.eye(len(names)) / fit.speed
    moved = np.append(nearer.speed - fit.speed, other - elasticity)
    covariance = jacobian @ fit.covariance @ jacobian.T + np.outer(moved, moved)
    low, high = zip(fit.interval, nearer.interval, strict=True)
    interval = min(low), max(high)
    return CrisisEdge(fit.speed, names, elasticity, covariance, values, interval, reach_rpm, fit, nearer)
