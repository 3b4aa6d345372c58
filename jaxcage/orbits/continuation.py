"""Pseudo-arclength continuation of many curves of solutions at a time, as an iterator over (problem, points); the step
control is in `step_length.py`.

A curve R(u) = 0 with one more unknown than equations is followed through folds, whether stable or not: the step control
predicts a point, the corrector finds the point of the curve on the plane through it, and events end the curve. Each of
the three is an argument of `Continuation`. Every curve has its own step length and number of steps per revolution;
corrections of all curves run in chunks of one compiled program on all cores.
"""

import concurrent.futures
import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError
from .._pytrees import compiled
from ..solve import AbstractMethod, cores
from .newton import TOLERANCE, AbstractEquations, solve
from .orbit import OrbitEquations
from .point import eigenvalues
from .problem import (
    ENDLESS,
    GIVEN_UP,
    SETTLED,
    SPEED,
    Counts,
    Given,
    Parameter,
    by_steps,
    counted,
    make_problem,
    without_turns,
)
from .step_length import Points, StepControl


CHUNK = 8  # points per call: up to eight cost as much as one, since they share vector instructions
FOLLOWING, OF_A_STEP = 1e-6, 1e-5  # tolerance of Newton's method in the unknowns' units, and relative to a short step
ONCE = 1e300  # tolerance for a single step of Newton's method; infinity would give NaN where an unknown is zero
CORRECTIONS = 8
LOOSE = 10.0  # errors may exceed the tolerance by this factor during continuation
COARSER = 100.0  # the steps per revolution are halved if errors are this factor below that limit
MOVED = 0.1  # largest change on halving the steps, over the step's length; a larger one may make the curve an artefact
CROSSED, ASIDE = 1e-4, 0.01
"""A step across which the orientation changes is halved down to the first length. If it still changes, the curve
crosses another one there, and one step leads across from the second distance before it, as tangents are lost to
rounding nearer to the crossing."""
Start = tuple[np.ndarray, float]
"""A state [SI] and the value of the parameter."""


