"""Damped Newton's method as an optimistix root finder.

Orbits of stiff systems with contact have small basins: a full step often leaves them. A step is taken back by halves
until Deuflhard's natural monotonicity test holds, |J^-1 f(new)| < |J^-1 f(old)| with the old Jacobian, which does not
depend on how the equations are scaled (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, sec. 3.3).
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Float


class NewtonState(eqx.Module):
    """The last point that was accepted, and what is known there."""

    point: Float[Array, " n"]
    jacobian: Float[Array, "n n"]
    step: Float[Array, " n"]
    """The full Newton step from `point`."""
    residual: Float[Array, " n"]
    factor: Float[Array, ""]
    """Share of `step` that is being tried."""


class DampedNewton(optx.AbstractRootFinder):
    """Newton's method with step halving; the Jacobian by forward differentiation, as strobe maps allow no other.

    Ends when the full step is below `atol` + `rtol` |y| in every component; that step is still taken, so that the error
    of the result is of the order of its square.
    """

    rtol: Any = 1e-9
    atol: Any = 1e-9
    norm: Callable = optx.max_norm
    longest: float = 1.0
    """Longest step in any component."""
    smallest_factor: float = 2.0**-10

    def init(self, fn: Any, y: Any, args: Any, options: Any, f_struct: Any, aux_struct: Any, tags: Any) -> NewtonState:
        del fn, args, options, aux_struct, tags
        n = y.size
        full = lambda *shape: jnp.full(shape, jnp.inf)
        return NewtonState(y, full(n, n), full(n), jnp.full(f_struct.shape, jnp.inf), jnp.ones(()))

    def step(self, fn: Any, y: Any, args: Any, options: Any, state: NewtonState, tags: Any) -> Any:
        del options, tags

        def evaluate(x: Array) -> tuple[Array, tuple[Array, Any]]:
            f, aux = fn(x, args)
            return f, (f, aux)

        jacobian, (f, aux) = jax.jacfwd(evaluate, has_aux=True)(y)
        first = jnp.isinf(state.step[0])
        known = jnp.where(first, jnp.eye(y.size), state.jacobian)
        ahead = jnp.linalg.solve(known, f)
        usable = jnp.all(jnp.isfinite(f)) & jnp.all(jnp.isfinite(jacobian))
        nearer = jnp.max(jnp.abs(ahead)) < jnp.max(jnp.abs(state.step))
        tiny = jnp.max(jnp.abs(state.step) / self._tolerance(y)) <= 1.0
        accept = usable & (first | nearer | tiny)
        taken = NewtonState(y, jacobian, -jnp.linalg.solve(jacobian, f), f, jnp.minimum(1.0, 2 * state.factor))
        kept = eqx.tree_at(lambda s: s.factor, state, state.factor / 2)
        new = jax.tree.map(lambda a, b: jnp.where(accept, a, b), taken, kept)
        length = jnp.max(jnp.abs(new.step))
        share = jnp.minimum(new.factor, self.longest / jnp.where(length > 0, length, 1.0))
        return new.point + share * new.step, new, aux

    def terminate(self, fn: Any, y: Any, args: Any, options: Any, state: NewtonState, tags: Any) -> Any:
        del fn, args, options, tags
        done = jnp.max(jnp.abs(state.step) / self._tolerance(y)) <= 1.0
        stuck = state.factor < self.smallest_factor
        result = optx.RESULTS.where(stuck, optx.RESULTS.nonlinear_divergence, optx.RESULTS.successful)
        return done | stuck, result

    def postprocess(
        self, fn: Any, y: Any, aux: Any, args: Any, options: Any, state: Any, tags: Any, result: Any
    ) -> tuple[Any, Any, dict[str, Any]]:
        del fn, args, options, state, tags, result
        return y, aux, {}

    def _tolerance(self, y: Array) -> Array:
        return self.atol + self.rtol * jnp.abs(y)
