"""Damped Newton's method for the equations of an orbit, repeated with twice the steps until the root no longer moves.

In stiff systems with contact a full Newton step often leaves the small region of convergence. A step is halved until
Deuflhard's natural monotonicity test holds, |J^-1 f(new)| < |J^-1 f(old)| with the old Jacobian, which is independent
of the scaling of the equations (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, sec. 3.3).

Roots have derivatives of any order by the implicit function theorem (`jax.lax.custom_root`), not through the
iterations. The equations depend on the system only through the few numbers of its field, so that the number of design
parameters does not matter. The return map is expanded in state and numbers (`by_columns`): reverse mode transposes its
Jacobian matrix and does not integrate backwards.
"""

import abc
import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from .._pytrees import Scalar, compiled
from ..solve import StrobeMap
from .problem import GIVEN_UP, Counts, OrbitProblem, by_steps, frozen


class AbstractEquations(eqx.Module):
    """Equations in an orbit's state and further unknowns."""

    problem: eqx.AbstractVar[OrbitProblem]

    @abc.abstractmethod
    def closing(
        self, u: Float[Array, " n"], image: Float[Array, " dim"], monodromy: Float[Array, "dim dim"]
    ) -> tuple[Float[Array, " n"], Any]:
        """Return the residual, and auxiliary results at the root, from the return map and its derivative."""

    @abc.abstractmethod
    def monodromy(self, found: Any) -> Any:
        """Return the monodromy matrix of `found`, which are `Points`."""

    @abc.abstractmethod
    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """Return the distance of two roots, in a unit of its own, and its ratio to the tolerance.

        **Arguments:** the difference of the two, shape (..., n), and the equations' derivatives at the first and at the
        second, which has twice the steps; arrays of JAX or NumPy.
        """

    def linearised(self, u: Float[Array, " n"], given: Any) -> tuple[Array, Array, Any]:
        """Return the residual, its derivative along each unknown, and auxiliary results at the root."""

        def at(u: Array) -> tuple[Array, tuple[Array, Any]]:
            problem = self.problem
            r, aux = self.closing(u, *problem.returned(problem.prepare(u, given), u[: problem.dimension]))
            return r, (r, aux)

        jacobian, (r, aux) = jax.jacfwd(at, has_aux=True)(u)
        return r, jacobian, aux


class Newton(NamedTuple):
    """Last point accepted by Newton's method, and `factor`, the fraction of the full step from there that is tried."""

    point: Float[Array, " n"]
    jacobian: Float[Array, "n n"]
    step: Float[Array, " n"]
    residual: Float[Array, " n"]
    factor: Float[Array, ""]
    done: Bool[Array, ""]


class Found(eqx.Module):
    """Result of Newton's method apart from the root, without derivatives; `error` is the distance to the root with half
    the steps (see `AbstractEquations.apart`), infinite if none was found, NaN if it was not computed."""

    converged: Bool[Array, ""]
    newton: Newton
    aux: Any
    steps: Int[Array, ""]
    error: Float[Array, ""]


TOLERANCE = 1e-9
"""Largest last step of Newton's method, in the unknowns' units; the error is of the order of its square."""
SMALLEST_FACTOR, SMALLEST_OF_A_NEAR_GUESS = 2.0**-10, 0.75
"""Smallest fraction of a full step that Newton's method tries, also from a guess that is near a root."""


def solve(
    linearised: Callable[[Array], tuple[Array, Array, Any]],
    guess: Float[Array, " n"],
    max_steps: int = 40,
    tolerance: Scalar = TOLERANCE,
    at_root: bool = False,
    skip: Any = False,
    near: Any = False,
) -> tuple[Float[Array, " n"], Found]:
    """Find a root by damped Newton's method.

    It ends if the full step is below `tolerance` (1 + |u|) in every component. That step is still taken, so that the
    error of the root is of the order of its square.

    **Arguments:** equations with their derivative; initial guess; maximum number of iterations; tolerance; `at_root`,
    to evaluate once more at the root; `skip`, to do nothing; `near`, to give up if a full step increases the distance.

    **Returns:** the root and `Found`, whose `newton` describes the point before the root or, if `at_root`, the root.
    """
    smallest = jnp.where(near, SMALLEST_OF_A_NEAR_GUESS, SMALLEST_FACTOR)
    size = lambda step: jnp.max(jnp.abs(step))
    tiny = lambda step, u: size(step / (tolerance + tolerance * jnp.abs(u))) <= 1.0

    def iteration(carry: tuple) -> tuple:
        i, u, newton, _, _ = carry
        r, jacobian, aux = linearised(u)
        first = jnp.isinf(newton.step[0])
        known = jnp.where(first, jnp.eye(u.size), newton.jacobian)
        nearer = size(jnp.linalg.solve(known, r)) < size(newton.step)
        there = tiny(newton.step, u)
        accept = jnp.all(jnp.isfinite(r)) & jnp.all(jnp.isfinite(jacobian)) & (first | nearer | there)
        step = -jnp.linalg.solve(jacobian, r)
        done = there if at_root else tiny(step, u)
        taken = Newton(u, jacobian, step, r, jnp.minimum(1.0, 2 * newton.factor), done)
        refused = newton._replace(factor=newton.factor / 2)
        new = jax.tree.map(lambda a, b: jnp.where(accept, a, b), taken, refused)
        length = size(new.step)
        share = jnp.minimum(new.factor, 1.0 / jnp.where(length > 0, length, 1.0))
        onward = new.point + share * new.step
        lost = (new.factor < smallest) | ~jnp.all(jnp.isfinite(u))
        return i + 1, jnp.where(new.done, u, onward) if at_root else onward, new, lost, aux

    unknown = lambda *shape: jnp.full(shape, jnp.inf)
    n, like = guess.size, eqx.filter_eval_shape(linearised, guess)[2]
    begin = Newton(guess, unknown(n, n), unknown(n), unknown(n), jnp.ones(()), jnp.asarray(skip))
    aux = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), like)
    start = jnp.zeros((), int), guess, begin, ~jnp.all(jnp.isfinite(guess)), aux
    goes_on = lambda carry: (carry[0] < max_steps) & ~carry[2].done & ~carry[3]
    _, u, newton, lost, aux = jax.lax.while_loop(goes_on, iteration, start)
    return u, Found(newton.done & ~lost, newton, aux, jnp.zeros((), int), jnp.asarray(jnp.nan))


