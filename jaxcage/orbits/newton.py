"""Newton's method for the equations of an orbit, damped, and repeated with twice the steps until the root stays.

Orbits of stiff systems with contact have small basins, which a full Newton step often leaves. A step is halved until
Deuflhard's natural monotonicity test holds, |J^-1 f(new)| < |J^-1 f(old)| with the old Jacobian, which does not depend
on how the equations are scaled (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, sec. 3.3).

Roots have derivatives by the implicit function theorem, and not through the iterations. The equations are
R(u, k, P, M) = 0 in the unknowns u, with the numbers k(u, given) of the field and image and derivative P, M of the
return map at (u, k). With R_x for all that follows from x,
    (R_u + R_k k_u) du = -R_k k_given dgiven.
One program for equations of every kind expands the map around (u, k) (`by_columns`); the number of design parameters
behind the few numbers k does not matter. Since the tangent is a matrix times dgiven, reverse mode transposes that
matrix and does not run revolutions backwards. The rule itself is differentiable, which gives second derivatives.
"""

import abc
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from .._pytrees import Scalar, compiled
from ..solve import StrobeMap
from .problem import OrbitProblem, Prepared, frozen
from .step_counts import GIVEN_UP, Counts, by_steps


class AbstractEquations(eqx.Module):
    """Equations in an orbit's state and further unknowns, split into a cheap part and the revolutions."""

    problem: eqx.AbstractVar[OrbitProblem]

    @abc.abstractmethod
    def prepare(self, u: Float[Array, " n"], given: Any) -> Prepared:
        """Return all that the revolutions need to know of the unknowns and of what is given."""

    @abc.abstractmethod
    def closing(
        self, u: Float[Array, " n"], prepared: Prepared, image: Float[Array, " dim"], columns: Float[Array, "dim c"]
    ) -> tuple[Float[Array, " n"], Any]:
        """Return the equations and what else is wanted at the root, from the return map and its derivatives."""

    @abc.abstractmethod
    def monodromy(self, found: Any) -> Any:
        """Return the monodromy matrix from what continuation knows at a point, `Points`."""

    @abc.abstractmethod
    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """Return the distance of two roots, in a unit of its own, and its ratio to what is allowed.

        **Arguments:** the difference of the two, shape (..., n), and the equations' derivatives at the first and at the
        second, which has twice the steps; of JAX or of NumPy.
        """

    def linearised(self, u: Float[Array, " n"], given: Any) -> tuple[Array, Array, Any]:
        """Return the equations, their derivative along each unknown, and what else is wanted at the root."""

        def at(u: Array) -> tuple[Array, tuple[Array, Any]]:
            strobe, drifts = prepared = self.prepare(u, given)
            image, columns = self.problem.returned(strobe, u[: self.problem.dimension], drifts)
            r, aux = self.closing(u, prepared, image, columns)
            return r, (r, aux)

        jacobian, (r, aux) = jax.jacfwd(at, has_aux=True)(u)
        return r, jacobian, aux


class Newton(NamedTuple):
    """The last point that Newton's method accepted, what is known there, and the share of the full step from there that
    is being tried."""

    point: Float[Array, " n"]
    jacobian: Float[Array, "n n"]
    step: Float[Array, " n"]
    residual: Float[Array, " n"]
    factor: Float[Array, ""]
    done: Bool[Array, ""]


class Found(eqx.Module):
    """The result of Newton's method beside the root, without derivatives.

    `error` is the distance to the root by half the steps per revolution (see `AbstractEquations.apart`), infinite if
    none was found, and NaN if these were not tried.
    """

    converged: Bool[Array, ""]
    iterations: Int[Array, ""]
    newton: Newton
    aux: Any
    steps: Int[Array, ""]
    error: Float[Array, ""]


TOLERANCE = 1e-9
"""Largest last step of Newton's method, in the unknowns' units; the error is of the order of its square."""
SMALLEST_FACTOR, SMALLEST_OF_A_NEAR_GUESS = 2.0**-10, 0.75
"""Newton's method ends before it tries a smaller share of its step."""


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

    It ends if the full step is below `tolerance` (1 + |u|) in every component; that step is still taken, so that the
    error of the root is of the order of its square.

    **Arguments:** equations with their derivative; first guess; most iterations; tolerance; `at_root` asks for one more
    evaluation, at the root; lanes with `skip` do nothing; a guess that is `near` is given up if a full step leads away.

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
    i, u, newton, lost, aux = jax.lax.while_loop(goes_on, iteration, start)
    return u, Found(newton.done & ~lost, i, newton, aux, jnp.zeros((), int), jnp.asarray(jnp.nan))


def refined(
    equations: AbstractEquations, given: Any, guess: Float[Array, " n"], counts: Counts, at_root: bool = False
) -> tuple[Float[Array, " n"], Found]:
    """Find a root with as many steps as it needs: solve again with twice as many until it stays where it is."""
    once = lambda steps, u, skip: solve(
        partial(by_steps(equations, steps).linearised, given=given), u, at_root=at_root, skip=skip
    )

    def doubling(carry: tuple) -> tuple:
        i, u, before, done = carry
        steps = counts.steps(i)  # the same in all lanes: numbers of their own would make them pass every step
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


def as_root(given: Any, *, equations: AbstractEquations, u: Float[Array, " n"], aux: Any) -> tuple[Array, Any]:
    """Return u and what else is known at it, as functions of what is given: u is a root of the equations there."""
    # `jax.grad` of a Python number traces a number that is no array, and that a filter of arrays would not see
    given = jax.tree.map(lambda x: jnp.asarray(x) if isinstance(x, Tracer) else x, given)
    return _as_root(given, equations=equations, u=u, aux=aux)


