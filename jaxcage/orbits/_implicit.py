"""Roots of an orbit's equations, differentiated through the equations that define them, never through the iterations.

The equations are R(u, k, P, M) = 0 in the unknowns u, with the numbers k(u, given) of the field and image and
derivative P, M of the return map at (u, k). The implicit function theorem gives, R_x being all that follows from x,
    (R_u + R_k k_u) du = -R_k k_given dgiven.
The map is expanded around (u, k) by one program that serves equations of every kind (`by_columns`); how many design
parameters stand behind the few numbers k does not matter, and because the tangent is a matrix times dgiven, reverse
mode is had by transposing that matrix and not by running revolutions backwards. The rule itself is differentiable:
second derivatives are derivatives of it.

Roots are found by damped Newton's method, since orbits of stiff systems with contact have small basins, which a full
step often leaves. A step is taken back by halves until Deuflhard's natural monotonicity test holds,
|J^-1 f(new)| < |J^-1 f(old)| with the old Jacobian, which does not depend on how the equations are scaled
(P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, sec. 3.3).
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

from .._form import compiled
from .._types import Scalar
from ..solve import StrobeMap
from ._problem import OrbitProblem, Prepared, frozen
from ._steps import GIVEN_UP, Counts, by_steps


class AbstractEquations(eqx.Module):
    """Equations in an orbit's state and more, split into what is cheap and what runs revolutions."""

    problem: eqx.AbstractVar[OrbitProblem]

    @abc.abstractmethod
    def prepare(self, u: Float[Array, " n"], given: Any) -> Prepared:
        """All that the revolutions need to know of the unknowns and of what is given."""

    @abc.abstractmethod
    def closing(
        self, u: Float[Array, " n"], prepared: Prepared, image: Float[Array, " dim"], columns: Float[Array, "dim c"]
    ) -> tuple[Float[Array, " n"], Any]:
        """The equations, with the image of the state and its derivatives (see `returned`), and what else is
        wanted at the root."""

    def linearised(self, u: Float[Array, " n"], given: Any) -> tuple[Array, Array, Any]:
        """The equations, their derivative along each unknown, and what else is wanted at the root."""

        def at(u: Array) -> tuple[Array, tuple[Array, Any]]:
            strobe, drifts = prepared = self.prepare(u, given)
            image, columns = self.problem.returned(strobe, u[: self.problem.dimension], drifts)
            r, aux = self.closing(u, prepared, image, columns)
            return r, (r, aux)

        jacobian, (r, aux) = jax.jacfwd(at, has_aux=True)(u)
        return r, jacobian, aux

    @abc.abstractmethod
    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """How far two roots are apart, the second by twice the steps: in a unit of its own, and over what is allowed;
        from the way from one to the other, shape (..., n), and the derivatives at both, of JAX or of NumPy."""


class Newton(NamedTuple):
    """The last point that Newton's method accepted, and what is known there."""

    point: Float[Array, " n"]
    jacobian: Float[Array, "n n"]
    step: Float[Array, " n"]
    """The full step from `point`."""
    residual: Float[Array, " n"]
    factor: Float[Array, ""]
    """Share of `step` that is being tried."""
    done: Bool[Array, ""]


class Found(eqx.Module):
    """How a solve ended; without derivatives."""

    converged: Bool[Array, ""]
    iterations: Int[Array, ""]
    newton: Newton
    aux: Any
    steps: Int[Array, ""]
    """Steps per revolution."""
    error: Float[Array, ""]
    """Distance to the root by half as many (see `AbstractEquations.apart`), infinite where none was found; NaN where
    that was not looked at."""


TOLERANCE = 1e-9
"""Newton's last step is below this, in the unknowns' units; the error is of the order of its square."""
SMALLEST_FACTOR, OF_A_NEAR_GUESS = 2.0**-10, 0.75
"""Newton's method ends where a smaller share of its step would be tried."""


def solve(
    linearised: Callable[[Array], tuple[Array, Array, Any]],
    guess: Float[Array, " n"],
    max_steps: int = 40,
    tolerance: Scalar = TOLERANCE,
    at_root: bool = False,
    skip: Any = False,
    near: Any = False,
) -> tuple[Float[Array, " n"], Found]:
    """Newton's method from `guess`; not a step of it in lanes that `skip` it. A guess that is said to be near is given
    up where a full step leads away.

    It ends when the full step is below `tolerance` (1 + |u|) in every component; that step is still taken, so that the
    error of the result is of the order of its square.

    **Returns:** the root and `Found`: its Newton state is that of the last point before the root or, if `at_root`, of
    the root, for one evaluation more.
    """
    smallest = jnp.where(near, OF_A_NEAR_GUESS, SMALLEST_FACTOR)
    size = lambda step: jnp.max(jnp.abs(step))
    tiny = lambda step, u: size(step / (tolerance + tolerance * jnp.abs(u))) <= 1.0

    def turn(carry: tuple) -> tuple:
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
    on = lambda carry: (carry[0] < max_steps) & ~carry[2].done & ~carry[3]
    i, u, newton, lost, aux = jax.lax.while_loop(on, turn, start)
    return u, Found(newton.done & ~lost, i, newton, aux, jnp.zeros((), int), jnp.asarray(jnp.nan))


