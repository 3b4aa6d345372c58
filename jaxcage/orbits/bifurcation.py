"""Bifurcation points of periodic orbits, by Newton's method on the orbit together with a scalar that vanishes there."""

import dataclasses
from typing import Any, NamedTuple, cast, get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._arguments import require_at_least, require_x64, shown, wrong
from .._errors import ArgumentError
from .._pytrees import Scalar, compiled
from ..models import AbstractForcedSystem, require_speeds
from ..solve import AbstractMethod
from .branch import follow_both_ways
from .continuation import Path, orbit_curves
from .location import sign_changes
from .newton import AbstractEquations, Found, as_root, refined
from .orbit import Orbit, PointGuess, guess_state, periodic_orbit, sorted_multipliers
from .point import Kind, Outcome, Point, bordered, null_vectors, require_found, singular_matrix, to_critical, value_at
from .problem import SPEED, Given, OrbitProblem, Parameter, Prepared, frozen, is_traced, make_problem, name_of
from .step_counts import (
    BY_OTHERS,
    ENOUGH,
    MOST_OF_A_POINT,
    POINT,
    SETTLED,
    Counts,
    by_steps,
    other_steps,
    with_fallback,
)
from .step_lengths import Points, StepControl


TANGENTIAL = 1e-2  # smallest change of |mu| for a relative change of the parameter by 1 at a crossing
ON_CIRCLE = 1e-5  # largest squared distance of a critical multiplier: a double one is known to the root of rounding
SPUN = 200  # revolutions of the simulation that finds an orbit
WALK = StepControl(first=0.05, longest=0.25, most=250)  # along a branch on which a bifurcation is looked for


class Singular(NamedTuple):
    """The monodromy matrix and null vectors of the singular matrix at a point."""

    monodromy: Float[Array, "dim dim"]
    right: Float[Array, " k"]
    left: Float[Array, " k"]


class PointEquations(AbstractEquations):
    """The orbit's equations and g = 0; for a branch point two more, with an imperfection as unknown."""

    problem: OrbitProblem
    left: Float[Array, " k"]
    right: Float[Array, " k"]
    kind: Kind = eqx.field(static=True)

    def prepare(self, u: Array, given: Given) -> Prepared:
        by_parameter = self.kind == "branch-point"
        drifts = [self.problem.drift(u, given, self.problem.dimension)] if by_parameter else []
        return self.problem.prepare(u, given), drifts

    def closing(self, u: Array, prepared: Prepared, image: Array, columns: Array) -> tuple[Array, Singular]:
        n = self.problem.dimension
        monodromy, closing = columns[:, :n], image - u[:n]
        g, q, p = bordered(singular_matrix(self.kind, monodromy), self.left, self.right)
        known = Singular(monodromy, q, p)
        if self.kind != "branch-point":
            return jnp.append(closing, g), known
        return jnp.concatenate([closing + u[n + 1] * self.left, jnp.stack([g, p @ columns[:, n]])]), known

    def monodromy(self, found: Any) -> Any:
        return found.aux.monodromy

    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """Compare by the change of the parameters, a unit of which is a tenth of their size."""
        n = self.problem.dimension
        shift = abs(moved[..., n : n + len(self.problem.parameters)]).max(-1)
        return shift, shift / (10 * POINT)


