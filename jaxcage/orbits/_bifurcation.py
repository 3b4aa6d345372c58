"""Bifurcation points of periodic orbits, by Newton's method on the orbit together with a scalar that vanishes there."""

import dataclasses
from typing import Any, NamedTuple, cast

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from .._arguments import require_at_least, shown, wrong
from .._checks import require_x64
from .._errors import ArgumentError
from .._types import Scalar
from ..integrate import AbstractMethod, StrobeMap, compiled
from ..models import AbstractForcedSystem, require_speeds
from ._by_name import SPEED, Parameter, with_value
from ._follower import Follower, make_follower, seeds, stable_steps
from ._implicit import AbstractMapEquations, Found, as_root, differentiated, settled
from ._normal_form import KINDS_WITH_ONE, coefficients
from ._orbit import Orbit, OrbitEquations, PointGuess, guess_state, is_free, periodic_orbit, settle, sorted_multipliers
from ._point import CRITICAL, FOUND, NO_SUCH_POINT, NOT_CONVERGED, OTHER_KIND, TANGENT, Point, require_found, value_at
from ._problem import Frame, Given, OrbitProblem, Prepared, frozen, is_traced, make_frame, returned
from ._singularity import KINDS, Kind, bordered, null_vectors, singular_matrix
from ._steps import (
    BY_OTHERS,
    ENOUGH,
    MOST_OF_A_POINT,
    POINT,
    SETTLED,
    Counts,
    by_steps,
    from_steps,
    other_steps,
    that_serves,
)
from ._walk import walk


TANGENTIAL = 1e-2
"""A crossing is tangential if |mu| changes by less than this for a relative change of the parameter by 1."""
ON_CIRCLE = 1e-5
SPUN = 200
"""Revolutions of the simulation that finds an orbit."""


class Singular(NamedTuple):
    """What is known at the root beside the unknowns."""

    monodromy: Float[Array, "dim dim"]
    right: Float[Array, " k"]
    left: Float[Array, " k"]


class PointEquations(AbstractMapEquations):
    """The orbit's equations and g = 0; a branch point has two more, with an imperfection as unknown."""

    problem: OrbitProblem
    frame: Frame
    left: Float[Array, " k"]
    right: Float[Array, " k"]
    kind: Kind = eqx.field(static=True)

    def prepare(self, u: Array, given: Given) -> Prepared:
        strobe = self.problem.prepare(u, given, self.frame)
        if self.kind != "branch-point":
            return strobe, []
        return strobe, [self.problem.drift(u, given, self.frame, self.problem.equations)]

    def closing(self, u: Array, prepared: Prepared, image: Array, columns: Array) -> tuple[Array, Singular]:
        strobe, drifts = prepared
        n, m = self.problem.dimension, self.problem.equations
        z, monodromy = u[:n], columns[:, :n]
        closing = self.problem.orbit_residual(z, image, self.frame)
        a = critical_matrix(self.problem, self.kind, strobe, z, monodromy, self.frame)
        g, q, p = bordered(a, self.left, self.right)
        known = Singular(monodromy, q, p)
        if not drifts:
            return jnp.append(closing, g), known
        return jnp.concatenate([closing + u[m + 1] * self.left, jnp.stack([g, p[:n] @ columns[:, n]])]), known

    def linearised(self, u: Array, given: Given) -> tuple[Array, Array, Singular]:
        return differentiated(self, u, given)

    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """By the change of the parameters, a unit of which is a tenth of their size."""
        m = self.problem.equations
        shift = abs(moved[..., m : m + len(self.problem.parameters)]).max(-1)
        return shift, shift / (10 * POINT)


def critical_matrix(
    problem: OrbitProblem, kind: Kind, strobe: StrobeMap, z: Array, monodromy: Array, frame: Frame
) -> Float[Array, "k k"]:
    """The matrix that is singular at the bifurcation.

    A self-excited orbit always has a multiplier 1; at its fold the derivative of its own equations is singular, in
    which the flow and the phase condition border M - I.
    """
    a = singular_matrix(kind, monodromy)
    if not problem.free_speed or kind in ("period-doubling", "Neimark-Sacker"):
        return a
    y = tuple(z[i] * frame.scale[i] for i in range(z.size))
    flow = jnp.stack([jnp.asarray(c) for c in strobe.field(jnp.zeros(()), y)]) / frame.scale
    return jnp.block([[a, flow[:, None]], [frame.phase_direction[None, :], jnp.zeros((1, 1))]])


