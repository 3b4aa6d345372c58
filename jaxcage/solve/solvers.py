"""Diffrax solvers of our own: L-stable Rosenbrock methods, Newmark's beta method, and the classical Runge-Kutta method.

A Rosenbrock method solves linear systems only, one matrix per step:
    (shift I - J) U_i = f(t + alpha_i h, y + sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_i h df/dt,
    y_1 = y + sum_i m_i U_i,  error = sum_i e_i U_i,  shift = 1/(gamma h).
The field's linearisation does the solve: for a second-order system it eliminates the positions in closed form.

Newmark's method is the paper's integrator ("modified Newmark-beta", after (32)):
    q_1 = q_0 + h v_0 + h^2 [(1/2 - beta) a_0 + beta a_1],   v_1 = v_0 + h [(1 - gamma) a_0 + gamma a_1],
with a_1 the acceleration at the end of the step, found by Newton's method on the velocities alone. With beta = 1/4 and
gamma = 1/2 (average acceleration) it is of second order and does not damp anything by itself: contact impacts ring.
"""

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from .._errors import ArgumentError
from .._types import Scalar, State
from ..models import AbstractField, SecondOrderField


def combine(base: State, weights: Any, stages: list[State], factor: Scalar = 1.0) -> State:
    """base + factor * sum of weights times stages, leaving out what is multiplied by zero."""
    used = [(float(w), u) for w, u in zip(weights, stages, strict=False) if w != 0.0]
    return tuple(b + factor * sum(w * u[i] for w, u in used) if used else b for i, b in enumerate(base))


class RosenbrockTableau(NamedTuple):
    """Coefficients in the form of Hairer and Wanner, Solving ODEs II, sec. IV.7."""

    gamma: float
    alpha: tuple[float, ...]
    gamma_sum: tuple[float, ...]
    a: tuple[tuple[float, ...], ...]
    c: tuple[tuple[float, ...], ...]
    m: tuple[float, ...]
    e: tuple[float, ...]


# A. Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II, Atmos. Environ. 31 (1997) 3459.
RODAS3 = RosenbrockTableau(
    gamma=0.5,
    alpha=(0.0, 0.0, 1.0, 1.0),
    gamma_sum=(0.5, 1.5, 0.0, 0.0),
    a=((), (0.0,), (2.0, 0.0), (2.0, 0.0, 1.0)),
    c=((), (4.0,), (1.0, -1.0), (1.0, -1.0, -8 / 3)),
    m=(2.0, 0.0, 1.0, 1.0),
    e=(0.0, 0.0, 0.0, 1.0),
)

