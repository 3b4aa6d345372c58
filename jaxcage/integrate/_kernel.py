"""One step of a method as a scalar function, for `lanewise`, with and without tangent vectors.

The numbers of field, system and scale are its inputs; the rest (structure, tableau) is fixed.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int

from .._types import LaneState, Scalar, State
from ..models import AbstractField, AbstractForcedSystem
from ._device import steps_on_device
from ._explicit import explicit_step
from ._lanewise import evaluate, is_lanewise, lanewise
from ._rosenbrock import AbstractRosenbrock, rosenbrock_step, rosenbrock_step_with_tangent


@dataclasses.dataclass(frozen=True)
class Structure:
    """A module without the numbers of the two rows it is put together from."""

    shared: Any
    own: Any
    rest: Any
    leaves: tuple[tuple[type, Any], ...]

    def remake(self, shared: Sequence[Any], own: Sequence[Any]) -> Any:
        """The module with these numbers."""
        rest = jax.tree.unflatten(self.rest, [x for _, x in self.leaves])
        return eqx.combine(jax.tree.unflatten(self.own, list(own)), jax.tree.unflatten(self.shared, list(shared)), rest)


class Split(NamedTuple):
    """The numbers of a module in two rows, and how to put the module together again."""

    shared: tuple[Array, ...]
    own: tuple[Array, ...]
    structure: Structure
    complete: bool  # no array is left that is not in one of the rows


def split(shared: Any, own: Any = None) -> Split:
    """Split a module into its arrays and the rest.

    **Arguments:** the module; the same module with those arrays that differ from lane to lane, None elsewhere.
    """
    own = eqx.filter(shared, lambda _: False) if own is None else own
    alike, static = eqx.partition(shared, eqx.is_inexact_array)
    first, first_tree = jax.tree.flatten(alike)
    second, second_tree = jax.tree.flatten(own)
    leaves, rest = jax.tree.flatten(static)
    complete = all(map(eqx.is_inexact_array, second)) and not any(map(eqx.is_array, leaves))
    structure = Structure(first_tree, second_tree, rest, tuple((type(x), x) for x in leaves))
    return Split(tuple(first), tuple(second), structure, complete)


class Lane(NamedTuple):
    """What a step moves, scalars or lanes: state, largest excursion, error estimates so far, tangent vectors."""

    y: tuple[Any, ...]
    peak: Any
    error: Any
    pending: tuple[Any, ...]  # for methods whose estimate is complete with the first stage of the next step only
    tangents: tuple[tuple[Any, ...], ...] = ()

    def row(self) -> tuple[Any, ...]:
        """All numbers one after the other."""
        return tuple(jax.tree.leaves(self))

    def filled(self, row: Sequence[Any]) -> "Lane":
        """A lane of this form from the numbers of `row`; what follows them is left alone."""
        leaves, form = jax.tree.flatten(self)
        return jax.tree.unflatten(form, list(row[: len(leaves)]))


Pieces = tuple[AbstractField, AbstractForcedSystem, State]
"""Field, system and scale: what a step needs to know."""
KernelSolver = AbstractRosenbrock | dfx.AbstractERK


def can_be_kernel(solver: Any) -> bool:
    """Whether a step of `solver` is a plain formula: ours, and explicit methods with the first stage last."""
    if isinstance(solver, dfx.AbstractERK):
        return isinstance(solver.tableau, dfx.ButcherTableau) and solver.tableau.fsal
    return isinstance(solver, AbstractRosenbrock)


def start_lane(solver: KernelSolver, y: LaneState, tangents: tuple[LaneState, ...] = ()) -> Lane:
    """A lane at the beginning of a revolution."""
    zero = jnp.zeros_like(jnp.asarray(y[0]))
    unknown = (zero + jnp.nan,) * (len(y) if isinstance(solver, dfx.AbstractERK) else 0)
    return Lane(y, zero, zero, unknown, tangents)


@dataclasses.dataclass(frozen=True)
class Step:
    """One step for `lanewise`: shared (phase, step, shared numbers), lane (`Lane.row`, own numbers) -> `Lane.row`."""

    solver: KernelSolver
    structure: Structure
    form: Any
    """That of the lane."""
    estimate: bool

    @classmethod
    def of(cls, solver: KernelSolver, numbers: Split, lane: Lane, estimate: bool) -> "Step":
        return cls(solver, numbers.structure, jax.tree.structure(lane), estimate)

    def __call__(self, shared: tuple[Any, ...], lane: tuple[Any, ...]) -> tuple[Any, ...]:
        solver, moved = self.solver, self.form.num_leaves
        t0, h, *alike = shared
        before: Lane = jax.tree.unflatten(self.form, lane[:moved])
        field, system, scale = self.structure.remake(alike, lane[moved:])
        pending = before.pending
        if isinstance(solver, dfx.AbstractERK):
            tableau = solver.tableau
            assert isinstance(tableau, dfx.ButcherTableau)
            y, tangents, first, early = explicit_step(tableau, field, t0, h, before.y, before.tangents)
            last = float(tableau.b_error[-1])
            late = tuple(h * (p + last * k) for p, k in zip(pending, first, strict=True))
            error = tuple(jnp.where(p == p, e, 0.0) for p, e in zip(pending, late, strict=True))  # not NaN: known
            pending = early
        elif before.tangents:
            y, tangent, error = rosenbrock_step_with_tangent(solver.tableau, field, t0, h, before.y, *before.tangents)
            tangents = (tangent,)
        else:
            (y, error, _), tangents = rosenbrock_step(solver.tableau, field, t0, h, before.y), ()
        excursion = jax.lax.stop_gradient(jnp.asarray(system.excursion(y)))
        peak = jnp.maximum(before.peak, excursion)  # the maximum keeps a NaN
        grown = sum(jnp.abs(e / s) for e, s in zip(error, scale, strict=True)) if self.estimate else 0.0
        return Lane(y, peak, before.error + grown, pending if self.estimate else before.pending, tangents).row()


@dataclasses.dataclass(frozen=True)
class Several:
    """`count` steps one after the other."""

    step: Step
    count: int

    def __call__(self, shared: tuple[Any, ...], lane: tuple[Any, ...]) -> tuple[Any, ...]:
        (t0, h, *alike), moved = shared, self.step.form.num_leaves
        row, own = lane[:moved], lane[moved:]
        for i in range(self.count):
            row = evaluate(self.step, (t0 + i * h, h, *alike), (*row, *own))
        return row


def runs_lanewise(solver: KernelSolver, numbers: Split, y: LaneState) -> bool:
    """Whether the step of this field can be one kernel: all its numbers scalars, all its operations elementary."""
    scalars = all(x.ndim == 0 for x in numbers.shared) and all(x.ndim == 1 for x in numbers.own)
    if not (numbers.complete and scalars):
        return False
    lane = start_lane(solver, y)
    step = Step.of(solver, numbers, lane, True)
    return is_lanewise(step, 2 + len(numbers.shared), len(lane.row()) + len(numbers.own))


TOGETHER = 4
"""Steps of an explicit method in one kernel, half as many with tangents: between kernels all numbers are copied."""


def run_steps(
    solver: KernelSolver,
    numbers: Split,
    lane: Lane,
    h: Scalar,
    count: Int[Array, ""] | int,
    estimate: bool = False,
    mine: Bool[Array, " lanes"] | None = None,
    divisor: int = 1,
) -> Lane:
    """`count` steps of size h from phase 0, in all lanes if any of them is `mine`, by default all.

    The tangent step of a Rosenbrock method is as large as a kernel can be, so that its tangents go one by one.
    `divisor` is a number that `count` is known to be a multiple of.
    """
    if isinstance(solver, AbstractRosenbrock) and len(lane.tangents) > 1:
        along = lambda t: run_steps(solver, numbers, lane._replace(tangents=(t,)), h, count, estimate, mine, divisor)
        each = jax.lax.map(along, jax.tree.map(lambda *t: jnp.stack(t), *lane.tangents))
        pick = lambda i: jax.tree.map(lambda x: x[i], each)
        return pick(0)._replace(tangents=tuple(pick(i).tangents[0] for i in range(len(lane.tangents))))
    step = Step.of(solver, numbers, lane, estimate)
    mine = jnp.ones(lane.y[0].shape, bool) if mine is None else mine
    if jax.default_backend() != "cpu":
        return lane.filled(steps_on_device(step, numbers.shared, lane.row(), numbers.own, h, count, mine))
    few = TOGETHER // 2 if lane.tangents else TOGETHER
    together = math.gcd(divisor, few) if isinstance(solver, dfx.AbstractERK) else 1
    several = Several(step, together) if together > 1 else step

    def body(i: Array, row: tuple[Array, ...]) -> tuple[Array, ...]:
        return lanewise(several, (i.astype(float) * (together * h), h, *numbers.shared), (*row, *numbers.own))

    return lane.filled(jax.lax.fori_loop(0, jnp.where(jnp.any(mine), count // together, 0), body, lane.row()))
