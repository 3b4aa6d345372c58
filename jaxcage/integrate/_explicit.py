"""The classical fourth-order Runge-Kutta method with an error estimate, as a diffrax solver; a step of any such method.

The estimate h/6 (k_4 - f(y_1)) is that of the embedded third-order method with weights (1, 2, 2, 0, 1)/6, whose last
stage is the first of the next step.
"""

from collections.abc import Callable
from typing import Any, ClassVar

import diffrax as dfx
import numpy as np

from .._types import Scalar, State
from ..models import AbstractField
from ..solve import combine


class ClassicalRK4(dfx.AbstractERK):
    """Kutta's method of 1901: four evaluations a step, order 4(3). Not for stiff systems."""

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
