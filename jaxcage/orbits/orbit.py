"""Periodic orbits: fixed points of powers of the strobe map, with their Floquet multipliers."""

import dataclasses
from typing import TYPE_CHECKING, Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from .._arguments import require_at_least, require_x64, shown
from .._errors import ArgumentError
from .._pytrees import Scalar, State, compiled
from ..models import AbstractForcedSystem, require_speeds
from ..quantities import notebook_html
from ..solve import SURE, AbstractMethod, FixedSteps, strobe_map
from .newton import AbstractEquations, as_root, refined
from .problem import (
    ENOUGH,
    IMAGE,
    SETTLED,
    SLOPE,
    Counts,
    Given,
    OrbitProblem,
    by_steps,
    frozen,
    is_traced,
    make_problem,
    with_fallback,
    without_turns,
)


if TYPE_CHECKING:
    from .point import Point

SPUN = 200  # revolutions of the simulation that leads to an orbit
AT_REST = 1e-3  # largest motion between two runs, in units of the system's scale, of a simulation that has settled


class OrbitEquations(AbstractEquations):
    """P(z) = z but for revolutions of angles, for an orbit or, if a parameter of the problem is free, for a branch."""

    problem: OrbitProblem

    def closing(self, u: Array, image: Array, monodromy: Array) -> tuple[Array, Array]:
        return self.problem.moved(u, image), monodromy

    def linearised(self, u: Array, given: Given) -> tuple[Array, Array, Any]:
        """Apply the map with the state's tangents and one column for each other unknown, in one kernel."""
        problem, n = self.problem, self.problem.dimension
        drifts = [problem.drift(u, given, i) for i in range(n, u.size)]
        image, columns = problem.returned(problem.prepare(u, given), u[:n], drifts)
        return problem.moved(u, image), columns - jnp.eye(n, u.size), None

    def monodromy(self, found: Any) -> Any:
        n = self.problem.dimension
        return found.jacobian[..., :n, :n] + np.eye(n)

    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """Compare the map, with the safety factor of simulations, and its relative derivative."""
        n = self.problem.dimension
        image = abs(fine @ moved[..., None])[..., 0].max(-1)
        size = lambda m: abs(m[..., :n]).max((-2, -1))
        return SURE * image, image / IMAGE + size(fine - coarse) / (1 + size(fine)) / SLOPE


class Orbit(eqx.Module):
    """A periodic orbit with its Floquet multipliers; if none was found, its numbers are NaN (see `status`).

    - `state`: state at phase 0 [SI]; `speed` [rad/s].
    - `multipliers`: Floquet multipliers over `periods` revolutions, the largest first; `monodromy` is the derivative of
        the map P, and `residual` the largest component of P(z) - z, both in units of the system's scale.
    - `steps`: steps per revolution of `solver`; 1 if the method has no such number and is `solver` itself.
    - `error`: three times the largest change of P at the orbit when the steps are halved, in units of the scale (the
        factor is for grazing contacts, where one difference may be small by chance). It is infinite if half the steps
        find no orbit, NaN if the method has no number of steps.
    """

    state: Float[Array, " dim"]
    speed: Scalar
    multipliers: Complex[Array, " dim"]
    monodromy: Float[Array, "dim dim"]
    residual: Float[Array, ""]
    steps: Int[Array, ""]
    error: Float[Array, ""]
    converged: Bool[Array, ""]
    periods: Int[Array, ""]
    solver: str | AbstractMethod = eqx.field(static=True)

    @property
    def method(self) -> AbstractMethod:
        """Integration method, with its number of steps."""
        return self.solver if isinstance(self.solver, AbstractMethod) else FixedSteps(self.solver, self.steps)

    @property
    def stable(self) -> Bool[Array, ""]:
        """True if every multiplier is inside the unit circle."""
        return self.converged & (jnp.max(jnp.abs(self.multipliers)) < 1.0)

    @property
    def status(self) -> str:
        """Status in words: `converged` or `no orbit`."""
        return "converged" if bool(self.converged) else "no orbit"

    def __str__(self) -> str:
        if not bool(self.converged):
            return f"No orbit found (residual {float(self.residual):.1e})"
        what = "stable" if bool(self.stable) else "unstable"
        speed, mu = float(self.speed), ", ".join(f"{complex(m):.4g}" for m in self.multipliers)
        return (
            f"Period-{int(self.periods)} orbit at {speed:.6g} rad/s ({speed * 30 / jnp.pi:.1f} rpm), {what}\n"
            f"  state       {', '.join(f'{float(c):.6g}' for c in self.state)}\n"
            f"  multipliers {mu}\n"
            f"  residual {float(self.residual):.1e}, {int(self.steps)} steps per revolution, "
            f"map to {float(self.error):.1e} of the scale"
        )

    _repr_html_ = notebook_html


