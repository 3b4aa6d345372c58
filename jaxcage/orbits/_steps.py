"""How many steps a revolution of an orbit takes: doubled until the orbit by half as many is the same.

The map of equal steps is as smooth as the field, so that roots and derivatives are exact for it; how far it is from
the true one is seen by solving again with twice the steps, from the orbit known. An orbit takes 256 to 2048 steps as a
rule, whether it touches the land or not: they are shortened through a contact.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from ..solve import AbstractMethod, FixedSteps, method as make_method


FIRST, MOST = 256, 16384
MOST_OF_A_POINT = 2 * MOST
"""A bifurcation point by 16384 steps is confirmed by twice as many."""
ENOUGH = 4096
"""Most steps of what only leads to an orbit."""
GIVEN_UP = 2048
"""Where so many steps find nothing, as many again are not tried."""
IMAGE, SLOPE = 1e-6, 1e-3
"""Largest change of the map, in units of the system's scale, and of its derivative, of its size and one, between an
orbit's steps and half as many."""
POINT = 1e-7
"""The same for the place of a bifurcation, relative."""
SETTLED = 2e-4
"""A point whose place changes by more, relative, is not known; nor is an orbit with a larger error."""
STIFF_FIRST = 512
BY_OTHERS = 2.0
"""A point is no more certain than this many times its distance to that by `other_steps`."""


def other_steps(steps: Any) -> Any:
    """A number of steps that shares no ends of steps with those before it: where a motion meets a kink of the law near
    an end that all of them share, doubling them again and again changes nothing, and all are wrong."""
    return (3 * steps // 4) | 1


class Counts(NamedTuple):
    """The numbers of steps to try, each twice the one before."""

    first: Int[Array, ""]
    last: Int[Array, ""]
    tolerance: Float[Array, ""]
    """How far apart two results may be, in units of what is allowed; 0 where the last number was asked for."""

    @property
    def tries(self) -> Int[Array, ""]:
        """How many numbers there are."""
        return 1 + jnp.ceil(jnp.log2(self.last.astype(float) / self.first.astype(float)) - 1e-9).astype(int)

    def steps(self, i: Any) -> Int[Array, ""]:
        """The i-th of them."""
        return jnp.minimum(self.first * 2**i, self.last)

    def each(self) -> list[int]:
        """All of them."""
        return [int(self.steps(i)) for i in range(int(self.tries))]


def counted(
    method: AbstractMethod | None, most: int = MOST, solver: str = "rk4", first: int = FIRST
) -> tuple[AbstractMethod, Counts]:
    """A method with its number of steps left open, and the numbers to try: those of the method and half as many, or,
    without a method, as many as are needed."""
    chosen, begin, last = make_method(solver) if method is None else method, first, most
    if not isinstance(chosen, FixedSteps):
        begin, last = 1, 1
    elif method is not None:
        begin, last = jnp.maximum(chosen.steps // 2, 1), chosen.steps
    counts = Counts(jnp.asarray(begin, int), jnp.asarray(last, int), jnp.asarray(float(method is None)))
    return by_steps(chosen, 1), counts


def from_steps(counts: Counts, steps: Any) -> Counts:
    """The numbers to try where `steps` were right nearby: half as many first, so that the error is known."""
    if steps is None or isinstance(steps, Tracer):
        return counts
    first = jnp.clip(jnp.asarray(steps, int) // 2, counts.first, counts.last)
    return counts._replace(first=jnp.where(counts.tolerance > 0, first, counts.first))


T = TypeVar("T", bound=eqx.Module)


def by_steps(tree: T, steps: Any) -> T:
    """A method, a problem or equations by so many steps a revolution; as they are where there is no such number."""
    changed = lambda x: FixedSteps(x.solver, jnp.asarray(steps, int)) if isinstance(x, FixedSteps) else x
    return jax.tree.map(changed, tree, is_leaf=lambda x: isinstance(x, AbstractMethod))  # not the rungs of a ladder


def that_serves(
    find: Callable[[AbstractMethod, Counts], Any],
    method: AbstractMethod | None,
    most: int = MOST,
    serves: Callable[[Any], Array] = lambda found: jnp.all(jnp.isfinite(found.residual)),
) -> Any:
    """What `find` finds by a method; without one by Runge-Kutta or, where that does not serve, by Rodas4. Which one is
    a matter of compilation: inside `jit` and `vmap` it is Runge-Kutta."""
    found = find(*counted(method, most))
    if method is not None or isinstance(found.residual, Tracer) or bool(serves(found)):
        return found
    return find(*stiff(most))


def stiff(most: int = MOST) -> tuple[AbstractMethod, Counts]:
    """Rodas4 with its number of steps left open, and the numbers to try."""
    return counted(None, most, "rodas4", STIFF_FIRST)
