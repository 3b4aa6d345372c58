"""Our own diffrax solvers: an L-stable Rosenbrock method, and the classical Runge-Kutta method.

A Rosenbrock method solves only linear systems, with one matrix per step:
    (shift I - J) U_i = f(t + alpha_i h, y + sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_i h df/dt,
    y_1 = y + sum_i m_i U_i,  error = sum_i e_i U_i,  shift = 1/(gamma h).
The field's linearisation provides the solver: for a second-order system it eliminates the positions in closed form.
"""

from collections.abc import Callable
from typing import Any, ClassVar

import diffrax as dfx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from .._errors import ArgumentError
from .._pytrees import Scalar, State
from ..models import AbstractField


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
    field: AbstractField,
    t0: Scalar,
    size: Callable[[State], Scalar],
    y0: State,
    settle: Callable[[Any, Scalar], Any] = lambda x, t0: x,
) -> tuple[State, State, State, Scalar]:
    """Take one step of `Rodas4` from y0 at phase t0, whose size is a function of the initial rate.

    `settle` is applied to intermediate results that XLA should not recompute (`computed_once`).

    **Returns:** new state, error estimate of the embedded method, dy/dtau at the beginning of the step, and step size.
    """
    near = settle(field.linearise(t0, y0), t0)
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
        stages.append(settle(solve(r), t0))
    return combine(y0, M, stages), combine(zero, E, stages), near.value, h


def computed_once(x: PyTree, t0: Scalar) -> PyTree:
    """Return x, computed completely before it is used.

    XLA's CPU backend computes each output of a fused loop separately, so that a step in one piece evaluates the same
    forces repeatedly (3.6 times the run time, measured for Rodas4 on the cage). It drops optimisation barriers before
    fusion (jax 0.10.1), but computes the operands of a conditional once.
    """
    return jax.lax.cond(
        jnp.isfinite(t0), lambda v: v, lambda v: jax.tree.map(lambda c: jnp.full_like(c, jnp.nan), v), x
    )


class Rodas4(dfx.AbstractAdaptiveSolver):
    """Stiffly accurate Rosenbrock method with six stages and order 4(3), for an `AbstractField`, which is passed as
    `args` of `diffrax.diffeqsolve`."""

    term_structure: ClassVar = dfx.ODETerm
    interpolation_cls: ClassVar[Callable[..., dfx.AbstractLocalInterpolation]] = (
        dfx.ThirdOrderHermitePolynomialInterpolation
    )

    def order(self, terms: Any) -> int:
        del terms
        return 4

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any) -> None:
        del terms, t0, t1, y0
        if not isinstance(args, AbstractField):
            raise ArgumentError("args", said="must be the field to integrate, but it is not an `AbstractField`.")

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any, solver_state: None, made_jump: Any
    ) -> tuple[Any, Any, dict[str, Any], None, dfx.RESULTS]:
        del terms, solver_state, made_jump
        h = t1 - t0
        y1, error, rate0, _ = rosenbrock_step(args, t0, lambda _: h, y0, computed_once)
        rate1 = args(t1, y1)
        k0, k1 = (tuple(h * c for c in rate) for rate in (rate0, rate1))
        return y1, error, dict(y0=y0, y1=y1, k0=k0, k1=k1), None, dfx.RESULTS.successful

    def func(self, terms: Any, t0: Any, y0: Any, args: Any) -> Any:
        return terms.vf(t0, y0, args)


class ClassicalRK4(dfx.AbstractERK):
    """Kutta's method of 1901, with four evaluations per step and order 4(3), not for stiff systems.

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
    tableau: Any, field: AbstractField, t0: Scalar, size: Callable[[State], Scalar], y0: State
) -> tuple[State, Scalar]:
    """Take one step of an explicit FSAL method from y0 at phase t0, whose size is a function of the initial rate;
    return the new state and the step size."""
    stages = [field(t0, y0)]
    h = size(stages[0])
    for c, row in zip(tableau.c, tableau.a_lower[:-1], strict=False):
        stages.append(field(t0 + float(c) * h, combine(y0, row, stages, h)))
    return combine(y0, tableau.b_sol, stages, h), h
