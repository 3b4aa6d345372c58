"""Derivatives of the roots of an orbit's equations, by the implicit function theorem and not through the iterations.

The equations are R(u, k, P, M) = 0 in the unknowns u, with the numbers k(u, given) of the field and image and
derivative P, M of the return map at (u, k). With R_x for all that follows from x, the theorem gives
    (R_u + R_k k_u) du = -R_k k_given dgiven.
One program for equations of every kind expands the map around (u, k) (`by_columns`). The number of design parameters
behind the few numbers k does not matter. Since the tangent is a matrix times dgiven, reverse mode transposes that
matrix and does not run revolutions backwards. The rule itself is differentiable, which gives second derivatives.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from .._form import compiled
from ..solve import StrobeMap
from .newton import AbstractEquations
from .problem import OrbitProblem, Prepared, frozen


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
