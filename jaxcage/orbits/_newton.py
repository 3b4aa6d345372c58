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
from jaxtyping import Array, Bool, Float


class NewtonState(eqx.Module):
    """The last point that was accepted, and what is known there."""

    point: Float[Array, " n"]
    jacobian: Float[Array, "n n"]
    step: Float[Array, " n"]
    """The full Newton step from `point`."""
    residual: Float[Array, " n"]
    factor: Float[Array, ""]
    """Share of `step` that is being tried."""
    done: Bool[Array, ""]


class DampedNewton(optx.AbstractRootFinder):
    """Newton's method with step halving, for a function that returns its Jacobian matrix first in its auxiliary output.

    Ends when the full step is below `atol` + `rtol` |y| in every component; that step is still taken, so that the error
    of the result is of the order of its square. With `at_root`, residual and Jacobian are then evaluated once more, so
    that the state has those of the result itself.
    """

    rtol: Any = 1e-9
    atol: Any = 1e-9
    norm: Callable = optx.max_norm
    longest: float = 1.0
    """Longest step in any component."""
    smallest_factor: Any = 2.0**-10
    at_root: bool = False

    def init(self, fn: Any, y: Any, args: Any, options: Any, f_struct: Any, aux_struct: Any, tags: Any) -> NewtonState:
        del fn, args, aux_struct, tags
        n, done = y.size, jnp.asarray(options.get("skip", False))
        full = lambda *shape: jnp.full(shape, jnp.inf)
        return NewtonState(y, full(n, n), full(n), jnp.full(f_struct.shape, jnp.inf), jnp.ones(()), done)

    def step(self, fn: Any, y: Any, args: Any, options: Any, state: NewtonState, tags: Any) -> Any:
        del options, tags
        f, aux = fn(y, args)
        jacobian = aux[0]
        first = jnp.isinf(state.step[0])
        known = jnp.where(first, jnp.eye(y.size), state.jacobian)
        ahead = jnp.linalg.solve(known, f)
        usable = jnp.all(jnp.isfinite(f)) & jnp.all(jnp.isfinite(jacobian))
        nearer = jnp.max(jnp.abs(ahead)) < jnp.max(jnp.abs(state.step))
        there = self._tiny(state.step, y)
        accept = usable & (first | nearer | there)
        step = -jnp.linalg.solve(jacobian, f)
        done = there if self.at_root else self._tiny(step, y)
        taken = NewtonState(y, jacobian, step, f, jnp.minimum(1.0, 2 * state.factor), done)
        kept = eqx.tree_at(lambda s: s.factor, state, state.factor / 2)
        new = jax.tree.map(lambda a, b: jnp.where(accept, a, b), taken, kept)
        length = jnp.max(jnp.abs(new.step))
        share = jnp.minimum(new.factor, self.longest / jnp.where(length > 0, length, 1.0))
        onward = new.point + share * new.step
        return jnp.where(new.done, y, onward) if self.at_root else onward, new, aux

    def terminate(self, fn: Any, y: Any, args: Any, options: Any, state: NewtonState, tags: Any) -> Any:
        del fn, y, args, options, tags
        stuck = state.factor < self.smallest_factor
        result = optx.RESULTS.where(stuck, optx.RESULTS.nonlinear_divergence, optx.RESULTS.successful)
        return state.done | stuck, result

    def postprocess(
        self, fn: Any, y: Any, aux: Any, args: Any, options: Any, state: Any, tags: Any, result: Any
    ) -> tuple[Any, Any, dict[str, Any]]:
        del fn, args, options, state, tags, result
        return y, aux, {}

    def _tiny(self, step: Array, y: Array) -> Bool[Array, ""]:
        """Whether a step is below the tolerances."""
        return jnp.max(jnp.abs(step) / (self.atol + self.rtol * jnp.abs(y))) <= 1.0
