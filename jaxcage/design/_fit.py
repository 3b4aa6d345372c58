"""The local stage of identification: least squares on exact edges with their exact derivatives.

With r_j = (w_j(p) - measured_j)/sigma_j the sum of squares is minus twice the logarithm of the likelihood. Where it is
smallest, (J^T J)^-1 is the covariance of the unknowns, J holding the derivatives of r. Its singular vectors are the
combinations of unknowns that the edges fix, well or not at all: on a logarithmic scale products of powers.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..orbits import Point
from ._measured import MeasuredEdge
from ._tracked import TrackedEdges
from ._unknowns import Unknown, check_unknowns, values_at, with_values


NORMAL_95 = 1.959963984540054
IDENTIFIED_BELOW = 0.10
"""A combination counts as identified if its 95 % interval reaches at most so far to either side, relatively."""
AT_BOUND = 1e-3
LOST = 1e9
"""Standard deviations that stand for an edge which is gone: no step of the optimiser that leads there is taken."""
TOLERANCE = 1e-6
"""Relative change of the places, and of the sum of squares, at which the search ends."""
STEPS_TOO_SHORT = 3
"""Status of scipy's search where the sum of squares might still fall."""


@dataclasses.dataclass(frozen=True)
class Combination:
    """A combination of unknowns: the product of their powers (or a weighted sum of those on a linear scale)."""

    weights: dict[str, float]
    """Powers, of length 1 together; on a linear scale weights of the value over its span."""
    half_width: float
    """Half of the 95 % interval, relative; infinite if the data say nothing."""

    @property
    def identified(self) -> bool:
        """Whether the data fix it to 10 % or better."""
        return bool(self.half_width <= IDENTIFIED_BELOW)

    def __str__(self) -> str:
        terms = [f"{n}^{w:+.2f}" for n, w in sorted(self.weights.items(), key=lambda x: -abs(x[1])) if abs(w) > 0.05]
        return f"{' '.join(terms)}: +-{100 * self.half_width:.2g} %{'' if self.identified else ', not identified'}"

    _repr_html_ = notebook_html


@dataclasses.dataclass(frozen=True)
class FittedEdge:
    """A measured edge beside that of the fitted model."""

    measured: MeasuredEdge
    rpm: float
    """NaN if it is gone."""
    status: str

    @property
    def residual(self) -> float:
        """Found less measured, in standard deviations."""
        return (self.rpm - self.measured.rpm) / self.measured.uncertainty_rpm


@dataclasses.dataclass(frozen=True)
class Fit:
    """Constants that make the model's edges those measured."""

    values: dict[str, float]
    """[SI]."""
    interval: dict[str, tuple[float, float]]
    """95 % interval of each unknown [SI], cut at its bounds."""
    edges: tuple[FittedEdge, ...]
    covariance: Float[np.ndarray, "unknowns unknowns"]
    """Of the logarithms (log scale) or the values over their span (linear); infinite where the data say nothing."""
    combinations: tuple[Combination, ...]
    """The best determined first."""
    at_bound: tuple[str, ...]
    """Unknowns that ended at a bound: neither their values nor their intervals are the data's."""
    chi_square: float
    """Sum of squared residuals, those of priors included."""
    solves: int
    """Edge solves it took."""
    status: str
    """`converged`; or what went wrong: an edge was lost on the way, or the steps did not suffice."""
    models: dict[str, AbstractForcedSystem]
    """The cases with the constants found."""

    @property
    def identified(self) -> tuple[Combination, ...]:
        """Combinations that the data fix to 10 % or better."""
        return tuple(c for c in self.combinations if c.identified)

    def __str__(self) -> str:
        rows = [f"Fit: {self.status}, chi^2 = {self.chi_square:.3g} of {len(self.edges)} edges, {self.solves} solves"]
        for name, value in self.values.items():
            low, high = self.interval[name]
            rows.append(
                f"  {name:<24} {value:.6g}  [{low:.4g}, {high:.4g}]{' at bound' if name in self.at_bound else ''}"
            )
        rows += ["Combinations, the best determined first", *(f"  {c}" for c in self.combinations)]
        rows += [
            f"  {e.measured.case} {e.measured.name:<14} {e.measured.rpm:9.1f} measured {e.rpm:9.1f} found "
            f"{e.residual:+.2f} sigma, {e.status}"
            for e in self.edges
        ]
        return "\n".join(rows)

    _repr_html_ = notebook_html


