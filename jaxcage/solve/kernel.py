"""One step of a method as plain scalar code, for `march`.

The numbers of field, system and scale are what is fixed; the rest (structure, tableau) is the step's own.
"""

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
"""Tangent vectors in units of the state, each with the tangents of the field's numbers in the order of its leaves, None
where there are none."""


class Pieces(NamedTuple):
    """The field, the model and its scale, as passed to the solver."""

    field: AbstractField
    system: AbstractForcedSystem
    scale: State


def can_be_kernel(solver: Any) -> bool:
    """True if a step of `solver` is a plain formula, as of ours, and of explicit methods whose last stage is kept."""
    if isinstance(solver, dfx.AbstractERK):
        return isinstance(solver.tableau, dfx.ButcherTableau) and solver.tableau.fsal
    return isinstance(solver, Rodas4)


NEARNESS = 0.2
"""Time to a place of abrupt change [rad], at the pace of the moment, at which steps are half as long."""
FAR = 0.5
"""Time [rad] from which on they are not shortened."""
SHORTEST = 1 / 1024
"""Smallest allowed step, as a fraction of the nominal step."""
MORE = 8
"""Steps are added by so many parts of a revolution's, until all lanes are through."""


def shortened(h: Scalar, near: Any, phase: Scalar, end: Scalar) -> Scalar:
    """The step from `phase`, of the size h far from abrupt changes, by the distance from the nearest and the speed
    towards it (`AbstractForcedSystem.abrupt`); the last one ends at `end`, and is 0 beyond it.

    It has no derivative: the mesh is what it is while the state on it is differentiated.
    """
    distance, speed = near
    short = h * distance / (distance + NEARNESS * jnp.maximum(speed - distance / FAR, 0.0))
    short = jnp.maximum(short, SHORTEST * h)
    left = jnp.maximum(end - phase, 0.0)
    return jax.lax.stop_gradient(jnp.where(left < 1.0001 * short, left, short))


@functools.partial(jax.jit, static_argnums=0)
def evaluated_often(structure: Form, numbers: Numbers, tau: Scalar, y: State) -> State:
    """The field of a structure of (field, system, scale)."""
    return structure.filled(numbers)[0](tau, y)


class _CalledField(AbstractField):
    """A field that a step evaluates several times, as calls of one function."""

    structure: Form = eqx.field(static=True)
    numbers: Numbers

    def __call__(self, tau: Scalar, y: State) -> State:
        return evaluated_often(self.structure, self.numbers, tau, y)

    def linearise(self, tau: Scalar, y: State) -> Linearisation:
        return self.structure.filled(self.numbers)[0].linearise(tau, y)


@dataclasses.dataclass(frozen=True)
class KernelStep:
    """One step for `march`: moved is the state; watched the largest excursion and, where steps are shortened, the
    phase; fixed the first phase, the step, the phase at the end, and the numbers of (field, system, scale)."""

    solver: Any
    structure: Form
    abrupt: bool
    """True if the law changes abruptly somewhere: steps are shortened there."""

    def watched(self, phase: Any) -> Numbers:
        """First values of the watched numbers: the excursion and the phase."""
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
            if self.abrupt:  # no step at all divides by zero
                y = tuple(jnp.where(step > 0, a, b) for a, b in zip(y, moved, strict=True))
        if self.abrupt:
            clock = [t0 + step]
        return y, (jnp.maximum(peak, jnp.asarray(system.excursion(y))), *clock)  # the maximum keeps a NaN


def steps_through(
    solver: Any, steps: Any, pieces: Pieces, y: State, phase: Any, parts: Parts, tangents: Tangents
) -> tuple[State, Scalar, tuple[State, ...]]:
    """One `parts`-th of a revolution of `steps` steps, and as many more as abrupt changes of the law ask for.

    **Returns:** the state after it, the largest excursion on the way, the tangent vectors.
    """
    field, system, scale = pieces
    # How far out a state is, and in which units, has no derivative.
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
        # A lane that is lost ends the loop: it is far out, or its phase is NaN.
        through = lambda c: (c[1][1] < end) & (c[1][0] <= ESCAPE)
        carry = jax.lax.while_loop(through, lambda c: go(c, more), carry)
    y, (peak, *_), after = carry
    return y, peak, tuple(after)
