"""How many steps a revolution of an orbit takes: they are doubled until half as many give the same orbit.

The map of equal steps is as smooth as the field, so that roots and derivatives are exact for it; its distance from the
true map is seen by solving again with twice the steps, from the orbit known. An orbit usually takes 256 to 2048 steps,
whether it touches the land or not, because steps are shortened during a contact.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from ..solve import AbstractMethod, FixedSteps, method as make_method


FIRST, FIRST_OF_RODAS4, MOST = 256, 512, 16384
MOST_OF_A_POINT = 2 * MOST  # a bifurcation point by 16384 steps is confirmed by twice as many
ENOUGH = 4096  # most steps of a computation that only leads to an orbit
GIVEN_UP = 2048  # if this many steps find nothing, more are not tried
IMAGE, SLOPE = 1e-6, 1e-3
"""Largest change of the map, in units of the system's scale, and of its derivative, relative to one plus its size,
between an orbit's steps and half as many."""
POINT = 1e-7  # largest change of the place of a bifurcation, relative
SETTLED = 2e-4  # a point whose place changes by more, relative, is not known; nor is an orbit with a larger error
BY_OTHERS = 2.0  # the stated error of a point is at least this many times its distance to that by `other_steps`


def other_steps(steps: Any) -> Any:
    """Return a number of steps that shares no ends of steps with `steps`.

    Where a motion meets a kink of the law near an end that 256, 512, 1024, ... steps share, doubling them changes
    nothing, and all of them are wrong.
    """
    return (3 * steps // 4) | 1


class Counts(NamedTuple):
    """The numbers of steps to try, each twice the one before."""

    first: Int[Array, ""]
    last: Int[Array, ""]
    tolerance: Float[Array, ""]
    """Allowed difference of two results, in units of what is allowed; 0 if the last number was asked for."""

    @property
    def tries(self) -> Int[Array, ""]:
        """How many numbers there are."""
        return 1 + jnp.ceil(jnp.log2(self.last.astype(float) / self.first.astype(float)) - 1e-9).astype(int)

    def steps(self, i: Any) -> Int[Array, ""]:
        """Return the i-th number."""
        return jnp.minimum(self.first * 2**i, self.last)

    def near(self, steps: Any) -> "Counts":
        """Return the numbers to try where `steps` were right nearby: half as many come first, for the error."""
        if steps is None or isinstance(steps, Tracer):
            return self
        first = jnp.clip(jnp.asarray(steps, int) // 2, self.first, self.last)
        return self._replace(first=jnp.where(self.tolerance > 0, first, self.first))

    @property
    def chooses(self) -> bool:
        """Whether the number of steps follows from the error."""
        return float(self.tolerance) > 0


def counted(
    method: AbstractMethod | None, most: int = MOST, solver: str = "rk4", first: int = FIRST
) -> tuple[AbstractMethod, Counts]:
    """Return a method with its number of steps left open, and the numbers to try.

    These are the number of the method and half as many or, without a method, as many as are needed.
    """
    chosen, begin, last = make_method(solver) if method is None else method, first, most
    if not isinstance(chosen, FixedSteps):
        begin, last = 1, 1
    elif method is not None:
        begin, last = jnp.maximum(chosen.steps // 2, 1), chosen.steps
    counts = Counts(jnp.asarray(begin, int), jnp.asarray(last, int), jnp.asarray(float(method is None)))
    return by_steps(chosen, 1), counts


def by_rodas4(most: int = MOST) -> tuple[AbstractMethod, Counts]:
    """Return Rodas4 with its number of steps left open, and the numbers to try."""
    return counted(None, most, "rodas4", FIRST_OF_RODAS4)


T = TypeVar("T", bound=eqx.Module)


def by_steps(tree: T, steps: Any) -> T:
    """Return a method, a problem or equations with this number of steps per revolution, if it has such a number."""
    changed = lambda x: FixedSteps(x.solver, jnp.asarray(steps, int)) if isinstance(x, FixedSteps) else x
    return jax.tree.map(changed, tree, is_leaf=lambda x: isinstance(x, AbstractMethod))  # not parts of a method


def with_fallback(
    find: Callable[[AbstractMethod, Counts], Any],
    method: AbstractMethod | None,
    most: int = MOST,
    serves: Callable[[Any], Array] = lambda found: jnp.all(jnp.isfinite(found.residual)),
) -> Any:
    """Return what `find` finds with a method or, without one, with Runge-Kutta and, if that fails, with Rodas4.

    The solver is chosen before compilation: inside `jit` and `vmap` it is always Runge-Kutta.
    """
    found = find(*counted(method, most))
    if method is not None or isinstance(found.residual, Tracer) or bool(serves(found)):
        return found
    return find(*by_rodas4(most))
