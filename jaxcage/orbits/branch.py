"""Branches of periodic orbits over a parameter, with their bifurcations, and period-doubling cascades."""

import dataclasses
import itertools
import math
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from .._arguments import require_at_least, require_x64
from .._errors import ArgumentError
from .._pytrees import Scalar
from ..analysis import Edge
from ..models import AbstractForcedSystem
from ..quantities import notebook_html
from ..solve import AbstractMethod, Rodas4
from .arclength import Points, StepControl
from .continuation import (
    ONCE,
    Continuation,
    ContinuationProblem,
    Event,
    Path,
    Start,
    correct,
    first_points,
    orbit_curves,
)
from .location import Place, bifurcations_of
from .orbit import NearOrbit, Orbit
from .point import CRITICAL, UNEXPLAINED, Outcome, Point, read_start, require_found, test_functions
from .problem import SETTLED, SPEED, Given, Parameter, name_of


FEIGENBAUM = 4.669201609102990
AMPLITUDE, SMALLEST_AMPLITUDE = 0.02, 1e-5
"""Distance from the period doubling at which the doubled branch is entered, and the smallest one tried."""


@dataclasses.dataclass(frozen=True)
class Branch:
    """Orbits in order along a branch, and its bifurcations: values of the parameter and states at phase 0 [SI], speeds
    [rad/s], `steps` per revolution, and `error` as in `Orbit`."""

    parameter: str
    value: Float[np.ndarray, " points"]
    speed: Float[np.ndarray, " points"]
    state: Float[np.ndarray, "points dim"]
    multipliers: Complex[np.ndarray, "points dim"]
    stable: Bool[np.ndarray, " points"]
    special: tuple[Point, ...]
    periods: int
    ended: tuple[str, str]
    """Reason for each end, first and last: `range`, the branch leaves the range; `closed`; `steps`, the maximum number
    was taken; `stopped`, by another branch or after many unstable orbits; `stuck`, no further orbit was found;
    `inaccurate`, the error is too large even with the most steps; `doubling`, it begins at a period doubling."""
    steps: Int[np.ndarray, " points"]
    error: Float[np.ndarray, " points"]

    @property
    def speed_rpm(self) -> Float[np.ndarray, " points"]:
        """Speeds [rpm]."""
        return self.speed * 30 / np.pi

    def __str__(self) -> str:
        head = (
            f"Branch of period-{self.periods} orbits: {self.value.size} points, {self.parameter} from "
            f"{self.value.min():.6g} to {self.value.max():.6g}, {np.mean(self.stable):.0%} stable, "
            f"ends: {', '.join(self.ended)}"
        )
        rows = [
            f"  {p.kind:<16} {p.parameter} = {p.value:.8g} ± {p.error:.1g}, multiplier {p.critical:.4f}, {p.status}"
            for p in self.special
        ]
        return "\n".join([head, *rows])

    _repr_html_ = notebook_html


def branch(
    system: AbstractForcedSystem,
    orbit: NearOrbit,
    parameter: Parameter = SPEED,
    *,
    lower: float,
    upper: float,
    speed: Scalar | None = None,
    periods: int = 1,
    steps: StepControl = StepControl(),
    method: AbstractMethod | None = None,
) -> Branch:
    """Follow a branch of periodic orbits in both directions from `orbit`, by pseudo-arclength continuation.

    **Arguments:**

    - `orbit`: an `Orbit`, a `Point`, or a pair (state, value of the parameter) near an orbit.
    - `parameter`: `"speed"`, the name of a parameter, or a function that picks it from the system.
    - `lower`, `upper`: range of the parameter [SI], in which `orbit` lies.
    - `speed`: speed [rad/s], if it is not the parameter and `orbit` does not contain it.
    - `steps`: step lengths; in units of 1/20 of the range for the parameter, and of the system's scale for the state.

    **Raises:** `ValueError` if there is no orbit near `orbit`, or if the range is not finite.
    """
    require_x64()
    require_at_least(1, periods=periods)
    start = read_start("orbit", orbit, system, parameter, speed)
    if isinstance(orbit, Orbit | Point):
        periods = int(orbit.periods)
    problem = orbit_curves(Given(system, start.speed), parameter, lower, upper, method, periods)
    at = float(start.at)
    problem.require_inside("orbit", at)
    if method is None and isinstance(orbit, Orbit) and isinstance(orbit.solver, Rodas4):
        problem = problem.by_rodas4()
    (found,) = follow_both_ways(problem, [(np.asarray(start.state), at)], steps)
    if found is None:
        raise ArgumentError("orbit", said=f"must be near a periodic orbit, but none is near it at {at:g}.")
    return found


