"""The equations of a periodic orbit, P(z) = z, in the unknowns of Newton's method and of continuation.

The unknowns are numbers of order one: the state z in units of the system's scale, then the free parameters in units of
their own. The revolutions, which are expensive, see the system only through the numbers of its field at one speed (some
twenty for a cage), and these follow cheaply from the design. `OrbitProblem.prepare` computes the numbers and
`OrbitProblem.returned` runs the revolutions, so that a derivative with respect to any number of design parameters costs
no more than one with respect to the field's numbers.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.extend as jex
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from .._parameters import Parameter as Parameter, pick as pick
from .._pytrees import Scalar
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod, StrobeMap, strobe_map


SPEED = "speed"


def value_of(system: AbstractForcedSystem, speed: Any, parameter: Parameter) -> Array:
    """Return the present value of `parameter`."""
    return jnp.asarray(speed if parameter == SPEED else pick(system, parameter)(system), dtype=float)


def name_of(parameter: Parameter) -> str:
    """Return the name of a parameter, which is `parameter` for one that a function picks."""
    return parameter if isinstance(parameter, str) else "parameter"


def _depends_on_input(f: Callable[[Array], list[Array]], x: Array) -> list[bool]:
    """Return, for each array of f(x), whether it depends on x."""
    traced = jax.make_jaxpr(f)(x).jaxpr
    touched = set(traced.invars)
    reached = lambda v: not isinstance(v, jex.core.Literal) and v in touched
    for equation in traced.eqns:
        if any(map(reached, equation.invars)):
            touched.update(equation.outvars)
    return list(map(reached, traced.outvars))


def frozen(tree: Any) -> Any:
    """Return the tree without derivatives; only traced values can have them."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x) if isinstance(x, Tracer) else x, tree)


def is_traced(tree: Any) -> bool:
    """Return whether anything in the tree is traced, and so may have derivatives."""
    return any(isinstance(x, Tracer) for x in jax.tree.leaves(tree))


class Given(eqx.Module):
    """The system and the speed: derivatives are taken with respect to these."""

    system: AbstractForcedSystem
    speed: Scalar

    def changed(self, parameter: Parameter, new: Any) -> "Given":
        """Return a copy with `parameter` set to `new`."""
        if parameter == SPEED:
            return Given(self.system, new)
        return Given(eqx.tree_at(pick(self.system, parameter), self.system, new), self.speed)


Prepared: TypeAlias = tuple[StrobeMap, list[Any]]
"""All that the revolutions of a problem need: a strobe map, and drifts of its field's numbers."""


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

    @property
    def dimension(self) -> int:
        """Length of the state."""
        return self.scale.shape[-1]

    def values(self, u: Float[Array, " n"]) -> Float[Array, " parameters"]:
        """Return the values of the free parameters [SI]."""
        return u[self.dimension :][: len(self.parameters)] * self.units

    def state(self, u: Float[Array, " n"]) -> Float[Array, " dim"]:
        """Return the state at phase 0 [SI]."""
        return u[: self.dimension] * self.scale

    def at(self, u: Float[Array, " n"], given: Given) -> Given:
        """Return system and speed at the unknowns u."""
        values = self.values(u)
        for i, parameter in enumerate(self.parameters):
            given = given.changed(parameter, values[i])
        return given

    def prepare(self, u: Float[Array, " n"], given: Given) -> StrobeMap:
        """Return the strobe map at the unknowns u, which is all that depends on speed and design."""
        there = self.at(u, given)
        return strobe_map(there.system, there.speed, self.method)

    def drift(self, u: Float[Array, " n"], given: Given, i: int) -> list[Any]:
        """Return how the field's numbers change with the i-th unknown; None for those that do not depend on it."""
        row = lambda x: jax.tree.leaves(eqx.filter(self.prepare(u.at[i].set(x), given).field, eqx.is_inexact_array))
        _, slope = jax.jvp(row, (u[i],), (jnp.ones_like(u[i]),))
        return [s if d else None for s, d in zip(slope, _depends_on_input(row, u[i]), strict=True)]

    def returned(self, strobe: StrobeMap, z: Float[Array, " dim"], drifts: Sequence[Any] = ()) -> tuple[Array, Array]:
        """Apply the return map, which is the strobe map `periods` times.

        **Returns:** the image of z, and the derivatives of the image in columns: with respect to z (the monodromy
        matrix), then along each drift of the field's numbers.
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
    numbers = frozen((scale, jnp.asarray(units, dtype=float), jnp.asarray(periods, dtype=int)))
    return OrbitProblem(method, parameters, *numbers)
