"""The default method of sweeps: machine code with error control, and what replaces it where it does not serve."""

import equinox as eqx
import jax
from jaxtyping import Array, Int

from .._errors import ArgumentError
from .._types import Scalar, State
from ..models import AbstractField, AbstractForcedSystem
from ..solve import PAIRS
from ._controlled import DEFAULT_ERROR, ControlledSteps, controlled, finer
from ._method import AbstractMethod, Stretch


DEFAULT_TOLERANCE = 1e-6
DEFAULT_PAIR = "tsit5"
FINER = 16.0
"""Factor between the tolerances of a run and of the one that confirms it."""


class NativeSteps(AbstractMethod):
    """Whole revolutions in machine code, by an embedded explicit pair with a step size of its own for each lane.

    Sweeps use it. Where a law cannot be translated, where lanes need an implicit method, and for all that is not a
    sweep, the method `instead` serves.
    """

    tolerance: float = eqx.field(static=True)
    """Largest estimated error of a step, relative to the state and to the system's scale."""
    error: float = eqx.field(static=True)
    """Largest measured error of a revolution, in units of the scale."""
    pair: str = eqx.field(static=True)
    instead: ControlledSteps

    @property
    def in_jax(self) -> AbstractMethod:
        return self.instead

    def advance(
        self,
        field: AbstractField,
        system: AbstractForcedSystem,
        scale: State,
        y: State,
        phase: Scalar,
        parts: Int[Array, ""] | int,
    ) -> Stretch:
        return self.instead.advance(field, system, scale, y, phase, parts)

    def finer(self, times: int) -> "NativeSteps":
        """The same with tolerances 16 times smaller, `times` over."""
        factor = FINER**-times
        return NativeSteps(factor * self.tolerance, factor * self.error, self.pair, finer(self.instead, times))

    def __str__(self) -> str:
        return (
            f"machine code, {self.pair} with a tolerance of {self.tolerance:.2g}, error of a revolution at most "
            f"{self.error:.2g}"
        )


def native(
    tolerance: float = DEFAULT_TOLERANCE, error: float = DEFAULT_ERROR, pair: str = DEFAULT_PAIR
) -> AbstractMethod:
    """Machine code for sweeps, compiled from the traced law.

    **Arguments:** largest estimated error of a step, relative to the state and to the system's scale; largest measured
    error of a revolution in units of the scale, beyond which a lane is run again with smaller tolerances; embedded
    pair, one of `tsit5`, `dopri5`, `bosh3`, `dopri8`.

    **Returns:** the method; `controlled(error)` on a machine whose JAX does not run on a CPU.

    **Raises:** `ValueError` for numbers that are not positive, and an unknown pair.
    """
    if not 0 < tolerance < 1:
        raise ArgumentError("tolerance", said=f"must lie between 0 and 1, but {tolerance} was given.")
    if not error > 0:
        raise ArgumentError("error", said=f"must be positive, but {error} was given.")
    if pair not in PAIRS:
        raise ArgumentError("pair", said=f"must be one of {', '.join(PAIRS)}, but '{pair}' was given.")
    instead = controlled(error)
    return NativeSteps(tolerance, error, pair, instead) if jax.default_backend() == "cpu" else instead


def refined(method: AbstractMethod, times: int = 1) -> AbstractMethod:
    """`method` with steps at most half as long, `times` over, for what it is to be confirmed by."""
    return method.finer(times) if isinstance(method, NativeSteps) else finer(method, times)
