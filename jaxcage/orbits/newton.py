"""Newton's method for the equations of an orbit, damped, and repeated with twice the steps until the root stays.

Orbits of stiff systems with contact have small basins, which a full Newton step often leaves. A step is halved until
Deuflhard's natural monotonicity test holds, |J^-1 f(new)| < |J^-1 f(old)| with the old Jacobian, which does not depend
on how the equations are scaled (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, sec. 3.3).
"""

import abc
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from .._types import Scalar
from .problem import OrbitProblem, Prepared
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
    """The result of Newton's method beside the root, without derivatives."""

    converged: Bool[Array, ""]
    iterations: Int[Array, ""]
    newton: Newton
    aux: Any
    steps: Int[Array, ""]
    """Steps per revolution."""
    error: Float[Array, ""]
    """Distance to the root by half as many steps (see `AbstractEquations.apart`), infinite if none was found; NaN if
    these were not tried."""


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
