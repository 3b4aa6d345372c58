"""One step of a method as plain scalar code, for `march`.

The numbers of field, system and scale are what is fixed; the rest (structure, tableau) is the step's own.
"""

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import Any, TypeGuard

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp

from .._recent import Form, split
from .._types import Scalar, State
from ..models import ESCAPE, AbstractField, AbstractForcedSystem, AbstractLinearisation
from ._explicit import Stages, chosen, explicit_step
from ._march import is_elementary, march_with_tangents
from ._newmark import NewmarkBeta
from ._program import Numbers, Sizes
from ._rosenbrock import AbstractRosenbrock, computed_once, rosenbrock_step


REVOLUTION = 2 * math.pi
KernelSolver = AbstractRosenbrock | NewmarkBeta | dfx.AbstractERK
Pieces = tuple[AbstractField, AbstractForcedSystem, State]
"""What is integrated: field, system and its scale."""


def can_be_kernel(solver: Any) -> TypeGuard[KernelSolver]:
    """Whether a step of `solver` is a plain formula: ours, and explicit methods with the first stage last."""
    if isinstance(solver, dfx.AbstractERK):
        return isinstance(solver.tableau, dfx.ButcherTableau) and solver.tableau.fsal
    return isinstance(solver, AbstractRosenbrock | NewmarkBeta)


NEARNESS = 0.2
"""Time to a place of abrupt change [rad], at the pace of the moment, at which steps are half as long."""
FAR = 0.5
"""Time [rad] from which on they are not shortened."""
SHORTEST = 1 / 1024
"""Of a step, what is left of it at least."""
MORE = 8
"""Steps are added by so many parts of a revolution's, until all lanes are through."""


def shortened(h: Scalar, near: tuple[Scalar, Scalar] | None, phase: Scalar, end: Scalar) -> Scalar:
    """The step from `phase`, of the size h far from abrupt changes; the last one ends at `end`, and is 0 beyond it.

    It has no derivative: the mesh is what it is while the state on it is differentiated.
    """
    assert near is not None
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

    def linearise(self, tau: Scalar, y: State) -> AbstractLinearisation:
        return self.structure.filled(self.numbers)[0].linearise(tau, y)


@dataclasses.dataclass(frozen=True)
class KernelStep:
    """One step for `march`: moved is the state; watched the largest excursion and, where steps are shortened, the
    phase and the length of the step, by Newmark's method by how much a defect was too large; fixed the first phase, the
    step, the phase at the end, and the numbers of (field, system, scale)."""

    solver: KernelSolver
    structure: Form
    abrupt: bool
    """Whether the law changes abruptly somewhere, and steps are shortened there."""
    whole: bool = True
    """Whether the step is one kernel; else it is left to XLA's fusions, and told what to work out once."""

    @property
    def stage(self) -> "KernelStage | None":
        """The part that a step of an explicit method is made of."""
        if not isinstance(self.solver, dfx.AbstractERK):
            return None
        return KernelStage(Stages.of(self.solver.tableau), self.structure, self.abrupt)  # pyright: ignore

    def watched(self, phase: Any) -> Numbers:
        """What is watched, at the beginning: the excursion, the phase and the length of the step, or the defect."""
        zero = jnp.zeros(())
        if isinstance(self.solver, NewmarkBeta):
            return zero, zero
        return (zero, zero + phase, zero) if self.abrupt else (zero,)

    def __call__(self, i: Any, moved: State, watched: Numbers, fixed: Numbers) -> tuple[State, Numbers]:
        phase, h, end, *numbers = fixed
        _, system, _ = self.structure.filled(numbers)
        field = _CalledField(self.structure, tuple(numbers))
        peak, *clock = watched
        t0 = clock[0] if self.abrupt else phase + i * h
        if isinstance(self.solver, NewmarkBeta):
            y, excess = self.solver.advance(self.structure.filled(numbers)[0], t0, t0 + h, moved)
            return y, (jnp.maximum(peak, jnp.asarray(system.excursion(y))), jnp.maximum(clock[0], excess))

        def size(rate: State) -> Scalar:
            return shortened(h, system.abrupt(moved, rate), t0, end) if self.abrupt else h

        if isinstance(self.solver, dfx.AbstractERK):
            assert isinstance(self.solver.tableau, dfx.ButcherTableau)
            y, step = explicit_step(self.solver.tableau, field, t0, size, moved)
        else:
            settle = (lambda x, t0: x) if self.whole else computed_once
            y, _, _, step = rosenbrock_step(self.solver.tableau, field, t0, size, moved, settle)
            if self.abrupt:  # no step at all divides by zero
                y = tuple(jnp.where(step > 0, a, b) for a, b in zip(y, moved, strict=True))
        if self.abrupt:
            clock = [t0 + step, step]
        return y, (jnp.maximum(peak, jnp.asarray(system.excursion(y))), *clock)  # the maximum keeps a NaN


