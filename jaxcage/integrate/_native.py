"""The default method: machine code with error control."""

import diffrax as dfx
import equinox as eqx
from jaxtyping import Array, Int

from .._errors import ArgumentError
from .._types import Scalar, State
from ..models import AbstractField, AbstractForcedSystem
from ..solve import PAIRS
from ._method import SHARPER, AbstractMethod, AdaptiveSteps, Stretch
from ._rosenbrock import Rodas4


DEFAULT_TOLERANCE = 1e-6
DEFAULT_ERROR = 3e-3
"""Largest error of a revolution, in units of the system's scale (for a cage: clearances)."""
DEFAULT_PAIR = "tsit5"
IMPLICIT = "rodas4"
"""Method of lanes that take too many or too short steps by an explicit one."""
FINER = 16.0
"""Factor between the tolerances of a run and of the one that confirms it."""


class NativeSteps(AbstractMethod):
    """Whole revolutions in machine code, by an embedded explicit pair with a step size of its own for each lane.

    Within JAX's programs, and for a law that cannot be translated, Tsitouras' method in diffrax stands for it.
    """

    tolerance: float = eqx.field(static=True)
    """Largest estimated error of a step, relative to the state and to the system's scale."""
    error: float = eqx.field(static=True)
    """Largest measured error of a revolution, in units of the scale."""
    pair: str = eqx.field(static=True)

    @property
    def allowed(self) -> float:
        return self.error

    @property
    def in_jax(self) -> AdaptiveSteps:
        solver = Rodas4() if self.pair == IMPLICIT else dfx.Tsit5()
        return AdaptiveSteps(solver, self.tolerance, self.tolerance)

    @property
    def reference(self) -> "NativeSteps":
        return NativeSteps(SHARPER * self.tolerance, self.error, self.pair)

    @property
    def implicit(self) -> "NativeSteps":
        """The same by the implicit method, for stiff laws."""
        return NativeSteps(self.tolerance, self.error, IMPLICIT)

    def advance(
        self,
        field: AbstractField,
        system: AbstractForcedSystem,
        scale: State,
        y: State,
        phase: Scalar,
        parts: Int[Array, ""] | int,
    ) -> Stretch:
        return self.in_jax.advance(field, system, scale, y, phase, parts)

    def finer(self, times: int = 1) -> "NativeSteps":
        """The same with tolerances 16 times smaller, `times` over."""
        factor = FINER**-times
        return NativeSteps(factor * self.tolerance, factor * self.error, self.pair)

    def __str__(self) -> str:
        return (
            f"machine code, {self.pair} with a tolerance of {self.tolerance:.2g}, error of a revolution at most "
            f"{self.error:.2g}"
        )


def native(
    tolerance: float = DEFAULT_TOLERANCE, error: float = DEFAULT_ERROR, pair: str = DEFAULT_PAIR
) -> AbstractMethod:
    """Machine code, compiled from the traced law.

    **Arguments:** largest estimated error of a step, relative to the state and to the system's scale; largest measured
    error of a revolution in units of the scale, beyond which a lane is run again with smaller tolerances; method, an
    embedded explicit pair (`tsit5`, `dopri5`, `bosh3`, `dopri8`) or the L-stable `rodas4`, which lanes take by
    themselves that an explicit one serves badly.

    **Raises:** `ValueError` for numbers that are not positive, and an unknown pair.
    """
    if not 0 < tolerance < 1:
        raise ArgumentError("tolerance", said=f"must lie between 0 and 1, but {tolerance} was given.")
    if not error > 0:
        raise ArgumentError("error", said=f"must be positive, but {error} was given.")
    if pair not in PAIRS:
        raise ArgumentError("pair", said=f"must be one of {', '.join(PAIRS)}, but '{pair}' was given.")
    return NativeSteps(tolerance, error, pair)