def bifurcation(
    system: AbstractForcedSystem,
    kind: str,
    guess: PointGuess,
    parameter: Parameter = SPEED,
    *,
    speed: Scalar | None = None,
    periods: int | Int[Array, ""] | None = None,
    period: str = "driven",
    reach: float | int = 0.1,
    method: AbstractMethod | None = None,
) -> Point:
    """The bifurcation of `kind` near `guess`, where `parameter` is free.

    Where Newton's method finds none, the branch of orbits through `guess` is followed both ways to the nearest.

    **Arguments:**

    - `kind`: `period-doubling`, `Neimark-Sacker`, `fold`, or `branch-point` (pitchfork or transcritical, which
        only systems with a symmetry have).
    - `guess`: a value of the parameter [SI], whose orbit is then found by simulation; an `Orbit` or a `Point`; or a
        pair (state, value of the parameter).
    - `parameter`: `"speed"`, the name of a parameter, or a function that picks it from the system.
    - `speed`: speed [rad/s] where it is not the parameter and `guess` does not have it.
    - `periods`: revolutions after which the orbit closes; by default those of `guess`, else 1.
    - `period`: `free` for a self-excited system, whose law does not depend on the phase: the speed is then found too.
    - `reach`: how far the branch is followed, as a fraction of the parameter's value (of 1 where that is 0); 0 turns
        this off. It is off under `jit`, `vmap` and `grad`, where it is not known what Newton's method finds.

    **Returns:** `Point`; it does not raise if there is none, but says where it looked. Works under `jit` and
    `vmap`; value, speed and state have derivatives of every order with respect to `system` and `speed`, by the implicit
    function theorem.

    **Raises:** `ValueError` for an unknown kind or parameter, or a guess without a speed.
    """
    require_x64()
    if periods is not None:
        require_at_least(1, periods=periods)
    if not 0 <= reach < float("inf"):
        raise ArgumentError("reach", said=f"must be at least 0 and finite, but {reach:g} was given.")
    if kind not in KINDS:
        raise ArgumentError("kind", said=f"must be one of {', '.join(KINDS)}, but '{kind}' was given.")
    start, first, at, spin = _read_guess(system, guess, parameter, speed)
    free = is_free(period, system, first)
    given = Given(system, jnp.asarray(first if speed is None else speed, dtype=float))
    near = guess if isinstance(guess, Orbit | Point) else None
    periods = jnp.asarray((1 if near is None else near.periods) if periods is None else periods)

    def find(state: Any, speed: Any, at: Any, spin: bool) -> Point:
        def by(method: AbstractMethod, counts: Counts) -> Point:
            problem = OrbitProblem(method, system.dimension, free, (parameter,))
            counts = from_steps(counts, None if near is None else near.steps)
            begin = jnp.asarray(speed, dtype=float)
            numbers = frozen((given, state, begin, at))
            found, equations, u, known = _find_point(problem, counts, cast(Kind, kind), *numbers, periods, spin)
            if not is_traced((given, found)):
                return by_others(found, problem, counts)
            u, _ = as_root(given, equations=equations, u=u, aux=known)
            place = _place(equations, u, given, found.converged)
            return dataclasses.replace(found, **dict(zip(("value", "speed", "state"), place, strict=True)))

        return that_serves(by, method, MOST_OF_A_POINT)

    def by_others(found: Point, problem: OrbitProblem, counts: Counts) -> Point:
        """The point with what other steps make of it in its error."""
        if not (bool(found.converged) and counts.tolerance > 0):
            return found
        steps = other_steps(found.steps)
        other = _find_point(
            problem,
            Counts(steps, steps, jnp.zeros_like(counts.tolerance)),
            cast(Kind, kind),
            *(given, found.state, jnp.asarray(found.speed), jnp.asarray(found.value)),
            periods,
            False,
        )[0]
        lost = found.error if kind == "branch-point" else jnp.inf  # its equations are all but singular
        apart = jnp.where(other.converged, BY_OTHERS * jnp.abs(other.value - found.value), lost)
        error = jnp.maximum(found.error, apart)
        far = error > SETTLED * jnp.maximum(jnp.abs(found.value), jnp.abs(at) if at else 1.0)
        outcome = jnp.where(far, NOT_CONVERGED, found.outcome)
        return dataclasses.replace(found, error=error, outcome=outcome)

    def around(value: float, part: float, speed: Scalar = given.speed) -> Follower:
        away = part * (abs(value) or 1.0)
        return make_follower(system, speed, parameter, value - away, value + away, period, method)

    found = find(start, first, at, spin)
    if is_traced((found, given, start)):
        return found
    if reach and int(found.outcome) in (NO_SUCH_POINT, OTHER_KIND):
        if spin:
            here, turning = with_value(system, first, parameter, at)
            start = periodic_orbit(
                here, turning, int(periods), guess=start, revolutions=SPUN, period=period, method=method
            ).state
        there, looked = walk(around(float(at), float(reach)), (np.asarray(start), float(at)), int(periods), kind)
        if there is not None:
            looked = f"{looked}, where it is near {there.parameter} = {there.value:.9g}"
            again = find(jnp.asarray(there.state), there.speed, jnp.asarray(there.value), False)
            found = again if bool(again.converged) else there  # Newton's method may fail at a kink of the law
        found = found if bool(found.converged) else dataclasses.replace(found, looked=looked)
    classed = bool(found.converged) and kind in KINDS_WITH_ONE
    return _classed(found, around(float(found.value), 0.1, found.speed)) if classed else found