@dataclasses.dataclass(frozen=True)
class KernelStage:
    """One stage of such a step: the loop's body has the field once, a quarter of a Runge-Kutta step to compile.

    Moved are the arguments of the stages to come as far as they are known, the state at the beginning of the step and
    that at its end; after the last stage all of them are the new state. Watched and fixed as in a step.
    """

    stages: Stages
    """The method's coefficients."""
    structure: Form
    abrupt: bool

    @property
    def count(self) -> int:
        """Stages of a step."""
        return len(self.stages.phase)

    @property
    def copies(self) -> int:
        """How many times the numbers of a state it moves."""
        return len(self.stages.ahead) + 2

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        phase, h, until, *numbers = fixed
        pieces: Pieces = self.structure.filled(numbers)
        field, system, scale = pieces
        method, n = self.stages, len(scale)
        step = jnp.floor(i / self.count)
        place = i - self.count * step
        first, last = place == 0.0, place == self.count - 1.0
        argument, *later, end = (moved[k : k + n] for k in range(0, len(moved), n))
        peak, *clock = watched

        t0 = clock[0] if self.abrupt else phase + step * h
        kept = clock[1] if self.abrupt else h  # of a step at its first stage, the one before it
        rate = field(t0 + jnp.where(first, 0.0, chosen(method.phase, place) * kept), argument)
        if self.abrupt:
            h = jnp.where(first, shortened(h, system.abrupt(argument, rate), t0, until), kept)
            clock = [jnp.where(last, t0 + h, t0), h]
        push = lambda y, row: tuple(c + h * chosen(row, place) * k for c, k in zip(y, rate, strict=True))
        at_last = lambda new, old: tuple(jnp.where(last, a, b) for a, b in zip(new, old, strict=True))
        end = push(end, method.weight)
        later = [at_last(end, y) for y in (*map(push, later, method.ahead), later[-1])]
        peak = jnp.where(last, jnp.maximum(peak, jnp.asarray(system.excursion(end))), peak)
        return tuple(c for y in (*later, end) for c in y), (peak, *clock)


def kernel_step(
    solver: KernelSolver, field: AbstractField, system: AbstractForcedSystem, scale: State
) -> tuple[KernelStep, list[Any]]:
    """A step and its fixed numbers behind phases and step size; system and scale have no derivative."""
    watching = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, (system, scale))
    structure, numbers = split((field, *watching), eqx.is_inexact_array)
    abrupt = system.abrupt(scale, scale) is not None and not isinstance(solver, NewmarkBeta)  # its steps are equal
    step = KernelStep(solver, structure, abrupt)
    plain = not any(eqx.is_array(x[1]) for x in structure.rest if x is not None)
    if plain and all(jnp.ndim(x) == 0 for x in numbers):
        part = step.stage or step  # of several parts one says it for all
        moved = len(scale) * (step.stage.copies if step.stage else 1)
        if is_elementary(part, Sizes(moved, len(step.watched(0.0)), 3 + len(numbers))):
            return step, numbers
    return dataclasses.replace(step, whole=False), numbers


def steps_through(
    solver: KernelSolver,
    steps: Any,
    pieces: Pieces,
    y: State,
    tangents: Sequence[State] = (),
    drifts: Sequence[Sequence[Any] | None] = (),
    phase: Any = 0.0,
    parts: Any = 1,
    multiple: int = 1,
) -> tuple[State, Scalar, dfx.RESULTS, tuple[State, ...]]:
    """One `parts`-th of a revolution of `steps` steps, and as many more as abrupt changes of the law ask for.

    **Arguments:** solver; steps of a revolution; what is integrated; state; tangent vectors, and for each of
    them the tangents of the field's numbers, None where there are none; phase and part; a number that the steps of a
    part are known to be a multiple of.

    **Returns:** the state after it, the largest excursion on the way, whether the steps' own iteration converged, the
    tangent vectors.
    """
    step, numbers = kernel_step(solver, *pieces)
    count, h = steps // parts, REVOLUTION / jnp.asarray(steps, dtype=float)
    end = phase + REVOLUTION / jnp.asarray(parts, dtype=float)
    fixed = (jnp.asarray(phase, dtype=float), h, end, *numbers)
    row = lambda drift: (None, None, None, *(drift or ()), *(None,) * (len(numbers) - len(drift or ())))
    along = [row(d) for d in drifts]

    def go(carry: tuple, count: Any, multiple: int) -> tuple:
        y, watched, tangents = carry
        return march_with_tangents(step, count, y, watched, fixed, tangents, along, multiple, step.whole)

    carry = go((tuple(y), step.watched(phase), tuple(tangents)), count, multiple)
    if step.abrupt:
        more = jnp.maximum(count // MORE, 1)
        # A lane that is lost ends the loop: it is far out, or its phase is NaN.
        through = lambda c: (c[1][1] < end) & (c[1][0] <= ESCAPE)
        carry = jax.lax.while_loop(through, lambda c: go(c, more, 1), carry)
    y, (peak, *others), after = carry
    result = dfx.RESULTS.successful
    if isinstance(solver, NewmarkBeta):
        result = dfx.RESULTS.where(others[0] <= 0, result, dfx.RESULTS.nonlinear_divergence)  # pyright: ignore
    return y, peak, result, tuple(after)
