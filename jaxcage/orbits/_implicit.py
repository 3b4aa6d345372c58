"""Roots of an orbit's equations, differentiated through the equations that define them, never through the iterations.

With R(u, k) = 0 and k = prepare(u, given), the implicit function theorem gives
    (R_u + R_k k_u) du = -R_k k_given dgiven.
The revolutions are differentiated once, with respect to the state and to the few numbers k of the field; how many
design parameters stand behind these does not matter, and because the tangent is a matrix times dgiven, reverse mode is
had by transposing that matrix and not by running revolutions backwards. The rule itself is differentiable: second
derivatives are derivatives of it.
"""

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from .._types import Scalar
from ..integrate import StrobeMap
from ._newton import DampedNewton, NewtonState
from ._problem import frozen
from ._steps import GIVEN_UP, Counts


class AbstractEquations(eqx.Module):
    """As many equations as unknowns, split into what is cheap and what runs revolutions."""

    @abc.abstractmethod
    def prepare(self, u: Float[Array, " n"], given: Any) -> Any:
        """All that the revolutions need to know of the unknowns and of what is given."""

    @abc.abstractmethod
    def residual(self, u: Float[Array, " n"], prepared: Any) -> tuple[Float[Array, " n"], Any]:
        """The equations, and what else is wanted at the root."""

    @abc.abstractmethod
    def linearised(self, u: Float[Array, " n"], given: Any) -> tuple[Array, Array, Any]:
        """The equations, their derivative, and what else is wanted at the root."""

    @abc.abstractmethod
    def by_steps(self, steps: Int[Array, ""] | int) -> "AbstractEquations":
        """The same equations by another number of steps."""

    @abc.abstractmethod
    def apart(self, moved: Any, coarse: Any, fine: Any) -> tuple[Any, Any]:
        """How far two roots are apart, the second by twice the steps: in a unit of its own, and over what is allowed.

        **Arguments:** the way from one to the other, shape (..., n), and the derivatives at both, (..., m, n); of JAX
        or of NumPy.
        """


def differentiated(equations: AbstractEquations, u: Float[Array, " n"], given: Any) -> tuple[Array, Array, Any]:
    """What `linearised` returns, by differentiating the residual."""

    def at(u: Array) -> tuple[Array, tuple[Array, Any]]:
        r, aux = equations.residual(u, equations.prepare(u, given))
        return r, (r, aux)

    jacobian, (r, aux) = jax.jacfwd(at, has_aux=True)(u)
    return r, jacobian, aux


class Found(eqx.Module):
    """How a solve ended; without derivatives."""

    converged: Bool[Array, ""]
    iterations: Int[Array, ""]
    newton: NewtonState
    aux: Any
    steps: Int[Array, ""]
    """Steps per revolution."""
    error: Float[Array, ""]
    """Distance to the root by half as many (see `AbstractEquations.apart`), infinite where none was found; NaN where
    that was not looked at."""


TOLERANCE = 1e-9
"""Newton's last step is below this, in the unknowns' units; the error is of the order of its square."""


def solve(
    equations: AbstractEquations,
    given: Any,
    guess: Float[Array, " n"],
    max_steps: int = 40,
    tolerance: Scalar = TOLERANCE,
    at_root: bool = False,
    skip: Any = False,
    near: Any = False,
) -> tuple[Float[Array, " n"], Found]:
    """Newton's method from `guess`; not a step of it in lanes that `skip` it. A guess that is said to be near is given
    up where a full step leads away.

    **Returns:** the root and `Found`: its Newton state is that of the last point before the root or, if `at_root`, of
    the root, for one evaluation more.
    """

    def fn(u: Array, given: Any) -> tuple[Array, Any]:
        r, jacobian, aux = equations.linearised(u, given)
        return r, (jacobian, aux)

    smallest = jnp.where(near, 0.75, DampedNewton.smallest_factor)
    solver = DampedNewton(tolerance, tolerance, smallest_factor=smallest, at_root=at_root)
    options = {"skip": skip}
    got = optx.root_find(fn, solver, guess, given, options, has_aux=True, max_steps=max_steps, throw=False)
    converged = got.result == optx.RESULTS.successful
    steps = jnp.zeros((), int)
    return got.value, Found(converged, got.stats["num_steps"], got.state, got.aux[1], steps, jnp.asarray(jnp.nan))


