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
from ..integrate import AbstractMethod
from ..models import CageModel
from ..sweeps import sweep_designs


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
CERTAIN = 3.0
"""Standard errors of an edge that must fit into the window."""
LIKELY = 0.001
"""Probability below which the law does not fit."""


@dataclasses.dataclass(frozen=True)
class LastingEdge:
    """Where the mean life of chaos passes the horizon, and how that moves with parameters."""

    speed_rpm: float
    names: tuple[str, ...]
    elasticity: Float[np.ndarray, " n"]
    """Relative change of the edge by that of each parameter."""
    slope: Float[np.ndarray, " n"]
    """[rpm per unit of the parameter]."""
    covariance: Float[np.ndarray, "1+n 1+n"]
    """Of the speed [rpm], then of the elasticities."""
    horizon: int
    window_rpm: float
    """Half the width of the speeds at which lanes ran."""
    steepness: float
    """Change of the logarithm of the escape rate with speed [1/rpm]."""
    fit: Hazard

    @property
    def standard_error_rpm(self) -> float:
        """Of the speed."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def elasticity_error(self) -> Float[np.ndarray, " n"]:
        """Standard error of each elasticity."""
        return np.sqrt(np.diag(self.covariance)[1:])

    @property
    def status(self) -> str:
        """`converged`, or why the numbers should not be used."""
        if not self.standard_error_rpm < self.window_rpm / CERTAIN:
            return "no edge: the mean life does not pass the horizon"
        return "converged" if self.fit.p_value >= LIKELY else "the rate of escapes is not log-linear here"

    def sum_of(self, *names: str) -> tuple[float, float]:
        """Elasticity by several parameters that change together, such as gap and eccentricity at a fixed ratio, with
        its standard error."""
        weight = np.array([0.0, *(float(n in names) for n in self.names)])
        return float(weight[1:] @ self.elasticity), math.sqrt(weight @ self.covariance @ weight)

    def __str__(self) -> str:
        each = zip(self.names, self.elasticity, self.elasticity_error, strict=True)
        rows = [f"  {name:<28} {value:+.3f} +- {error:.3f}" for name, value, error in each]
        lanes = f"{self.fit.escapes} of {self.fit.lanes} chaotic lanes escaped by revolution {self.horizon}"
        head = f"{self.speed_rpm:.0f} +- {self.standard_error_rpm:.0f} rpm, elasticities ({lanes}; {self.status})"
        return "\n".join([head, *rows])

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
    progress: Any = None,
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

    **Raises:** `ValueError` for parameters that are unknown or 0, and where too few lanes escape to tell anything.
    """
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
        edge, elasticity = found.speed_rpm, found.elasticity
        window = float(np.clip(REACH / max(abs(found.steepness), 1e-12), window / 2, 2 * window))
    assert found is not None
    return found


def lasting_width(
    model: CageModel, zone: Zone, **options: Any
) -> tuple[dict[str, LastingEdge], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """How the width of a zone of lasting chaos changes [rpm by a relative change of each parameter]: its edges, that,
    and its standard error. An open zone has one edge.

    **Arguments:** the design; a zone of `jaxcage.zones`; options of `lasting_edge`.
    """
    edges, total, variance = {}, 0.0, 0.0
    for end, sign in (("onset", -1.0), ("exit", 1.0)):
        given = getattr(zone, end)
        if given is not None:
            edges[end] = found = lasting_edge(model, given.speed_rpm, given.uncertainty_rpm, **options)
            total = total + sign * found.elasticity * found.speed_rpm
            variance = variance + (found.elasticity_error * found.speed_rpm) ** 2
    return edges, np.asarray(total), np.sqrt(variance)


def _escapes(
    model: CageModel,
    names: Sequence[str],
    values: Float[np.ndarray, "designs n"],
    rpm: Float[np.ndarray, " designs"],
    horizon: int,
    method: AbstractMethod | None,
    progress: Any,
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
    fit = hazard(times, horizon, np.column_stack([u, u**2, change / scale]), block=LIFE_BLOCK, t0=DISCARD)
    b0, b1, b2, *b = fit.coefficients
    at = _nearest_root(b2, b1, b0 + math.log(horizon))  # where the rate is one escape in a horizon
    steep = b1 + 2 * b2 * at
    speed = edge + window * at
    slope = -window * np.asarray(b) / steep / scale  # rpm by relative change
    # Derivatives of the speed and of slope / speed by the coefficients.
    of_at = np.concatenate([-np.array([1.0, at, at**2]) / steep, np.zeros(len(b))])
    of_steep = np.concatenate([[0.0, 1.0, 2 * at], np.zeros(len(b))]) + 2 * b2 * of_at
    of_slope = -np.outer(slope / steep, of_steep)
    of_slope[:, 3:] += np.diag(-window / steep / scale)
    jacobian = np.vstack([window * of_at, (of_slope - np.outer(slope / speed, window * of_at)) / speed])
    covariance = jacobian @ fit.covariance @ jacobian.T
    return LastingEdge(
        speed, tuple(names), slope / speed, slope / base, covariance, horizon, window, steep / window, fit
    )


def _nearest_root(a: float, b: float, c: float) -> float:
    """Of a u^2 + b u + c, the real root nearest to 0; the place nearest to one if there is none."""
    roots = np.roots([a, b, c])
    return float(min(roots, key=abs).real)