def fit_edges(
    systems: Mapping[str, AbstractForcedSystem],
    unknowns: Sequence[Unknown],
    measured: Sequence[MeasuredEdge],
    points: Sequence[Point],
    *,
    start: Mapping[str, float],
    method: AbstractMethod | None = None,
    max_steps: int = 40,
) -> Fit:
    """Find the unknowns for which the edges of the cases are those measured.

    **Arguments:**

    - `systems`: the cases by name; their unknown parameters are overwritten.
    - `unknowns`: what is to be found, shared by all cases.
    - `measured`: edges with their uncertainties, all synchronous-loss.
    - `points`: for each of them the bifurcation that it is, as located with the unknowns at `start`.
    - `start`: values of the unknowns [SI] to start from.
    - `method`: integration method of the orbits.

    **Returns:** `Fit`. If an edge vanishes on the way, the step that led there is undone and a shorter one tried;
    `status` says if the search ended at such a limit.

    **Raises:** `ValueError` for edges that are chaotic, of a case that is not there, or without a point; unknowns that
    no case has; a start out of bounds.
    """
    from scipy.optimize import least_squares  # takes a quarter of a second to load

    require_x64()
    check_unknowns(systems, unknowns)
    _check(systems, unknowns, measured, points, start)
    place = np.array([u.place(start[u.name]) for u in unknowns])
    first = np.clip(place, AT_BOUND, 1 - AT_BOUND)
    tracked = TrackedEdges(systems, unknowns, [e.case for e in measured], points, place, method)
    if not np.all(np.isfinite(tracked(first).rpm)):
        gone = [f"{e.case} {e.name}" for e, w in zip(measured, tracked(first).rpm, strict=True) if not np.isfinite(w)]
        raise ArgumentError("points", said=f"must be bifurcations at `start`, but of {', '.join(gone)} none was found.")
    lost = []

    def residuals(place: np.ndarray) -> np.ndarray:
        off, _ = _misfit(tracked, measured, place)
        lost.append(not np.all(np.isfinite(off)))
        return np.nan_to_num(off, nan=LOST)

    slopes = lambda place: np.nan_to_num(_misfit(tracked, measured, place)[1])
    end = least_squares(
        residuals,
        first,
        slopes,  # pyright: ignore[reportArgumentType]
        bounds=(0.0, 1.0),
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        max_nfev=max_steps,
    )
    shortened = any(lost) and end.status == STEPS_TOO_SHORT
    return _report(tracked, measured, end.x, bool(end.success) and not shortened)


def _check(
    systems: Mapping[str, AbstractForcedSystem],
    unknowns: Sequence[Unknown],
    measured: Sequence[MeasuredEdge],
    points: Sequence[Point],
    start: Mapping[str, float],
) -> None:
    if len(points) != len(measured) or not measured:
        raise ArgumentError(
            "points", said=f"must hold one point per edge, but {len(points)}, {len(measured)} were given."
        )
    for edge in measured:
        if edge.kind != "synchronous-loss":
            raise ValueError(
                f"Only synchronous-loss edges have exact equations, but {edge.case} {edge.name} is chaotic."
            )
        if edge.case not in systems:
            raise ValueError(f"Edge `{edge.name}` must belong to one of {', '.join(systems)}, but is of {edge.case}.")
    for u in unknowns:
        if u.name not in start or not 0 <= u.place(start[u.name]) <= 1:
            given = start.get(u.name, "nothing")
            raise ValueError(f"Start of `{u.name}` must lie between {u.lower} and {u.upper}, but {given} was given.")