@dataclasses.dataclass(frozen=True, eq=False)
class ContinuationProblem:
    """Equations of orbits or of bifurcation points, and the range in which their curves are followed.

    It is no `equinox.Module`, of which each call of a method makes a new one: there are thousands on a branch.
    """

    equations: AbstractEquations
    given: Given
    counts: Counts
    lower: Float[np.ndarray, " parameters"]
    upper: Float[np.ndarray, " parameters"]

    @functools.cached_property
    def parameter(self) -> Parameter:
        """The first free parameter."""
        return self.equations.problem.parameters[0]

    @functools.cached_property
    def units(self) -> np.ndarray:
        """Units of the free parameters."""
        return np.asarray(self.equations.problem.units)

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """Units of the state."""
        return np.asarray(self.equations.problem.scale)

    @functools.cached_property
    def turns(self) -> np.ndarray:
        """Revolutions of the unknowns that are angles."""
        return np.append(self.equations.problem.turns, np.full(self.units.size, ENDLESS))

    def around(self, at: float) -> "ContinuationProblem":
        """Return the problem of orbits in the system's scale at a value of the parameter."""
        mine, there = self.equations.problem, self.given.changed(self.parameter, jnp.asarray(at, dtype=float))
        problem = make_problem(there, mine.parameters, mine.units, mine.periods, mine.method)
        return dataclasses.replace(self, equations=OrbitEquations(problem))

    def by_rodas4(self) -> "ContinuationProblem":
        """Return the problem with Rodas4, which chooses its number of steps."""
        method, counts = counted(None, solver="rodas4")
        equations = eqx.tree_at(lambda e: e.problem.method, self.equations, method)
        return dataclasses.replace(self, equations=equations, counts=counts)

    def with_stable_steps(self, start: Start) -> "ContinuationProblem":
        """Return the problem, with Rodas4 if it chooses its steps and Runge-Kutta is unstable at `start`."""
        if not self.counts.chooses or np.all(np.isfinite(self.around(start[1]).orbits_near([start]).jacobian)):
            return self
        return self.by_rodas4()

    def orbits_near(self, guesses: Sequence[Start], likely: np.ndarray | None = None) -> Points:
        """Find orbits near states at fixed values of the parameter (see `first_points` for `likely`)."""
        u = np.array([self.unknowns(state, value) for state, value in guesses])
        return first_points(self, u, np.eye(1, u.shape[1], u.shape[1] - 1).repeat(len(u), axis=0), likely=likely)

    def unknowns(self, state: Any, *values: float) -> np.ndarray:
        """Return the unknowns for a state and the parameters' values [SI]."""
        return np.array([*(np.asarray(state) / self.scale), *(np.array(values) / self.units)])

    def states(self, u: np.ndarray) -> np.ndarray:
        """Return states [SI], shape (..., dim)."""
        return u[..., : self.scale.size] * self.scale

    def values(self, u: np.ndarray) -> np.ndarray:
        """Return values of the parameters [SI], shape (..., parameters)."""
        return u[..., self.scale.size :] * self.units

    def inside(self, u: np.ndarray) -> bool:
        values = self.values(u)
        return bool(np.all((self.lower < values) & (values < self.upper)))

    def require_inside(self, name: str, at: float) -> None:
        """Raise `ArgumentError` for a first point outside the range of the first parameter."""
        lower, upper = self.lower[0], self.upper[0]
        slack = 1e-9 * max(abs(lower), abs(upper))  # speeds in rpm are rounded
        if not lower - slack <= at <= upper + slack:
            said = f"must begin from {lower:g} to {upper:g}, `lower` and `upper`, but is at {at:g}."
            raise ArgumentError(name, said=said)

    def multipliers(self, points: Points) -> np.ndarray:
        """Return the multipliers of each orbit, the largest first."""
        return eigenvalues(self.equations.monodromy(points))

    def unstable(self, points: Points, circle: float = 1.0) -> Any:
        """Return the number of multipliers of each orbit outside a circle of radius `circle`."""
        return np.sum(~(np.abs(self.multipliers(points)) < circle), axis=-1)


def orbit_curves(
    given: Given, parameter: Parameter, lower: float, upper: float, method: AbstractMethod | None, periods: int = 1
) -> ContinuationProblem:
    """Return the problem of branches of orbits over a parameter, in the system's scale at the given speed.

    **Raises:** `ArgumentError` for a range in which the parameter cannot be followed.
    """
    if not lower < upper:
        raise ArgumentError("upper", said=f"must be above `lower`, but they are {upper:g} and {lower:g}.")
    if not -math.inf < lower < upper < math.inf:
        raise ArgumentError("lower", "upper", said=f"must be finite, but are {lower:g} and {upper:g}.")
    if parameter == SPEED and lower <= 0:
        raise ArgumentError("lower", said=f"must be positive where the speed is followed, but {lower:g} was given.")
    chosen, counts = counted(method)
    problem = make_problem(given, (parameter,), [(upper - lower) / 20], periods, chosen)
    return ContinuationProblem(OrbitEquations(problem), given, counts, np.array([lower]), np.array([upper]))


# --- corrector -----------------------------------------------------------------------------------------------------