def settled(
    equations: AbstractEquations, given: Any, guess: Float[Array, " n"], counts: Counts, at_root: bool = False
) -> tuple[Float[Array, " n"], Found]:
    """The root by as many steps as it needs: solved again by twice as many until it stays where it is.

    **Returns:** the root by the last number of steps, and `Found`.
    """
    once = lambda steps, u, skip: solve(equations.by_steps(steps), given, u, at_root=at_root, skip=skip)

    def turn(carry: tuple) -> tuple:
        i, u, before, done = carry
        steps = counts.rung(i)  # the same in all lanes: numbers of their own would make them pass every step
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
    _, u, found, _ = jax.lax.while_loop(lambda carry: carry[0] < counts.rungs, turn, start)
    return u, found


def implicit_root(
    equations: AbstractEquations, given: Any, guess: Float[Array, " n"], counts: Counts, at_root: bool = False
) -> tuple[Float[Array, " n"], Found]:
    """u with residual(u, prepare(u, given)) = 0 by as many steps as it needs (see `settled`), differentiable with
    respect to `given` only.

    **Returns:** u, NaN where Newton's method did not get there, and `Found`.
    """
    u, found = _root(given, equations=frozen(equations), guess=frozen(guess), counts=counts, at_root=at_root)
    return jnp.where(found.converged, u, jnp.nan), found


@eqx.filter_custom_jvp
def _root(given: Any, *, equations: AbstractEquations, guess: Array, counts: Counts, at_root: bool) -> Any:
    return settled(equations, given, guess, counts, at_root)


@_root.def_jvp
def _root_jvp(
    primals: Any, tangents: Any, *, equations: AbstractEquations, guess: Array, counts: Counts, at_root: bool
) -> Any:
    (given,), (given_dot,) = primals, tangents
    u, found = _root(given, equations=equations, guess=guess, counts=counts, at_root=at_root)
    equations = equations.by_steps(found.steps)
    row = lambda v, g: numbers_of(equations.prepare(v, g))[0]
    _, remake = numbers_of(equations.prepare(u, given))
    k, k_dot = eqx.filter_jvp(lambda g: row(u, g), (given,), (given_dot,))
    residual = lambda x: equations.residual(x[: u.size], remake(x[u.size :]))[0]
    whole = jax.jacfwd(residual)(jnp.concatenate([u, k]))
    of_u, of_k = whole[:, : u.size], whole[:, u.size :]
    k_of_u = jax.jacfwd(lambda v: row(v, given))(u)
    u_dot = -jnp.linalg.solve(of_u + of_k @ k_of_u, of_k @ k_dot)
    return (u, found), (u_dot, jax.tree.map(lambda _: None, found))


def numbers_of(prepared: Any) -> tuple[Float[Array, " k"], Callable[[Array], Any]]:
    """All numbers of `prepared` that its results depend on in a row, and the function that puts such a row back.

    Of a strobe map these are its field's: system and scale only say how far out a state is and how large an error.
    """
    numbers, rest = eqx.partition(prepared, jax.tree.map(_numbers, prepared, is_leaf=_is_map))
    k, unravel = ravel_pytree(numbers)
    return k, lambda row: eqx.combine(unravel(row), rest)


def _is_map(node: Any) -> bool:
    return isinstance(node, StrobeMap)


def _numbers(node: Any) -> Any:
    """Which parts of `node` matter, as a filter of Equinox."""
    if not isinstance(node, StrobeMap):
        return eqx.is_inexact_array
    return eqx.tree_at(lambda m: m.field, jax.tree.map(lambda _: False, node), eqx.is_inexact_array)


@eqx.filter_custom_jvp
def by_columns(x: Float[Array, " n"], *, f: Callable[[Array], Any], known: Any) -> Any:
    """`known`, which is f(x), differentiated by f's Jacobian matrix in forward mode even in reverse mode.

    `f` is a module; what it holds has no derivative. Without derivatives f is not evaluated, nor compiled.
    """
    return known


@by_columns.def_jvp
def _by_columns_jvp(primals: Any, tangents: Any, *, f: Callable[[Array], Any], known: Any) -> Any:
    (x,), (x_dot,) = primals, tangents
    jacobian, value = jax.jacfwd(lambda x: (f(x),) * 2, has_aux=True)(x)
    return value, jax.tree.map(lambda j: j @ x_dot, jacobian)
