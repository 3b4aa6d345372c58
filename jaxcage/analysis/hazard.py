"""Regression of the rate at which lanes leave chaos on speed and design, from their escape times.

At a constant escape rate kappa, chaos survives a block of b revolutions with probability exp(-kappa b). With log kappa
linear in the covariates, each observed block of a lane is a Bernoulli trial with a complementary log-log link
(P. McCullagh and J. A. Nelder, Generalized Linear Models, 2nd ed. 1989, chapter 4); lanes that are chaotic to the end
are censored.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError


FEWEST_ESCAPES = 10
"""Smallest number of escapes, and of blocks survived, for which slopes are estimated."""
BINS = 8
"""Groups of lanes, by their first covariate, in which observed and expected escapes are compared."""


class Hazard(NamedTuple):
    """Fitted law log kappa = intercept + slope . x, with kappa in escapes per revolution."""

    coefficients: Float[np.ndarray, " 1+n"]
    """Intercept, then the slopes."""
    covariance: Float[np.ndarray, "1+n 1+n"]
    """Covariance of the coefficients from the scatter of the lanes (P. J. Huber 1967), robust to a misspecified law."""
    escapes: int
    lanes: int
    p_value: float
    """Probability of a misfit at least as large as observed, in groups of lanes by the first covariate."""


def hazard(
    times: Float[np.ndarray, " lanes"],
    horizon: float | int,
    x: Float[np.ndarray, "lanes n"],
    *,
    block: float | int,
    t0: float | int = 0,
) -> Hazard:
    """Fit the law to escape times in whole blocks by maximum likelihood.

    **Arguments:** escape time of each lane [revolutions], infinity for never, NaN for failed; time to which lanes were
    followed; covariates of each lane, of order one; resolution of the escape times, and time left out [revolutions].
    Lanes that are calm at t0 or failed do not count.

    **Raises:** `ValueError` with fewer than ten escapes, or fewer than ten blocks survived.
    """
    at_risk = times > t0  # false for NaN
    late, x = times[at_risk], np.asarray(x, dtype=float)[at_risk]
    escaped = late <= horizon
    survived = np.where(escaped, late - block - t0, horizon - t0) / block
    if min(np.sum(escaped), np.sum(survived)) < FEWEST_ESCAPES:
        raise ArgumentError(
            "times",
            said=f"must have at least {FEWEST_ESCAPES} escapes after {t0:g} revolutions and as many blocks survived; "
            f"{np.sum(escaped)} of {late.size} chaotic lanes escaped, and {np.sum(survived):.0f} blocks were survived.",
        )
    design = np.column_stack([np.ones(late.size), x])
    guess = np.zeros(design.shape[1])
    guess[0] = np.log(np.sum(escaped) / np.sum(survived + escaped) / block)
    from scipy.optimize import minimize  # takes half a second to load

    lanes = lambda beta: _costs_of_lanes(design @ beta, survived, escaped, block)
    curvature = lambda beta: design.T @ (lanes(beta)[2][:, None] * design)
    best = minimize(
        lambda beta: np.sum(lanes(beta)[0]),
        guess,
        jac=lambda beta: lanes(beta)[1] @ design,
        hess=curvature,
        method="trust-exact",
        tol=1e-8,
    ).x
    inverse, each = np.linalg.pinv(curvature(best)), lanes(best)[1][:, None] * design
    fits = _probability_of_fit(design @ best, survived, escaped, block, along=design[:, 1])
    return Hazard(best, inverse @ (each.T @ each) @ inverse, int(np.sum(escaped)), late.size, fits)


def _costs_of_lanes(
    log_rate: np.ndarray, survived: np.ndarray, escaped: np.ndarray, block: float | int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Negative log-likelihood of each lane, and its first and second derivatives by log kappa."""
    rate = block * np.exp(np.clip(log_rate, -500.0, 60.0))
    gone = -np.expm1(-rate)
    left = rate * np.exp(-rate) / gone
    cost = rate * survived - escaped * np.log(gone)
    return cost, rate * survived - escaped * left, rate * survived + escaped * left * (left + rate - 1)


def _probability_of_fit(
    log_rate: np.ndarray, survived: np.ndarray, escaped: np.ndarray, block: float | int, along: np.ndarray
) -> float:
    """P-value of a chi-squared test of the escapes in groups of lanes by `along`, with equal expected numbers."""
    expected = -np.expm1(-block * np.exp(log_rate)) * (survived + escaped)
    order = np.argsort(along)
    part = np.minimum((np.cumsum(expected[order]) / np.sum(expected) * BINS).astype(int), BINS - 1)
    of = lambda y: np.bincount(part, weights=y[order], minlength=BINS)
    misfit = np.sum((of(escaped.astype(float)) - of(expected)) ** 2 / np.maximum(of(expected), 1e-9))
    from scipy.stats import chi2  # takes half a second to load

    return float(chi2.sf(misfit, BINS - 2))