_A4 = (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950)
# E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), sec. VI.4 (their code RODAS).
RODAS4 = RosenbrockTableau(
    gamma=0.25,
    alpha=(0.0, 0.386, 0.21, 0.63, 1.0, 1.0),
    gamma_sum=(0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0),
    a=(
        (),
        (1.544,),
        (0.9466785280815826, 0.2557011698983284),
        (3.314825187068521, 2.896124015972201, 0.9986419139977817),
        _A4,
        (*_A4, 1.0),
    ),
    c=(
        (),
        (-5.6688,),
        (-2.430093356833875, -0.2063599157091915),
        (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
        (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
        (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
    ),
    m=(*_A4, 1.0, 1.0),
    e=(0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
)


def rosenbrock_step(
    tableau: RosenbrockTableau,
    field: AbstractField,
    t0: Scalar,
    size: Callable[[State], Scalar],
    y0: State,
    settle: Callable[[Any, Scalar], Any] = lambda x, t0: x,
) -> tuple[State, State, State, Scalar]:
    """One step from y0 at phase t0, of the size that is told from the rate at its beginning.

    `settle` is told what had better be worked out in full before it is used, where the step is left to XLA's fusions.

    **Returns:** the new state, the error estimate of the embedded method, dy/dtau at the beginning of the step, and the
    step.
    """
    near = settle(field.linearise(t0, y0), t0)
    h = size(near.value)
    solve = near.solver(1 / (tableau.gamma * h))
    zero = tuple(jnp.zeros_like(c) for c in near.value)
    stages: list[State] = []
    rates = near.value
    for i, a_row in enumerate(tableau.a):
        if any(a_row):  # else the stage is evaluated at (t0, y0) like the first
            rates = field(t0 + tableau.alpha[i] * h, combine(y0, a_row, stages))
        r = combine(rates, tableau.c[i], stages, 1 / h)
        if tableau.gamma_sum[i] != 0.0:
            r = tuple(c + tableau.gamma_sum[i] * h * s for c, s in zip(r, near.phase_derivative, strict=True))
        stages.append(settle(solve(r), t0))
    return combine(y0, tableau.m, stages), combine(zero, tableau.e, stages), near.value, h


def computed_once(x: PyTree, t0: Scalar) -> PyTree:
    """x as it is, worked out in full before anything makes use of it.

    XLA's CPU backend computes each output of a fused loop by itself, so that a step written in one piece evaluates the
    same forces over and over: 3.6 times the run time, measured for Rodas4 on the cage. It drops optimisation barriers
    before it fuses (jax 0.10.1), but computes the operands of a conditional once.
    """
    return jax.lax.cond(
        jnp.isfinite(t0), lambda v: v, lambda v: jax.tree.map(lambda c: jnp.full_like(c, jnp.nan), v), x
    )


class AbstractRosenbrock(dfx.AbstractAdaptiveSolver):
    """A Rosenbrock method on an `AbstractField`, which travels as the `args` of `diffrax.diffeqsolve`."""

    term_structure: ClassVar = dfx.ODETerm
    interpolation_cls: ClassVar[Callable[..., dfx.AbstractLocalInterpolation]] = (
        dfx.ThirdOrderHermitePolynomialInterpolation
    )
    tableau: ClassVar[RosenbrockTableau]

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any) -> None:
        del terms, t0, t1, y0
        if not isinstance(args, AbstractField):
            raise ArgumentError("args", said="must be the field to integrate, but it is not an `AbstractField`.")

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any, solver_state: None, made_jump: Any
    ) -> tuple[Any, Any, dict[str, Any], None, dfx.RESULTS]:
        del terms, solver_state, made_jump
        h = t1 - t0
        y1, error, rate0, _ = rosenbrock_step(self.tableau, args, t0, lambda _: h, y0, computed_once)
        rate1 = args(t1, y1)
        k0, k1 = (tuple(h * c for c in rate) for rate in (rate0, rate1))
        return y1, error, dict(y0=y0, y1=y1, k0=k0, k1=k1), None, dfx.RESULTS.successful

    def func(self, terms: Any, t0: Any, y0: Any, args: Any) -> Any:
        return terms.vf(t0, y0, args)


class Rodas3(AbstractRosenbrock):
    """Four stages, three evaluations, order 3(2), stiffly accurate."""

    tableau: ClassVar[RosenbrockTableau] = RODAS3

    def order(self, terms: Any) -> int:
        del terms
        return 3


class Rodas4(AbstractRosenbrock):
    """Six stages, order 4(3), stiffly accurate."""

    tableau: ClassVar[RosenbrockTableau] = RODAS4

    def order(self, terms: Any) -> int:
        del terms
        return 4


class NewmarkBeta(dfx.AbstractSolver):
    """Newmark's method on a `SecondOrderField`, which travels as the `args` of `diffrax.diffeqsolve`.

    It has no error estimate: constant steps only. A step whose Newton iteration has not converged after
    `max_iterations` ends with the result `nonlinear_divergence`.
    """

    beta: float = eqx.field(static=True, default=0.25)
    gamma: float = eqx.field(static=True, default=0.5)
    tolerance: float = eqx.field(static=True, default=1e-9)
    max_iterations: int = eqx.field(static=True, default=8)

    term_structure: ClassVar = dfx.ODETerm
    interpolation_cls: ClassVar[Callable[..., dfx.AbstractLocalInterpolation]] = dfx.LocalLinearInterpolation

    def order(self, terms: Any) -> int:
        del terms
        return 2

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any) -> None:
        del terms, t0, t1, y0, args

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any, solver_state: None, made_jump: Any
    ) -> tuple[Any, None, dict[str, Any], None, Any]:
        del terms, solver_state, made_jump
        y1, excess = self.advance(args, t0, t1, y0)
        result = dfx.RESULTS.where(excess <= 0, dfx.RESULTS.successful, dfx.RESULTS.nonlinear_divergence)  # pyright: ignore
        return y1, None, dict(y0=y0, y1=y1), None, result

    def func(self, terms: Any, t0: Any, y0: Any, args: Any) -> Any:
        return terms.vf(t0, y0, args)

    def advance(self, field: AbstractField, t0: Scalar, t1: Scalar, y0: State) -> tuple[State, Scalar]:
        """The state at the end of the step, and by how much the defect that is left is too large.

        The iterations are as many for all lanes and written out: a step is then a plain formula, one kernel.
        """
        if not isinstance(field, SecondOrderField):
            raise ArgumentError("args", said="must be a `SecondOrderField`: Newmark's method needs accelerations.")
        n = len(y0) // 2
        q0, v0 = y0[:n], y0[n:]
        h = (t1 - t0) / field.speed
        a0 = field.acceleration(t0, q0, v0)
        shift = 1 / (self.gamma * (t1 - t0))

        def positions(v1: State) -> State:
            a1 = tuple(
                (b - a - h * (1 - self.gamma) * c) / (h * self.gamma) for a, b, c in zip(v0, v1, a0, strict=True)
            )
            return tuple(
                q + h * v + h**2 * ((0.5 - self.beta) * a + self.beta * b)
                for q, v, a, b in zip(q0, v0, a0, a1, strict=True)
            )

        def defect(v1: State) -> State:
            a1 = field.acceleration(t1, positions(v1), v1)
            rates = zip(v0, v1, a0, a1, strict=True)
            return tuple(b - a - h * ((1 - self.gamma) * c + self.gamma * d) for a, b, c, d in rates)

        zero = tuple(jnp.zeros_like(c) for c in q0)
        v1 = tuple(v + h * a for v, a in zip(v0, a0, strict=True))
        for _ in range(self.max_iterations):
            # The Newton matrix I - h gamma A_v - h^2 beta A_q is that of the field's own solver where beta = gamma^2,
            # as it is for average acceleration; elsewhere the iteration is a modified Newton's.
            near = field.linearise(t1, (*positions(v1), *v1))
            change = near.solver(shift)((*zero, *(shift * c for c in defect(v1))))[n:]
            v1 = tuple(a - b for a, b in zip(v1, change, strict=True))

        left = jnp.sqrt(sum(c * c for c in defect(v1)))
        size = jnp.sqrt(sum(a * a + (b - a) ** 2 for a, b in zip(v0, v1, strict=True)))
        return (*positions(v1), *v1), left - self.tolerance * size


