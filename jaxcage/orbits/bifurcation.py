"""Bifurcation points of periodic orbits, by Newton's method on the orbit and a scalar that vanishes at the point."""

import dataclasses
from typing import Any, NamedTuple, cast

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._arguments import require_at_least, require_x64
from .._pytrees import Scalar, compiled
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod
from .branch import follow_both_ways
from .continuation import Path, orbit_curves
from .location import sign_changes
from .newton import AbstractEquations, Found, as_root, refined
from .orbit import NearOrbit, Orbit, sorted_multipliers
from .point import (
    Kind,
    Outcome,
    Point,
    Start,
    bordered,
    critical_of,
    null_vectors,
    read_start,
    singular_matrix,
    to_critical,
)
from .problem import (
    BY_OTHERS,
    ENOUGH,
    MOST_OF_A_POINT,
    POINT,
    SETTLED,
    SPEED,
    Counts,
    Given,
    OrbitProblem,
    Parameter,
    by_steps,
    frozen,
    is_traced,
    make_problem,
    name_of,
    other_steps,
    with_fallback,
)
from .step_length import Points, StepControl


TANGENTIAL = 1e-2  # smallest change of |mu| for a relative change of the parameter by 1 at a crossing
ON_CIRCLE = 1e-5  # largest squared distance of a critical multiplier: a double one is accurate to sqrt(rounding)
WALK = StepControl(first=0.05, longest=0.25, most=250)  # along a branch that is searched for a bifurcation
REACH = 0.1  # distance to which it is followed, as a fraction of the parameter's value (of 1 if that is 0)


class Singular(NamedTuple):
    """The monodromy matrix and null vectors of the singular matrix at a point."""

    monodromy: Float[Array, "dim dim"]
    right: Float[Array, " k"]
    left: Float[Array, " k"]


class PointEquations(AbstractEquations):
    """The orbit's equations and g = 0, a scalar that vanishes where a matrix is singular (see `bordered`).

    `critical` is the critical multiplier, -1 or 1, or None for a complex pair.
    """

    problem: OrbitProblem
    critical: Float[Array, ""] | None
    left: Float[Array, " k"]
    right: Float[Array, " k"]

    def closing(self, u: Array, image: Array, monodromy: Array) -> tuple[Array, Singular]:
        g, q, p = bordered(singular_matrix(self.critical, monodromy), self.left, self.right)
        return jnp.append(self.problem.moved(u, image), g), Singular(monodromy, q, p)

    def monodromy(self, found: Any) -> Any:
        return found.aux.monodromy

    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """Compare the parameters, whose unit is a tenth of their size."""
        shift = abs(moved[..., self.problem.dimension :]).max(-1)
        return shift, shift / (10 * POINT)


