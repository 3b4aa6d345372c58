"""One step of a method as plain scalar code, for `march`.

The numbers of field, system and scale are what is fixed; the rest (structure, tableau) is the step's own.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp

from .._types import State
from ..models import AbstractField, AbstractForcedSystem
from ._explicit import Stages, chosen, explicit_step
from ._march import is_elementary
from ._program import Numbers, Sizes
from ._rosenbrock import AbstractRosenbrock, computed_once, rosenbrock_step


KernelSolver = AbstractRosenbrock | dfx.AbstractERK


def can_be_kernel(solver: Any) -> bool:
    """Whether a step of `solver` is a plain formula: ours, and explicit methods with the first stage last."""
    if isinstance(solver, dfx.AbstractERK):
        return isinstance(solver.tableau, dfx.ButcherTableau) and solver.tableau.fsal
    return isinstance(solver, AbstractRosenbrock)


@dataclasses.dataclass(frozen=True)
class Structure:
    """A module without its numbers."""

    numbers: Any
    rest: Any
    leaves: tuple[tuple[type, Any], ...]

    @classmethod
    def of(cls, module: Any) -> tuple["Structure", list[Any]]:
        """The structure of a module, and its numbers in a row."""
        numbers, static = eqx.partition(module, eqx.is_inexact_array)
        row, form = jax.tree.flatten(numbers)
        leaves, rest = jax.tree.flatten(static)
        return cls(form, rest, tuple((type(x), x) for x in leaves)), row

    @property
    def plain(self) -> bool:
        """Whether the numbers are all the arrays there are."""
        return not any(eqx.is_array(x) for _, x in self.leaves)

    def remake(self, numbers: Sequence[Any]) -> Any:
        """The module with these numbers."""
        rest = jax.tree.unflatten(self.rest, [x for _, x in self.leaves])
        return eqx.combine(jax.tree.unflatten(self.numbers, list(numbers)), rest)


@dataclasses.dataclass(frozen=True)
class KernelStep:
    """One step for `march`: moved is the state; watched the largest excursion, the sum of the error estimates, and
    of an explicit method the part of its estimate that is complete with the first stage of the next step only; fixed
    the first phase, the step, and the numbers of (field, system, scale)."""

    solver: KernelSolver
    structure: Structure
    whole: bool = True
    """Whether the step is one kernel; else it is left to XLA's fusions, and told what to work out once."""

    @property
    def stage(self) -> "KernelStage | None":
        """The part that a step of an explicit method is made of."""
        return KernelStage(self.solver, self.structure) if isinstance(self.solver, dfx.AbstractERK) else None

    def watched(self, dimension: int) -> Numbers:
        """What is watched, at the beginning."""
        zero = jnp.zeros(())
        unknown = (zero + jnp.nan,) * (dimension if isinstance(self.solver, dfx.AbstractERK) else 0)
        return (zero, zero, *unknown)

    def __call__(self, i: Any, moved: State, watched: Numbers, fixed: Numbers) -> tuple[State, Numbers]:
        phase, h, *numbers = fixed
        pieces: tuple[AbstractField, AbstractForcedSystem, State] = self.structure.remake(numbers)
        field, system, scale = pieces
        t0, (peak, grown, *pending) = phase + i * h, watched
        if isinstance(self.solver, dfx.AbstractERK):
            tableau = self.solver.tableau
            assert isinstance(tableau, dfx.ButcherTableau)
            y, first, early = explicit_step(tableau, field, t0, h, moved)
            last = float(tableau.b_error[-1])
            late = tuple(h * (p + last * k) for p, k in zip(pending, first, strict=True))
            error = tuple(jnp.where(p == p, e, 0.0) for p, e in zip(pending, late, strict=True))  # not NaN: known
            pending = early
        else:
            settle = (lambda x, t0: x) if self.whole else computed_once
            y, error, _ = rosenbrock_step(self.solver.tableau, field, t0, h, moved, settle)
        grown = grown + sum(jnp.abs(e / s) for e, s in zip(error, scale, strict=True))
        peak = jnp.maximum(peak, jnp.asarray(system.excursion(y)))  # the maximum keeps a NaN
        return y, (peak, grown, *pending)


@dataclasses.dataclass(frozen=True)
class KernelStage:
    """One stage of such a step: the loop's body has the field once, a quarter of a Runge-Kutta step to compile.

    Moved are the arguments of the stages to come as far as they are known, the state at the beginning of the step and
    that at its end; after the last stage all of them are the new state. Watched and fixed as in a step.
    """

    solver: dfx.AbstractERK
    structure: Structure

    @property
    def stages(self) -> Stages:
        """The method's coefficients."""
        assert isinstance(self.solver.tableau, dfx.ButcherTableau)
        return Stages.of(self.solver.tableau)

    @property
    def count(self) -> int:
        """Stages of a step."""
        return len(self.stages.phase)

    @property
    def copies(self) -> int:
        """How many times the numbers of a state it moves."""
        return len(self.stages.ahead) + 2

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        phase, h, *numbers = fixed
        pieces: tuple[AbstractField, AbstractForcedSystem, State] = self.structure.remake(numbers)
        field, system, scale = pieces
        method, n = self.stages, len(scale)
        step = jnp.floor(i / self.count)
        place = i - self.count * step
        first, last = place == 0.0, place == self.count - 1.0
        argument, *later, end = (moved[k : k + n] for k in range(0, len(moved), n))
        peak, grown, *pending = watched

        rate = field(phase + (step + chosen(method.phase, place)) * h, argument)
        push = lambda y, row: tuple(c + h * chosen(row, place) * k for c, k in zip(y, rate, strict=True))
        at_last = lambda new, old: tuple(jnp.where(last, a, b) for a, b in zip(new, old, strict=True))
        end = push(end, method.weight)
        later = [at_last(end, y) for y in (*map(push, later, method.ahead), later[-1])]
        late = tuple(h * (p + method.last_error * k) for p, k in zip(pending, rate, strict=True))
        error = tuple(jnp.where(first & (p == p), e, 0.0) for p, e in zip(pending, late, strict=True))
        kept = tuple(jnp.where(first, 0.0, p) for p in pending)
        pending = tuple(p + chosen(method.error, place) * k for p, k in zip(kept, rate, strict=True))
        grown = grown + sum(jnp.abs(e / s) for e, s in zip(error, scale, strict=True))
        peak = jnp.where(last, jnp.maximum(peak, jnp.asarray(system.excursion(end))), peak)
        return tuple(c for y in (*later, end) for c in y), (peak, grown, *pending)


def kernel_step(
    solver: KernelSolver, field: AbstractField, system: AbstractForcedSystem, scale: State
) -> tuple[KernelStep, list[Any]]:
    """A step and its fixed numbers behind phase and step size; system and scale have no derivative."""
    watching = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, (system, scale))
    structure, numbers = Structure.of((field, *watching))
    step = KernelStep(solver, structure)
    if structure.plain and all(jnp.ndim(x) == 0 for x in numbers):
        dimension, part = len(scale), step.stage or step  # of several parts one says it for all
        moved = dimension * (step.stage.copies if step.stage else 1)
        if is_elementary(part, Sizes(moved, len(step.watched(dimension)), 2 + len(numbers))):
            return step, numbers
    return dataclasses.replace(step, whole=False), numbers
