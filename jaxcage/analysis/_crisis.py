"""Where a crisis ends a chaotic attractor: the mean life of what is left of it, extrapolated to its divergence.

Beyond a crisis chaos is a transient. Its mean life falls with the distance from the crisis as a power,
1/tau = amplitude distance^gamma (C. Grebogi, E. Ott, F. Romeiras and J. A. Yorke, Phys. Rev. A 36 (1987) 5365). No
horizon enters into where it diverges: every other edge of lasting chaos moves with the horizon. Lanes on the side of
the transients, each at a speed and of a design of its own, tell place and power together by maximum likelihood; the
place may depend on the design, linearly. Lanes that are chaotic to the end are censored.

Limits. The law holds near the crisis; `p_value` tells where the lanes reach too far. The likelihood of the place is no
parabola: its interval comes from the likelihood itself, other errors are those of fits to data drawn from the law. The
intervals of 95 % are a little too short: they held 26 of 30 planted places with gamma 1.5, and 16 of 20 with 0.5.
"""

import dataclasses
import math

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from .._notebook import notebook_html
from ._hazard import FEWEST_ESCAPES, costs_of_lanes, probability_of_fit


POWERS = 0.1, 6.0
"""Between which gamma is sought."""
NEAREST = 1e-4
"""Distance, as a part of the range of speeds, at which an escape is as unlikely as it gets."""
FALL, DOUBLINGS = 1.92, 10
"""Of the logarithm of the likelihood at the ends of an interval of 95 %, and how often a way to them is doubled."""
GRID = 0.003, 0.01, 0.03, 0.1, 0.3, 1.0
"""How far before the first escape the crisis may lie, as parts of the range of speeds: where fits begin."""