def bifurcation(
    system: AbstractForcedSystem,
    kind: Kind,
    guess: NearOrbit,
    parameter: Parameter = SPEED,
    *,
    speed: Scalar | None = None,
    periods: int | Int[Array, ""] | None = None,
    method: AbstractMethod | None = None,
) -> Point:
    """Find the bifurcation of `kind` near `guess`, with `parameter` free.

    If Newton's method fails, the branch of orbits through `guess` is followed both ways to the nearest bifurcation (not
    under `jit`, `vmap` and `grad`).

    **Arguments:**

    - `kind`: `period-doubling`, `Neimark-Sacker` or `fold`. Branch points, which only systems with a symmetry have, are
        found by `branch`.
    - `guess`: an `Orbit`, a `Point`, or a pair (state [SI], value of the parameter).
    - `parameter`: `"speed"`, the name of a parameter, or a function that picks it from the system.
    - `speed`: speed [rad/s], if it is not the parameter; by default that of `guess`.
    - `periods`: revolutions after which the orbit closes; by default those of `guess`, else 1.

    **Returns:** `Point`; if none is found there is no exception (see `Point.status`). The function works under `jit`
    and `vmap`; value, speed and state have derivatives of every order with respect to `system` and `speed`.

    **Raises:** `ValueError` for an unknown kind or parameter, or a guess without a speed; `RuntimeError` without double
    precision.
    """
    require_x64()
    if periods is not None:
        require_at_least(1, periods=periods)
    near = guess if isinstance(guess, Orbit | Point) else None
    periods = (1 if near is None else near.periods) if periods is None else periods
    start = read_start("guess", guess, system, parameter, speed)
    given = Given(system, start.speed)

    def find(begin: Start) -> Point:
        def by(method: AbstractMethod, counts: Counts) -> Point:
            counts = counts.near(None if near is None else near.steps)
            point, equations, u = solve_point(given, kind, parameter, periods, begin, method, counts)
            if is_traced((given, point)):
                u, _ = as_root(given, equations=equations, u=u)
                return dataclasses.replace(point, **_place(equations, u, given, point.converged))
            if not (bool(point.converged) and counts.chooses):
                return point
            steps = other_steps(point.steps)
            others = Counts(steps, steps, jnp.zeros_like(counts.tolerance))
            at_point = Start(point.state, point.speed, point.value)
            other = solve_point(given, kind, parameter, periods, at_point, method, others)[0]
            apart = jnp.where(other.converged, BY_OTHERS * jnp.abs(other.value - point.value), jnp.inf)
            error = jnp.maximum(point.error, apart)
            far = error > SETTLED * jnp.maximum(jnp.abs(point.value), jnp.abs(start.at) if start.at else 1.0)
            return dataclasses.replace(point, error=error, outcome=jnp.where(far, Outcome.NOT_CONVERGED, point.outcome))

        return with_fallback(by, method, lambda point: jnp.all(jnp.isfinite(point.residual)), MOST_OF_A_POINT)

    found = find(start)
    if is_traced((found, given, start)) or found.status not in ("no such point", "other kind"):
        return found
    there = _along_branch(given, parameter, int(periods), start, kind, method)
    if there is None:
        return found
    again = find(Start(jnp.asarray(there.state), jnp.asarray(there.speed), jnp.asarray(there.value)))
    return again if bool(again.converged) else there  # Newton's method may fail at a kink of the law


def _along_branch(
    given: Given, parameter: Parameter, periods: int, begin: Start, kind: str, method: AbstractMethod | None
) -> Point | None:
    """Return the nearest bifurcation of `kind` on the branch through an orbit, or None; this succeeds near superstable
    orbits, where the scalar of Newton's method is flat."""
    at = float(begin.at)
    away = REACH * (abs(at) or 1.0)
    problem = orbit_curves(given, parameter, at - away, at + away, method, periods)

    def passed(curve: Path) -> str:
        """Event: the last step passed a point of the kind, and the stability changed."""
        step = Points.stacked(curve.points[-2:])
        before, after = problem.unstable(step)
        found = before != after and any(k == kind for _, k in sign_changes(problem, step))
        return "stopped" if found else ""

    (found,) = follow_both_ways(problem, [(np.asarray(begin.state), at)], WALK, events=(passed,))
    mine = [p for p in found.special if p.kind == kind and p.status == "converged"] if found else []
    return min(mine, key=lambda p: abs(p.value - at), default=None)


Solved = tuple[Point, PointEquations, Array]
"""A point without derivatives, its equations, and its unknowns."""


def solve_point(
    given: Given, kind: Kind, parameter: Parameter, periods: Any, begin: Start, method: AbstractMethod, counts: Counts
) -> Solved:
    """Solve for the bifurcation near `begin` by Newton's method alone."""
    known, begin = frozen((given, begin))
    there = Given(known.system, begin.speed).changed(parameter, begin.at)
    unit = jnp.where(begin.at == 0, 0.1, 0.1 * jnp.abs(begin.at))
    problem = make_problem(there, (parameter,), unit[None], periods, method)
    point, *rest = _solve_point(problem, critical_of(kind), counts, known, begin)
    return dataclasses.replace(point, kind=kind), *rest


