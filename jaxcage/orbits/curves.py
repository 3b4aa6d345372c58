"""Bifurcation points followed in two parameters: the curves of a stability map."""

import dataclasses
import itertools
from typing import cast

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from .._arguments import require_x64
from .._errors import ArgumentError
from ..models import AbstractForcedSystem
from ..quantities import notebook_html
from ..solve import AbstractMethod
from .bifurcation import PointEquations
from .continuation import Continuation, ContinuationProblem, Path, first_points, in_parallel
from .point import Kind, Point, null_vectors, require_found, singular_matrix
from .problem import SPEED, Given, Parameter, make_problem, value_of
from .step_counts import ENOUGH, by_steps, counted
from .step_lengths import Points, StepControl


@dataclasses.dataclass(frozen=True)
class Curve:
    """Bifurcation points of one kind over two parameters [SI], in order along the curve.

    A curve of Neimark-Sacker bifurcations is not `genuine` where it goes on as neutral saddles. `ended` is as in
    `Branch`. `error` is the distance in x, or in y in the same share of its range, to the curve by half the steps.
    """

    kind: str
    x: str
    y: str
    x_value: Float[np.ndarray, " points"]
    y_value: Float[np.ndarray, " points"]
    state: Float[np.ndarray, "points dim"]
    multipliers: Complex[np.ndarray, "points dim"]
    genuine: Bool[np.ndarray, " points"]
    ended: tuple[str, str]
    name: str = ""
    steps: Int[np.ndarray, " points"] = dataclasses.field(default_factory=lambda: np.zeros(0, dtype=int))
    error: Float[np.ndarray, " points"] = dataclasses.field(default_factory=lambda: np.zeros(0))

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
    steps: StepControl = StepControl(first=0.05, longest=0.25, most=200),
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
    require_found(point)
    if not (lower < upper and x_lower < x_upper):
        raise ArgumentError("lower", "upper", "x_lower", "x_upper", said="must be in ascending order.")
    own = float(value_of(system, point.speed, y))
    if not lower <= own <= upper:
        said = f"must have the system's {y} between them, {own:g}, but are {lower:g} and {upper:g}."
        raise ArgumentError("lower", "upper", said=said)
    low, high = np.array([x_lower, lower]), np.array([x_upper, upper])
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    problem, start = point_curve(given, (x, y), (high - low) / 20, (low, high), point, own, method)
    problem.require_inside("point", float(point.value))
    if not bool(start.converged[0]):
        said = f"must be a {point.kind} of the system, but Newton's method finds none there."
        raise ArgumentError("point", said=said)
    up, down = in_parallel(lambda sign: follow_curve(problem, start.turned(sign), steps), [1.0, -1.0])
    points = up.row.after(down.row)
    multipliers, values = problem.multipliers(points), problem.values(points.u)
    genuine = np.array([point.kind != "Neimark-Sacker" or _is_on_circle(mu) for mu in multipliers])
    ended, error = (down.ended, up.ended), points.error * problem.units[0]
    states = problem.states(points.u)
    return Curve(
        point.kind, x, y, values[:, 0], values[:, 1], states, multipliers, genuine, ended, name, points.steps, error
    )


def point_curve(
    given: Given,
    parameters: tuple[Parameter, Parameter],
    units: Float[np.ndarray, " 2"],
    limits: tuple[np.ndarray, np.ndarray],
    point: Point,
    second: float,
    method: AbstractMethod | None,
) -> tuple[ContinuationProblem, Points]:
    """Return the problem of the curve through a bifurcation point over two parameters, and its first point.

    **Arguments:** system; parameters, their units and limits [SI]; the point, and its value of the second parameter.
    """
    chosen, counts = counted(method)
    orbit = make_problem(given, parameters, units, point.periods, chosen)
    count = int(point.steps) or min(int(counts.last), ENOUGH)
    z = jnp.asarray(np.asarray(point.state) / np.asarray(orbit.scale))
    there = jnp.append(z, jnp.asarray([float(point.value), second]) / orbit.units)
    _, monodromy = orbit.returned(by_steps(orbit, count).prepare(there, given), z)
    borders = null_vectors(singular_matrix(cast(Kind, point.kind), monodromy))
    problem = ContinuationProblem(PointEquations(orbit, *borders, cast(Kind, point.kind)), given, counts, *limits)
    u = problem.unknowns(point.state, float(point.value), second)
    return problem, first_points(problem, u[None], np.eye(1, u.size, u.size - 1), count // 2)


def follow_curve(problem: ContinuationProblem, start: Points, steps: StepControl) -> Path:
    """Follow a curve of bifurcation points in the direction of its first tangent, until it leaves its limits."""
    walk = Continuation(problem, start, steps, oriented=False)
    for advanced in walk:
        for one in advanced:
            walk.problem = _with_fresh_borders(walk.problem, one)
    return walk.curves[0]


def _is_on_circle(multipliers: np.ndarray) -> bool:
    """Return whether the two multipliers whose product is closest to 1 are a complex pair and no neutral saddle."""
    one, other = min(itertools.combinations(multipliers, 2), key=lambda pair: abs(pair[0] * pair[1] - 1))
    return bool(abs((one + other).real / 2) <= 1)


def _with_fresh_borders(problem: ContinuationProblem, followed: Path) -> ContinuationProblem:
    """Return the problem with borders from the null vectors at the last point, which keep it far from singular."""
    known = followed.points[-1].aux
    borders = tuple(v / np.linalg.norm(v) for v in (known.left, known.right))
    return eqx.tree_at(lambda p: (p.equations.left, p.equations.right), problem, borders)
