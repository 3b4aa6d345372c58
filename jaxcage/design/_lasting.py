"""Edges of lasting chaos that no bifurcation explains, with their gradients and error bars.

At such an edge the mean life of chaos passes the horizon. It is never differentiated along a chaotic trajectory: many
lanes, each at its own speed and of its own design near the edge, leave chaos at a rate whose logarithm is linear in
speed and parameters; the edge is where that rate is one escape in a horizon, and its slopes follow from the two.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from .._notebook import notebook_html
from .._parameters import parameters, replace
from ..analysis import LIFE_BLOCK, Hazard, Zone, hazard
from ..models import CageModel
from ..solve import AbstractMethod
from ..sweeps import Progress, sweep_designs


NAMES = ("guidance_gap", "eccentricity")
DESIGNS = 64
ROUNDS = 4
"""How often lanes are spread again, about the edge as it is known by then."""
SPREAD = 0.02
"""Relative standard deviation of the parameters."""
REACH = 2.0
"""Lanes are spread over speeds with mean lives of e^-REACH to e^REACH horizons, as far as the last round tells."""
DISCARD, OBSERVED = 100, 300
"""Revolutions left out, and those after which lanes that are calm are not followed."""
LIKELY = 0.001
"""Probability below which the law of escapes does not fit."""
CERTAIN = 3.0
"""Standard errors of an edge that must fit into the window."""


@dataclasses.dataclass(frozen=True)
class LastingEdge:
    """Where the mean life of chaos passes the horizon, and how that moves with parameters."""

    speed_rpm: float
    names: tuple[str, ...]
    elasticity: Float[np.ndarray, " n"]
    """Relative change of the edge by that of each parameter."""
    covariance: Float[np.ndarray, "1+n 1+n"]
    """Of the speed [rpm], then of the elasticities."""
    values: Float[np.ndarray, " n"]
    """Of the parameters [SI]."""
    horizon: int
    middle_rpm: float
    window_rpm: float
    """Middle of the speeds at which lanes ran in the end, and half their width."""
    steepness: float
    """Change of the logarithm of the escape rate with speed [1/rpm]."""
    fit: Hazard

    @property
    def status(self) -> str:
        """`converged`, or why the numbers should not be used."""
        away = abs(self.speed_rpm - self.middle_rpm)
        if not max(away, CERTAIN * self.standard_error_rpm) < self.window_rpm:
            return "no edge: the mean life does not pass the horizon among these speeds"
        return "converged" if self.fit.p_value >= LIKELY else "the rate of escapes is not log-linear here"

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

    def __str__(self) -> str:
        lanes = f"{self.fit.escapes} of {self.fit.lanes} chaotic lanes escaped by revolution {self.horizon}"
        head = f"{self.speed_rpm:.0f} +- {self.standard_error_rpm:.0f} rpm, elasticities ({lanes}; {self.status})"
        each = zip(self.names, self.elasticity, self.elasticity_error, strict=True)
        return "\n".join([head, *(f"  {name:<28} {value:+.3f} +- {error:.3f}" for name, value, error in each)])

    _repr_html_ = notebook_html


def lasting_edge(
    model: CageModel,
    rpm: float,
    within_rpm: float,
    *,
    names: Sequence[str] = NAMES,
    designs: int = DESIGNS,
    horizon: int = 3000,
    rounds: int = ROUNDS,
    spread: float = SPREAD,
    seed: int = 0,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> LastingEdge:
    """Solve for an edge of lasting chaos and its elasticities, by survival regression.

    **Arguments:**

    - `model`: the design.
    - `rpm`, `within_rpm`: where the edge is, and how uncertain that is, as a sweep says.
    - `names`: parameters; each costs no more, but all answers become less certain.
    - `designs`: designs of each round, each at a speed of its own, from all starts of the model.
    - `horizon`: mean life of chaos at the edge [revolutions].
    - `rounds`: how often lanes are spread again about the edge as it is known by then; all rounds count in the end.
    - `spread`: relative standard deviation of the parameters among the lanes.
    - `seed`, `method`, `progress`: of the draws; as in `sweep`.

    **Returns:** `LastingEdge`; its `status` says where the numbers should not be used.

    **Raises:** `ValueError` for parameters that are unknown or 0, a window that is none, a horizon that is not beyond
    what every lane runs, and where too few lanes escape to tell anything.
    """
    if not within_rpm > 0:
        raise ArgumentError("within_rpm", said=f"must be positive, but {within_rpm} was given.")
    if horizon <= DISCARD + OBSERVED:
        raise ArgumentError("horizon", said=f"must be above {DISCARD + OBSERVED} revolutions, but {horizon} was given.")
    values = parameters(model)
    for name in names:
        if name not in values or not float(values[name]):
            raise ArgumentError("names", said=f"must hold parameters of the design that are not 0, but has {name!r}.")
    base = np.array([float(values[name]) for name in names])
    rng = np.random.default_rng(seed)
    edge, window = float(rpm), float(within_rpm)
    elasticity = np.zeros(len(names))
    speed, change, times = np.empty(0), np.empty((0, len(names))), np.empty(0)
    found = None
    for _ in range(rounds):
        moved = rng.normal(size=(designs, len(names))).clip(-2, 2) * spread
        at = (edge + window * rng.uniform(-1, 1, designs)) * (1 + moved @ elasticity)
        new, end = _escapes(model, names, base * (1 + moved), at, horizon, method, progress)
        each = new.shape[1]
        speed, times = np.append(speed, np.repeat(at, each)), np.append(times, new)
        change = np.vstack([change, np.repeat(moved, each, axis=0)])
        found = _fitted(speed, change, times, edge, window, end, names, base)
        edge, elasticity = edge + float(np.clip(found.speed_rpm - edge, -window, window)), found.elasticity
        window = float(np.clip(REACH / max(abs(found.steepness), 1e-12), window / 2, 2 * window))
    assert found is not None
    return found


def lasting_edges(model: CageModel, zone: Zone, **options: Any) -> dict[str, LastingEdge]:
    """Edges of a zone of lasting chaos: `onset`, `exit`, or one of them where it is open.

    **Arguments:** the design; one of `jaxcage.zones`; options of `lasting_edge`.
    """
    ends = {end: getattr(zone, end) for end in ("onset", "exit")}
    return {
        end: lasting_edge(model, edge.speed_rpm, edge.uncertainty_rpm, **options)
        for end, edge in ends.items()
        if edge is not None
    }


def _escapes(
    model: CageModel,
    names: Sequence[str],
    values: Float[np.ndarray, "designs n"],
    rpm: Float[np.ndarray, " designs"],
    horizon: int,
    method: AbstractMethod | None,
    progress: Progress | None,
) -> tuple[Float[np.ndarray, "designs starts"], int]:
    """Revolutions after which lanes are calm, from all starts of each design; and to where they were followed."""
    designs = [replace(model, **dict(zip(names, row.tolist(), strict=True))) for row in values]
    speeds = rpm[:, None] * math.pi / 30
    found = sweep_designs(
        designs,
        speeds,
        discard=DISCARD,
        revolutions=OBSERVED,
        blocks=OBSERVED // LIFE_BLOCK,
        confirm=False,
        horizon=horizon,
        method=method,
        progress=progress,
    )
    return np.stack([s.escape[0] for s in found if s.escape is not None]), found[0].horizon


def _fitted(
    rpm: np.ndarray,
    change: np.ndarray,
    times: np.ndarray,
    edge: float,
    window: float,
    horizon: int,
    names: Sequence[str],
    base: np.ndarray,
) -> LastingEdge:
    """The edge as the lanes tell it."""
    scale = np.maximum(np.std(change, axis=0), 1e-12)
    u = (rpm - edge) / window
    of = lambda *x: hazard(times, horizon, np.column_stack([*x, change / scale]), block=LIFE_BLOCK, t0=DISCARD)
    fit, order = of(u, u**2), 2
    if not _steep(fit, _root(fit, horizon)):
        fit, order = of(u), 1
    beta, n = fit.coefficients, len(names)
    at = _root(fit, horizon) if order == 2 else -(beta[0] + math.log(horizon)) / beta[1]
    powers = at ** np.arange(order + 1.0)  # log rate = sum of beta u^k + ..., and its slope by u:
    by_slope = np.concatenate([[0.0, 1.0], 2 * powers[1:order], np.zeros(n)])
    steep = float(by_slope @ beta)
    speed = edge + window * at
    slope = -window * beta[order + 1 :] / steep / scale  # rpm by relative change
    # Derivatives of the speed, and of slope / speed, by the coefficients.
    of_at = -np.concatenate([powers, np.zeros(n)]) / steep
    of_steep = by_slope + (2 * beta[2] if order == 2 else 0.0) * of_at
    of_slope = -np.outer(slope / steep, of_steep)
    of_slope[:, order + 1 :] -= np.diag(window / steep / scale)
    jacobian = np.vstack([window * of_at, (of_slope - np.outer(slope / speed, window * of_at)) / speed])
    covariance = jacobian @ fit.covariance @ jacobian.T
    return LastingEdge(speed, tuple(names), slope / speed, covariance, base, horizon, edge, window, steep / window, fit)


def _root(bent: Hazard, horizon: int) -> float:
    """Where a law with a square in it is one escape in a horizon [windows]: nearest to 0, NaN if nowhere."""
    roots = np.roots(bent.coefficients[2::-1] + np.array([0.0, 0.0, math.log(horizon)]))
    real = roots[np.isreal(roots)].real
    return float(min(real, key=abs, default=math.nan))


def _steep(bent: Hazard, at: float) -> bool:
    """Whether the law is at its edge half as steep as in the middle at least: near its vertex there is no edge."""
    b, c = bent.coefficients[1:3].tolist()
    return abs(b + 2 * c * at) > abs(b) / 2  # false for NaN
