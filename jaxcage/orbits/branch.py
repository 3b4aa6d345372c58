"""Branches of periodic orbits over a parameter, with their bifurcations."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from .._arguments import require_at_least, require_x64
from .._errors import ArgumentError
from .._pytrees import Scalar
from ..models import AbstractForcedSystem
from ..quantities import notebook_html
from ..solve import IMPLICIT, AbstractMethod
from .continuation import Continuation, ContinuationProblem, Event, Path, Start, orbit_curves
from .location import Place, bifurcations_of
from .orbit import NearOrbit, Orbit
from .point import UNEXPLAINED, Outcome, Point, read_start
from .problem import SETTLED, SPEED, Given, Parameter, name_of, without_turns
from .step_length import Points, StepControl


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
    `inaccurate`, the error is too large even with the most steps."""
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
    periods: int | None = None,
    steps: StepControl = StepControl(),
    method: AbstractMethod | None = None,
) -> Branch:
    """Follow a branch of periodic orbits in both directions from `orbit`, by pseudo-arclength continuation.

    **Arguments:**

    - `system`: any forced system.
    - `orbit`: an `Orbit`, a `Point`, or a pair (state [SI], value of the parameter) near an orbit.
    - `parameter`: `"speed"`, the name of a parameter, or a function that picks it from the system.
    - `lower`, `upper`: range of the parameter [SI], in which `orbit` lies.
    - `speed`: speed [rad/s], if it is not the parameter; by default that of `orbit`.
    - `periods`: revolutions after which the orbit closes; by default those of `orbit`, else 1.
    - `steps`: step lengths; in units of 1/20 of the range for the parameter, and of the system's scale for the state.

    **Returns:** `Branch`. **Raises:** `ValueError` if there is no orbit near `orbit`, or if the range is not finite;
    `RuntimeError` without double precision.
    """
    require_x64()
    if periods is None:
        periods = int(orbit.periods) if isinstance(orbit, Orbit | Point) else 1
    require_at_least(1, periods=periods)
    start = read_start("orbit", orbit, system, parameter, speed)
    problem = orbit_curves(Given(system, start.speed), parameter, lower, upper, method, periods)
    at = float(start.at)
    problem.require_inside("orbit", at)
    if method is None and isinstance(orbit, Orbit) and orbit.solver == IMPLICIT:
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
    if problem.counts.chooses and not np.any(first.converged):  # Runge-Kutta may need too many steps
        problem = problem.by_rodas4()
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
    located = bifurcations_of(problem, [points for points, _ in rows])
    found = {i: _branch(problem, *one, ended) for i, one, (_, ended) in zip(kept, located, rows, strict=True)}
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
    order = np.arange(count + 1) + int(np.argmin(stable[:-1]))
    around = row.u[-1] - row.u[0]
    turned = np.outer(order // count, around - without_turns(around, problem.turns))  # where angles turn on the way
    row = row.take(order % count)
    return row._replace(u=row.u + turned), ("closed", "closed")


def _branch(problem: ContinuationProblem, points: Points, places: Sequence[Place], ended: tuple[str, str]) -> Branch:
    stable = problem.unstable(points) == 0
    before = [place.after for place in places]
    # If several lie between two points, only the outer ones are next to an orbit of known stability.
    outer = lambda i, k: (stable[k] and k not in before[:i]) or (stable[k + 1] and k not in before[i + 1 :])
    special = [_point(problem, place, bool(outer(i, place.after))) for i, place in enumerate(places)]
    value, ends = problem.values(points.u)[:, 0], np.array([problem.lower[0], problem.upper[0]])
    for end in ends:  # as given, not as rounded in the unit of the parameter
        value = np.where(np.abs(value - end) <= 1e-12 * np.abs(ends).max(), end, value)
    speed = value if problem.parameter == SPEED else np.full(value.shape, float(problem.given.speed))
    state, multipliers = problem.states(points.u), problem.multipliers(points)
    name, periods = name_of(problem.parameter), int(problem.equations.problem.periods)
    accuracy = points.steps, points.error
    return Branch(name, value, speed, state, multipliers, stable, tuple(special), periods, ended, *accuracy)


def _point(problem: ContinuationProblem, place: Place, edge: bool) -> Point:
    kind, p, unit = place.kind, place.point, problem.units[0]
    assert p is not None
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
        outcome=Outcome.UNEXPLAINED if kind == UNEXPLAINED else Outcome.NOT_CONVERGED if lost else Outcome.FOUND,
        index=place.after,
        edge=edge,
    )