if TYPE_CHECKING:
    StateLike: TypeAlias = State | Float[Array, " dim"] | Float[np.ndarray, " dim"]
    Guess: TypeAlias = StateLike | Orbit
    NearOrbit: TypeAlias = Orbit | Point | tuple[StateLike, Scalar]
else:  # checked by the functions themselves
    Guess = NearOrbit = object


@jax.custom_jvp
def sorted_multipliers(monodromy: Float[Array, "dim dim"]) -> Complex[Array, " dim"]:
    """Return the eigenvalues, the largest first, differentiable to any order where they are distinct."""
    mu = jnp.linalg.eigvals(monodromy)
    return mu[jnp.argsort(-jnp.abs(mu))]


@sorted_multipliers.defjvp
def _sorted_multipliers_jvp(primals: Any, tangents: Any) -> Any:
    (m,), (m_dot,) = primals, tangents
    mu, v = jax.lax.linalg.eig(m, compute_left_eigenvectors=False, enable_eigvec_derivs=True)
    order = jnp.argsort(-jnp.abs(mu))
    mu, v = mu[order], v[:, order]
    return mu, jnp.diagonal(jnp.linalg.solve(v, m_dot.astype(v.dtype) @ v))


def _simulated(
    problem: OrbitProblem, given: Given, start: Array, revolutions: Array, counts: Counts
) -> Float[Array, " dim"]:
    """Return the state after `revolutions` from `start`, repeated with twice the steps until it settles."""

    def turn(i: Array, carry: tuple) -> tuple:
        y, done = carry
        strobe = strobe_map(given.system, given.speed, by_steps(problem, counts.steps(i)).method)
        begin = jnp.where(jnp.all(jnp.isfinite(y)), y, start)
        row, spin = tuple(begin[k] for k in range(start.size)), jnp.where(done, 0, revolutions)
        z = jnp.stack(jax.lax.fori_loop(0, spin, lambda _, y: strobe(y).y, row))
        moved = problem.moved(y / problem.scale, z / problem.scale)
        return z, done | (jnp.max(jnp.abs(moved)) < AT_REST * counts.tolerance)

    return jax.lax.fori_loop(0, counts.tries, turn, (start, jnp.array(False)))[0]


@compiled
def _find(
    problem: OrbitProblem, counts: Counts, spinning: Counts, given: Given, guess: Array, revolutions: Any
) -> tuple[Orbit, OrbitEquations, Array]:
    """Find the orbit, without derivatives; also return its equations and unknowns."""
    if revolutions is not None:
        guess = _simulated(problem, given, guess, revolutions, spinning)
        guess = without_turns(guess, problem.turns * problem.scale)
    equations = OrbitEquations(problem)
    u, found = refined(equations, given, guess / problem.scale, counts)
    converged = found.converged & ~((counts.tolerance > 0) & (found.error > SETTLED))
    u, equations = jnp.where(converged, u, jnp.nan), by_steps(equations, found.steps)
    n, at_root = problem.dimension, found.newton  # image and derivative of the map are those of the last evaluation
    monodromy = jnp.where(converged, at_root.jacobian[:n, :n] + jnp.eye(n), jnp.nan)
    state, multipliers = _place(equations, u, monodromy)
    orbit = Orbit(
        state=state,
        speed=given.speed,
        multipliers=multipliers,
        monodromy=monodromy,
        residual=jnp.max(jnp.abs(at_root.residual[:n])),
        steps=found.steps,
        error=found.error,
        converged=converged,
        periods=problem.periods,
        solver=problem.method.solver if isinstance(problem.method, FixedSteps) else problem.method,
    )
    return orbit, equations, u