def _misfit(
    tracked: TrackedEdges, measured: Sequence[MeasuredEdge], place: Float[np.ndarray, " unknowns"]
) -> tuple[np.ndarray, np.ndarray]:
    """Found less measured in standard deviations, and its derivatives; rows of prior knowledge below those of edges."""
    found, sigma = tracked(place), np.array([e.uncertainty_rpm for e in measured])
    priors = [(i, *u.prior_place) for i, u in enumerate(tracked.unknowns) if u.prior_place is not None]
    off = (found.rpm - np.array([e.rpm for e in measured])) / sigma
    off = np.append(off, [(place[i] - mean) / deviation for i, mean, deviation in priors])
    rows = [np.eye(len(place))[i] / deviation for i, _, deviation in priors]
    return off, np.vstack([found.slope / sigma[:, None], *rows])


def _report(tracked: TrackedEdges, measured: Sequence[MeasuredEdge], place: np.ndarray, converged: bool) -> Fit:
    found, unknowns = tracked(place), tracked.unknowns
    unit = np.array([u.span if u.scale == "log" else 1.0 for u in unknowns])
    off, rows = _misfit(tracked, measured, place)
    rows = np.nan_to_num(rows)
    covariance, combinations = determined(rows / unit, [u.name for u in unknowns])
    deviation = np.sqrt(np.diag(covariance)) / unit  # of the place
    ends = [np.clip(place + s * NORMAL_95 * deviation, 0, 1) for s in (-1, 1)]
    lost = not np.all(np.isfinite(found.rpm))
    return Fit(
        values=values_at(unknowns, place),
        interval={u.name: (u.value(a), u.value(b)) for u, a, b in zip(unknowns, *ends, strict=True)},
        edges=tuple(FittedEdge(e, float(w), s) for e, w, s in zip(measured, found.rpm, found.status, strict=True)),
        covariance=covariance,
        combinations=combinations,
        at_bound=tuple(u.name for u, p in zip(unknowns, place, strict=True) if min(p, 1 - p) < 2 * AT_BOUND),
        chi_square=float(np.sum(off**2)),
        solves=tracked.solves,
        status="an edge is lost" if lost else "converged" if converged else "not converged",
        models={case: with_values(system, unknowns, place) for case, system in tracked.systems.items()},
    )


def determined(
    jacobian: Float[np.ndarray, "rows unknowns"], names: Sequence[str]
) -> tuple[Float[np.ndarray, "unknowns unknowns"], tuple[Combination, ...]]:
    """Covariance of the unknowns, and the combinations that the data determine, the best first.

    **Arguments:** derivatives of the residuals, each in units of its standard deviation; names of the unknowns.
    """
    n = len(names)
    _, size, directions = np.linalg.svd(np.vstack([jacobian, np.zeros((n, n))]), full_matrices=False)
    known = size > 1e-10 * max(size[0], 1e-300)
    deviation = np.where(known, 1 / np.where(known, size, 1.0), np.inf)
    with np.errstate(invalid="ignore"):
        spread = directions.T * np.where(np.isinf(deviation), 0.0, deviation)
        covariance = spread @ spread.T
    free = np.any(np.abs(directions[~known]) > 1e-8, axis=0)
    covariance[np.ix_(free, free)] = np.where(np.eye(int(free.sum()), dtype=bool), np.inf, np.nan)
    turned = directions * np.sign(directions[np.arange(len(size)), np.argmax(np.abs(directions), axis=1)])[:, None]
    combos = tuple(
        Combination(dict(zip(names, d.tolist(), strict=True)), float(NORMAL_95 * s))
        for d, s in zip(turned, deviation, strict=True)
    )
    return covariance, combos