def bifurcation(
    system: AbstractForcedSystem,
    kind: str,
    guess: PointGuess,
    parameter: Parameter = SPEED,
    *,
    speed: Scalar | None = None,
    periods: int | Int[Array, ""] | None = None,
    reach: float | int = 0.1,
    method: AbstractMethod | None = None,
) -> Point:
    """Find the bifurcation of `kind` near `guess`, with `parameter` free.

    If Newton's method finds none, the branch of orbits through `guess` is followed both ways to the nearest.

    **Arguments:**

    - `kind`: `period-doubling`, `Neimark-Sacker`, `fold`, or `branch-point` (pitchfork or transcritical, which
        only systems with a symmetry have).
    - `guess`: a value of the parameter [SI], whose orbit is then found by simulation; an `Orbit` or a `Point`; or a
        pair (state [SI], value of the parameter).
    - `parameter`: `"speed"`, the name of a parameter, or a function that picks it from the system.
    - `speed`: speed [rad/s], if it is not the parameter and `guess` does not have it.
    - `periods`: revolutions after which the orbit closes; by default those of `guess`, else 1.
    - `reach`: how far the branch is followed, as a fraction of the parameter's value (of 1 if that is 0). 0 turns
        this off, and so do `jit`, `vmap` and `grad`, under which the result of Newton's method is not known.

    **Returns:** `Point`; it does not raise if there is none, but says where it looked. The function works under `jit`
    and `vmap`; value, speed and state have derivatives of every order with respect to `system` and `speed`.

    **Raises:** `ValueError` for an unknown kind or parameter, or a guess without a speed.
    """
    require_x64()
    if periods is not None:
        require_at_least(1, periods=periods)
    if not 0 <= reach < float("inf"):
        raise ArgumentError("reach", said=f"must be at least 0 and finite, but {reach:g} was given.")
    if kind not in get_args(Kind):
        raise ArgumentError("kind", said=f"must be one of {', '.join(get_args(Kind))}, but '{kind}' was given.")
    near = guess if isinstance(guess, Orbit | Point) else None
    periods = (1 if near is None else near.periods) if periods is None else periods
    start = _read_guess(system, guess, parameter, speed, periods, method)
    given = Given(system, jnp.asarray(start.speed if speed is None else speed, dtype=float))

    def newton(method: AbstractMethod, counts: Counts, begin: _Begin) -> Any:
        """Return what `_find_point` finds from there."""
        known, begin = frozen((given, begin))
        there = Given(known.system, begin.speed).changed(parameter, begin.at)
        unit = jnp.where(begin.at == 0, 0.1, 0.1 * jnp.abs(begin.at))
        problem = make_problem(there, (parameter,), unit[None], periods, method)
        return _find_point(problem, counts, cast(Kind, kind), known, begin)

    def find(begin: _Begin) -> Point:
        def by(method: AbstractMethod, counts: Counts) -> Point:
            counts = counts.near(None if near is None else near.steps)
            found, equations, u, known = newton(method, counts, begin)
            if is_traced((given, found)):
                u, _ = as_root(given, equations=equations, u=u, aux=known)
                return dataclasses.replace(found, **_place(equations, u, given, found.converged))
            return compared(found, method, counts) if bool(found.converged) and counts.chooses else found

        return with_fallback(by, method, MOST_OF_A_POINT)

    def compared(found: Point, method: AbstractMethod, counts: Counts) -> Point:
        """Return the point with the larger error that a comparison with other steps may show."""
        steps = other_steps(found.steps)
        others = Counts(steps, steps, jnp.zeros_like(counts.tolerance))
        other = newton(method, others, _Begin(found.state, found.speed, found.value))[0]
        lost = found.error if kind == "branch-point" else jnp.inf  # its equations are all but singular
        apart = jnp.where(other.converged, BY_OTHERS * jnp.abs(other.value - found.value), lost)
        error = jnp.maximum(found.error, apart)
        far = error > SETTLED * jnp.maximum(jnp.abs(found.value), jnp.abs(start.at) if start.at else 1.0)
        return dataclasses.replace(found, error=error, outcome=jnp.where(far, Outcome.NOT_CONVERGED, found.outcome))

    found = find(start)
    if is_traced((found, given, start)) or not reach or found.status not in ("no such point", "other kind"):
        return found
    there, looked = _along_branch(given, parameter, int(periods), start, kind, reach, method)
    if there is not None:
        again = find(_Begin(jnp.asarray(there.state), jnp.asarray(there.speed), jnp.asarray(there.value)))
        found = again if bool(again.converged) else there  # Newton's method may fail at a kink of the law
    return found if bool(found.converged) else dataclasses.replace(found, looked=looked)


class _Begin(NamedTuple):
    """Where Newton's method for a point begins: state [SI], speed [rad/s], value of the parameter [SI]."""

    state: Any
    speed: Any
    at: Any


