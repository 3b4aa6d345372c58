"""Continuation of bifurcation points in two parameters: curves of a stability map, and edges from design to design.

Between two designs the parameters are the speed and the position on the straight line from one design to the other, so
that an edge is followed round a fold in the design. The predictor uses the full tangent of state, speed and position by
the implicit function theorem, so that the orbit follows a contact that moves with the design.
"""

import dataclasses
import itertools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from .._arguments import require_x64
from .._errors import ArgumentError
from .._parameters import parameters
from ..models import AbstractForcedSystem
from ..quantities import notebook_html
from ..solve import AbstractMethod
from .bifurcation import point_equations
from .continuation import Continuation, ContinuationProblem, first_points, in_parallel
from .gradient import Sensitivity, sensitivity
from .point import Point, critical_of, require_found
from .problem import ENOUGH, SPEED, Given, Parameter, counted, make_problem, value_of
from .step_length import Points, StepControl


SHARE = "share"
LONGEST, SHORTEST, MOST = 1.5, 1e-8, 300
"""Longest and shortest step, in clearances and tenths of the speed and of the largest relative change; most steps.
Where an orbit begins to graze the land, the curve turns within a small part of the length over which contact sets in.
"""
LEAST = 1e-10  # designs that differ by less are the same up to rounding
SAME_EDGE = 2e-3
"""Largest relative distance between the end of the curve and the edge solved for at the new design."""
WALK = StepControl(first=0.05, longest=0.25, most=200)  # in units of 1/20 of the ranges and of the system's scale