def _classed(point: Point, follower: Follower) -> Point:
    """The point with the coefficient of its normal form."""
    place = np.asarray(point.state), float(point.value)
    frame = follower.frame(jnp.asarray(point.state), place[1], int(point.periods))
    again = lambda follower: seeds(follower, frame, [place], int(point.steps))
    orbit = again(follower)
    if not orbit.converged[0]:
        follower = stable_steps(follower, place, int(point.periods))
        orbit = again(follower)
    free = follower.problem.free_speed
    found = coefficients(follower.curves(frame, [0]), orbit, [point.kind], place[0].size, free=free)[0]
    return dataclasses.replace(point, coefficient=jnp.asarray(found[0]), coefficient_error=jnp.asarray(found[1]))


def _read_guess(
    system: AbstractForcedSystem, guess: PointGuess, parameter: Parameter, speed: Scalar | None
) -> tuple[Array, Any, Array, bool]:
    """State, speed, value of the parameter, and whether the state is to be found by simulation."""
    spin, known_speed = False, speed
    if isinstance(guess, Orbit | Point):
        state, known_speed = guess.state, guess.speed
        at = value_at(guess, system, known_speed, parameter)
    elif isinstance(guess, tuple) and len(guess) == 2:
        state, at = guess
    else:
        spin, state, at = True, None, guess
    if isinstance(guess, Point) and not is_traced((guess, at)):
        require_found(guess, at, "guess")
    if wrong(Scalar, at):
        said = "must be a number, a state and a number, an `Orbit` or a `Point`"
        raise ArgumentError("guess", said=f"{said}, but {shown(guess)} was given.")
    if parameter == SPEED:
        known_speed = at
    if known_speed is None:
        raise ArgumentError("speed", said=f"must be given where the parameter is `{parameter}`, but it is not.")
    require_speeds(system, known_speed)
    return guess_state(system, known_speed, state), known_speed, frozen(jnp.asarray(at, dtype=float)), spin


@compiled
def _find_point(
    problem: OrbitProblem,
    counts: Counts,
    kind: Kind,
    given: Given,
    start: Array,
    speed: Scalar,
    at: Array,
    periods: Array,
    spin: bool,
) -> tuple[Point, PointEquations, Array, Singular]:
    """The point, without derivatives; its equations, unknowns, and what else is known there."""
    (parameter,) = problem.parameters
    unit = jnp.where(at == 0, 0.1, 0.1 * jnp.abs(at))
    system, here = with_value(given.system, speed, parameter, at)
    if spin:
        start = settle(problem, Given(system, here), start, SPUN, counts)
    frame = make_frame(problem, Given(system, here), start, here, unit[None], periods)
    u0 = start / frame.scale
    if problem.free_speed:
        u0 = jnp.append(u0, 1.0)
    if spin:  # on the orbit itself, if there is one here
        fixed = OrbitProblem(problem.method, problem.dimension, problem.free_speed, ())
        u1, found = settled(OrbitEquations(fixed, frame), Given(system, here), u0, counts)
        u0 = jnp.where(found.converged, u1, u0)
    u0 = jnp.append(u0, at / unit)
    strobe = by_steps(problem, jnp.minimum(counts.last, ENOUGH)).prepare(u0, given, frame)
    _, monodromy = returned(strobe, frame, u0[: problem.dimension])
    a = critical_matrix(problem, kind, strobe, u0[: problem.dimension], monodromy, frame)
    left, right = null_vectors(jnp.where(jnp.isfinite(a), a, 0.0))
    if kind == "branch-point":
        u0 = jnp.append(u0, 0.0)
    equations = PointEquations(problem, frame, left, right, kind)
    u, found = settled(equations, given, u0, counts, at_root=True)
    u, equations = jnp.where(found.converged, u, jnp.nan), by_steps(equations, found.steps)
    return _describe(equations, u, found, given), equations, u, found.aux


@compiled
def _place(equations: PointEquations, u: Array, given: Given, converged: Array) -> tuple[Array, Array, Array]:
    """The parameter's value, speed and state; NaN, and their derivatives too, where there is no such point."""
    problem, frame = equations.problem, equations.frame
    keep = lambda x: x * jnp.where(converged, 1.0, jnp.nan)
    speed = jnp.asarray(problem.speed(u, given, frame), dtype=float)
    return keep(problem.values(u, frame)[0]), keep(speed), keep(problem.state(u, frame))


