"""The equations of a periodic orbit, P(z) = z, in the unknowns that Newton's method and continuation work on.

Unknowns are numbers of order one: the state z in units of the system's scale, then, as far as they are not given, the
speed of a self-excited system over its guess, and the free parameters in units of their own.

What is expensive, the revolutions, sees the system only through the numbers of its field at one speed (for a cage some
twenty of them); how these follow from the design is cheap. `prepare` does the latter, `returned` the former, so that a
derivative with respect to any number of design parameters costs no more than one with respect to the field's numbers.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.extend as jex
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from .._types import Scalar
from ..integrate import AbstractMethod, StrobeMap, pushed, strobe_map
from ..models import AbstractForcedSystem
from ._by_name import Parameter, with_value


def depends_on_input(f: Callable[[Array], list[Array]], x: Array) -> list[bool]:
    """For each array that f(x) returns, whether it depends on x."""
    traced = jax.make_jaxpr(f)(x).jaxpr
    touched = set(traced.invars)
    reached = lambda v: not isinstance(v, jex.core.Literal) and v in touched
    for equation in traced.eqns:
        if any(map(reached, equation.invars)):
            touched.update(equation.outvars)
    return list(map(reached, traced.outvars))


def frozen(tree: Any) -> Any:
    """The same without derivatives; only what is traced can have them."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x) if isinstance(x, Tracer) else x, tree)


def is_traced(tree: Any) -> bool:
    """Whether anything in it is traced: it may have derivatives."""
    return any(isinstance(x, Tracer) for x in jax.tree.leaves(tree))


class Given(eqx.Module):
    """What derivatives are taken with respect to."""

    system: AbstractForcedSystem
    speed: Scalar


class Frame(NamedTuple):
    """Numbers that only fix units and the phase of a self-excited orbit; results do not depend on them."""

    scale: Float[Array, " dim"]
    speed: Float[Array, ""]
    units: Float[Array, " parameters"]
    phase_point: Float[Array, " dim"]
    phase_direction: Float[Array, " dim"]
    periods: Int[Array, ""]


def returned(
    strobe: StrobeMap, frame: Frame, z: Float[Array, " dim"], drifts: Sequence[Any] = ()
) -> tuple[Array, Array]:
    """The return map, `periods` applications of the strobe map, in units of the frame.

    **Returns:** the image of z; its derivatives with respect to z, the monodromy matrix, and, behind these, along each
    drift of the field's numbers (in a column each).
    """
    scale, n = frame.scale, z.size
    zero = jnp.zeros(())
    basis = [tuple(scale[j] if i == j else zero for j in range(n)) for i in range(n)]
    start = (tuple(z * scale), (*basis, *[(zero,) * n] * len(drifts)))
    along = [*[None] * n, *drifts]

    def once(_: Array, carry: tuple) -> tuple:
        y, tangents = carry
        moved = pushed(strobe, y, tangents, along)
        return moved.y, moved.tangents

    y, tangents = jax.lax.fori_loop(0, frame.periods, once, start)
    columns = jnp.stack([jnp.stack(t) for t in tangents], axis=1)
    return jnp.stack(y) / scale, columns / scale[:, None]


Prepared: TypeAlias = tuple[StrobeMap, list[Any]]
"""All that the revolutions of a problem need to know: a strobe map, and drifts of its field's numbers."""


class OrbitProblem(eqx.Module):
    """A periodic orbit of a system, with the speed free for a self-excited one, and free parameters."""

    method: AbstractMethod
    dimension: int = eqx.field(static=True)
    free_speed: bool = eqx.field(static=True)
    parameters: tuple[Parameter, ...] = eqx.field(static=True)

    @property
    def equations(self) -> int:
        """How many equations `residual` has."""
        return self.dimension + self.free_speed

    def speed(self, u: Float[Array, " n"], given: Given, frame: Frame) -> Scalar:
        """Speed [rad/s] at the unknowns u."""
        return self._located(u, given, frame)[1]

    def values(self, u: Float[Array, " n"], frame: Frame) -> Float[Array, " parameters"]:
        """Values of the free parameters, in SI units."""
        return u[self.equations :][: len(self.parameters)] * frame.units

    def state(self, u: Float[Array, " n"], frame: Frame) -> Float[Array, " dim"]:
        """State at phase 0, in SI units."""
        return u[: self.dimension] * frame.scale

    def _located(self, u: Array, given: Given, frame: Frame) -> tuple[AbstractForcedSystem, Scalar]:
        system, speed = given.system, given.speed
        if self.free_speed:
            speed = u[self.dimension] * frame.speed
        values = self.values(u, frame)
        for i, parameter in enumerate(self.parameters):
            system, speed = with_value(system, speed, parameter, values[i])
        return system, speed

    def across(self, u: Float[Array, " n"], given: Given, frame: Frame) -> Frame:
        """The frame with the plane on which a self-excited orbit begins through u, across the flow there."""
        z = u[: self.dimension]
        y = tuple(z[i] * frame.scale[i] for i in range(z.size))
        flow = jnp.stack([jnp.asarray(c) for c in self.prepare(u, given, frame).field(jnp.zeros(()), y)]) / frame.scale
        return frame._replace(phase_point=z, phase_direction=flow / jnp.linalg.norm(flow))

    def prepare(self, u: Float[Array, " n"], given: Given, frame: Frame) -> StrobeMap:
        """The strobe map at the unknowns u: all that depends on speed and design."""
        return strobe_map(*self._located(u, given, frame), self.method)

    def drift(self, u: Float[Array, " n"], given: Given, frame: Frame, i: int) -> list[Any]:
        """How the field's numbers change with the i-th unknown; None for those that do not depend on it."""
        row = lambda x: jax.tree.leaves(
            eqx.filter(self.prepare(u.at[i].set(x), given, frame).field, eqx.is_inexact_array)
        )
        _, slope = jax.jvp(row, (u[i],), (jnp.ones_like(u[i]),))
        return [s if d else None for s, d in zip(slope, depends_on_input(row, u[i]), strict=True)]

    def orbit_residual(
        self, z: Float[Array, " dim"], image: Float[Array, " dim"], frame: Frame
    ) -> Float[Array, " equations"]:
        """P(z) - z, and the phase condition of a self-excited orbit."""
        closing = image - z
        if not self.free_speed:
            return closing
        return jnp.append(closing, jnp.dot(z - frame.phase_point, frame.phase_direction))


def make_frame(
    problem: OrbitProblem,
    given: Given,
    state: Float[Array, " dim"],
    speed: Scalar,
    units: Float[Array, " parameters"],
    periods: Any,
) -> Frame:
    """The frame around a first guess: `state` (SI) at `speed` [rad/s]."""
    at = frozen(jnp.asarray(speed, dtype=float))
    given, state, units = frozen((given, state, units))
    system = given.system
    scale = jnp.stack([jnp.asarray(c, dtype=float) for c in system.scale(at)])
    z = state / scale
    if problem.free_speed:
        rate = system.at_speed(at)(jnp.zeros(()), tuple(state[i] for i in range(state.size)))
        direction = jnp.stack([jnp.asarray(c) for c in rate]) / scale
        direction = direction / jnp.linalg.norm(direction)
    else:
        direction = jnp.zeros_like(z)
    return frozen(Frame(scale, at, units, z, direction, jnp.asarray(periods, dtype=int)))