@eqx.filter_custom_jvp
def _as_root(given: Any, *, equations: AbstractEquations, u: Array, aux: Any) -> tuple[Array, Any]:
    return u, aux


@_as_root.def_jvp
def _as_root_jvp(primals: Any, tangents: Any, *, equations: AbstractEquations, u: Array, aux: Any) -> Any:
    (given,), (given_dot,) = primals, tangents
    u, aux = _as_root(given, equations=equations, u=u, aux=aux)
    numbers, moving = eqx.filter_jvp(lambda g: numbers_around(equations, u, g), (given,), (given_dot,))
    around, slopes = expansion(equations.problem, u, numbers)
    _, slopes = around_root(equations, u, numbers, around, slopes)
    return (u, aux), _root_tangent(numbers, *slopes, moving.k)


class FieldNumbers(NamedTuple):
    """The numbers of the field at a root, or their tangents."""

    k: Float[Array, " k"]
    of_u: Float[Array, "k n"]
    """Derivatives of k with respect to the unknowns."""
    like: Prepared
    """The tree that the numbers k belong to."""


@compiled
def numbers_around(equations: AbstractEquations, u: Array, given: Any) -> FieldNumbers:
    """Return the numbers of the field at the unknowns u, and their derivatives with respect to u."""
    row = lambda v: numbers_of(equations.prepare(v, given))[0]
    return FieldNumbers(row(u), jax.jacfwd(row)(u), equations.prepare(u, given))


def expansion(problem: OrbitProblem, u: Float[Array, " n"], numbers: FieldNumbers) -> tuple[Any, Any]:
    """Return image of the state and its derivatives, and the slopes of both by the state and the field's numbers."""
    x = jnp.concatenate([u[: problem.dimension], numbers.k])
    return by_columns(x, f=Slopes(Push(frozen(numbers.like), problem)))


@compiled
def around_root(
    equations: AbstractEquations, u: Array, numbers: FieldNumbers, around: Any, slopes: Any
) -> tuple[tuple[Array, Any], tuple[Array, Any]]:
    """Return the equations and what else is known at u, and the derivatives of both by u and, then, by k."""
    n, m, remake = equations.problem.dimension, u.size, numbers_of(numbers.like)[1]

    def closing(moved: Array) -> tuple[Any, Any]:
        """Return the equations, with the map linear from here."""
        y = jnp.concatenate([u, numbers.k]) + moved
        off = jnp.concatenate([moved[:n], moved[m:]])
        found = equations.closing(y[:m], remake(y[m:]), *jax.tree.map(lambda p, s: p + s @ off, around, slopes))
        return found, found

    slopes_there, there = jax.jacfwd(closing, has_aux=True)(jnp.zeros(m + numbers.k.size))
    return there, slopes_there


@compiled
def _root_tangent(numbers: FieldNumbers, of_r: Array, of_aux: Any, k_dot: Array) -> tuple[Array, Any]:
    """Return the derivatives of a root, and of what else is known there, along `k_dot`."""
    m = of_r.shape[0]
    u_dot = -jnp.linalg.solve(of_r[:, :m] + of_r[:, m:] @ numbers.of_u, of_r[:, m:] @ k_dot)
    moved = jnp.concatenate([u_dot, k_dot + numbers.of_u @ u_dot])
    return u_dot, jax.tree.map(lambda d: d @ moved, of_aux)


def numbers_of(prepared: Any) -> tuple[Float[Array, " k"], Callable[[Array], Any]]:
    """Return all numbers that the results of `prepared` depend on, in a row, and the function that puts a row back.

    For a strobe map these are the field's numbers: system and scale only say how far out a state is and how large an
    error.
    """
    is_map = lambda node: isinstance(node, StrobeMap)
    matters = lambda node: (
        eqx.tree_at(lambda m: m.field, jax.tree.map(lambda _: False, node), eqx.is_inexact_array)
        if is_map(node)
        else eqx.is_inexact_array(node)
    )
    numbers, rest = eqx.partition(prepared, jax.tree.map(matters, prepared, is_leaf=is_map))
    k, unravel = ravel_pytree(numbers)
    return k, lambda row: eqx.combine(unravel(row), rest)


class Push(eqx.Module):
    """Image of a state and its derivatives, as a function of state and numbers of the field in a row."""

    like: Prepared
    problem: OrbitProblem

    def __call__(self, x: Array) -> tuple[Array, Array]:
        n = self.problem.dimension
        strobe, drifts = numbers_of(self.like)[1](x[n:])
        return self.problem.returned(strobe, x[:n], drifts)


class Slopes(eqx.Module):
    """A function's value and Jacobian matrix."""

    f: Callable[[Array], Any]

    def __call__(self, x: Array) -> tuple[Any, Any]:
        slopes, value = jax.jacfwd(lambda x: (self.f(x),) * 2, has_aux=True)(x)
        return value, slopes


@eqx.filter_custom_jvp
def by_columns(x: Float[Array, " n"], *, f: Callable[[Array], Any]) -> Any:
    """Return f(x), which reverse mode, too, differentiates by f's Jacobian matrix in forward mode, to any order.

    `f` is a module; its own numbers have no derivative.
    """
    return _evaluated(f, x)


@by_columns.def_jvp
def _by_columns_jvp(primals: Any, tangents: Any, *, f: Callable[[Array], Any]) -> Any:
    (x,), (x_dot,) = primals, tangents
    value, slopes = by_columns(x, f=Slopes(f))
    return value, jax.tree.map(lambda s: s @ x_dot, slopes)


@compiled
def _evaluated(f: Callable[[Array], Any], x: Array) -> Any:
    return f(x)