def _along_branch(
    given: Given,
    parameter: Parameter,
    periods: int,
    begin: _Begin,
    kind: str,
    reach: float,
    method: AbstractMethod | None,
) -> tuple[Point | None, str]:
    """Return the nearest bifurcation of `kind` on the branch through an orbit, if there is one, and what was searched.

    Near a superstable orbit the scalar that vanishes at the point is flat, and Newton's steps lead anywhere; the branch
    itself leads on.
    """
    at = float(begin.at)
    away = float(reach) * (abs(at) or 1.0)
    problem = orbit_curves(given, parameter, at - away, at + away, method, periods)
    say = lambda x: f"{x * 30 / np.pi:.6g} rpm" if parameter == SPEED else f"{x:.6g}"
    name = "the parameter" if callable(parameter) else parameter
    reached: list[float] = []

    def passed(curve: Path) -> str:
        """Event: a point of the kind was passed, or the other direction found one at a smaller distance."""
        step = Points.stacked(curve.points[-2:])
        far = float(abs(step.u[1, -1] - curve.points[0].u[-1]))
        before, after = problem.unstable(step)
        if before != after and any(k == kind for _, k in sign_changes(problem, step)):
            reached.append(far)
            return "stopped"
        return "stopped" if reached and far > min(reached) else ""

    (found,) = follow_both_ways(problem, [(np.asarray(begin.state), at)], WALK, events=(passed,))
    if found is None:
        return None, f"no orbit near the guess at {name} = {say(at)} to follow"
    low, high = (say(float(f(found.value))) for f in (np.min, np.max))
    looked = f"looked along the branch of its orbit, {name} from {low} to {high} (ends: {', '.join(found.ended)})"
    mine = [p for p in found.special if p.kind == kind and p.status == "converged"]
    return min(mine, key=lambda p: abs(p.value - at), default=None), looked


def _read_guess(
    system: AbstractForcedSystem,
    guess: PointGuess,
    parameter: Parameter,
    speed: Scalar | None,
    periods: int | Int[Array, ""],
    method: AbstractMethod | None,
) -> _Begin:
    """Return where Newton's method begins: on an orbit that simulation finds, if only a value is given."""
    known_speed, state, simulated = speed, None, False
    if isinstance(guess, Orbit | Point):
        state, known_speed = guess.state, guess.speed
        at = value_at(guess, system, known_speed, parameter)
        if isinstance(guess, Point) and not is_traced((guess, at)):
            require_found(guess, "guess")
    elif isinstance(guess, tuple) and len(guess) == 2:
        state, at = guess
    else:
        simulated, at = True, guess
    if wrong(Scalar, at):
        said = "must be a number, a state and a number, an `Orbit` or a `Point`"
        raise ArgumentError("guess", said=f"{said}, but {shown(guess)} was given.")
    if parameter == SPEED:
        known_speed = at
    if known_speed is None:
        raise ArgumentError("speed", said=f"must be given where the parameter is `{parameter}`, but it is not.")
    require_speeds(system, known_speed)
    state = guess_state(system, known_speed, state)
    speed, at = jnp.asarray(known_speed, dtype=float), frozen(jnp.asarray(at, dtype=float))
    if simulated:
        here = frozen(Given(system, speed)).changed(parameter, at)
        orbit = periodic_orbit(here.system, here.speed, periods, guess=state, revolutions=SPUN, method=method)
        state = jnp.where(orbit.converged, orbit.state, state)
    return _Begin(state, speed, at)


@compiled
def _find_point(
    problem: OrbitProblem, counts: Counts, kind: Kind, given: Given, begin: _Begin
) -> tuple[Point, PointEquations, Array, Singular]:
    """Find the point, without derivatives; return its equations, its unknowns and what else is known there, too."""
    u0 = jnp.append(begin.state / problem.scale, begin.at / problem.units)
    strobe = by_steps(problem, jnp.minimum(counts.last, ENOUGH)).prepare(u0, given)
    _, monodromy = problem.returned(strobe, u0[: problem.dimension])
    a = singular_matrix(kind, monodromy)
    left, right = null_vectors(jnp.where(jnp.isfinite(a), a, 0.0))
    if kind == "branch-point":
        u0 = jnp.append(u0, 0.0)
    equations = PointEquations(problem, left, right, kind)
    u, found = refined(equations, given, u0, counts, at_root=True)
    u, equations = jnp.where(found.converged, u, jnp.nan), by_steps(equations, found.steps)
    return _describe(equations, u, found, given), equations, u, found.aux


