"""Telling an attractor from a chaotic transient: how long lanes stay chaotic, with an error.

Lanes that start near a chaotic set which attracts nothing for ever leave it one by one, at a rate that after a short
time t0 no longer depends on where they came from: of N lanes N exp(-t/tau) are left after t. Followed for long enough,
they tell tau; where none leaves, a lower bound of tau is all that they tell. No run proves an attractor.

Y.-C. Lai and T. Tel, Transient Chaos (Springer 2011); E. G. Altmann, J. S. E. Portela and T. Tel, Leaking chaotic
systems, Rev. Mod. Phys. 85 (2013) 869-918.

Lanes are seen block by block, so that an escape is only known to lie within a block of b revolutions. Of E revolutions
survived in whole blocks and n escapes the most likely mean life is

    tau = b / log(1 + n b / E),

which is E/n for short blocks, and E/n + b/2 to first order: what those that escaped survived of their last block. It is
the inverse 1/kappa of the escape rate of continuous time; lanes that survive a block with probability q have
kappa = -log(q) / b. For an iterated map b = 1. A delay between an escape and the sign of it does not matter, as long as
it is the same, or as random, early and late. Lanes must be independent: initial states spread over states, not over
rounding errors.

Limits. A lane that leaves one chaotic set for another has not escaped here, and one in a laminar phase at its very end
may seem to have. Weak chaos needs long blocks.
"""

import dataclasses
import math

import numpy as np
import scipy.special
from jaxtyping import Bool, Float

from .._errors import ArgumentError
from ..quantities import notebook_html
from .labels import CHAOS_THRESHOLD, TORUS_THRESHOLD, closing_period, scatter


CONFIRM = 8
"""Blocks at the end of a run in which a lane must be calm if it is to have escaped."""
FEW = 10
"""With fewer escapes an interval is given instead of a standard error."""


def calm_threshold(block: int) -> float:
    """Largest mean growth per revolution of a calm block of so many revolutions.

    On a periodic orbit or a torus the length of a tangent vector goes up and down by a factor that does not depend on
    how long the block is; e^2 is allowed for, a mean growth of 2/block. Chaos of exponent lambda grows by lambda, with
    a scatter: it shows in most blocks where lambda * block exceeds 4. Where it is weaker, blocks must be longer.
    """
    return max(CHAOS_THRESHOLD, 2 / block)


def calm_at_the_end(
    strobe: Float[np.ndarray, "lanes keep dim"],
    scale: Float[np.ndarray, "*#lanes dim"],
    growth: Float[np.ndarray, "lanes blocks"],
    block: int,
) -> Bool[np.ndarray, " lanes"]:
    """Lanes that end on a periodic orbit or a torus, or on their way to one.

    A lane is calm at the end if its last strobe states close with a period up to 8, or if the exponent of its last
    blocks is zero or below within its error: two standard errors, and what blocks of that length cannot tell.

    **Arguments:** the last strobe states; characteristic magnitudes of the state; mean growth per revolution of each
    block; revolutions per block.
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
    """After how many revolutions each lane stays calm to the end of the run.

    Chaos dips: with an exponent of 0.15 and a scatter of 0.1 between blocks of 25 revolutions one block in four cannot
    be told from calm. So a lane escapes after the last block that is not calm, and only if it is calm at the end by its
    label too, and in the last `CONFIRM` blocks. A chaotic lane of which a share p of the blocks dips passes for escaped
    with a probability of p**CONFIRM at most.
    Where p comes near 1, chaos is too weak for the blocks, and lanes seem calm long before they are.

    What happens in those last blocks is not judged: the time to which lanes are followed, the horizon, ends before
    them. A lane that escapes later was still chaotic at the horizon.

    **Arguments:**

    - `growth`: mean logarithmic growth per revolution (the windowed exponent) of each block.
    - `calm_end`: lanes that end on a periodic orbit or a torus (`calm_at_the_end`).
    - `block`: revolutions per block.
    - `failed`: lanes that did not finish; those with growth that is not finite have failed, too.

    **Returns:** for each lane the revolutions after which it is calm, counted from the first block, a multiple of
    `block`: 0 for one that always is, infinity for one that is chaotic at the horizon, NaN for one that failed; and the
    horizon [revolutions].
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
    """How long lanes stayed chaotic after t0: escapes counted, mean life estimated."""

    lanes: int
    """Lanes that finished."""
    failed: int
    """Lanes that did not, and are left out."""
    calm: int
    """Lanes that were calm at t0: no escapes, for nothing says that they ever were in the chaotic set."""
    escapes: int
    """Lanes that were chaotic at t0 and calm at the horizon."""
    survived: float
    """Revolutions survived after t0 in whole blocks, summed over lanes."""
    t0: float
    """Revolutions left out at the beginning."""
    horizon: float
    """Revolutions to which lanes were followed."""
    block: float
    """Revolutions within which an escape is known; 0 where it is known exactly."""

    @property
    def chaotic(self) -> int:
        """Lanes that were chaotic at t0."""
        return self.lanes - self.calm

    @property
    def kind(self) -> str:
        """`transient`: lanes escaped. `chaotic`: none did. `coexisting`: none did, but some were calm at t0 already.
        `calm`: none was chaotic at t0.
        """
        if not self.chaotic:
            return "calm"
        if self.escapes:
            return "transient"
        return "coexisting" if self.calm else "chaotic"

    @property
    def remaining(self) -> float:
        """Share of the lanes that were chaotic at t0 and still are at the horizon; NaN for none."""
        return 1 - self.escapes / self.chaotic if self.chaotic else math.nan

    @property
    def rate(self) -> float:
        """Escape rate kappa [1/revolution]: 0 without escapes, infinite where all escaped in the first block."""
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
        """Standard error of the mean life [revolutions]: relative 1/sqrt(n) for short blocks; NaN where unknown.

        From the information in the counts of blocks: times sinh(x/2)/(x/2), with x the block in units of the mean life.
        """
        if not self.escapes or not self.survived:
            return math.nan
        half = self.block * self.rate / 2
        return self.mean_life * (math.sinh(half) / half if half else 1.0) / math.sqrt(self.escapes)

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of 95 % for the mean life [revolutions], for any number of escapes.

        From the exact limits of a Poisson count (F. Garwood, Biometrika 28 (1936) 437), or of a binomial one where
        escapes are only known by the block (C. J. Clopper and E. S. Pearson, Biometrika 26 (1934) 404).
        """
        return self._limit(0.975), self._limit(0.025)

    @property
    def lower_bound(self) -> float:
        """Lower limit of the mean life at 95 % [revolutions], one-sided: E/3 where nothing escaped."""
        return self._limit(0.95) if self.escapes else self.survived / 3

    def _limit(self, level: float) -> float:
        """Mean life at which the escape rate has its limit of this level: high rate, short life."""
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
    """Censored maximum likelihood of the mean life from escape times.

    Lanes that failed, or are calm at t0, are left out. Those that escape after the horizon, or never, are censored at
    the time to which they were followed. Lanes that start off the chaotic set need a t0 of several e-foldings of their
    approach to it.

    **Arguments:**

    - `times`: escape time of each lane [revolutions], infinity for never, NaN for failed, as from `escape_times`; for a
        map, the number of the first iterate that is outside.
    - `horizon`: time to which lanes were followed [revolutions].
    - `t0`: time left out at the beginning [revolutions].
    - `block`: revolutions within which an escape is known: one at time t happened in (t - block, t]. 0 for exact times,
        1 for a map.

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
