"""Newmark's beta method, the paper's integrator ("modified Newmark-beta", after (32)), as a diffrax solver.

    q_1 = q_0 + h v_0 + h^2 [(1/2 - beta) a_0 + beta a_1],   v_1 = v_0 + h [(1 - gamma) a_0 + gamma a_1],
with a_1 the acceleration at the end of the step, found by Newton's method on the velocities alone. With beta = 1/4 and
gamma = 1/2 (average acceleration) it is of second order and does not damp anything by itself: contact impacts ring.
"""

from collections.abc import Callable
from typing import Any, ClassVar

import diffrax as dfx
import equinox as eqx
import jax.numpy as jnp

from .._errors import ArgumentError
from .._types import Scalar, State
from ..models import AbstractField, SecondOrderField


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
