"""Bifurcation points followed in two parameters: the curves of a stability map."""

import dataclasses
import itertools
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod
from ._arclength import Corrected, Curves, Steps, follow, put, settle_on, stack, take
from ._bifurcation import PointEquations
from ._follower import eigenvalues, in_a_row, require_within, turned
from ._point import Point, require_found
from ._problem import SPEED, Given, make_problem, value_of
from ._singularity import null_vectors, singular_matrix
from ._steps import ENOUGH, by_steps, counted


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
    """False where a curve of Neimark-Sacker bifurcations has gone on as neutral saddles."""
    ended: tuple[str, str]
    """Why the curve ends where it begins and where it ends: as for `Trace`."""
    name: str = ""
    steps: Int[np.ndarray, " points"] = dataclasses.field(default_factory=lambda: np.zeros(0, dtype=int))
    """Steps per revolution."""
    error: Float[np.ndarray, " points"] = dataclasses.field(default_factory=lambda: np.zeros(0))
    """Distance in x, or in y in the same share of its range, to the curve by half the steps [SI]."""

    def __str__(self) -> str:
        head = f"{self.name or 'curve'}: {self.kind} over {self.x} and {self.y}"
        return f"{head}, {self.x_value.size} points, ends: {', '.join(self.ended)}"

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

    **Raises:** `ValueError` if Newton's method does not find the point again, or for a kind that cannot be followed.
    """
    require_x64()
    if point.kind not in ("period-doubling", "Neimark-Sacker", "fold"):
        said = f"must be a period-doubling, Neimark-Sacker or fold, but it is a {point.kind}."
        raise ArgumentError("point", said=said)
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
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    problem = make_problem(given, (x, y), units, point.periods, chosen)
    scale = np.asarray(problem.scale)
    u = np.array([*(np.asarray(point.state) / scale), *(np.array([float(point.value), own]) / units)])
    count = int(point.steps) or min(int(counts.last), ENOUGH)
    strobe = by_steps(problem, count).prepare(jnp.asarray(u), given)
    _, monodromy = problem.returned(strobe, jnp.asarray(u[: scale.size]))
    borders = null_vectors(singular_matrix(point.kind, monodromy))
    curves = Curves(stack(PointEquations(problem, *borders, point.kind), 1), given, counts)
    y_kept = np.eye(1, u.size, u.size - 1)
    start = settle_on(curves, u[None], y_kept, count // 2)
    if not bool(start.converged[0]):
        said = f"must be a {point.kind} of the system, but Newton's method finds none there."
        raise ArgumentError("point", said=said)
    both = np.zeros(2, dtype=int)
    up, down = follow(
        curves.take(both),
        turned(take(start, both), np.array([1.0, -1.0])),
        steps=steps,
        inside=lambda u: np.all((u[..., -2:] * units > low) & (u[..., -2:] * units < high), axis=-1),
        update=_fresh_borders,
    )
    points = in_a_row(down.points, up.points)
    multipliers = eigenvalues(points.aux.monodromy)
    return Curve(
        kind=point.kind,
        x=x,
        y=y,
        x_value=points.u[:, -2] * units[0],
        y_value=points.u[:, -1] * units[1],
        state=points.u[:, : scale.size] * scale,
        multipliers=multipliers,
        genuine=np.array([point.kind != "Neimark-Sacker" or _is_on_circle(mu) for mu in multipliers]),
        steps=points.steps,
        error=points.error * units[0],
        ended=(down.ended, up.ended),
        name=name,
    )


def _is_on_circle(multipliers: np.ndarray) -> bool:
    """Whether the two multipliers whose product is closest to 1 are a complex pair and no neutral saddle."""
    one, other = min(itertools.combinations(multipliers, 2), key=lambda pair: abs(pair[0] * pair[1] - 1))
    return bool(abs((one + other).real / 2) <= 1)


def _fresh_borders(curves: Any, points: Corrected, lanes: np.ndarray) -> Any:
    """Borders from the null vectors at the last points, so that they stay far from singular."""
    unit = lambda v: v / np.linalg.norm(v, axis=-1, keepdims=True)
    borders = unit(points.aux.left), unit(points.aux.right)
    return eqx.tree_at(lambda c: (c.left, c.right), curves, put((curves.left, curves.right), lanes, borders))
