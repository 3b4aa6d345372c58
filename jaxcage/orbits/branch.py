"""Branches of periodic orbits over a parameter, with their bifurcations, and period-doubling cascades."""

import dataclasses
import itertools
import math
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from .._types import Scalar
from ..analysis import Edge
from ..integrate import AbstractMethod, Rodas4
from ..models import AbstractForcedSystem, require_speeds
from .continuation import (
    ONCE,
    Continuation,
    ContinuationProblem,
    Curve,
    Event,
    correct,
    first_points,
    in_a_row,
    orbit_curves,
    orbits_near,
    passes,
    require_range,
    require_within,
    take,
    turned,
    with_stable_steps,
)
from .location import Place, bifurcations_of
from .orbit import NearOrbit, Orbit, guess_state
from .point import (
    CRITICAL,
    FOUND,
    NOT_CONVERGED,
    NOT_EXPLAINED,
    UNEXPLAINED,
    Point,
    require_found,
    test_functions,
    value_at,
)
from .problem import SPEED, Given, Parameter, name_of
from .step_control import Points, StepControl
from .step_counts import SETTLED


FEIGENBAUM = 4.669201609102990
SMALLEST_AMPLITUDE = 1e-5
"""A doubled branch is looked for down to this distance from its period doubling."""


@dataclasses.dataclass(frozen=True)
class Branch:
    """Orbits in order along a branch."""

    parameter: str
    value: Float[np.ndarray, " points"]
    """Values of the parameter [SI]."""
    speed: Float[np.ndarray, " points"]
    """Speeds [rad/s]."""
    state: Float[np.ndarray, "points dim"]
    """States at phase 0 [SI]."""
    multipliers: Complex[np.ndarray, "points dim"]
    stable: Bool[np.ndarray, " points"]
    special: tuple[Point, ...]
    """Bifurcations, in order along the branch."""
    periods: int
    ended: tuple[str, str]
    """Why it ends where it begins and where it ends: `range`, it leaves the range; `closed`; `steps`, the largest
    number; `stopped`, on another branch or after many unstable orbits; `stuck`, no further orbit was found;
    `inaccurate`, the finest steps do not tell where it is; `doubling`, it forks off."""
    steps: Int[np.ndarray, " points"]
    """Steps per revolution."""
    error: Float[np.ndarray, " points"]
    """Error of each orbit (see `Orbit.error`)."""

    @property
    def speed_rpm(self) -> Float[np.ndarray, " points"]:
        """Speeds in revolutions per minute."""
        return self.speed * 30 / np.pi

    def __str__(self) -> str:
        head = (
            f"Branch of period-{self.periods} orbits: {self.value.size} points, {self.parameter} from "
            f"{self.value.min():.6g} to {self.value.max():.6g}, {np.mean(self.stable):.0%} stable, "
            f"ends: {', '.join(self.ended)}"
        )
        rows = [
            f"  {p.kind:<16} {p.parameter} = {p.value:.8g} +- {p.error:.1g}, multiplier {p.critical:.4f}, {p.status}"
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
    """Follow a branch of periodic orbits both ways from `orbit`, by pseudo-arclength continuation.

    **Arguments:**

    - `orbit`: an `Orbit`, a `Point`, or a pair (state, value of the parameter) near an orbit.
    - `parameter`: `"speed"`, the name of a parameter, or a function that picks it from the system.
    - `lower`, `upper`: range of the parameter [SI], in which `orbit` lies.
    - `speed`: speed [rad/s], if it is not the parameter and `orbit` does not have it.
    - `steps`: step lengths; in units of 1/20 of the range for the parameter, and of the system's scale for the state.

    **Raises:** `ValueError` if there is no orbit to start from, or if the range is not finite.
    """
    require_x64()
    require_at_least(1, periods=periods)
    require_range(parameter, lower, upper)
    if isinstance(orbit, Orbit | Point):
        speed, periods = orbit.speed, int(orbit.periods)
        state, at = orbit.state, value_at(orbit, system, speed, parameter)
    else:
        state, at = orbit
    known_speed = at if parameter == SPEED else speed
    if known_speed is None:
        raise ArgumentError("speed", said=f"must be given where the parameter is `{parameter}`, but it is not.")
    require_speeds(system, known_speed)
    require_within("orbit", float(at), lower, upper)
    given = Given(system, jnp.asarray(known_speed, dtype=float))
    problem = orbit_curves(given, parameter, lower, upper, method, periods)
    if method is None and isinstance(orbit, Orbit) and isinstance(orbit.solver, Rodas4):
        problem = problem.by_rodas4()
    state = guess_state(system, known_speed, state)
    (found,) = follow_both_ways(problem, [(np.asarray(state), float(at))], steps)
    if found is None:
        raise ArgumentError("orbit", said=f"must be near a periodic orbit, but none is near it at {float(at):g}.")
    return found


def follow_both_ways(
    problem: ContinuationProblem,
    starts: Sequence[tuple[np.ndarray, float]],
    control: StepControl,
    patience: int | float = math.inf,
    events: Sequence[Event] = (),
) -> list[Branch | None]:
    """Follow a branch through each start, a state [SI] and a value of the parameter.

    A curve that comes upon another one ends there: one branch may come in two parts. It also ends after `patience`
    unstable orbits in a row, since such a branch may wind without end, or by one of the events.

    **Returns:** None for a start that is not near an orbit, or lies on the branch of an earlier one.
    """
    problem = with_stable_steps(problem.around(starts[0][1]), starts[0])
    first = orbits_near(problem, starts)
    count = len(starts)
    taken = ~first.converged
    unstable = [0] * (2 * count)

    def meets_another(curve: Curve) -> str:
        own, step = curve.number % count, (curve.points[-2].u, curve.points[-1].u)
        for other in range(own + 1, count):
            taken[other] |= passes(*step, first.u[other][None])
        others = [c for c in walk.curves if c.number % count != own and not taken[c.number % count]]
        points = [p.u for c in others if len(c.points) > 1 for p in c.points]
        return "stopped" if points and passes(*step, np.stack(points)) else ""

    def stops(curve: Curve) -> str:
        calm = problem.unstable(curve.points[-1]) == 0
        unstable[curve.number] = 0 if calm else unstable[curve.number] + 1
        return "stopped" if taken[curve.number % count] or unstable[curve.number] >= patience else ""

    both = turned(take(first, np.tile(np.arange(count), 2)), np.repeat([1.0, -1.0], count))
    walk = Continuation(problem, both, control, (stops, *events, meets_another))
    for _ in walk:
        pass
    kept = [i for i in range(count) if not taken[i]]
    rows = [_joined(problem, walk.curves[i], walk.curves[i + count]) for i in kept]
    found = dict(zip(kept, described(problem, rows), strict=True))
    return [found.get(i) for i in range(count)]


def _joined(problem: ContinuationProblem, up: Curve, down: Curve) -> tuple[Points, tuple[str, str]]:
    """Return both directions as one row of points, and why they end.

    A closed curve, which was gone round twice, is taken once, from an unstable orbit on, so that no stable part is cut.
    """
    if "closed" not in (up.ended, down.ended):
        return in_a_row(down.row, up.row), (down.ended, up.ended)
    row = (up if up.ended == "closed" else down).row
    stable = problem.unstable(row) == 0
    count = stable.size - 1  # the last point is past the first
    order = (np.arange(count + 1) + int(np.argmin(stable[:-1]))) % count
    return take(row, order), ("closed", "closed")


def described(problem: ContinuationProblem, rows: Sequence[tuple[Points, tuple[str, str]]]) -> list[Branch]:
    """Return branches from their points and ends, with the bifurcations of all located at the same time."""
    found = bifurcations_of(problem, [points for points, _ in rows])
    return [_branch(problem, *row, ended) for row, (_, ended) in zip(found, rows, strict=True)]


def _branch(problem: ContinuationProblem, points: Points, places: Sequence[Place], ended: tuple[str, str]) -> Branch:
    stable = problem.unstable(points) == 0
    value = problem.values(points.u)[:, 0]
    periods, name = int(problem.problem.periods), name_of(problem.parameter)
    before = [place.after for place in places]
    special = []
    for i, place in enumerate(places):
        k, kind, p, error = place.after, place.kind, place.point, place.error * problem.unit
        assert p is not None
        direction = np.zeros(problem.scale.size)
        if kind in CRITICAL:
            singular = problem.equations.monodromy(p) - CRITICAL[kind] * np.eye(direction.size)
            direction = np.linalg.svd(singular)[2][-1]
        # Of several between two points, only the outer ones are next to orbits whose stability is known.
        edge = bool((stable[k] and k not in before[:i]) or (stable[k + 1] and k not in before[i + 1 :]))
        at = float(problem.values(p.u)[0])
        settled = NOT_CONVERGED if error > SETTLED * max(abs(at), problem.unit) else FOUND
        outcome = NOT_EXPLAINED if kind == UNEXPLAINED else settled
        known = float("nan") if outcome == NOT_CONVERGED else 1.0
        special.append(
            Point(
                kind=kind,
                speed=known * (at if name == SPEED else float(problem.given.speed)),
                state=problem.states(p.u),
                periods=periods,
                steps=int(p.steps),
                parameter=name,
                value=at * known,
                error=error,
                multipliers=problem.multipliers(p),
                direction=direction * problem.scale,
                outcome=outcome,
                index=k,
                edge=edge,
            )
        )
    return Branch(
        parameter=name,
        value=value,
        speed=value if name == SPEED else np.full(value.shape, float(problem.given.speed)),
        state=problem.states(points.u),
        multipliers=problem.multipliers(points),
        stable=stable,
        steps=points.steps,
        error=points.error,
        special=tuple(special),
        periods=periods,
        ended=ended,
    )


# --- period doublings ----------------------------------------------------------------------------------------------


def doubled_branch(
    system: AbstractForcedSystem,
    point: Point,
    parameter: Parameter = SPEED,
    *,
    lower: float,
    upper: float,
    steps: StepControl = StepControl(first=0.01),
    amplitude: float = 0.02,
    until_doubling: bool = False,
    method: AbstractMethod | None = None,
) -> Branch:
    """Follow the branch of orbits of twice the period that begins at a period doubling.

    **Arguments:**

    - `point`: a period doubling, of an orbit of any number of revolutions.
    - `lower`, `upper`, `steps`: as for `branch`.
    - `amplitude`: distance from the doubling at which the branch is entered, along the critical direction in units of
        the system's scale.
    - `until_doubling`: end with the branch's own first period doubling.

    **Raises:** `ValueError` if the branch is not found.
    """
    require_x64()
    require_range(parameter, lower, upper)
    if point.kind != "period-doubling":
        raise ArgumentError("point", said=f"must be a period doubling, but it is a {point.kind}.")
    require_found(point)
    at, periods = float(point.value), int(point.periods)
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    problem = orbit_curves(given, parameter, lower, upper, method).around(at, 2 * periods)
    half = problem.around(at, periods)
    test = lambda points: test_functions(problem.multipliers(points))["period-doubling"]
    u = problem.unknowns(point.state, at)[None]
    across = np.append(np.asarray(point.direction) / problem.scale, 0.0)[None]
    across /= np.linalg.norm(across)
    while amplitude > SMALLEST_AMPLITUDE:
        start = first_points(problem, u + amplitude * across, across, int(point.steps))
        near = start.converged[0] and abs(start.u[0, -1] - u[0, -1]) < 1.0
        once = correct(half, start.u, across, start.steps, ONCE)  # where it is half of its revolutions later
        away = np.linalg.norm(once.jacobian[0] @ (start.u - once.u)[0])  # nothing if it is the orbit that doubles
        if near and test(start)[0] > 0 and away > amplitude:
            break
        amplitude /= 4
    else:
        raise ArgumentError("point", said=f"must be a period doubling, but no doubled branch begins at {at:g}.")
    doubles: Event = lambda curve: "stopped" if until_doubling and test(curve.points[-1]) < 0 else ""
    walk = Continuation(problem, start, steps, (doubles,))
    for _ in walk:
        pass
    (curve,) = walk.curves
    return described(problem, [(curve.row, ("doubling", curve.ended))])[0]


@dataclasses.dataclass(frozen=True)
class Cascade:
    """Period doublings of orbits of period 1, 2, 4, ... times the first one's."""

    points: tuple[Point, ...]
    """Fewer than asked for if the doubled branch was lost or does not double again (`ended`)."""
    limit: float
    """Where they accumulate [SI], extrapolated with Feigenbaum's ratio; NaN with fewer than two points."""
    error: float
    """Distance of the last two extrapolations and errors of the last two points; infinite with fewer than three."""
    ended: str = ""
    """Why there are not as many points as were asked for."""

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the parameter [SI]."""
        return tuple(float(p.value) for p in self.points)

    def as_edge(self, kind: str) -> Edge:
        """Return the limit, of a cascade over speed, as the edge of a chaotic zone."""
        return Edge(self.limit * 30 / np.pi, self.error * 30 / np.pi, kind, "period-doubling", "cascade")

    def __str__(self) -> str:
        rows = [
            f"  period {int(p.periods)} to {2 * int(p.periods)}: {float(p.value):.10g} +- {float(p.error):.1g}"
            for p in self.points
        ]
        last = [f"  ended: {self.ended}"] if self.ended else []
        return "\n".join(["Period-doubling cascade", *rows, f"  limit {self.limit:.10g} +- {self.error:.1g}", *last])

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
    """Follow a period-doubling cascade from the doubling of a period-1 orbit.

    **Arguments:** system; first point; parameter and its range [SI]; number of doublings; integration method.
    """
    require_x64()
    require_range(parameter, lower, upper)
    require_found(point)
    require_at_least(1, levels=levels)
    points, amplitude, ended = [point], 0.02, ""
    while len(points) < levels:
        try:
            doubled = doubled_branch(
                system,
                points[-1],
                parameter,
                lower=lower,
                upper=upper,
                amplitude=amplitude,
                until_doubling=True,
                method=method,
            )
        except ValueError as error:
            ended = str(error)
            break
        following = [p for p in doubled.special if p.kind == "period-doubling" and p.status == "converged"]
        if not following:
            ended = f"the branch of period {doubled.periods} does not double again (ends: {doubled.ended[1]})"
            break
        points.append(following[0])
        amplitude /= 2
    pairs = itertools.pairwise(float(p.value) for p in points)
    limits = [b + (b - a) / (FEIGENBAUM - 1) for a, b in pairs] or [float("nan")]
    error = abs(limits[-1] - limits[-2]) if len(limits) > 1 else float("inf")
    located = sum(w * float(np.nan_to_num(p.error)) for w, p in zip((1 + 1 / (FEIGENBAUM - 1), 0.3), points[::-1]))
    return Cascade(tuple(points), limits[-1], error + located, ended)