@dataclasses.dataclass(frozen=True)
class Crisis:
    """kappa = amplitude distance^power escapes per revolution on the side of the transients, none on the other."""

    speed: float
    """Where the mean life diverges for the design with x = 0, in the unit of the speeds given."""
    slope: Float[np.ndarray, " n"]
    """Its change with each column of `x`."""
    power: float
    """gamma."""
    amplitude: float
    """kappa at a distance of 1."""
    covariance: Float[np.ndarray, "1+n 1+n"]
    """Of the speed, then of its slopes: mean squares about what was fitted, what is systematic included."""
    power_error: float
    """Standard error, likewise."""
    interval: tuple[float, float]
    """Of 95 %, for the speed: where the likelihood, the rest fitted anew, has fallen by e^1.92. It is not symmetric."""
    beyond: str
    """Where chaos is transient: `above` or `below`."""
    escapes: int
    lanes: int
    p_value: float
    """Probability of escapes at least as unlike the fitted ones, in parts of the lanes along their distance."""

    @property
    def speed_error(self) -> float:
        """Standard error of the speed."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def slope_error(self) -> Float[np.ndarray, " n"]:
        """Standard error of each slope."""
        return np.sqrt(np.diag(self.covariance)[1:])

    def mean_life(self, speed: float) -> float:
        """At a speed, for the design with x = 0 [revolutions]; infinite on the other side."""
        distance = (speed - self.speed) * (1 if self.beyond == "above" else -1)
        return 1 / (self.amplitude * distance**self.power) if distance > 0 else math.inf

    def __str__(self) -> str:
        slopes = zip(self.slope, self.slope_error, strict=True)
        rows = [f"  slope {value:+.4g} +- {error:.2g}" for value, error in slopes]
        power = f"mean life ~ distance^-({self.power:.2f} +- {self.power_error:.2f})"
        counted = f"{self.escapes} of {self.lanes} chaotic lanes escaped, p = {self.p_value:.2g}"
        low, high = self.interval
        return "\n".join([f"crisis at {self.speed:.8g} ({low:.8g} to {high:.8g}), {power}; {counted}", *rows])

    _repr_html_ = notebook_html


def crisis(
    times: Float[np.ndarray, " lanes"],
    horizon: float | int,
    speeds: Float[np.ndarray, " lanes"],
    x: Float[np.ndarray, "lanes n"] | None = None,
    *,
    block: float | int,
    beyond: str,
    t0: float | int = 0,
    draws: int = 60,
    seed: int = 0,
) -> Crisis:
    """Where the mean life of chaos diverges, from escape times in whole blocks.

    **Arguments:** escape time of each lane [revolutions], infinity for never, NaN for failed; time to which lanes were
    followed; speed of each lane, in any unit; what differs between their designs; revolutions within which an escape is
    known; on which side of the crisis chaos is transient, `above` or `below`; time left out; data sets drawn from the
    fitted law, whose own fits tell the errors, and their seed. Lanes that are calm at t0 or failed do not count.

    **Raises:** `ValueError` for another `beyond`, and with fewer than ten escapes.
    """
    if beyond not in ("above", "below"):
        raise ArgumentError("beyond", said=f"must be above or below, but '{beyond}' was given.")
    at_risk = times > t0  # false for NaN
    late, escaped = times[at_risk], times[at_risk] <= horizon
    if np.sum(escaped) < FEWEST_ESCAPES:
        raise ArgumentError(
            "times",
            said=f"must have at least {FEWEST_ESCAPES} escapes after {t0:g} revolutions, but {np.sum(escaped)} of "
            f"{late.size} chaotic lanes escaped.",
        )
    side = 1.0 if beyond == "above" else -1.0
    speed = side * np.asarray(speeds, dtype=float)[at_risk]
    moved = np.zeros((late.size, 0)) if x is None else np.asarray(x, dtype=float)[at_risk]
    low, span, scale = float(np.min(speed)), float(np.ptp(speed)), np.maximum(np.std(moved, axis=0), 1e-12)
    lanes = _Lanes((speed - low) / span, moved / scale, block)
    survived = np.round(np.where(escaped, late - block - t0, horizon - t0) / block)
    best = min((lanes.fit(begin, survived, escaped) for begin in lanes.begins(survived, escaped)), key=lambda f: f[0])[
        1
    ]
    rng, most = np.random.default_rng(seed), round((horizon - t0) / block)
    drawn = np.array([lanes.fit(best, *lanes.drawn(best, most, rng))[1] for _ in range(draws)])
    unit = side * span / np.append(1.0, scale)
    off = (drawn - best)[:, 2:] * unit
    covariance = off.T @ off / draws
    step = math.sqrt(covariance[0, 0]) / span
    ends = [side * (low + span * lanes.end(best, survived, escaped, far)) for far in (-step, step)]
    power = float(np.exp(best[1]))
    return Crisis(
        side * (low + span * float(best[2])),
        best[3:] * unit[1:],
        power,
        float(np.exp(best[0]) / span**power),
        covariance,
        float(np.sqrt(np.mean((np.exp(drawn[:, 1]) - power) ** 2))),
        (min(ends), max(ends)),
        beyond,
        int(np.sum(escaped)),
        late.size,
        probability_of_fit(lanes.log_rate(best), survived, escaped, block, along=lanes.distance(best), fitted=3),
    )


@dataclasses.dataclass(frozen=True)
class _Lanes:
    """Lanes with the law log kappa = a + gamma log(at - c - x . s): theta = a, log gamma, c, s."""

    at: np.ndarray
    """Speeds, over their range, ascending away from the crisis."""
    x: np.ndarray
    block: float | int

    def distance(self, theta: np.ndarray) -> np.ndarray:
        return self.at - theta[2] - self.x @ theta[3:]

    def log_rate(self, theta: np.ndarray) -> np.ndarray:
        away = self.distance(theta)
        log = np.log(np.maximum(away, NEAREST)) + np.minimum(away / NEAREST - 1, 0.0)  # goes on as a line: no wall
        return theta[0] + np.exp(theta[1]) * log

    def cost(self, theta: np.ndarray, survived: np.ndarray, escaped: np.ndarray) -> tuple[float, np.ndarray]:
        """Minus the logarithm of the likelihood, and its slope."""
        log_rate, power = self.log_rate(theta), np.exp(theta[1])
        value, slope, _ = costs_of_lanes(log_rate, survived, escaped, self.block)
        pull = -slope * power / np.maximum(self.distance(theta), NEAREST)
        by_power = slope @ (log_rate - theta[0])
        return float(np.sum(value)), np.array([np.sum(slope), by_power, np.sum(pull), *(pull @ self.x)])

    def fit(
        self, begin: np.ndarray, survived: np.ndarray, escaped: np.ndarray, place: float | None = None
    ) -> tuple[float, np.ndarray]:
        """The least cost, and where; with the crisis at `place`, if that is given."""
        from scipy.optimize import minimize  # takes half a second to load

        bounds = [(None, None), tuple(np.log(POWERS)), (place, place), *[(None, None)] * self.x.shape[1]]
        begin = begin if place is None else np.concatenate([begin[:2], [place], begin[3:]])
        options = {"maxiter": 200, "ftol": 1e-10, "gtol": 1e-8}
        found = minimize(self.cost, begin, (survived, escaped), "L-BFGS-B", jac=True, bounds=bounds, options=options)
        return float(found.fun), np.asarray(found.x)

    def end(self, best: np.ndarray, survived: np.ndarray, escaped: np.ndarray, step: float) -> float:
        """How far the crisis may lie to one side; infinitely far if the likelihood does not fall."""
        from scipy.optimize import brentq  # takes half a second to load

        least = self.cost(best, survived, escaped)[0]
        rise = lambda away: self.fit(best, survived, escaped, float(best[2] + away))[0] - least - FALL
        near = 0.0
        for far in step * 2.0 ** np.arange(DOUBLINGS):
            if rise(far) > 0:
                return float(best[2] + brentq(rise, near, far, xtol=abs(step) * 0.02))
            near = far
        return math.copysign(math.inf, step)

    def begins(self, survived: np.ndarray, escaped: np.ndarray) -> list[np.ndarray]:
        """Crises at several distances before the first escape, of designs that do not differ."""
        first = float(np.min(self.at[escaped]))
        rate = np.log(np.sum(escaped) / np.sum(survived + escaped) / self.block)
        return [np.array([rate, 0.0, first - before, *np.zeros(self.x.shape[1])]) for before in GRID]

    def drawn(self, theta: np.ndarray, most: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Blocks survived and escapes under the law, followed for `most` blocks."""
        rate = self.block * np.exp(np.clip(self.log_rate(theta), -60.0, 60.0))
        life = np.floor(rng.exponential(size=rate.size) / rate)
        return np.minimum(life, most), life < most