class ClassicalRK4(dfx.AbstractERK):
    """Kutta's method of 1901: four evaluations a step, order 4(3). Not for stiff systems.

    The error estimate h/6 (k_4 - f(y_1)) is that of the embedded third-order method with weights (1, 2, 2, 0, 1)/6,
    whose last stage is the first of the next step.
    """

    tableau: ClassVar[dfx.ButcherTableau] = dfx.ButcherTableau(  # pyright: ignore[reportIncompatibleVariableOverride]
        c=np.array([1 / 2, 1 / 2, 1, 1]),
        a_lower=(
            np.array([1 / 2]),
            np.array([0, 1 / 2]),
            np.array([0, 0, 1.0]),
            np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6]),
        ),
        b_sol=np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6, 0]),
        b_error=np.array([0, 0, 0, 1 / 6, -1 / 6]),
    )
    interpolation_cls: ClassVar[Callable[..., dfx.AbstractLocalInterpolation]] = (
        dfx.ThirdOrderHermitePolynomialInterpolation.from_k
    )

    def order(self, terms: Any) -> int:
        del terms
        return 4


def explicit_step(
    tableau: dfx.ButcherTableau, field: AbstractField, t0: Scalar, size: Callable[[State], Scalar], y0: State
) -> tuple[State, Scalar]:
    """One step from y0 at phase t0, for a method whose last stage is the first of the next step.

    **Arguments:** `size` tells the step from the rate at its beginning.

    **Returns:** the new state, the step.
    """
    stages = [field(t0, y0)]
    h = size(stages[0])
    for c, row in zip(tableau.c, tableau.a_lower[:-1], strict=False):
        stages.append(field(t0 + float(c) * h, combine(y0, row, stages, h)))
    return combine(y0, tableau.b_sol, stages, h), h
