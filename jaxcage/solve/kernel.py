"""One step of a method as scalar code, for `march`: the numbers of field, system and scale are its fixed numbers.

A Rosenbrock method solves only linear systems, with one matrix per step:
    (shift I - J) U_i = f(t + alpha_i h, y + sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_i h df/dt,
    y_1 = y + sum_i m_i U_i,  error = sum_i e_i U_i,  shift = 1/(gamma h).
The field's linearisation provides the solver: for a second-order system it eliminates the positions in closed form.
"""

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._pytrees import Form, Scalar, State, split
from ..models import ESCAPE, AbstractField, AbstractForcedSystem, Linearisation
from .layout import REVOLUTION, Tableau
from .march import march_with_tangents
from .program import Numbers


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


EXPLICIT = {
    "rk4": Tableau(
        [0.0, 1 / 2, 1 / 2, 1.0, 1.0],
        [[], [1 / 2], [0.0, 1 / 2], [0.0, 0.0, 1.0], [1 / 6, 1 / 3, 1 / 3, 1 / 6]],
        [],
        4,
    ),
    "tsit5": Tableau.named("tsit5"),
}
"""Explicit methods with equal steps: Kutta's of 1901, and Tsitouras' of 2011."""


def combine(base: State, weights: Any, stages: list[State], factor: Scalar = 1.0) -> State:
    """Return base + factor * sum of weights times stages, without terms of zero weight."""
    used = [(float(w), u) for w, u in zip(weights, stages, strict=False) if w != 0.0]
    return tuple(b + factor * sum(w * u[i] for w, u in used) if used else b for i, b in enumerate(base))


# E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), sec. VI.4 (their code RODAS), in
# the form of sec. IV.7; GAMMA_SUM are the row sums of gamma_ij.
GAMMA = 0.25
ALPHA = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
GAMMA_SUM = (0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0)
_LAST = (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950)
A: tuple[tuple[float, ...], ...] = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    _LAST,
    (*_LAST, 1.0),
)
C: tuple[tuple[float, ...], ...] = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)
M = (*_LAST, 1.0, 1.0)
E = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def rosenbrock_step(
    field: AbstractField, t0: Scalar, size: Callable[[State], Scalar], y0: State
) -> tuple[State, State, Scalar]:
    """Take one step of Rodas4 (six stages, order 4(3)) from y0 at phase t0, whose size is a function of the initial
    rate; return the new state, the error estimate of the embedded method, and the step size."""
    near = field.linearise(t0, y0)
    h = size(near.value)
    solve = near.solver(1 / (GAMMA * h))
    zero = tuple(jnp.zeros_like(c) for c in near.value)
    stages: list[State] = []
    rates = near.value
    for i, a_row in enumerate(A):
        if any(a_row):  # otherwise the stage is evaluated at (t0, y0) like the first
            rates = field(t0 + ALPHA[i] * h, combine(y0, a_row, stages))
        r = combine(rates, C[i], stages, 1 / h)
        if GAMMA_SUM[i] != 0.0:
            r = tuple(c + GAMMA_SUM[i] * h * s for c, s in zip(r, near.phase_derivative, strict=True))
        stages.append(solve(r))
    return combine(y0, M, stages), combine(zero, E, stages), h


def explicit_step(
    tableau: Tableau, field: AbstractField, t0: Scalar, size: Callable[[State], Scalar], y0: State
) -> tuple[State, Scalar]:
    """Take one step of an explicit method from y0 at phase t0, whose size is a function of the initial rate; return the
    new state and the step size."""
    stages = [field(t0, y0)]
    h = size(stages[0])
    for c, row in zip(tableau.phase[1:-1], tableau.stages[1:-1], strict=True):
        stages.append(field(t0 + c * h, combine(y0, row, stages, h)))
    return combine(y0, tableau.stages[-1], stages, h), h


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

    solver: str
    """Name of an explicit method, or `rodas4`."""
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

        if self.solver in EXPLICIT:
            y, step = explicit_step(EXPLICIT[self.solver], field, t0, size, moved)
        else:
            y, _, step = rosenbrock_step(field, t0, size, moved)
            if self.abrupt:  # a step of size zero divides by zero
                y = tuple(jnp.where(step > 0, a, b) for a, b in zip(y, moved, strict=True))
        if self.abrupt:
            clock = [t0 + step]
        return y, (jnp.maximum(peak, jnp.asarray(system.excursion(y))), *clock)  # `maximum` propagates NaN


def steps_through(
    solver: str, steps: Any, pieces: Pieces, y: State, phase: Any, parts: Parts, tangents: Tangents
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
