"""L-stable Rosenbrock methods as diffrax solvers that use the structure of the field they integrate."""

from collections.abc import Callable
from typing import Any, ClassVar

import diffrax as dfx
import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from .._errors import ArgumentError
from .._types import Scalar
from ..models import AbstractField
from ..solve import RODAS3, RODAS4, RosenbrockTableau, rosenbrock_step


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