@compiled
def _place(equations: OrbitEquations, u: Array, monodromy: Array) -> tuple[Array, Array]:
    finite = jnp.isfinite(monodromy)
    multipliers = jnp.where(jnp.all(finite), sorted_multipliers(jnp.where(finite, monodromy, 0.0)), jnp.nan)
    return equations.problem.state(u), multipliers


def periodic_orbit(
    system: AbstractForcedSystem,
    speed: Scalar,
    periods: int | Int[Array, ""] = 1,
    *,
    guess: Guess | None = None,
    revolutions: int | None = None,
    method: AbstractMethod | None = None,
) -> Orbit:
    """Find the orbit that closes after `periods` revolutions, by damped Newton's method on the strobe map.

    **Arguments:**

    - `system`, `speed`: any forced system, and its speed [rad/s].
    - `periods`: revolutions after which the orbit closes.
    - `guess`: a state [SI] near the orbit, or an `Orbit`; by default the first of the system's own initial states.
    - `revolutions`: revolutions of simulation before Newton's method; by default 200 without a guess, none with one.
    - `method`: integration method; by default Runge-Kutta with as many steps as the orbit needs or, if that does not
        converge, Rodas4 (never under `jit` and `vmap`).

    **Returns:** `Orbit`, with the steps used and their error; if none is found there is no exception. The function
    works under `jit` and `vmap`. State and multipliers have derivatives of every order with respect to `system` and
    `speed`.

    **Raises:** `ValueError` for an impossible speed, guess or count; `RuntimeError` without double precision.
    """
    require_x64()
    require_at_least(1, periods=periods)
    require_speeds(system, speed)
    if revolutions is not None:
        require_at_least(0, revolutions=revolutions)
    given = Given(system, jnp.asarray(speed, dtype=float))
    start = guess_state(system, given.speed, guess)
    once = revolutions is not None  # no more revolutions than requested
    if revolutions is None and guess is None:
        revolutions = SPUN
    spin = None if revolutions is None else jnp.asarray(revolutions)

    def find(method: AbstractMethod, counts: Counts) -> Orbit:
        here, begin = frozen((given, start))
        problem = make_problem(here, (), jnp.ones(0), periods, method)
        counts = counts.near(guess.steps if isinstance(guess, Orbit) else None)
        enough = jnp.minimum(counts.last, ENOUGH)
        first = enough if once else jnp.minimum(counts.first * 2, enough)
        found, equations, u = _find(problem, counts, counts._replace(first=first, last=enough), here, begin, spin)
        if not is_traced(given):
            return found
        u, monodromy = as_root(given, equations=equations, u=u)
        state, multipliers = _place(equations, u, monodromy)
        return dataclasses.replace(found, state=state, speed=given.speed, multipliers=multipliers, monodromy=monodromy)

    return with_fallback(find, method, lambda found: found.converged)


def guess_state(
    system: AbstractForcedSystem, speed: Scalar, guess: Guess | None, name: str = "guess"
) -> Float[Array, " dim"]:
    """Return a guess (argument `name`), by default the first initial state, as an array without derivative."""
    given: Any = system.initial_states(speed)[0] if guess is None else guess
    wanted = f"must be a state of {system.dimension} numbers"
    try:
        state = given.state if isinstance(given, Orbit) else jnp.stack([jnp.asarray(c, dtype=float) for c in given])
    except (TypeError, ValueError) as error:  # not numbers, or of unequal shapes
        raise ArgumentError(name, said=f"{wanted}, but {shown(guess)} was given.") from error
    if state.shape != (system.dimension,):
        raise ArgumentError(name, said=f"{wanted}, but has shape {state.shape}.")
    return jax.lax.stop_gradient(state)