def follow_both_ways(
    problem: ContinuationProblem,
    guesses: Sequence[Start],
    control: StepControl,
    patience: int | float = math.inf,
    events: Sequence[Event] = (),
) -> list[Branch | None]:
    """Follow a branch through each guess, a state [SI] and a value of the parameter.

    A curve ends where it meets another one, so that one branch may be returned in two parts; by one of the events; and
    after `patience` unstable orbits in a row, since such a branch may be endless.

    **Returns:** one `Branch` per guess, None for a guess that is not near an orbit, or on the branch of an earlier one.
    """
    problem = problem.around(guesses[0][1]).with_stable_steps(guesses[0])
    first = problem.orbits_near(guesses)
    count = len(guesses)
    taken = ~first.converged
    unstable = [0] * (2 * count)

    def meets_another(curve: Path) -> str:
        own = curve.number % count
        for other in range(own + 1, count):
            taken[other] |= curve.passes(first.u[other][None])
        others = [c for c in walk.curves if c.number % count != own and not taken[c.number % count]]
        points = [p.u for c in others if len(c.points) > 1 for p in c.points]
        return "stopped" if points and curve.passes(np.stack(points)) else ""

    def stops(curve: Path) -> str:
        calm = problem.unstable(curve.points[-1]) == 0
        unstable[curve.number] = 0 if calm else unstable[curve.number] + 1
        return "stopped" if taken[curve.number % count] or unstable[curve.number] >= patience else ""

    both = first.take(np.tile(np.arange(count), 2)).turned(np.repeat([1.0, -1.0], count))
    walk = Continuation(problem, both, control, (stops, *events, meets_another))
    walk.finished()
    kept = [i for i in range(count) if not taken[i]]
    rows = [_joined(problem, walk.curves[i], walk.curves[i + count]) for i in kept]
    found = dict(zip(kept, described(problem, rows), strict=True))
    return [found.get(i) for i in range(count)]


def _joined(problem: ContinuationProblem, up: Path, down: Path) -> tuple[Points, tuple[str, str]]:
    """Return both directions as one row of points, and the reasons why they end.

    A closed curve was followed twice; it is returned once, from an unstable orbit on, so that no stable part is cut.
    """
    if "closed" not in (up.ended, down.ended):
        return up.row.after(down.row), (down.ended, up.ended)
    row = (up if up.ended == "closed" else down).row
    stable = problem.unstable(row) == 0
    count = stable.size - 1  # the last point is past the first
    order = (np.arange(count + 1) + int(np.argmin(stable[:-1]))) % count
    return row.take(order), ("closed", "closed")


def described(problem: ContinuationProblem, rows: Sequence[tuple[Points, tuple[str, str]]]) -> list[Branch]:
    """Return branches from their points and ends, after locating the bifurcations of all at the same time."""
    found = bifurcations_of(problem, [points for points, _ in rows])
    return [_branch(problem, *row, ended) for row, (_, ended) in zip(found, rows, strict=True)]


def _branch(problem: ContinuationProblem, points: Points, places: Sequence[Place], ended: tuple[str, str]) -> Branch:
    stable = problem.unstable(points) == 0
    before = [place.after for place in places]
    # If several lie between two points, only the outer ones are next to an orbit of known stability.
    outer = lambda i, k: (stable[k] and k not in before[:i]) or (stable[k + 1] and k not in before[i + 1 :])
    special = [_point(problem, place, bool(outer(i, place.after))) for i, place in enumerate(places)]
    value = problem.values(points.u)[:, 0]
    speed = value if problem.parameter == SPEED else np.full(value.shape, float(problem.given.speed))
    state, multipliers = problem.states(points.u), problem.multipliers(points)
    name, periods = name_of(problem.parameter), int(problem.equations.problem.periods)
    accuracy = points.steps, points.error
    return Branch(name, value, speed, state, multipliers, stable, tuple(special), periods, ended, *accuracy)


def _point(problem: ContinuationProblem, place: Place, edge: bool) -> Point:
    kind, p, unit = place.kind, place.point, problem.units[0]
    assert p is not None
    direction = np.zeros(problem.scale.size)
    if kind in CRITICAL:
        direction = np.linalg.svd(problem.equations.monodromy(p) - CRITICAL[kind] * np.eye(direction.size))[2][-1]
    at, error = float(problem.values(p.u)[0]), place.error * unit
    lost = kind != UNEXPLAINED and error > SETTLED * max(abs(at), unit)
    value = float("nan") if lost else at
    speed = value if problem.parameter == SPEED else value - value + float(problem.given.speed)
    return Point(
        kind,
        speed,
        problem.states(p.u),
        int(problem.equations.problem.periods),
        int(p.steps),
        name_of(problem.parameter),
        value,
        error,
        problem.multipliers(p),
        direction * problem.scale,
        outcome=Outcome.UNEXPLAINED if kind == UNEXPLAINED else Outcome.NOT_CONVERGED if lost else Outcome.FOUND,
        index=place.after,
        edge=edge,
    )