def settled(
    equations: AbstractEquations, given: Any, guess: Float[Array, " n"], counts: Counts, at_root: bool = False
) -> tuple[Float[Array, " n"], Found]:
    """The root by as many steps as it needs: solved again by twice as many until it stays where it is."""
    by = lambda steps: partial(by_steps(equations, steps).linearised, given=given)
    once = lambda steps, u, skip: solve(by(steps), u, at_root=at_root, skip=skip)

    def turn(carry: tuple) -> tuple:
        i, u, before, done = carry
        steps = counts.steps(i)  # the same in all lanes: numbers of their own would make them pass every step
        v, found = once(steps, jnp.where(before.converged, u, guess), done)
        both = before.converged & found.converged
        error, over = equations.apart(v - u, before.newton.jacobian, found.newton.jacobian)
        error = jnp.where(both, error, jnp.where(i == 0, jnp.nan, jnp.inf))
        settled = both & (over <= counts.tolerance)
        lost = ~found.converged & ~before.converged & (steps >= GIVEN_UP)
        found = eqx.tree_at(lambda f: (f.steps, f.error), found, (steps.astype(int), error))
        kept = jax.tree.map(lambda old, new: jnp.where(done, old, new), (u, before), (v, found))
        return i + 1, *kept, done | settled | lost

    shapes = eqx.filter_eval_shape(once, counts.last, guess, False)[1]
    nothing = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    start = jnp.zeros((), int), guess, nothing, jnp.array(False)
    _, u, found, _ = jax.lax.while_loop(lambda carry: carry[0] < counts.tries, turn, start)
    return u, found


# --- derivatives ---------------------------------------------------------------------------------------------------


def as_root(given: Any, *, equations: AbstractEquations, u: Float[Array, " n"], aux: Any) -> tuple[Array, Any]:
    """u and what else is known at it, as functions of what is given: a root of the equations there."""
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
    return (u, aux), _moved(equations, u, numbers, around, slopes, moving.k)


class FieldNumbers(NamedTuple):
    """What is known of the field at a root, or its tangent."""

    k: Float[Array, " k"]
    of_u: Float[Array, "k n"]
    like: Prepared
    """What they are numbers of."""


@compiled
def numbers_around(equations: AbstractEquations, u: Array, given: Any) -> FieldNumbers:
    """The numbers of the field at the unknowns u, and how they follow from these."""
    row = lambda v: numbers_of(equations.prepare(v, given))[0]
    return FieldNumbers(row(u), jax.jacfwd(row)(u), equations.prepare(u, given))


def expansion(problem: OrbitProblem, u: Float[Array, " n"], numbers: FieldNumbers) -> tuple[Any, Any]:
    """Image of the state and its derivatives, and the slopes of these by the state and by the numbers of the field."""
    x = jnp.concatenate([u[: problem.dimension], numbers.k])
    return by_columns(x, f=Slopes(Push(frozen(numbers.like), problem)))


@compiled
def _moved(
    equations: AbstractEquations, u: Array, numbers: FieldNumbers, around: Any, slopes: Any, k_dot: Array
) -> tuple[Array, Any]:
    """Derivatives of a root, and of what else is known there, along `k_dot`."""
    k, k_of_u, like = numbers
    n, m, remake = equations.problem.dimension, u.size, numbers_of(like)[1]

    def closing(moved: Array) -> tuple[Array, Any]:
        """The equations, with the map linear from here."""
        y = jnp.concatenate([u, k]) + moved
        off = jnp.concatenate([moved[:n], moved[m:]])
        return equations.closing(y[:m], remake(y[m:]), *jax.tree.map(lambda p, s: p + s @ off, around, slopes))

    of_r, of_aux = jax.jacfwd(closing)(jnp.zeros(m + k.size))
    u_dot = -jnp.linalg.solve(of_r[:, :m] + of_r[:, m:] @ k_of_u, of_r[:, m:] @ k_dot)
    moved = jnp.concatenate([u_dot, k_dot + k_of_u @ u_dot])
    return u_dot, jax.tree.map(lambda d: d @ moved, of_aux)


def numbers_of(prepared: Any) -> tuple[Float[Array, " k"], Callable[[Array], Any]]:
    """All numbers of `prepared` that its results depend on in a row, and the function that puts such a row back. Of a
    strobe map these are its field's: system and scale only say how far out a state is and how large an error."""
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
    """f(x), differentiated by f's Jacobian matrix in forward mode even in reverse mode, to any order. `f` is a module;
    what it holds has no derivative."""
    return _evaluated(f, x)


@by_columns.def_jvp
def _by_columns_jvp(primals: Any, tangents: Any, *, f: Callable[[Array], Any]) -> Any:
    (x,), (x_dot,) = primals, tangents
    value, slopes = by_columns(x, f=Slopes(f))
    return value, jax.tree.map(lambda s: s @ x_dot, slopes)


@compiled
def _evaluated(f: Callable[[Array], Any], x: Array) -> Any:
    return f(x)
