"""Mean life of chaos, with an error, from the times at which lanes leave it: an attractor or a chaotic transient.

Lanes leave a chaotic set that is not an attractor one by one, after a short time t0 at a rate that no longer depends on
their initial states: of N lanes N exp(-t/tau) remain after t. The escapes yield an estimate of tau; without escapes
only a lower bound of tau is known. No finite run proves an attractor. Lanes that are periodic or quasi-periodic, or
approach such a motion, are called calm.

Y.-C. Lai and T. Tel, Transient Chaos (Springer 2011); E. G. Altmann, J. S. E. Portela and T. Tel, Leaking chaotic
systems, Rev. Mod. Phys. 85 (2013) 869-918.

An escape is only known to lie within a block of b revolutions. With E revolutions survived in whole blocks and n
escapes the maximum-likelihood estimate of the mean life is

    tau = b / log(1 + n b / E),

which is E/n for short blocks, and E/n + b/2 to first order: b/2 is the part of its last block that a lane survived. It
is the inverse 1/kappa of the escape rate in continuous time; lanes that survive a block with probability q have
kappa = -log(q) / b. For an iterated map b = 1. A delay between an escape and its detection does not matter if its
distribution does not change with time. Lanes must be independent: their initial states must differ by more than
rounding.

`hazard` regresses this rate on speed and design. With log kappa linear in the covariates, each observed block of a lane
is a Bernoulli trial with a complementary log-log link (P. McCullagh and J. A. Nelder, Generalized Linear Models, 2nd
ed. 1989, chapter 4); lanes that are chaotic to the end are censored.

Limits. A lane that leaves one chaotic set for another does not count as escaped, and one in a laminar phase at its very
end may be counted as escaped. Weak chaos needs long blocks.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import scipy.special
from jaxtyping import Bool, Float

from .._errors import ArgumentError
from ..quantities import notebook_html
from .labels import CHAOS_THRESHOLD, TORUS_THRESHOLD, closing_period, scatter


CONFIRM = 8
"""Number of blocks at the end of a run in which a lane must be calm to count as escaped."""
FEW = 10
"""Smallest number of escapes for which a standard error is reported instead of an interval."""


def calm_threshold(block: int) -> float:
    """Largest mean growth per revolution at which a block of `block` revolutions counts as calm (not chaotic).

    On a periodic orbit or a torus the length of a tangent vector varies by a factor that is independent of the length
    of the block; e^2 is allowed for, a mean growth of 2/block. In chaos with exponent lambda the mean growth scatters
    about lambda and is above the threshold in most blocks if lambda * block exceeds 4; weaker chaos needs longer ones.
    """
    return max(CHAOS_THRESHOLD, 2 / block)


def calm_at_the_end(
    strobe: Float[np.ndarray, "lanes keep dim"],
    scale: Float[np.ndarray, "*#lanes dim"],
    growth: Float[np.ndarray, "lanes blocks"],
    block: int,
) -> Bool[np.ndarray, " lanes"]:
    """True for lanes that end on a periodic orbit or a torus, or approach one.

    A lane is calm at the end if its last strobe states close with a period up to 8, or if the exponent of its last
    blocks is at most zero within its error: the larger of two standard errors and the resolution of these blocks.

    **Arguments:** last strobe states; scale of each component; mean growth per revolution of each block; revolutions
    per block.
    """
    end = growth[:, -CONFIRM:]
    exponent = np.mean(end, axis=1)
    error = scatter(end, axis=1) if end.shape[1] > 1 else np.zeros(exponent.shape)
    unknown = max(TORUS_THRESHOLD, 1 / (block * end.shape[1]))
    return (closing_period(strobe, scale) > 0) | (exponent <= np.maximum(2 * error, unknown))  # false for NaN


def escape_times(
    growth: Float[np.ndarray, "lanes blocks"],
    calm_end: Bool[np.ndarray, " lanes"],
    block: int,
    *,
    failed: Bool[np.ndarray, " lanes"] | None = None,
) -> tuple[Float[np.ndarray, " lanes"], int]:
    """Escape time of each lane, after which it is calm until the end of the run, and the horizon.

    Single blocks of a chaotic lane may look calm: with an exponent of 0.15 and a scatter of 0.1 between blocks of 25
    revolutions, one in four does. So a lane escapes after its last block that is not calm, and only if it is calm in
    the last `CONFIRM` blocks, and at the end by `calm_end`. A chaotic lane of which a fraction p of the blocks looks
    calm is counted as escaped with a probability of at most p**CONFIRM. If p is near 1, chaos is too weak for this
    length of block, and lanes seem to escape too early.

    The horizon, to which lanes are followed, is the beginning of those last blocks: a lane that escapes later is
    chaotic at the horizon.

    **Arguments:**

    - `growth`: mean logarithmic growth per revolution (the windowed exponent) of each block.
    - `calm_end`: True for lanes that end on a periodic orbit or a torus (`calm_at_the_end`).
    - `block`: revolutions per block.
    - `failed`: lanes that did not finish; those with growth that is not finite have failed, too.

    **Returns:** for each lane the revolutions from the first block to its escape, a multiple of `block`: 0 for one that
    is always calm, infinity for one that is chaotic at the horizon, NaN for one that failed; and the horizon
    [revolutions].
    """
    lanes, blocks = growth.shape
    lost = ~np.all(np.isfinite(growth), axis=1) | (np.zeros(lanes, dtype=bool) if failed is None else failed)
    restless = growth > calm_threshold(block)
    last = np.max(np.where(restless, np.arange(1, blocks + 1), 0), axis=1)
    escaped = calm_end & (last <= blocks - CONFIRM)
    times = np.where(escaped, last * float(block), np.inf)
    return np.where(lost, np.nan, times), (blocks - CONFIRM) * block


@dataclasses.dataclass(frozen=True)
class Survival:
    """Counts of escapes from chaos after t0, and the estimated mean life."""

    lanes: int
    """Number of lanes that finished."""
    failed: int
    """Number of lanes that failed, and are left out."""
    calm: int
    """Number of lanes that were calm at t0; not escapes, since they may never have been in the chaotic set."""
    escapes: int
    """Number of lanes that were chaotic at t0 and calm at the horizon."""
    survived: float
    """Revolutions survived after t0 in whole blocks, summed over lanes."""
    t0: float
    """Revolutions left out at the beginning."""
    horizon: float
    """Revolutions to which lanes were followed."""
    block: float
    """Resolution of the escape times [revolutions]; 0 if they are known exactly."""

    @property
    def chaotic(self) -> int:
        """Number of lanes that were chaotic at t0."""
        return self.lanes - self.calm

    @property
    def kind(self) -> str:
        """Kind of chaos: `transient`, lanes escaped; `chaotic`, none did; `coexisting`, none did, but some were calm at
        t0; `calm`, none was chaotic at t0."""
        if not self.chaotic:
            return "calm"
        if self.escapes:
            return "transient"
        return "coexisting" if self.calm else "chaotic"

    @property
    def remaining(self) -> float:
        """Fraction of the lanes chaotic at t0 that are chaotic at the horizon; NaN without any."""
        return 1 - self.escapes / self.chaotic if self.chaotic else math.nan

    @property
    def rate(self) -> float:
        """Escape rate kappa [1/revolution]: 0 without escapes, infinite if all escaped in the first block."""
        n, b, survived = self.escapes, self.block, self.survived
        if not n:
            return 0.0
        if not survived:
            return math.inf
        return math.log1p(n * b / survived) / b if b else n / survived

    @property
    def mean_life(self) -> float:
        """Mean life tau = 1/kappa [revolutions]: infinite without escapes."""
        return _inverse(self.rate)

    @property
    def standard_error(self) -> float:
        """Standard error of the mean life [revolutions], NaN if unknown: from the Fisher information of the counts of
        blocks, relative sinh(x/2)/(x/2) / sqrt(n), with x the block in units of the mean life."""
        if not self.escapes or not self.survived:
            return math.nan
        half = self.block * self.rate / 2
        return self.mean_life * (math.sinh(half) / half if half else 1.0) / math.sqrt(self.escapes)

    @property
    def interval(self) -> tuple[float, float]:
        """Confidence interval (95 %) for the mean life [revolutions], for any number of escapes.

        From the exact limits of a Poisson count (F. Garwood, Biometrika 28 (1936) 437), or of a binomial one if escapes
        are only known by the block (C. J. Clopper and E. S. Pearson, Biometrika 26 (1934) 404).
        """
        return self._limit(0.975), self._limit(0.025)

    @property
    def lower_bound(self) -> float:
        """One-sided lower limit (95 %) of the mean life [revolutions]: E/3 without escapes."""
        return self._limit(0.95) if self.escapes else self.survived / 3

    def _limit(self, level: float) -> float:
        """Limit of the mean life, from the quantile `level` of the escape rate: a high rate is a short life."""
        n = self.escapes
        if not self.chaotic or (n == 0 and level < 0.5):
            return math.inf if self.chaotic else math.nan
        count = n + 1 if level > 0.5 else n
        if not self.block:
            return _inverse(float(scipy.special.gammaincinv(count, level)) / self.survived) if self.survived else 0.0
        whole = self.survived / self.block
        if not whole and level > 0.5:
            return 0.0
        share = float(scipy.special.betaincinv(count, whole + (level < 0.5), level))
        return _inverse(-math.log1p(-share) / self.block)

    def __str__(self) -> str:
        watched = f"{self.horizon - self.t0:.10g} revolutions"
        beside = [(self.calm, f"{self.calm} were calm after {self.t0:.10g}"), (self.failed, f"{self.failed} failed")]
        others = "".join(f"; {text}" for count, text in beside if count)
        if self.kind == "calm":
            failed = f"; {self.failed} failed" if self.failed else ""
            return f"none of {self.lanes} lanes was chaotic after {self.t0:.10g} revolutions{failed}"
        if not self.escapes:
            bound = f"mean life > E/3 = {_number(self.lower_bound)} revolutions"
            return f"none of {self.chaotic} lanes escaped in {watched} ({bound}){others}"
        n, (low, high) = self.escapes, self.interval
        counts = f"({n} of {self.chaotic} lanes escaped in {watched})"
        if not self.survived:
            return f"transient, mean life below {_number(high)} revolutions {counts}{others}"
        error = f"± {_number(self.standard_error)}" if n >= FEW else f"({_number(low)} to {_number(high)})"
        return f"transient, mean life {_number(self.mean_life)} {error} revolutions {counts}{others}"

    _repr_html_ = notebook_html


def survival(
    times: Float[np.ndarray, " lanes"], horizon: float | int, *, t0: float | int = 0, block: float | int = 0
) -> Survival:
    """Estimate the mean life from escape times by censored maximum likelihood.

    Lanes that failed, or are calm at t0, are left out. Those that escape after the horizon, or never, are censored at
    the horizon. If lanes start off the chaotic set, t0 must be several e-foldings of their approach to it.

    **Arguments:**

    - `times`: escape time of each lane [revolutions], infinity for never, NaN for failed, as from `escape_times`; for a
        map, the number of the first iterate that is outside.
    - `horizon`: time to which lanes were followed [revolutions].
    - `t0`: time left out at the beginning [revolutions].
    - `block`: resolution of the times: an escape at t happened in (t - block, t]; 0 for exact times, 1 for a map.

    **Raises:** `ValueError` for a horizon not beyond t0, and for a t0 or times that do not end a block.
    """
    if not 0 <= t0 < horizon:
        raise ArgumentError("t0", said=f"must lie between 0 and the horizon of {horizon} revolutions, but is {t0}.")
    after = times[np.isfinite(times)]
    if block and np.any(np.concatenate([after, [t0, horizon]]) % block):
        raise ArgumentError("times", "horizon", "t0", said=f"must be multiples of the block of {block} revolutions.")
    known = times[~np.isnan(times)]
    risk = known[known > t0]
    escaped = risk <= horizon
    survived = np.where(escaped, risk - block, horizon) - t0
    return Survival(
        lanes=known.size,
        failed=times.size - known.size,
        calm=known.size - risk.size,
        escapes=int(np.sum(escaped)),
        survived=float(np.sum(survived)),
        t0=float(t0),
        horizon=float(horizon),
        block=float(block),
    )


def _inverse(x: float) -> float:
    return 1 / x if x else math.inf


def _number(x: float) -> str:
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"


# --- the escape rate as a function of speed and design ---------------------------------------------------------------


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