def _describe(equations: PointEquations, u: Array, found: Found, given: Given) -> Point:
    problem, frame, kind = equations.problem, equations.frame, equations.kind
    known: Singular = found.aux
    finite = jnp.all(jnp.isfinite(known.monodromy))
    multipliers = sorted_multipliers(jnp.where(finite, known.monodromy, 0.0))
    matches = is_critical(kind, multipliers)
    borders = equations.left, equations.right
    rate = critical_rate(kind, problem.equations, found.newton.jacobian, known, borders)
    at = problem.values(u, frame)[0]
    # In the parameter's unit the guess is 10; the value itself may be zero.
    error = found.error * frame.units[0]
    moving = error > SETTLED * jnp.maximum(jnp.abs(at), 10 * frame.units[0])
    tangential = jnp.abs(rate) * jnp.maximum(jnp.abs(u[problem.equations]), 10.0) < TANGENTIAL
    kept = jnp.where(moving, NOT_CONVERGED, jnp.where(tangential, TANGENT, FOUND))
    outcome = jnp.where(found.converged, jnp.where(matches, kept, OTHER_KIND), NO_SUCH_POINT)
    there = (outcome == FOUND) | (outcome == TANGENT)
    keep = lambda x: jnp.where(there, x, jnp.nan)
    value, speed, state = _place(equations, u, given, there)
    direction = jnp.zeros(problem.dimension) if kind == "Neimark-Sacker" else known.right[: problem.dimension]
    length = jnp.linalg.norm(direction)
    (parameter,) = problem.parameters
    return Point(
        value=value,
        error=error,
        steps=found.steps,
        speed=speed,
        state=state,
        multipliers=jnp.where(found.converged, multipliers, jnp.nan),
        residual=jnp.max(jnp.abs(found.newton.residual)),
        transversality=keep(rate / frame.units[0]),
        direction=keep(direction / jnp.where(length > 0, length, 1.0) * frame.scale),
        outcome=outcome,
        iterations=found.iterations,
        periods=frame.periods,
        kind=kind,
        parameter=parameter if isinstance(parameter, str) else "parameter",
    )


def is_critical(kind: Kind, multipliers: Complex[Array, " dim"]) -> Bool[Array, ""]:
    """Whether a multiplier is where a bifurcation of `kind` has it."""
    if kind == "Neimark-Sacker":
        off = jnp.where(jnp.abs(multipliers.imag) > 1e-9, jnp.abs(jnp.abs(multipliers) - 1), jnp.inf)
    else:
        off = jnp.abs(multipliers - CRITICAL[kind])
    return jnp.min(off) < jnp.sqrt(ON_CIRCLE)  # a double multiplier is only known to the square root of rounding


def critical_rate(kind: Kind, equations: int, jacobian: Array, known: Singular, borders: tuple[Array, Array]) -> Array:
    """Rate d|mu| / d parameter of the critical multiplier along the orbit, in the parameter's unit.

    At a fold, where it is infinite, the drift of the map along the critical direction instead.

    **Arguments:** kind; number of the orbit's own equations; derivative of all equations at the point; null vectors;
    the left and right border.
    """
    m = equations
    of_orbit, drift = jacobian[:m, :m], jacobian[:m, m]
    overlap = known.left @ known.right
    if kind == "fold":
        return jnp.abs(known.left[:m] @ drift / overlap)
    g = jacobian[m]
    if kind == "branch-point":
        return _branching_rate(m, jacobian, known, borders) / jnp.abs(overlap)
    along = g[:m] @ -jnp.linalg.solve(of_orbit, drift) + g[m]
    rate = -along / overlap
    return rate / 2 if kind == "Neimark-Sacker" else -rate


def _branching_rate(m: int, jacobian: Array, known: Singular, borders: tuple[Array, Array]) -> Array:
    """Branches leave along a x^2 + 2 b x y + c y^2 = 0, x along the critical direction and y the parameter."""
    of_orbit, drift, g, h = jacobian[:m, :m], jacobian[:m, m], jacobian[m], jacobian[m + 1]
    left, right = borders
    whole = jnp.block([[of_orbit, left[:, None]], [right[None, :], jnp.zeros((1, 1))]])
    w = jnp.linalg.solve(whole, jnp.append(-drift, 0.0))[:m]
    a, b, c = g[:m] @ known.right[:m], g[:m] @ w + g[m], h[:m] @ w + h[m]
    return jnp.sqrt(jnp.maximum(b**2 + a * c, 0.0))
