"""The return map of a periodic orbit in the unknowns of Newton's method and of continuation; its steps per revolution.

The unknowns are of order one: the state z in units of the system's scale, then the free parameters in units of their
own. The expensive integration depends on the system only through the numbers of its field at one speed (about twenty
for a cage), which follow cheaply from the design. `OrbitProblem.prepare` computes these numbers and
`OrbitProblem.returned` integrates, so that derivatives with respect to any number of design parameters cost no more
than those with respect to the field's numbers.

The steps per revolution are doubled until half as many give the same orbit. The map of equal steps is as smooth as the
field, so that roots and derivatives are exact for it; its error is estimated by solving again with twice the steps from
the known orbit. An orbit usually takes 256 to 2048 steps, with or without contact, because steps are shortened during a
contact.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from .._parameters import Parameter as Parameter, pick as pick
from .._pytrees import Scalar
from ..models import AbstractForcedSystem
from ..solve import REVOLUTION, AbstractMethod, FixedSteps, StrobeMap, depends, method as make_method, strobe_map


SPEED = "speed"
FIRST, MOST = {"rk4": 256, "rodas4": 512}, 16384  # least steps of each method, and most of all
MOST_OF_A_POINT = 2 * MOST  # a bifurcation point by 16384 steps is confirmed by twice as many
ENOUGH = 4096  # most steps of a computation that only provides a guess
GIVEN_UP = 2048  # if this many steps find nothing, more are not tried
IMAGE, SLOPE = 1e-6, 1e-3
"""Largest change of the map, in units of the system's scale, and of its derivative, relative to one plus its size,
between an orbit's steps and half as many."""
ENDLESS = 1e100  # revolution of a component that is no angle
POINT = 1e-7  # largest relative change of the value of a bifurcation
SETTLED = 2e-4  # a point with a larger relative change, or an orbit with a larger error, counts as not found
BY_OTHERS = 2.0  # the stated error of a point is at least this many times its change with `other_steps`


def turns_of(angles: Sequence[int], dimension: int) -> Float[np.ndarray, " dim"]:
    """Return 2 pi for each component of a state that is an angle, and a number beyond all others for the rest."""
    return np.where(np.isin(np.arange(dimension), angles), REVOLUTION, ENDLESS)


def without_turns(way: Any, turns: Any) -> Any:
    """Return differences of states without whole revolutions of the angles; arrays of JAX or NumPy."""
    return way - turns * (way / turns).round()


def value_of(system: AbstractForcedSystem, speed: Any, parameter: Parameter, name: str = "parameter") -> Array:
    return jnp.asarray(speed if parameter == SPEED else pick(system, parameter, name)(system), dtype=float)


def name_of(parameter: Parameter) -> str:
    return parameter if isinstance(parameter, str) else "parameter"


def frozen(tree: Any) -> Any:
    """Return the tree without derivatives, which only traced values can have."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x) if isinstance(x, Tracer) else x, tree)


def is_traced(tree: Any) -> bool:
    """Return True if anything in the tree is traced, and so may have derivatives."""
    return any(isinstance(x, Tracer) for x in jax.tree.leaves(tree))


class Given(eqx.Module):
    """System and speed, with respect to which derivatives are taken."""

    system: AbstractForcedSystem
    speed: Scalar

    def changed(self, parameter: Parameter, new: Any) -> "Given":
        if parameter == SPEED:
            return Given(self.system, new)
        return Given(eqx.tree_at(pick(self.system, parameter), self.system, new), self.speed)


class OrbitProblem(eqx.Module):
    """A periodic orbit of a system with free parameters. Results do not depend on the units."""

    method: AbstractMethod
    parameters: tuple[Parameter, ...] = eqx.field(static=True)
    scale: Float[Array, " dim"]
    """Units of the state."""
    units: Float[Array, " parameters"]
    """Units of the free parameters."""
    periods: Int[Array, ""]
    """Revolutions after which the orbit closes."""
    angles: tuple[int, ...] = eqx.field(static=True)
    """Indices of the coordinates that are angles."""

    @property
    def dimension(self) -> int:
        return self.scale.shape[-1]

    def values(self, u: Float[Array, " n"]) -> Float[Array, " parameters"]:
        """Return the values of the free parameters [SI]."""
        return u[self.dimension :][: len(self.parameters)] * self.units

    def state(self, u: Float[Array, " n"]) -> Float[Array, " dim"]:
        """Return the state at phase 0 [SI]."""
        return u[: self.dimension] * self.scale

    @property
    def turns(self) -> Float[Array, " dim"]:
        """Revolutions of the components that are angles (see `turns_of`), in units of the state."""
        return jnp.asarray(turns_of(self.angles, self.dimension)) / self.scale

    def moved(self, u: Float[Array, " n"], image: Float[Array, " dim"]) -> Float[Array, " dim"]:
        """Return the motion from the unknowns u to the image of the map, without whole revolutions of the angles."""
        return without_turns(image - u[: self.dimension], self.turns)

    def at(self, u: Float[Array, " n"], given: Given) -> Given:
        """Return system and speed at the unknowns u."""
        values = self.values(u)
        for i, parameter in enumerate(self.parameters):
            given = given.changed(parameter, values[i])
        return given

    def prepare(self, u: Float[Array, " n"], given: Given) -> StrobeMap:
        """Return the strobe map at the unknowns u, which contains all that depends on speed and design."""
        there = self.at(u, given)
        return strobe_map(there.system, there.speed, self.method)

    def drift(self, u: Float[Array, " n"], given: Given, i: int) -> list[Any]:
        """Return the derivatives of the field's numbers by the i-th unknown, None for those independent of it."""
        row = lambda x: jax.tree.leaves(eqx.filter(self.prepare(u.at[i].set(x), given).field, eqx.is_inexact_array))
        _, slope = jax.jvp(row, (u[i],), (jnp.ones_like(u[i]),))
        return [s if d else None for s, d in zip(slope, depends(row, u[i]), strict=True)]

    def returned(self, strobe: StrobeMap, z: Float[Array, " dim"], drifts: Sequence[Any] = ()) -> tuple[Array, Array]:
        """Apply the return map, the strobe map `periods` times.

        **Returns:** the image of z, and its derivatives in columns: by z (the monodromy matrix), then along each drift
        of the field's numbers.
        """
        scale, n = self.scale, z.size
        zero = jnp.zeros(())
        basis = [tuple(scale[j] if i == j else zero for j in range(n)) for i in range(n)]
        start = (tuple(z * scale), (*basis, *[(zero,) * n] * len(drifts)))
        along = [*[None] * n, *drifts]

        def once(_: Array, carry: tuple) -> tuple:
            y, tangents = carry
            moved = strobe(y, list(zip(tangents, along, strict=True)))
            return moved.y, moved.tangents

        y, tangents = jax.lax.fori_loop(0, self.periods, once, start)
        columns = jnp.stack([jnp.stack(t) for t in tangents], axis=1)
        return jnp.stack(y) / scale, columns / scale[:, None]