def _correct(
    equations: AbstractEquations, given: Any, at: Array, normal: Array, tolerance: Array, steps: Array, measured: Array
) -> Points:
    """Return the point and, if `measured`, its image under one step of Newton's method with half the steps."""

    def solved(plane: tuple[Array, Array], half: Array) -> tuple[tuple[Array, Array], Points]:
        at, normal = plane
        by = jnp.where(half, (steps + 1) // 2, steps)
        last, skip = jnp.where(half, ONCE, tolerance), half & ~measured

        def on_plane(u: Array) -> tuple[Array, Array, Any]:
            r, jacobian, aux = by_steps(equations, by).linearised(u, given)
            return jnp.append(r, jnp.dot(normal, u - at)), jnp.concatenate([jacobian, normal[None]]), aux

        u, found = solve(on_plane, at, CORRECTIONS, last, skip=skip, near=tolerance > TOLERANCE)
        jacobian = found.newton.jacobian[:-1]
        whole = jnp.concatenate([jacobian, normal[None]])
        tangent = jnp.linalg.solve(whole, jnp.zeros(u.size).at[-1].set(1.0))
        tangent = tangent / jnp.linalg.norm(tangent)
        fine = found.converged & jnp.all(jnp.isfinite(u)) & jnp.all(jnp.isfinite(tangent))
        unknown = jnp.full(3, jnp.nan)
        return (u, tangent), Points(u, tangent, jacobian, fine, found.aux, by, *unknown)

    return jax.lax.scan(solved, (at, normal), jnp.array([False, True]))[1]


_correct_chunk = compiled(eqx.filter_vmap(_correct, in_axes=(None, None, 0, 0, 0, None, None)))


def correct(
    problem: ContinuationProblem,
    at: Float[np.ndarray, "points n"],
    normal: Float[np.ndarray, "points n"],
    steps: np.ndarray,
    tolerance: Any = TOLERANCE,
    measured: bool = False,
) -> Points:
    """Find the points of curves on planes across them by Newton's method.

    **Arguments:** problem; points of the planes and their normals; steps per revolution of each; tolerance of Newton's
    method, of all or each; `measured`, to estimate errors by one step of Newton's method with half the steps.
    """
    measured = measured and int(problem.counts.last) > 1
    tolerance = np.broadcast_to(np.asarray(tolerance, dtype=float), len(at))
    chunks = []
    for count in np.unique(steps):  # points with the same number of steps run together
        mine = np.flatnonzero(steps == count)
        chunks += [mine[np.minimum(np.arange(i, i + CHUNK), mine.size - 1)] for i in range(0, mine.size, CHUNK)]

    def part(k: np.ndarray) -> Points:
        numbers = (np.asarray(x) for x in (at[k], normal[k], tolerance[k], steps[k[0]], measured))
        return jax.tree.map(np.asarray, _correct_chunk(problem.equations, problem.given, *numbers))

    parts = in_parallel(part, chunks)
    _, where = np.unique(np.concatenate(chunks), return_index=True)
    both = jax.tree.map(lambda *x: np.concatenate(x)[where], *parts)
    points, half = both.take((slice(None), 0)), both.take((slice(None), 1))
    if not measured:
        return points
    with np.errstate(invalid="ignore"):
        moved = points.u - half.u
        apart = *problem.equations.apart(moved, half.jacobian, points.jacobian), np.linalg.norm(moved, axis=1)
    lost = ~(half.converged & points.converged)
    error, excess, far = (np.where(lost, np.inf, x) for x in apart)
    return points._replace(error=error, excess=excess, moved=far)


def in_parallel(f: Callable[[Any], Any], each: Sequence[Any]) -> list[Any]:
    """Return f(x) for each x, evaluated on all cores."""
    if len(each) == 1:
        return [f(each[0])]
    with concurrent.futures.ThreadPoolExecutor(cores()) as pool:
        return list(pool.map(f, each))


def first_points(
    problem: ContinuationProblem,
    at: Float[np.ndarray, "points n"],
    normal: Float[np.ndarray, "points n"],
    steps: int = 0,
    likely: np.ndarray | None = None,
) -> Points:
    """Find points of curves on planes across them, each with as many steps as it needs, at least `steps`; if the first
    number of steps finds nothing, more are tried only for points that are `likely`, by default all."""
    counts = problem.counts
    first = int(counts.first if counts.chooses else counts.last)
    likely = np.ones(len(at), dtype=bool) if likely is None else likely
    found = correct(problem, at, normal, np.full(len(at), max(steps, first)), measured=True)
    while counts.chooses:
        given_up = ~found.converged & ((found.steps >= GIVEN_UP) | ~likely)
        again = np.flatnonzero(~(found.excess <= LOOSE) & ~given_up & (found.steps < int(counts.last)))
        if not again.size:
            break
        begin = np.where(found.converged[again, None], found.u[again], at[again])
        found = found.put(again, correct(problem, begin, normal[again], 2 * found.steps[again], measured=True))
    return found


def solved_again(
    problem: ContinuationProblem, row: Points, which: np.ndarray, steps: np.ndarray, corrector: Callable = correct
) -> Points:
    """Return the points with those at `which` solved for again with other steps, if that succeeds."""
    if not which.size:
        return row
    got = corrector(problem, row.u[which], row.tangent[which], steps)
    good = got.converged
    return row.put(which[good], got.take(good).with_errors_of(row.take(which[good])))


# --- iterator ------------------------------------------------------------------------------------------------------


@dataclasses.dataclass
class Path:
    """State of a curve during continuation: points, length of the next step, `steps` per revolution, `turns` of the
    unknowns that are angles, number, and reason why it `ended` (see `Branch.ended`), empty if it has not; if `crosses`,
    the next point may be beyond a crossing."""

    points: list[Points]
    length: float
    steps: int
    turns: np.ndarray
    number: int = 0
    ended: str = ""
    crosses: bool = False

    @property
    def row(self) -> Points:
        return Points.stacked(self.points)

    def passes(self, places: Float[np.ndarray, "places n"]) -> bool:
        """Return True if the last step goes through any of these places, or whole revolutions of the angles from it, to
        the accuracy of the chord."""
        step, way = self.points[-1].u - self.points[-2].u, without_turns(places - self.points[-2].u, self.turns)
        share = way @ step / np.dot(step, step)
        off = np.linalg.norm(share[:, None] * step - way, axis=1)
        return bool(np.any((share > 0) & (share <= 1) & (off < 0.2 * np.linalg.norm(step))))


Event = Callable[[Path], str]
"""Function that returns the reason why a curve ends at its last point, or an empty string."""


def closes(path: Path) -> str:
    """Event: the last step passed the first point in the same direction."""
    first, before, last = path.points[0], path.points[-2], path.points[-1]
    same = np.dot(last.u - before.u, first.tangent) > 0
    return "closed" if len(path.points) >= 8 and same and path.passes(first.u[None]) else ""


class Continuation:
    """Iterator that takes one step along each curve, and returns the curves that have a new point.

    A point whose error is too large is rejected: the steps per revolution are doubled, the last point is solved for
    again, and the step along the curve is repeated. If the error is small the steps per revolution are halved.

    **Arguments:** problem, which may be replaced between two steps; first points, each followed in the direction of its
    tangent; step control; further events; corrector; `oriented`, True if the equations keep their orientation along a
    curve, which they do not if the problem is replaced.
    """

    def __init__(
        self,
        problem: ContinuationProblem,
        start: Points,
        control: StepControl,
        events: Sequence[Event] = (),
        corrector: Callable[..., Points] = correct,
        oriented: bool = True,
    ):
        self.problem, self.control, self.corrector, self.oriented = problem, control, corrector, oriented
        leaves = lambda curve: "" if self.problem.inside(curve.points[-1].u) else "range"
        counts = lambda curve: "steps" if len(curve.points) > control.most else ""
        self.events = (leaves, *events, closes, counts)
        self.chooses = problem.counts.chooses
        self.least, self.most = int(problem.counts.first), int(problem.counts.last)
        self.curves = [
            Path([start.take(i)], control.first, int(steps), problem.turns, i, "" if start.converged[i] else "stuck")
            for i, steps in enumerate(start.steps)
        ]

    def finished(self) -> list[Path]:
        """Take all steps and return the curves, which end on the limits of the range where they leave it."""
        for _ in self:
            pass
        if left := [c for c in self.curves if c.ended == "range"]:
            self._cut(left)
        return self.curves

    def _cut(self, left: Sequence[Path]) -> None:
        """Replace the last points, which are outside the range, by those on its limits, where these are found."""
        problem, dim = self.problem, self.problem.scale.size
        before, beyond = (np.stack([c.points[k].u for c in left]) for k in (-2, -1))
        first, moved = problem.values(before), problem.values(beyond - before)
        limit = np.where(moved > 0, problem.upper, problem.lower)
        shares = np.divide(limit - first, moved, out=np.full(moved.shape, np.inf), where=moved != 0)
        row, which = np.arange(len(left)), np.argmin(shares, axis=1)
        share, normal = np.maximum(shares[row, which], 0.0), np.zeros(before.shape)
        at = before + share[:, None] * (beyond - before)
        at[row, dim + which], normal[row, dim + which] = (limit / problem.units)[row, which], np.sign(moved)[row, which]
        got = self.corrector(problem, at, normal, np.array([int(c.points[-1].steps) for c in left]), measured=True)
        near = got.converged & (np.linalg.norm(got.u - at, axis=1) < np.linalg.norm(beyond - before, axis=1))
        for i, curve in enumerate(left):
            if share[i] == 0:  # it begins on the limit
                curve.points.pop()
            elif near[i]:
                curve.points[-1] = got.take(i)

    def __iter__(self) -> "Continuation":
        return self

    def __next__(self) -> list[Path]:
        active = [c for c in self.curves if not c.ended]
        if not active:
            raise StopIteration
        changed = [c for c in active if c.steps != c.points[-1].steps]
        if changed:  # solve for the last points again with the present number of steps
            last, steps = Points.stacked([c.points[-1] for c in changed]), np.array([c.steps for c in changed])
            last = solved_again(self.problem, last, np.arange(len(changed)), steps, self.corrector)
            for i, c in enumerate(changed):
                c.points[-1] = last.take(i)
        ahead, normal = (
            np.stack(x) for x in zip(*(self.control.predict(c.points, c.length) for c in active), strict=True)
        )
        steps, lengths = (np.array([getattr(c, name) for c in active]) for name in ("steps", "length"))
        closely = np.clip(OF_A_STEP * lengths, 2 * TOLERANCE, FOLLOWING)
        got = self.corrector(self.problem, ahead, normal, steps, closely, measured=True)
        unknown = np.flatnonzero(
            self.chooses & got.converged & (steps >= self.most) & ~(got.error <= SETTLED)
        )  # too few steps per revolution, or too large a tolerance of Newton's method
        if unknown.size:
            closer = self.corrector(self.problem, got.u[unknown], normal[unknown], steps[unknown], measured=True)
            got = got.put(unknown, closer)
        return [
            c for i, c in enumerate(active) if self._advances(c, got.take(i), ahead[i], normal[i], bool(i in unknown))
        ]

    def _advances(self, curve: Path, new: Points, ahead: np.ndarray, normal: np.ndarray, unknown: bool) -> bool:
        """Accept or reject a new point, and choose the next step; return True if it is accepted."""
        control, length = self.control, curve.length
        step = control.compare(curve.points, new, ahead, normal, length)
        same = step.same or not self.oriented
        finer = self.chooses and curve.steps < self.most
        excess = max(new.excess / LOOSE, new.moved / (MOVED * length))
        if finer and new.converged and excess > 1:
            curve.steps *= 2
            return False
        if unknown and not new.error <= SETTLED:
            curve.ended = "inaccurate"
            return False
        if step.sure and not same and not curve.crosses:
            if length < CROSSED:
                while len(curve.points) > 1 and np.linalg.norm(curve.points[-1].u - new.u) < ASIDE:
                    curve.points.pop()
                curve.crosses, curve.length = True, 2 * ASIDE
                return False
            step = step._replace(sure=False)
        if not step.sure:
            curve.length = control.after_failure(length, bool(new.converged))
            if curve.length < control.shortest:
                curve.length = control.first
                if not finer:
                    curve.ended = "stuck"
                else:
                    curve.steps *= 2
            return False
        curve.points.append(new)
        curve.crosses &= same
        if self.chooses and curve.steps > self.least and excess < 1 / COARSER:
            curve.steps //= 2
        curve.length = control.after_success(length, step)
        curve.ended = next(filter(None, (event(curve) for event in self.events)), "")
        return True
