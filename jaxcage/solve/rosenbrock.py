"""A step of L-stable Rosenbrock methods, which uses the structure of the field it integrates.

A Rosenbrock method solves linear systems only, one matrix per step:
    (shift I - J) U_i = f(t + alpha_i h, y + sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_i h df/dt,
    y_1 = y + sum_i m_i U_i,  error = sum_i e_i U_i,  shift = 1/(gamma h).
The field's linearisation does the solve: for a second-order system it eliminates the positions in closed form.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp

from .._types import Scalar, State
from ..models import AbstractField


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