def make_problem(
    given: Given, parameters: tuple[Parameter, ...], units: Any, periods: Any, method: AbstractMethod
) -> OrbitProblem:
    """Return the problem in units of the system's scale at the given speed."""
    scale = jnp.stack([jnp.asarray(c, dtype=float) for c in given.system.scale(given.speed)])
    scale, units, periods = frozen((scale, jnp.asarray(units, dtype=float), jnp.asarray(periods, dtype=int)))
    return OrbitProblem(method, parameters, scale, units, periods, given.system.angles)


# --- steps per revolution -------------------------------------------------------------------------------------------


def other_steps(steps: Any) -> Any:
    """Return a number of steps whose ends are at other phases: doubling 256 steps again and again does not reveal the
    error from a kink of the law near an end that all these numbers share."""
    return (3 * steps // 4) | 1


class Counts(NamedTuple):
    """Numbers of steps to try, each twice the one before."""

    first: Int[Array, ""]
    last: Int[Array, ""]
    tolerance: Float[Array, ""]
    """Allowed ratio of the difference of two results to its tolerance; 0 if the last number is prescribed."""

    @property
    def tries(self) -> Int[Array, ""]:
        """Number of numbers to try."""
        return 1 + jnp.ceil(jnp.log2(self.last.astype(float) / self.first.astype(float)) - 1e-9).astype(int)

    def steps(self, i: Any) -> Int[Array, ""]:
        return jnp.minimum(self.first * 2**i, self.last)

    def near(self, steps: Any) -> "Counts":
        """Return the numbers to try if `steps` were sufficient nearby, from half as many on, for the error."""
        if steps is None or isinstance(steps, Tracer):
            return self
        first = jnp.clip(jnp.asarray(steps, int) // 2, self.first, self.last)
        return self._replace(first=jnp.where(self.tolerance > 0, first, self.first))

    @property
    def chooses(self) -> bool:
        """True if the number of steps is chosen by the error."""
        return float(self.tolerance) > 0


def counted(method: AbstractMethod | None, most: int = MOST, solver: str = "rk4") -> tuple[AbstractMethod, Counts]:
    """Return a method with its number of steps left open, and the numbers to try: half the method's own number and that
    number or, without a method, as many of `solver` as are needed."""
    chosen, begin, last = make_method(solver) if method is None else method, FIRST[solver], most
    if not isinstance(chosen, FixedSteps):
        begin, last = 1, 1
    elif method is not None:
        begin, last = (chosen.steps + 1) // 2, chosen.steps
    counts = Counts(jnp.asarray(begin, int), jnp.asarray(last, int), jnp.asarray(float(method is None)))
    return by_steps(chosen, 1), counts


T = TypeVar("T", bound=eqx.Module)


def by_steps(tree: T, steps: Any) -> T:
    """Return a method, a problem or equations with this number of steps per revolution, if the method has one."""
    changed = lambda x: FixedSteps(x.solver, jnp.asarray(steps, int)) if isinstance(x, FixedSteps) else x
    return jax.tree.map(changed, tree, is_leaf=lambda x: isinstance(x, AbstractMethod))  # do not enter methods


def with_fallback(
    find: Callable[[AbstractMethod, Counts], Any],
    method: AbstractMethod | None,
    serves: Callable[[Any], Any],
    most: int = MOST,
) -> Any:
    """Return the result of `find` with a method or, without one, with Runge-Kutta and, if that fails, with Rodas4 (but
    never under `jit` and `vmap`, since the solver is chosen before compilation)."""
    found = find(*counted(method, most))
    if method is not None or isinstance(good := serves(found), Tracer) or bool(good):
        return found
    return find(*counted(None, most, "rodas4"))
