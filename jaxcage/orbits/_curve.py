"""Bifurcation points followed in two parameters: the curves of a stability map, with codimension-2 points flagged."""

import dataclasses
import itertools
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float, Int, Shaped

from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ._arclength import Corrected, Curves, Steps, follow, put, settle_on, stack, take
from ._bifurcation import PointEquations, critical_matrix
from ._by_name import SPEED, value as value_of
from ._follower import eigenvalues, in_a_row, require_within, turned, without_trivial
from ._illinois import zeros
from ._normal_form import FEW, coefficients, criticality
from ._orbit import is_free
from ._point import Point, require_found
from ._problem import Frame, Given, OrbitProblem, make_frame, returned
from ._singularity import Kind, null_vectors, test_functions
from ._steps import ENOUGH, Counts, by_steps, counted


TURNS = {"period-doubling": "generalised flip", "Neimark-Sacker": "Chenciner"}
"""Where bifurcations of a kind turn from super- to subcritical."""


@dataclasses.dataclass(frozen=True)
class CodimensionTwo:
    """A point of a curve at which something else happens too."""

    kind: str
    """`cusp`; `1:1`, `1:2`, `1:3`, `1:4 resonance`; `fold-flip`, `fold-Neimark-Sacker`, `flip-Neimark-Sacker`,
    `double Neimark-Sacker`; `generalised flip` or `Chenciner`, where period doublings or Neimark-Sacker bifurcations
    turn from super- to subcritical; or `extreme`, where the curve turns back in x: at the value of y two edges meet
    there, or are born."""
    x_value: float
    y_value: float
    multipliers: Complex[np.ndarray, " dim"]


@dataclasses.dataclass(frozen=True)
class Curve:
    """Bifurcation points of one kind over two parameters, in order along the curve."""

    kind: str
    x: str
    y: str
    x_value: Float[np.ndarray, " points"]
    """[SI]; a speed in rad/s."""
    y_value: Float[np.ndarray, " points"]
    state: Float[np.ndarray, "points dim"]
    multipliers: Complex[np.ndarray, "points dim"]
    genuine: Bool[np.ndarray, " points"]
    """False where a curve of Neimark-Sacker bifurcations has gone on, beyond a resonance, as neutral saddles."""
    special: tuple[CodimensionTwo, ...]
    ended: tuple[str, str]
    name: str = ""
    steps: Int[np.ndarray, " points"] = dataclasses.field(default_factory=lambda: np.zeros(0, dtype=int))
    """Steps per revolution."""
    error: Float[np.ndarray, " points"] = dataclasses.field(default_factory=lambda: np.zeros(0))
    """Distance in x, or in y in the same share of its range, to the curve by half the steps [SI]."""
    criticality: Shaped[np.ndarray, " points"] = dataclasses.field(default_factory=lambda: np.zeros(0, dtype=str))
    """`supercritical`, `subcritical` or `unknown`; nothing without a coefficient."""

    def __str__(self) -> str:
        head = f"{self.name or 'curve'}: {self.kind} over {self.x} and {self.y}, {self.x_value.size} points"
        return "\n".join([head, *(f"  {p.kind} at {p.x_value:.8g}, {p.y_value:.8g}" for p in self.special)])

    _repr_html_ = notebook_html