@compiled
def _place(equations: PointEquations, u: Array, given: Given, converged: Array) -> dict[str, Array]:
    """Return the parameter's value, speed and state; they and their derivatives are NaN if there is no such point."""
    problem = equations.problem
    keep = lambda x: x * jnp.where(converged, 1.0, jnp.nan)
    speed = jnp.asarray(problem.at(u, given).speed, dtype=float)
    return {"value": keep(problem.values(u)[0]), "speed": keep(speed), "state": keep(problem.state(u))}


def _describe(equations: PointEquations, u: Array, found: Found, given: Given) -> Point:
    """Return all that is known of a point."""
    problem, kind = equations.problem, equations.kind
    known: Singular = found.aux
    finite = jnp.all(jnp.isfinite(known.monodromy))
    multipliers = sorted_multipliers(jnp.where(finite, known.monodromy, 0.0))
    matches = to_critical(kind, multipliers) < jnp.sqrt(ON_CIRCLE)
    borders = equations.left, equations.right
    rate = critical_rate(kind, problem.dimension, found.newton.jacobian, known, borders)
    at, unit = problem.values(u)[0], problem.units[0]
    # In the parameter's unit the guess is 10; the value itself may be zero.
    error = found.error * unit
    moving = error > SETTLED * jnp.maximum(jnp.abs(at), 10 * unit)
    tangential = jnp.abs(rate) * jnp.maximum(jnp.abs(u[problem.dimension]), 10.0) < TANGENTIAL
    kept = jnp.where(moving, Outcome.NOT_CONVERGED, jnp.where(tangential, Outcome.TANGENTIAL, Outcome.FOUND))
    outcome = jnp.where(found.converged, jnp.where(matches, kept, Outcome.OTHER_KIND), Outcome.NO_SUCH_POINT)
    there = (outcome == Outcome.FOUND) | (outcome == Outcome.TANGENTIAL)
    keep = lambda x: jnp.where(there, x, jnp.nan)
    direction = jnp.zeros(problem.dimension) if kind == "Neimark-Sacker" else known.right
    length = jnp.linalg.norm(direction)
    return Point(
        **_place(equations, u, given, there),
        error=error,
        steps=found.steps,
        multipliers=jnp.where(found.converged, multipliers, jnp.nan),
        residual=jnp.max(jnp.abs(found.newton.residual)),
        transversality=keep(rate / unit),
        direction=keep(direction / jnp.where(length > 0, length, 1.0) * problem.scale),
        outcome=outcome,
        iterations=found.iterations,
        periods=problem.periods,
        kind=kind,
        parameter=name_of(problem.parameters[0]),
    )


def critical_rate(kind: Kind, n: int, jacobian: Array, known: Singular, borders: tuple[Array, Array]) -> Array:
    """Return the rate d|mu| / d parameter of the critical multiplier along the orbit, in the parameter's unit.

    At a fold, where it is infinite, it is the drift of the map along the critical direction.

    **Arguments:** kind; dimension of the state; derivative of all equations at the point; null vectors; borders.
    """
    of_orbit, drift = jacobian[:n, :n], jacobian[:n, n]
    overlap = known.left @ known.right
    if kind == "fold":
        return jnp.abs(known.left @ drift / overlap)
    g = jacobian[n]
    if kind == "branch-point":
        return _branching_rate(jacobian, known, borders) / jnp.abs(overlap)
    along = g[:n] @ -jnp.linalg.solve(of_orbit, drift) + g[n]
    rate = -along / overlap
    return rate / 2 if kind == "Neimark-Sacker" else -rate


def _branching_rate(jacobian: Array, known: Singular, borders: tuple[Array, Array]) -> Array:
    """Return the rate at a branch point.

    Branches leave along a x^2 + 2 b x y + c y^2 = 0, x along the critical direction and y the parameter.
    """
    n = known.right.size
    of_orbit, drift, g, h = jacobian[:n, :n], jacobian[:n, n], jacobian[n], jacobian[n + 1]
    left, right = borders
    whole = jnp.block([[of_orbit, left[:, None]], [right[None, :], jnp.zeros((1, 1))]])
    w = jnp.linalg.solve(whole, jnp.append(-drift, 0.0))[:n]
    a, b, c = g[:n] @ known.right, g[:n] @ w + g[n], h[:n] @ w + h[n]
    return jnp.sqrt(jnp.maximum(b**2 + a * c, 0.0))