@compiled
def _solve_point(problem: OrbitProblem, critical: Array | None, counts: Counts, given: Given, begin: Start) -> Solved:
    u0 = jnp.append(begin.state / problem.scale, begin.at / problem.units)
    equations = point_equations(problem, critical, u0, given, jnp.minimum(counts.last, ENOUGH))
    u, found = refined(equations, given, u0, counts)
    u, equations = jnp.where(found.converged, u, jnp.nan), by_steps(equations, found.steps)
    return _describe(equations, u, found, given), equations, u


def point_equations(
    problem: OrbitProblem, critical: Array | None, u: Array, given: Given, steps: Any
) -> PointEquations:
    """Return a point's equations, with `steps` per revolution and borders from the null vectors at the unknowns u."""
    strobe = by_steps(problem, steps).prepare(u, given)
    a = singular_matrix(critical, problem.returned(strobe, u[: problem.dimension])[1])
    return PointEquations(problem, critical, *null_vectors(jnp.where(jnp.isfinite(a), a, 0.0)))


@compiled
def _place(equations: PointEquations, u: Array, given: Given, converged: Array) -> dict[str, Array]:
    """Return the parameter's value, speed and state; these and their derivatives are NaN if not `converged`."""
    problem = equations.problem
    keep = lambda x: x * jnp.where(converged, 1.0, jnp.nan)
    speed = jnp.asarray(problem.at(u, given).speed, dtype=float)
    return {"value": keep(problem.values(u)[0]), "speed": keep(speed), "state": keep(problem.state(u))}


def _describe(equations: PointEquations, u: Array, found: Found, given: Given) -> Point:
    problem, critical, known = equations.problem, equations.critical, cast(Singular, found.aux)
    finite = jnp.all(jnp.isfinite(known.monodromy))
    multipliers = sorted_multipliers(jnp.where(finite, known.monodromy, 0.0))
    matches = to_critical(critical, multipliers)[0] < jnp.sqrt(ON_CIRCLE)
    rate = _critical_rate(critical, problem.dimension, found.newton.jacobian, known)
    at, unit = problem.values(u)[0], problem.units[0]
    # The guess is 10 in the parameter's unit; the value itself may be zero.
    error = found.error * unit
    moving = error > SETTLED * jnp.maximum(jnp.abs(at), 10 * unit)
    tangential = jnp.abs(rate) * jnp.maximum(jnp.abs(u[problem.dimension]), 10.0) < TANGENTIAL
    kept = jnp.where(moving, Outcome.NOT_CONVERGED, jnp.where(tangential, Outcome.TANGENTIAL, Outcome.FOUND))
    outcome = jnp.where(found.converged, jnp.where(matches, kept, Outcome.OTHER_KIND), Outcome.NO_SUCH_POINT)
    there = (outcome == Outcome.FOUND) | (outcome == Outcome.TANGENTIAL)
    keep = lambda x: jnp.where(there, x, jnp.nan)
    return Point(
        **_place(equations, u, given, there),
        error=error,
        steps=found.steps,
        multipliers=jnp.where(found.converged, multipliers, jnp.nan),
        residual=jnp.max(jnp.abs(found.newton.residual)),
        transversality=keep(rate / unit),
        outcome=outcome,
        periods=problem.periods,
        kind="",
        parameter=name_of(problem.parameters[0]),
    )


def _critical_rate(critical: Array | None, n: int, jacobian: Array, known: Singular) -> Array:
    """Return d|mu| / d parameter of the critical multiplier along the orbit, in the parameter's unit.

    At a fold, where this is infinite, return the drift of the map along the critical direction.

    **Arguments:** critical multiplier; dimension of the state; derivative of all equations at the point; null vectors.
    """
    of_orbit, drift, g = jacobian[:n, :n], jacobian[:n, n], jacobian[n]
    overlap = known.left @ known.right
    rate = (g[:n] @ jnp.linalg.solve(of_orbit, drift) - g[n]) / overlap
    if critical is None:
        return rate / 2
    return jnp.where(critical > 0, jnp.abs(known.left @ drift / overlap), -rate)
