"""Edges of lasting chaos that no bifurcation explains, with their gradients and error bars, and widths of zones.

At such an edge the mean life of chaos passes the horizon. It is never differentiated along a chaotic trajectory: many
lanes, each at its own speed and of its own design near the edge, leave chaos at a rate whose logarithm is linear in
speed and parameters; the edge is where that rate is one escape in a horizon, and its slopes follow from the two.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError
from .._parameters import parameters, replace
from ..analysis import LIFE_BLOCK, Hazard, Zone, hazard
from ..lanes import Plan, Progress, Run, run_lanes
from ..models import CageModel
from ..orbits import Sensitivity
from ..quantities import notebook_html
from ..solve import AbstractMethod


NAMES = ("guidance_gap", "eccentricity")
DESIGNS = 64
ROUNDS = 4
"""Times that lanes are spread, about the edge as it is known by then."""
SPREAD = 0.02
"""Relative standard deviation of the parameters among the lanes."""
REACH = 2.0
"""Lanes are spread over speeds with mean lives of e^-REACH to e^REACH horizons, as far as the last round tells."""
DISCARD, OBSERVED = 100, 300
"""Revolutions left out, and observed; lanes that are calm after these are not followed."""
LIKELY = 0.001
"""Probability below which the law of escapes does not fit."""
CERTAIN = 3.0
"""Standard errors of an edge that must fit into the window."""


@dataclasses.dataclass(frozen=True)
class LastingEdge:
    """Speed at which the mean life of chaos passes the horizon, and its elasticities."""

    speed_rpm: float
    names: tuple[str, ...]
    elasticity: Float[np.ndarray, " n"]
    """Relative change of the edge by that of each parameter."""
    covariance: Float[np.ndarray, "1+n 1+n"]
    """Covariance of the speed [rpm] and the elasticities."""
    horizon: int
    window_rpm: tuple[float, float]
    """Middle and half width of the speeds of the last round."""
    steepness: float
    """Change of the logarithm of the escape rate with speed [1/rpm]."""
    fit: Hazard

    @property
    def status(self) -> str:
        """`converged`, or why the numbers should not be used."""
        middle, half = self.window_rpm
        if not max(abs(self.speed_rpm - middle), CERTAIN * self.standard_error_rpm) < half:
            return "no edge: the mean life does not pass the horizon among these speeds"
        return "converged" if self.fit.p_value >= LIKELY else "the rate of escapes is not log-linear here"

    @property
    def standard_error_rpm(self) -> float:
        """Standard error of the speed."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def elasticity_error(self) -> Float[np.ndarray, " n"]:
        """Standard error of each elasticity."""
        return np.sqrt(np.diag(self.covariance)[1:])

    def sum_of(self, *names: str) -> tuple[float, float]:
        """Elasticity by several parameters that change together, such as gap and eccentricity at a fixed ratio, with
        its standard error.

        **Raises:** `ValueError` for a parameter without an elasticity.
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
    seed: int = 0,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> LastingEdge:
    """Solve for an edge of lasting chaos and its elasticities, by survival regression.

    **Arguments:**

    - `model`: the design.
    - `rpm`, `within_rpm`: speed of the edge and its uncertainty, as a sweep gives them.
    - `names`: parameters; each costs no more, but all answers become less certain.
    - `designs`: designs of each of four rounds, each at a speed of its own, from all starts of the model.
    - `horizon`: mean life of chaos at the edge [revolutions].
    - `seed`: seed of the draws; `method`, `progress`: as in `sweep`.

    **Returns:** `LastingEdge`; its `status` says where the numbers should not be used.

    **Raises:** `ValueError` for parameters that are unknown or 0, a window that is not positive, a horizon within the
    revolutions that every lane runs, and too few escapes.
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
    for _ in range(ROUNDS):  # all rounds count in the end
        moved = rng.normal(size=(designs, len(names))).clip(-2, 2) * SPREAD
        at = (edge + window * rng.uniform(-1, 1, designs)) * (1 + moved @ elasticity)
        new, end = _escapes(model, names, base * (1 + moved), at, horizon, method, progress)
        each = new.shape[1]
        speed, times = np.append(speed, np.repeat(at, each)), np.append(times, new)
        change = np.vstack([change, np.repeat(moved, each, axis=0)])
        found = _fitted(speed, change, times, (edge, window), end, tuple(names))
        edge, elasticity = edge + float(np.clip(found.speed_rpm - edge, -window, window)), found.elasticity
        window = float(np.clip(REACH / max(abs(found.steepness), 1e-12), window / 2, 2 * window))
    assert found is not None
    return found


def lasting_edges(model: CageModel, zone: Zone, **options: object) -> dict[str, LastingEdge]:
    """Edges of a zone of lasting chaos: `onset`, `exit`, or one of them where it is open.

    **Arguments:** the design; one of `jaxcage.zones`; options of `lasting_edge`.
    """
    ends = {"onset": zone.onset, "exit": zone.exit}
    solve: Any = lasting_edge
    return {end: solve(model, e.speed_rpm, e.uncertainty_rpm, **options) for end, e in ends.items() if e is not None}