def curve(
    system: AbstractForcedSystem,
    point: Point,
    x: str = SPEED,
    y: str = "guidance_gap",
    *,
    lower: float,
    upper: float,
    x_lower: float,
    x_upper: float,
    period: str = "driven",
    name: str = "",
    steps: Steps = Steps(first=0.05, longest=0.25, most=200),
    method: AbstractMethod | None = None,
) -> Curve:
    """Follow a bifurcation point both ways in two parameters.

    **Arguments:**

    - `point`: a period doubling, Neimark-Sacker bifurcation or fold with `x` as its parameter, from a branch or
        `bifurcation`.
    - `x`, `y`: the two parameters, by name.
    - `lower`, `upper`, `x_lower`, `x_upper`: the range of `y` and of `x` [SI]; the curve ends where it leaves them.
    - `steps`: step lengths, in units of 1/20 of the ranges and of the system's scale.

    **Returns:** `Curve`.

    **Raises:** `ValueError` if Newton's method does not find the point again, or for a kind that cannot be followed.
    """
    require_x64()
    if point.kind not in ("period-doubling", "Neimark-Sacker", "fold"):
        raise ArgumentError(
            "point", said=f"must be a period-doubling, Neimark-Sacker or fold, but it is a {point.kind}."
        )
    require_found(point, point.value)
    if not (lower < upper and x_lower < x_upper):
        raise ArgumentError("lower", "upper", "x_lower", "x_upper", said="must be in ascending order.")
    require_within("point", float(point.value), x_lower, x_upper)
    own = float(value_of(system, point.speed, y))
    if not lower <= own <= upper:
        said = f"must have the system's {y} between them, {own:g}, but are {lower:g} and {upper:g}."
        raise ArgumentError("lower", "upper", said=said)
    low, high = np.array([x_lower, lower]), np.array([x_upper, upper])
    units = (high - low) / 20
    chosen, counts = counted(method)
    problem = OrbitProblem(chosen, system.dimension, is_free(period, system, point.speed), (x, y))
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    frame = make_frame(problem, given, jnp.asarray(point.state), given.speed, jnp.asarray(units), point.periods)
    tracer = _Tracer(problem, counts, given, frame, point.kind, units)
    start, curves = tracer.start(point)
    if not bool(start.converged[0]):
        raise ArgumentError(
            "point", said=f"must be a {point.kind} of the system, but Newton's method finds none there."
        )
    both = turned(take(start, np.zeros(2, dtype=int)), np.array([1.0, -1.0]))
    up, down = follow(
        curves.take(np.zeros(2, dtype=int)),
        both,
        steps=steps,
        inside=lambda u: np.all((u[..., -2:] * units > low) & (u[..., -2:] * units < high), axis=-1),
        update=_fresh_borders,
    )
    cubic = [tracer.cubic(t.points) for t in (down, up)]
    special = [p for t, c in zip((down, up), cubic, strict=True) for p in tracer.special(t.points, c)]
    points = in_a_row(down.points, up.points)
    multipliers = eigenvalues(points.aux.monodromy)
    return Curve(
        kind=point.kind,
        x=x,
        y=y,
        x_value=points.u[:, -2] * units[0],
        y_value=points.u[:, -1] * units[1],
        state=points.u[:, : system.dimension] * np.asarray(frame.scale),
        multipliers=multipliers,
        genuine=tracer.genuine(points),
        special=tuple(special),
        steps=points.steps,
        error=points.error * units[0],
        ended=(down.ended, up.ended),
        name=name,
        criticality=np.array([criticality(point.kind, *c) for c in np.concatenate([cubic[0][:0:-1], cubic[1]])]),
    )