# --- period doublings ----------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Cascade:
    """Successive period doublings of an orbit, and the parameter value at which they accumulate [SI].

    The limit is extrapolated with Feigenbaum's ratio, and NaN with fewer than two points. Its error is the difference
    of the last two extrapolations plus the weighted errors of the last two points, and infinite with fewer than three.
    `ended` is the reason if there are fewer points than requested.
    """

    points: tuple[Point, ...]
    limit: float
    error: float
    ended: str = ""

    @property
    def values(self) -> tuple[float, ...]:
        """Parameter values at the period doublings [SI]."""
        return tuple(float(p.value) for p in self.points)

    def as_edge(self, kind: str) -> Edge:
        """Return the limit of a cascade over speed as the edge of a chaotic zone."""
        return Edge(self.limit * 30 / np.pi, self.error * 30 / np.pi, kind, "period-doubling", "cascade")

    def __str__(self) -> str:
        rows = [
            f"  period {int(p.periods)} to {2 * int(p.periods)}: {float(p.value):.10g} ± {float(p.error):.1g}"
            for p in self.points
        ]
        last = [f"  ended: {self.ended}"] if self.ended else []
        return "\n".join(["Period-doubling cascade", *rows, f"  limit {self.limit:.10g} ± {self.error:.1g}", *last])

    _repr_html_ = notebook_html


def cascade(
    system: AbstractForcedSystem,
    point: Point,
    parameter: Parameter = SPEED,
    *,
    lower: float,
    upper: float,
    levels: int = 4,
    method: AbstractMethod | None = None,
) -> Cascade:
    """Follow a period-doubling cascade: each doubled branch up to its own first period doubling.

    **Arguments:** system; first period doubling, of an orbit of any period; parameter and its range [SI]; number of
    doublings; integration method.

    **Raises:** `ValueError` for a point that is not a period doubling, or was not found.
    """
    require_x64()
    if point.kind != "period-doubling":
        raise ArgumentError("point", said=f"must be a period doubling, but it is a {point.kind}.")
    require_found(point)
    require_at_least(1, levels=levels)
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    problem = orbit_curves(given, parameter, lower, upper, method)
    points, ended = [point], ""
    while len(points) < levels and not ended:
        doubled = _doubled(problem, points[-1], AMPLITUDE / 2 ** (len(points) - 1))
        if doubled is None:
            ended = f"no doubled branch begins at {float(points[-1].value):g}"
            break
        following = [p for p in doubled.special if p.kind == "period-doubling" and p.status == "converged"]
        if not following:
            ended = f"the branch of period {doubled.periods} does not double again (ends: {doubled.ended[1]})"
        points += following[:1]
    pairs = itertools.pairwise(float(p.value) for p in points)
    limits = [b + (b - a) / (FEIGENBAUM - 1) for a, b in pairs] or [float("nan")]
    error = abs(limits[-1] - limits[-2]) if len(limits) > 1 else float("inf")
    located = sum(w * float(np.nan_to_num(p.error)) for w, p in zip((1 + 1 / (FEIGENBAUM - 1), 0.3), points[::-1]))
    return Cascade(tuple(points), limits[-1], error + located, ended)


def _doubled(problem: ContinuationProblem, point: Point, amplitude: float) -> Branch | None:
    """Follow the doubled branch from `amplitude` (in units of the scale) along the critical direction to its own first
    period doubling; None if no branch is found."""
    at, periods = float(point.value), int(point.periods)
    problem, half = problem.around(at, 2 * periods), problem.around(at, periods)
    test = lambda points: test_functions(problem.multipliers(points))["period-doubling"]
    u = problem.unknowns(point.state, at)[None]
    across = np.append(np.asarray(point.direction) / problem.scale, 0.0)[None]
    across /= np.linalg.norm(across)
    while amplitude > SMALLEST_AMPLITUDE:
        start = first_points(problem, u + amplitude * across, across, int(point.steps))
        near = start.converged[0] and abs(start.u[0, -1] - u[0, -1]) < 1.0
        once = correct(half, start.u, across, start.steps, ONCE)  # one Newton step with half the period
        away = np.linalg.norm(once.jacobian[0] @ (start.u - once.u)[0])  # zero on the branch of half the period
        if near and test(start)[0] > 0 and away > amplitude:
            doubles: Event = lambda path: "stopped" if test(path.points[-1]) < 0 else ""
            (path,) = Continuation(problem, start, StepControl(first=0.01), (doubles,)).finished()
            return described(problem, [(path.row, ("doubling", path.ended))])[0]
        amplitude /= 4
    return None