def refined(
    equations: AbstractEquations, given: Any, guess: Float[Array, " n"], counts: Counts
) -> tuple[Float[Array, " n"], Found]:
    """Find a root, doubling the steps per revolution until it no longer moves."""
    once = lambda steps, u, skip: solve(
        partial(by_steps(equations, steps).linearised, given=given), u, at_root=True, skip=skip
    )

    def doubling(carry: tuple) -> tuple:
        i, u, before, done = carry
        steps = counts.steps(i)  # common to all lanes under `vmap`: otherwise each would run the largest number
        v, found = once(steps, jnp.where(before.converged, u, guess), done)
        both = before.converged & found.converged
        error, ratio = equations.apart(v - u, before.newton.jacobian, found.newton.jacobian)
        error = jnp.where(both, error, jnp.where(i == 0, jnp.nan, jnp.inf))
        settled = both & (ratio <= counts.tolerance)
        lost = ~found.converged & ~before.converged & (steps >= GIVEN_UP)
        found = eqx.tree_at(lambda f: (f.steps, f.error), found, (steps.astype(int), error))
        kept = jax.tree.map(lambda old, new: jnp.where(done, old, new), (u, before), (v, found))
        return i + 1, *kept, done | settled | lost

    shapes = eqx.filter_eval_shape(once, counts.last, guess, False)[1]
    nothing = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    start = jnp.zeros((), int), guess, nothing, jnp.array(False)
    _, u, found, _ = jax.lax.while_loop(lambda carry: carry[0] < counts.tries, doubling, start)
    return u, found


# --- derivatives ---------------------------------------------------------------------------------------------------


@compiled
def as_root(given: Any, *, equations: AbstractEquations, u: Float[Array, " n"]) -> tuple[Array, Any]:
    """Return the root u of the equations and the auxiliary results there as differentiable functions of `given`."""
    closing = lambda u: expanded(equations, u, given)
    matrix = lambda linear, y: jnp.linalg.solve(jax.jacfwd(linear)(jnp.zeros_like(y)), y)
    root = jax.lax.custom_root(lambda u: closing(u)[0], frozen(u), lambda _, u: u, matrix)
    return root, closing(root)[1]


def expanded(equations: AbstractEquations, u: Float[Array, " n"], given: Any) -> tuple[Array, Any]:
    """Return residual and auxiliary results at the unknowns u as differentiable functions of u and `given`."""
    problem = equations.problem
    strobe = problem.prepare(u, given)
    x = jnp.concatenate([u[: problem.dimension], numbers_of(strobe)[0]])
    return equations.closing(u, *by_columns(x, Push(frozen(strobe), problem)))


def numbers_of(strobe: StrobeMap) -> tuple[Float[Array, " k"], Callable[[Array], StrobeMap]]:
    """Return the numbers of a map's field in a row, and the function that puts such a row into the map; the system and
    its scale, which only serve to measure excursions and errors, are left out."""
    numbers, rest = eqx.partition(strobe.field, eqx.is_inexact_array)
    k, unravel = ravel_pytree(numbers)
    return k, lambda row: dataclasses.replace(strobe, field=eqx.combine(unravel(row), rest))


class Push(eqx.Module):
    """Image of a state and its derivatives, as a function of the state and the field's numbers in a row."""

    strobe: StrobeMap
    problem: OrbitProblem

    def __call__(self, x: Array) -> tuple[Array, Array]:
        n = self.problem.dimension
        return self.problem.returned(numbers_of(self.strobe)[1](x[n:]), x[:n])


class Slopes(eqx.Module):
    """Value and Jacobian matrix of `f`."""

    f: Callable[[Array], Any]

    def __call__(self, x: Array) -> tuple[Any, Any]:
        slopes, value = jax.jacfwd(lambda x: (self.f(x),) * 2, has_aux=True)(x)
        return value, slopes


def by_columns(x: Float[Array, " n"], f: Callable[[Array], Any]) -> Any:
    """Return f(x); even in reverse mode its derivatives, of any order, come from Jacobians in forward mode. `f` is a
    module, whose own numbers have no derivative."""
    numbers, rest = eqx.partition(f, eqx.is_array)

    @jax.custom_jvp
    def value(numbers: Any, x: Array) -> Any:
        return eqx.combine(numbers, rest)(x)

    @value.defjvp
    def _(primals: Any, tangents: Any) -> Any:
        result, slopes = by_columns(primals[1], Slopes(eqx.combine(primals[0], rest)))
        return result, jax.tree.map(lambda s: s @ tangents[1], slopes)

    return value(numbers, x)