class _Tracer(NamedTuple):
    """What both directions of a curve share."""

    problem: OrbitProblem
    counts: Counts
    given: Given
    frame: Frame
    kind: Kind
    units: Float[np.ndarray, "2"]

    def start(self, point: Any) -> tuple[Corrected, Curves]:
        """The point itself, with `y` kept, and the curve; one lane."""
        values = [float(value_of(self.given.system, self.given.speed, p)) for p in self.problem.parameters]
        values[0] = float(point.value)
        free = [1.0] if self.problem.free_speed else []
        z = np.asarray(point.state) / np.asarray(self.frame.scale)
        u = np.array([*z, *free, *(np.array(values) / self.units)])
        steps = int(point.steps) or min(int(self.counts.last), ENOUGH)
        strobe = by_steps(self.problem, steps).prepare(jnp.asarray(u), self.given, self.frame)
        _, monodromy = returned(strobe, self.frame, jnp.asarray(z))
        a = critical_matrix(self.problem, self.kind, strobe, jnp.asarray(z), monodromy, self.frame)
        normal = np.zeros((1, u.size))
        normal[0, -1] = 1.0
        curves = self.curves(stack(null_vectors(a), 1))
        return settle_on(curves, u[None], normal, steps // 2), curves

    def curves(self, borders: tuple[np.ndarray, np.ndarray]) -> Curves:
        """A curve for each pair of borders, these with the lanes first."""
        left, right = (jnp.asarray(b[0]) for b in borders)
        first = PointEquations(self.problem, self.frame, left, right, self.kind)
        equations = eqx.tree_at(lambda e: (e.left, e.right), stack(first, len(borders[0])), borders)
        return Curves(equations, self.given, self.counts)

    def cubic(self, points: Corrected) -> Float[np.ndarray, "points 2"]:
        """Coefficients of the normal form and their errors."""
        kinds = [self.kind if known else "" for known in self.genuine(points)]
        n, free = self.problem.dimension, self.problem.free_speed
        return coefficients(self.curves(_borders(points)), points, kinds, n, FEW, free=free)

    def special(self, points: Corrected, cubic: Float[np.ndarray, "points 2"]) -> list[CodimensionTwo]:
        """Codimension-2 points between the points of one direction, located."""
        signals = self.signals(points)
        wanted = [(kind, int(k), int(k) + 1) for kind, f in signals.items() for k in np.flatnonzero(f[:-1] * f[1:] < 0)]
        sure = np.flatnonzero(np.abs(cubic[:, 0]) > cubic[:, 1])
        turns = np.flatnonzero(cubic[sure[:-1], 0] * cubic[sure[1:], 0] < 0)
        wanted += [(TURNS[self.kind], int(sure[k]), int(sure[k + 1])) for k in turns]
        if not wanted:
            return []
        ends = [take(points, np.array([k, m])) for _, k, m in wanted]
        curves = self.curves(_borders(take(points, np.array([k for _, k, _ in wanted]))))
        steps = np.array([e.steps.max() for e in ends])

        def signal(i: int, p: Corrected) -> np.ndarray:
            kind = wanted[i][0]
            return self.cubic(p)[:, 0] if kind in TURNS.values() else self.signals(p)[kind]

        located = zeros(curves, ends, signal, steps)
        found = []
        for i, ((kind, k, m), p) in enumerate(zip(wanted, located, strict=True)):
            if p is not None and kind in TURNS.values():  # and not the pole that it has at a fold-flip
                at = abs(signal(i, jax.tree.map(lambda x: np.asarray(x)[None], p))[0])
                p = p if at < 0.01 * np.min(np.abs(cubic[[k, m], 0])) else None
            if p is not None and _real(kind, self.kind, self.multipliers(p)):
                x, y = p.u[-2:] * self.units
                found.append(CodimensionTwo(kind, float(x), float(y), eigenvalues(p.aux.monodromy)))
        # At a cusp the curve turns back in every parameter.
        cusps = [p for p in found if p.kind == "cusp"]
        near = lambda p, q: abs(p.x_value - q.x_value) < 1e-4 * self.units[0]
        return [p for p in found if p.kind != "extreme" or not any(near(p, q) for q in cusps)]

    def genuine(self, points: Corrected) -> Bool[np.ndarray, " points"]:
        """Whether points of a curve of Neimark-Sacker bifurcations are no neutral saddles."""
        return np.array([self.kind != "Neimark-Sacker" or abs(_pair(mu)[1]) <= 1 for mu in self.multipliers(points)])

    def multipliers(self, points: Corrected) -> np.ndarray:
        """Those of each orbit, without the one at 1 of a self-excited orbit."""
        found = eigenvalues(points.aux.monodromy)
        return without_trivial(found) if self.problem.free_speed else found

    def signals(self, points: Corrected) -> dict[str, np.ndarray]:
        """Functions along the curve that change sign at codimension-2 points."""
        rows = [_others(self.kind, mu) for mu in self.multipliers(points)]
        others = test_functions(np.array([o for o, _ in rows]))
        flip, fold, pairs = (others[kind] for kind in ("period-doubling", "fold", "Neimark-Sacker"))
        found = {"extreme": points.tangent[..., -2]}
        if self.kind == "Neimark-Sacker":
            cosine = np.array([c for _, c in rows])
            found |= {f"1:{k} resonance": cosine - at for k, at in ((1, 1.0), (2, -1.0), (3, -0.5), (4, 0.0))}
            return found | {
                "fold-Neimark-Sacker": fold,
                "flip-Neimark-Sacker": flip,
                "double Neimark-Sacker": pairs,
            }
        if self.kind == "period-doubling":
            return found | {"1:2 resonance": flip, "fold-flip": fold, "flip-Neimark-Sacker": pairs}
        n = self.problem.dimension
        bend = np.sum(points.jacobian[..., -1, :n] * points.aux.right[..., :n], axis=-1)
        return found | {
            "cusp": bend,
            "1:1 resonance": fold,
            "fold-flip": flip,
            "fold-Neimark-Sacker": pairs,
        }


def _pair(multipliers: np.ndarray) -> tuple[tuple[int, int], float]:
    """The two multipliers whose product is closest to 1, and half their sum: the cosine of the angle on the circle."""
    pairs = itertools.combinations(range(multipliers.size), 2)
    i, j = min(pairs, key=lambda p: abs(multipliers[p[0]] * multipliers[p[1]] - 1))
    return (i, j), float((multipliers[i] + multipliers[j]).real / 2)


def _others(kind: str, multipliers: np.ndarray) -> tuple[np.ndarray, float]:
    """The multipliers that are not critical, and the cosine of the critical angle."""
    if kind == "Neimark-Sacker":
        taken, cosine = _pair(multipliers)
        return np.delete(multipliers, taken), cosine
    target = -1.0 if kind == "period-doubling" else 1.0
    return np.delete(multipliers, np.argmin(np.abs(multipliers - target))), target


def _real(what: str, kind: str, multipliers: np.ndarray) -> bool:
    """Whether a change of sign is what it is named for, and not that of a neutral saddle."""
    others, cosine = _others(kind, multipliers)
    if what in ("fold-Neimark-Sacker", "flip-Neimark-Sacker", "double Neimark-Sacker") and kind != "Neimark-Sacker":
        return bool(np.any(np.abs(np.imag(others)) > 1e-9))
    return kind != "Neimark-Sacker" or abs(cosine) <= 1 + 1e-6


def _borders(points: Corrected) -> tuple[np.ndarray, np.ndarray]:
    """Left and right borders from the null vectors at some points."""
    unit = lambda v: v / np.linalg.norm(v, axis=-1, keepdims=True)
    return unit(points.aux.left), unit(points.aux.right)


def _fresh_borders(curves: Any, points: Corrected, lanes: np.ndarray) -> Any:
    """Borders from the last points, so that they stay far from singular."""
    renewed = put((curves.left, curves.right), lanes, _borders(points))
    return eqx.tree_at(lambda c: (c.left, c.right), curves, renewed)