def _escapes(
    model: CageModel,
    names: Sequence[str],
    values: Float[np.ndarray, "designs n"],
    rpm: Float[np.ndarray, " designs"],
    horizon: int,
    method: AbstractMethod | None,
    progress: Progress | None,
) -> tuple[Float[np.ndarray, "designs starts"], int]:
    """Revolutions after which the lanes of each design are calm; and revolutions to which they were followed."""
    designs = [replace(model, **dict(zip(names, row.tolist(), strict=True))) for row in values]
    length = {"discard": DISCARD, "revolutions": OBSERVED, "blocks": OBSERVED // LIFE_BLOCK, "horizon": horizon}
    run = Run.of(model, confirm=False, method=method, **length)
    found = run_lanes(Plan.one_speed_each(designs, rpm * math.pi / 30), run, progress)
    return found["escape"].values, found.attrs["horizon"]


def _fitted(
    rpm: np.ndarray,
    change: np.ndarray,
    times: np.ndarray,
    about: tuple[float, float],
    horizon: int,
    names: tuple[str, ...],
) -> LastingEdge:
    """The edge by a law of escapes whose logarithm is a square of the speed, or linear where that is not steep."""
    scale = np.maximum(np.std(change, axis=0), 1e-12)
    edge, window = about
    u = (rpm - edge) / window

    def solved(beta: Array) -> tuple[Array, Array]:
        """Speed and elasticities, and the slope of the logarithm, where log rate = a + b u + c u^2 + ... is that of one
        escape in a horizon, at the root that is nearest to 0."""
        a, b = beta[0] + math.log(horizon), beta[1]
        c = beta[2] if beta.size > 2 + len(names) else 0.0
        at = -2 * a / (b + jnp.sign(b) * jnp.sqrt(b * b - 4 * a * c))
        steep, speed = b + 2 * c * at, edge + window * at
        return jnp.append(speed, -window * beta[-len(names) :] / steep / scale / speed), steep

    for powers in ([u, u**2], [u]):
        fit = hazard(times, horizon, np.column_stack([*powers, change / scale]), block=LIFE_BLOCK, t0=DISCARD)
        beta = jnp.asarray(fit.coefficients)
        (found, steep), (jacobian, _) = solved(beta), jax.jacfwd(solved)(beta)
        if abs(steep) > abs(fit.coefficients[1]) / 2:  # false for NaN; near the vertex of a square there is no edge
            break
    speed, *elasticity = np.asarray(found).tolist()
    covariance = np.asarray(jacobian) @ fit.covariance @ np.asarray(jacobian).T
    return LastingEdge(speed, names, np.array(elasticity), covariance, horizon, about, float(steep) / window, fit)


SolvedEdge = LastingEdge | Sensitivity
"""An edge with its elasticities: by survival regression, or exact."""


@dataclasses.dataclass(frozen=True)
class ZoneWidth:
    """Width of a zone, of lasting chaos or of synchronous loss, and its change with parameters.

    Each edge has an error of its own; the gradient of an exact edge has none. A zone that is cut by the range is open:
    it has no width, but its gradient is that of the other edge.
    """

    onset: SolvedEdge | None
    exit: SolvedEdge | None
    """None where the zone goes on beyond the range."""

    @property
    def open(self) -> bool:
        """True if the range cuts it."""
        return self.onset is None or self.exit is None

    @property
    def trusted(self) -> bool:
        """True if all edges that it has are converged."""
        return all(edge is None or edge.status == "converged" for edge in (self.onset, self.exit))

    @property
    def status(self) -> str:
        """`converged`, `open: ...`, or which edge should not be used, and why."""
        ends = {"onset": self.onset, "exit": self.exit}
        bad = [f"{name}: {edge.status}" for name, edge in ends.items() if edge and edge.status != "converged"]
        missing = [f"open: no {name} within the range" for name, edge in ends.items() if edge is None]
        return "; ".join([*missing, *bad]) or "converged"

    @property
    def width_rpm(self) -> float | None:
        """Exit less onset; None for an open zone."""
        return None if self.open else sum(speed for speed, *_ in self._ends())

    @property
    def standard_error_rpm(self) -> float | None:
        """Standard error of the width; for an exact edge its distance to that by half the steps counts."""
        return None if self.open else math.hypot(*(error for _, error, _ in self._ends()))

    def change(self, *names: str) -> tuple[float, float]:
        """Change of the width when parameters grow together [rpm by their relative change], with its standard error;
        for an open zone that of its one edge."""
        found = [(speed, *edge(names)) for speed, _, edge in self._ends()]
        return sum(by * e for by, e, _ in found), math.hypot(*(by * error for by, _, error in found))

    def _ends(self) -> list[tuple[float, float, Any]]:
        """Speed, negative for the onset, its error, and the function that sums elasticities, of each edge."""
        ends = [(-1.0, self.onset), (1.0, self.exit)]
        exact = lambda edge: lambda names: (sum(edge.elasticity[n] for n in names), 0.0)
        return [
            (sign * edge.value_rpm, edge.error_rpm, exact(edge))
            if isinstance(edge, Sensitivity)
            else (sign * edge.speed_rpm, edge.standard_error_rpm, lambda names, edge=edge: edge.sum_of(*names))
            for sign, edge in ends
            if edge is not None
        ]


def zone_width(edges: Mapping[str, SolvedEdge], zone: int = 1) -> ZoneWidth:
    """Width of a zone, exit less onset [rpm], and its change with the design, with standard errors.

    **Arguments:** edges by name, `zone 1 onset` and the like, as `jaxcage.orbits.sensitivities` has them, or `onset`
    and `exit`, as `lasting_edges` does; number of the zone.

    **Raises:** `ValueError` for a zone of which no edge is known.
    """
    ends = [edges.get(f"zone {zone} {end}", edges.get(end)) for end in ("onset", "exit")]
    if not any(ends):
        raise ArgumentError("zone", said=f"must be one with an edge among {', '.join(edges)}, but is {zone}.")
    return ZoneWidth(*ends)