@dataclasses.dataclass(frozen=True)
class Curve:
    """Bifurcation points of one kind over two parameters [SI], in order along the curve.

    `genuine` is False where a curve of Neimark-Sacker bifurcations continues as neutral saddles. `ended` is as in
    `Branch`. `error` is the distance to the curve computed with half the steps, in units of x; in y it is the same
    fraction of the range.
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
    method: AbstractMethod | None = None,
) -> Curve:
    """Follow a bifurcation point in both directions in two parameters.

    **Arguments:**

    - `point`: a period doubling, Neimark-Sacker bifurcation or fold with `x` as its parameter, from a branch or
        `bifurcation`.
    - `x`, `y`: the two parameters, by name.
    - `lower`, `upper`, `x_lower`, `x_upper`: ranges of `y` and of `x` [SI]; the curve ends where it leaves them.

    **Returns:** `Curve`. **Raises:** `ValueError` if Newton's method does not find the point again, or for a kind that
    cannot be followed; `RuntimeError` without double precision.
    """
    require_x64()
    if point.kind not in ("period-doubling", "Neimark-Sacker", "fold"):
        said = f"must be a period-doubling, Neimark-Sacker or fold, but it is a {point.kind}."
        raise ArgumentError("point", said=said)
    require_found(point)
    if y == x or point.parameter not in (x, "parameter"):  # the latter was picked by a function
        said = f"must be the parameter of the point, {point.parameter}, and another one, but are {x} and {y}."
        raise ArgumentError("x", "y", said=said)
    if not (-math.inf < lower < upper < math.inf and -math.inf < x_lower < x_upper < math.inf):
        raise ArgumentError("lower", "upper", "x_lower", "x_upper", said="must be in ascending order and finite.")
    own = float(value_of(system, point.speed, y, "y"))
    if not lower <= own <= upper:
        said = f"must have the system's {y} between them, {own:g}, but are {lower:g} and {upper:g}."
        raise ArgumentError("lower", "upper", said=said)
    low, high = np.array([x_lower, lower]), np.array([x_upper, upper])
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    problem, start = _point_curve(given, (x, y), (high - low) / 20, (low, high), point, own, method)
    problem.require_inside("point", float(point.value))
    if not bool(start.converged[0]):
        said = f"must be a {point.kind} of the system, but Newton's method finds none there."
        raise ArgumentError("point", said=said)
    up, down = in_parallel(lambda sign: _followed(problem, start.turned(sign), WALK).finished()[0], [1.0, -1.0])
    points = up.row.after(down.row)
    multipliers, values = problem.multipliers(points), problem.values(points.u)
    genuine = np.array([point.kind != "Neimark-Sacker" or _is_on_circle(mu) for mu in multipliers])
    ended, error = (down.ended, up.ended), points.error * problem.units[0]
    states = problem.states(points.u)
    return Curve(
        point.kind, x, y, values[:, 0], values[:, 1], states, multipliers, genuine, ended, name, points.steps, error
    )


def _point_curve(
    given: Given,
    parameters: tuple[Parameter, Parameter],
    units: Float[np.ndarray, " 2"],
    limits: tuple[np.ndarray, np.ndarray],
    point: Point,
    second: float,
    method: AbstractMethod | None,
) -> tuple[ContinuationProblem, Points]:
    """Return the problem of the curve through a bifurcation point, and its first point.

    **Arguments:** system; parameters, their units and limits [SI]; the point, and its value of the second parameter.
    """
    chosen, counts = counted(method)
    orbit = make_problem(given, parameters, units, point.periods, chosen)
    count = int(point.steps) or min(int(counts.last), ENOUGH)
    z = jnp.asarray(np.asarray(point.state) / np.asarray(orbit.scale))
    there = jnp.append(z, jnp.asarray([float(point.value), second]) / orbit.units)
    equations = point_equations(orbit, critical_of(point.kind), there, given, count)
    problem = ContinuationProblem(equations, given, counts, *limits)
    u = problem.unknowns(point.state, float(point.value), second)
    least = count // 2 if counts.chooses else 0
    return problem, first_points(problem, u[None], np.eye(1, u.size, u.size - 1), least)


def _followed(problem: ContinuationProblem, start: Points, steps: StepControl) -> Continuation:
    """Follow a curve of bifurcation points in the direction of its first tangent, up to the first point outside."""
    walk = Continuation(problem, start, steps, oriented=False)
    for advanced in walk:
        for one in advanced:  # borders from the null vectors at the last point keep the equations far from singular
            known = one.points[-1].aux
            borders = tuple(v / np.linalg.norm(v) for v in (known.left, known.right))
            equations = eqx.tree_at(lambda e: (e.left, e.right), walk.problem.equations, borders)
            walk.problem = dataclasses.replace(walk.problem, equations=equations)
    return walk


def _is_on_circle(multipliers: np.ndarray) -> bool:
    """Return True if the two multipliers whose product is closest to 1 are a complex pair, not a neutral saddle."""
    one, other = min(itertools.combinations(multipliers, 2), key=lambda pair: abs(pair[0] * pair[1] - 1))
    return bool(abs((one + other).real / 2) <= 1)


# --- from one design to another -------------------------------------------------------------------------------------


class Between(Given):
    """A system on the straight line between two designs: `share` is 0 at the first and 1 at the second."""

    other: AbstractForcedSystem

    def changed(self, parameter: Parameter, new: Any) -> Given:
        if parameter == SPEED:
            return dataclasses.replace(self, speed=new)
        mixed = jax.tree.map(lambda a, b: a + new * (b - a), self.system, self.other)
        return Given(mixed, self.speed)


class Followed(NamedTuple):
    """An edge after a change of design, or the reason why it no longer exists.

    - `edge`: the edge with its derivatives, None if it was lost.
    - `ended`: empty; `turned back`, the edge met another one before the change was complete and both vanished;
        `left the range` of speed; `neutral saddle`, the critical multipliers of a Neimark-Sacker bifurcation are real
        at the new design, so that nothing bifurcates; `lost`, continuation found no further point.
    - `share`: fraction of the change up to which the edge exists, 1 if it reached the new design.
    """

    edge: Sensitivity | None
    ended: str = ""
    share: float = 1.0


def follow(
    system: AbstractForcedSystem,
    point: Point,
    other: AbstractForcedSystem,
    *,
    lower: float,
    upper: float,
    name: str = "edge",
    method: AbstractMethod | None = None,
) -> Followed:
    """Follow an edge from the design `system`, at which it is `point`, to the design `other`.

    **Arguments:** design; a period doubling, Neimark-Sacker bifurcation or fold over speed that was found there; new
    design, of the same kind of model; range of speed [rad/s] within which the edge is followed.

    **Returns:** the edge at the new design with its exact derivatives, or the reason why there is none.
    """
    require_x64()
    a, b = (np.array([float(x) for x in parameters(m).values()]) for m in (system, other))
    size = np.maximum(np.abs(a), np.abs(b))
    length = 10 * float(np.max(np.abs(b - a)[size > 0] / size[size > 0], initial=0.0))
    if length < LEAST:
        return _solved(other, point, name, method)
    given = Between(system, jnp.asarray(point.speed, dtype=float), other)
    units = np.array([0.1 * float(point.speed), 1 / length])
    limits = np.array([lower, -1e-9]), np.array([upper, 1.0])
    problem, start = _point_curve(given, (SPEED, SHARE), units, limits, point, 0.0, method)
    if not bool(start.converged[0]):
        return Followed(None, "lost", 0.0)
    ahead = float(start.tangent[0, -1])
    first = min(LONGEST, length / max(abs(ahead), 1e-3))
    control = StepControl(first=first, longest=max(LONGEST, first), shortest=min(SHORTEST, first), most=MOST)
    (path,) = _followed(problem, start.turned(np.sign(ahead)), control).curves
    row = path.row
    share = row.u[:, -1] / length
    if share[-1] >= 1:
        return _solved(other, _landed(problem, row, share, point), name, method)
    reach = float(np.max(share))
    if row.tangent[-1, -1] < 0:
        return Followed(None, "turned back", reach)
    return Followed(None, "left the range" if path.ended == "range" else "lost", reach)


def _landed(problem: ContinuationProblem, row: Points, share: np.ndarray, point: Point) -> Point:
    """Return the point at the new design, by a cubic through a curve's last two points and their tangents."""
    (a, b), (sa, sb) = row.take(slice(-2, None)).u, share[-2:]
    da, db = (t * (sb - sa) / (t[-1] * problem.units[1]) for t in row.tangent[-2:])
    s = (1 - sa) / (sb - sa)
    u = a + s * (b - a) + s * (1 - s) * ((1 - s) * (da - (b - a)) + s * ((b - a) - db))
    speed = float(problem.values(u)[0])
    return dataclasses.replace(point, speed=speed, value=speed, state=problem.states(u), steps=int(row.steps[-1]))


def _solved(system: AbstractForcedSystem, point: Point, name: str, method: AbstractMethod | None) -> Followed:
    """Solve for the edge at the new design."""
    edge = sensitivity(system, point, name, method)
    if edge.status == "other kind":
        return Followed(None, "neutral saddle")
    near = abs(edge.value_rpm - float(point.speed_rpm)) < SAME_EDGE * float(point.speed_rpm)
    return Followed(edge) if np.isfinite(edge.value_rpm) and near else Followed(None, "lost")


def follow_all(
    system: AbstractForcedSystem,
    points: Mapping[str, Point],
    other: AbstractForcedSystem,
    limits: tuple[float, float],
    method: AbstractMethod | None = None,
) -> dict[str, Followed]:
    """Follow each edge to another design, on all cores."""
    lower, upper = limits
    one = lambda name: follow(system, points[name], other, lower=lower, upper=upper, name=name, method=method)
    return dict(zip(points, in_parallel(one, list(points)), strict=True)) if points else {}
