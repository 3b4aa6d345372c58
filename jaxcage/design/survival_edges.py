"""Edges of lasting chaos that no bifurcation explains, with gradients and error bars, and widths of zones.

At such an edge the mean life of chaos equals the horizon. No chaotic trajectory is differentiated: many lanes, each at
its own speed and with its own design near the edge, leave chaos at a rate whose logarithm is linear in speed and
parameters. The edge is where the rate is one escape per horizon; ratios of the slopes give its derivatives.
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
from ..analysis import LIFE_BLOCK, Hazard, Zone, hazard
from ..lanes import Plan, Progress, Run, run_lanes
from ..models import CageModel
from ..orbits import Sensitivity
from ..solve import AbstractMethod
from .design_space import Models
from .slopes import Slopes, moved_designs, moved_parameters


NAMES = ("guidance_gap", "eccentricity")
DESIGNS = 64
ROUNDS = 4
"""Number of rounds of lanes, spread around the current estimate of the edge."""
SPREAD = 0.02
"""Relative standard deviation of the parameters among the lanes."""
REACH = 2.0
"""Lanes are spread over speeds with mean lives of e^-REACH to e^REACH horizons, as the last round estimates."""
DISCARD, OBSERVED = 100, 300
"""Revolutions discarded, and observed; lanes that are calm after these are not followed."""
LIKELY = 0.001
"""p-value below which the law of escapes is rejected."""
CERTAIN = 3.0
"""Number of standard errors of an edge that must fit into the window."""


@dataclasses.dataclass(frozen=True)
class LastingEdge(Slopes):
    """Speed [rpm] at which the mean life of chaos equals the horizon, and its slopes; middle and half width of the
    speeds of the last round; slope of the logarithm of the escape rate over speed [1/rpm]."""

    horizon: int
    window_rpm: tuple[float, float]
    steepness: float
    fit: Hazard

    @property
    def status(self) -> str:
        """`converged`, or why the numbers should not be used."""
        middle, half = self.window_rpm
        if not max(abs(self.value - middle), CERTAIN * self.value_error) < half:
            return "no edge: the mean life does not pass the horizon among these speeds"
        return "converged" if self.fit.p_value >= LIKELY else "the rate of escapes is not log-linear here"


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
    """Estimate an edge of lasting chaos and its elasticities by survival regression.

    **Arguments:** design; speed of the edge and its uncertainty [rpm], as from a sweep; parameters, of which more cost
    no more runs, but make all results less certain; designs of each of four rounds, each at its own speed, from all
    initial states of the model; mean life of chaos at the edge [revolutions]; seed; method and progress as in `sweep`.

    **Returns:** `LastingEdge`, whose `status` says if the numbers should not be used.

    **Raises:** `ValueError` for parameters that are unknown or 0, a window that is not positive, a horizon within the
    revolutions that every lane runs, and too few escapes.
    """
    if not within_rpm > 0:
        raise ArgumentError("within_rpm", said=f"must be positive, but {within_rpm} was given.")
    if horizon <= DISCARD + OBSERVED:
        raise ArgumentError("horizon", said=f"must be above {DISCARD + OBSERVED} revolutions, but {horizon} was given.")
    base, rng = moved_parameters(model, names, "names"), np.random.default_rng(seed)
    length = {"discard": DISCARD, "revolutions": OBSERVED, "blocks": OBSERVED // LIFE_BLOCK, "horizon": horizon}
    run = Run.of(model, confirm=False, method=method, **length)
    edge, window, elasticity = float(rpm), float(within_rpm), np.zeros(len(names))
    speed, change, times = np.empty(0), np.empty((0, len(names))), np.empty(0)
    found = None
    for _ in range(ROUNDS):  # each fit includes all rounds so far
        moved = rng.normal(size=(designs, len(names))).clip(-2, 2) * SPREAD
        at = (edge + window * rng.uniform(-1, 1, designs)) * (1 + moved @ elasticity)
        new, end = _escapes(moved_designs(model, base, moved), at, run, progress)
        each = new.shape[1]
        speed, times = np.append(speed, np.repeat(at, each)), np.append(times, new)
        change = np.vstack([change, np.repeat(moved, each, axis=0)])
        found = _fitted(speed, change, times, (edge, window), end, tuple(names))
        edge, elasticity = edge + float(np.clip(found.value - edge, -window, window)), found.elasticity
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
    designs: Models, rpm: Float[np.ndarray, " designs"], run: Run, progress: Progress | None
) -> tuple[Float[np.ndarray, "designs initial_states"], int]:
    """Revolutions after which the lanes of each design are calm, and the horizon up to which they were followed."""
    found = run_lanes(Plan.one_speed_each(designs, rpm * math.pi / 30), run, progress)
    return found["escape"].values, found.attrs["horizon"]


def _fitted(
    rpm: Any, change: Any, times: Any, about: tuple[float, float], horizon: int, names: tuple[str, ...]
) -> LastingEdge:
    """Edge by an escape rate whose logarithm is quadratic in speed, or linear where the slope is too small."""
    scale = np.maximum(np.std(change, axis=0), 1e-12)
    edge, window = about
    u = (rpm - edge) / window

    def solved(beta: Array) -> tuple[Array, Array]:
        """Speed and its slopes, and the slope of log rate = a + b u + c u^2 + ..., at its root nearest to 0."""
        a, b = beta[0] + math.log(horizon), beta[1]
        c = beta[2] if beta.size > 2 + len(names) else 0.0
        at = -2 * a / (b + jnp.sign(b) * jnp.sqrt(b * b - 4 * a * c))
        steep = b + 2 * c * at
        return jnp.append(edge + window * at, -window * beta[-len(names) :] / steep / scale), steep

    for powers in ([u, u**2], [u]):
        fit = hazard(times, horizon, np.column_stack([*powers, change / scale]), block=LIFE_BLOCK, t0=DISCARD)
        beta = jnp.asarray(fit.coefficients)
        (found, steep), (jacobian, _) = solved(beta), jax.jacfwd(solved)(beta)
        if abs(steep) > abs(fit.coefficients[1]) / 2:  # false for NaN; near the vertex of the parabola there is no edge
            break
    covariance = np.asarray(jacobian) @ fit.covariance @ np.asarray(jacobian).T
    slopes = float(found[0]), names, np.asarray(found[1:]), covariance
    return LastingEdge("edge", "rpm", *slopes, horizon, about, float(steep) / window, fit)


SolvedEdge = LastingEdge | Sensitivity
"""Edge with its slopes: by survival regression, or exact."""


@dataclasses.dataclass(frozen=True)
class ZoneWidth(Slopes):
    """Width [rpm] of a zone of lasting chaos or of an unstable range, exit minus onset, and its slopes.

    Errors of the edges are independent; the gradient of an exact edge has none. A zone cut by the range is `open`: its
    width is NaN, and its slopes are those of its one edge, with the opposite sign for an onset. It is `trusted` if all
    its edges are converged; `status` is `converged`, `open: ...`, or says which edge should not be used, and why.
    """

    open: bool
    trusted: bool
    status: str


def zone_width(edges: Mapping[str, SolvedEdge], zone: int = 1) -> ZoneWidth:
    """Width of a zone and its derivatives by the parameters common to its edges, with standard errors.

    **Arguments:** edges by name, `zone 1 onset` and the like, as from `jaxcage.orbits.sensitivities`, or `onset` and
    `exit`, as from `lasting_edges`; number of the zone.

    **Raises:** `ValueError` for a zone without a known edge.
    """
    both = {end: edges.get(f"zone {zone} {end}", edges.get(end)) for end in ("onset", "exit")}
    solved = {end: edge for end, edge in both.items() if edge is not None}
    if not solved:
        raise ArgumentError("zone", said=f"must be one with an edge among {', '.join(edges)}, but is {zone}.")
    missing = [f"open: no {end} within the range" for end in both if end not in solved]
    bad = [f"{end}: {edge.status}" for end, edge in solved.items() if edge.status != "converged"]
    ends = [(1.0 if end == "exit" else -1.0, Slopes.of(edge)) for end, edge in solved.items()]
    names = [n for n in ends[0][1].directions if all(n in edge.directions for _, edge in ends)]
    at = [[0, *(1 + edge.directions.index(n) for n in names)] for _, edge in ends]
    each = [s * np.append(e.value, e.by_relative_change)[i] for (s, e), i in zip(ends, at, strict=True)]
    value, *by = np.sum(each, axis=0).tolist()
    covariance = np.sum([e.covariance[np.ix_(i, i)] for (_, e), i in zip(ends, at, strict=True)], axis=0)
    slopes = math.nan if missing else value, tuple(names), np.array(by), covariance
    status = "; ".join([*missing, *bad]) or "converged"
    return ZoneWidth(f"zone {zone} width", "rpm", *slopes, bool(missing), not bad, status)
