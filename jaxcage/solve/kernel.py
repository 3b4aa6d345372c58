"""One step of a method as scalar code, for `march`: the numbers of field, system and scale are its fixed numbers."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._pytrees import Form, Scalar, State, split
from ..models import ESCAPE, AbstractField, AbstractForcedSystem, Linearisation
from .layout import REVOLUTION
from .march import march_with_tangents
from .program import Numbers
from .solvers import Rodas4, explicit_step, rosenbrock_step


Parts = Int[Array, ""] | Scalar
"""Number of equal parts of a revolution."""
Tangents = Sequence[tuple[State, Sequence[Any] | None]]
"""Tangent vectors in units of the state, each with the tangents of the field's numbers in the order of its leaves (None
for zero)."""


class Pieces(NamedTuple):
    """The field, the model and its scale, as passed to the solver."""

    field: AbstractField
    system: AbstractForcedSystem
    scale: State


def can_be_kernel(solver: Any) -> bool:
    """True if a step of `solver` is a closed formula: `Rodas4`, and explicit methods with FSAL (first same as last)."""
    if isinstance(solver, dfx.AbstractERK):
        return isinstance(solver.tableau, dfx.ButcherTableau) and solver.tableau.fsal
    return isinstance(solver, Rodas4)


NEARNESS = 0.2
"""Time to an abrupt change of the law [rad], at the present speed, at which steps are half as long."""
FAR = 0.5
"""Time to an abrupt change [rad] beyond which steps are not shortened."""
SHORTEST = 1 / 1024
"""Smallest allowed step, as a fraction of the nominal step."""
MORE = 8
"""Divisor of the nominal number of steps that gives the number added at a time, until all lanes reach the end."""


def shortened(h: Scalar, near: Any, phase: Scalar, end: Scalar) -> Scalar:
    """Step size at `phase`: h, shortened `near` an abrupt change of the law (`AbstractForcedSystem.abrupt`) and to end
    at `end`, beyond which it is 0. It has no derivative: the state is differentiated on a fixed mesh."""
    distance, speed = near
    short = h * distance / (distance + NEARNESS * jnp.maximum(speed - distance / FAR, 0.0))
    short = jnp.maximum(short, SHORTEST * h)
    left = jnp.maximum(end - phase, 0.0)
    return jax.lax.stop_gradient(jnp.where(left < 1.0001 * short, left, short))


@functools.partial(jax.jit, static_argnums=0)
def evaluated_often(structure: Form, numbers: Numbers, tau: Scalar, y: State) -> State:
    """Evaluate the field of a structure of (field, system, scale)."""
    return structure.filled(numbers)[0](tau, y)


class _CalledField(AbstractField):
    """Field whose evaluations within a step are calls of one function."""

    structure: Form = eqx.field(static=True)
    numbers: Numbers

    def __call__(self, tau: Scalar, y: State) -> State:
        return evaluated_often(self.structure, self.numbers, tau, y)

    def linearise(self, tau: Scalar, y: State) -> Linearisation:
        return self.structure.filled(self.numbers)[0].linearise(tau, y)


@dataclasses.dataclass(frozen=True)
class KernelStep:
    """One step for `march`: moved is the state; watched are the largest excursion and, if steps are shortened, the
    phase; fixed are the first phase, step size, final phase, and the numbers of (field, system, scale)."""

    solver: Any
    structure: Form
    abrupt: bool
    """True if the law has abrupt changes, near which steps are shortened."""

    def watched(self, phase: Any) -> Numbers:
        """Initial values of the watched numbers: the excursion and the phase."""
        zero = jnp.zeros(())
        return (zero, zero + phase) if self.abrupt else (zero,)

    def __call__(self, i: Any, moved: State, watched: Numbers, fixed: Numbers) -> tuple[State, Numbers]:
        phase, h, end, *numbers = fixed
        _, system, _ = self.structure.filled(numbers)
        field = _CalledField(self.structure, tuple(numbers))
        peak, *clock = watched
        t0 = clock[0] if self.abrupt else phase + i * h

        def size(rate: State) -> Scalar:
            return shortened(h, system.abrupt(moved, rate), t0, end) if self.abrupt else h

        if isinstance(self.solver, dfx.AbstractERK):
            y, step = explicit_step(self.solver.tableau, field, t0, size, moved)
        else:
            y, _, _, step = rosenbrock_step(field, t0, size, moved)
            if self.abrupt:  # a step of size zero divides by zero
                y = tuple(jnp.where(step > 0, a, b) for a, b in zip(y, moved, strict=True))
        if self.abrupt:
            clock = [t0 + step]
        return y, (jnp.maximum(peak, jnp.asarray(system.excursion(y))), *clock)  # `maximum` propagates NaN


def steps_through(
    solver: Any, steps: Any, pieces: Pieces, y: State, phase: Any, parts: Parts, tangents: Tangents
) -> tuple[State, Scalar, tuple[State, ...]]:
    """Advance by one of `parts` equal parts of a revolution of `steps` steps, and more near abrupt changes of the law;
    return the final state, the largest excursion and the tangent vectors."""
    field, system, scale = pieces
    # Excursion and scale have no derivative.
    watching = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, (system, scale))
    structure, numbers = split((field, *watching), eqx.is_inexact_array)
    step = KernelStep(solver, structure, system.abrupt(scale, scale) is not None)
    count, h = steps // parts, REVOLUTION / jnp.asarray(steps, dtype=float)
    end = phase + REVOLUTION / jnp.asarray(parts, dtype=float)
    fixed = (jnp.asarray(phase, dtype=float), h, end, *numbers)
    row = lambda drift: (None, None, None, *(drift or ()), *(None,) * (len(numbers) - len(drift or ())))
    along = [row(drift) for _, drift in tangents]

    def go(carry: tuple, count: Any) -> tuple:
        y, watched, tangents = carry
        return march_with_tangents(step, count, y, watched, fixed, tangents, along)

    carry = go((tuple(y), step.watched(phase), tuple(t for t, _ in tangents)), count)
    if step.abrupt:
        more = jnp.maximum(count // MORE, 1)
        # A failed lane, with a large excursion or NaN, also ends the loop.
        through = lambda c: (c[1][1] < end) & (c[1][0] <= ESCAPE)
        carry = jax.lax.while_loop(through, lambda c: go(c, more), carry)
    y, (peak, *_), after = carry
    return y, peak, tuple(after)
