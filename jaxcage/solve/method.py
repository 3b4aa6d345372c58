"""Integration methods, each a solver with its choice of steps."""

import abc
import math
from typing import Any, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._errors import ArgumentError
from .._pytrees import Scalar, State, split
from ..models import ESCAPE, ScaledField, divide, multiply
from .kernel import EXPLICIT, REVOLUTION, Parts, Pieces, Tangents, steps_through
from .layout import IMPLICIT, PAIRS
from .march import with_tangents
from .outcomes import FINISHED, NOT_FINITE, OTHER, OUTCOMES, OUTSIDE, TOO_MANY


FIRST_STEPS, MOST_STEPS = 64, 100_000
"""Number of first steps that would make a revolution, and maximum number of steps, with adaptive steps."""
SHARPER = 1e-2
"""Tolerance of the reference run that measures errors, as a fraction of the method's."""
DEFAULT_TOLERANCE = 1e-6
DEFAULT_ERROR = 3e-3
"""Largest error of a revolution, in units of the system's scale (for a cage: clearances)."""
DEFAULT_PAIR = "tsit5"
FINER = 16.0
"""Factor by which `finer` divides tolerances."""


class Stretch(NamedTuple):
    """Result of the advance of a lane, or of many with their axis last, by a part of a revolution."""

    y: State
    peak: Scalar
    """Largest excursion."""
    outcome: Int[Array, "*lanes"]
    """Index into `OUTCOMES`."""
    tangents: tuple[State, ...]


def _evaluate(tau: Any, y: Any, field: Any) -> State:
    return field(tau, y)


TERM = dfx.ODETerm(_evaluate)
"""Diffrax term of every field; the field itself is passed as `args`, where solvers can use its structure."""


class AbstractMethod(eqx.Module):
    """Abstract method for integrating a field over a part of a revolution."""

    @property
    def allowed(self) -> float:
        """Largest accepted measured error of a revolution, in units of the scale."""
        return math.inf

    @property
    def in_jax(self) -> "AbstractMethod":
        """Method that replaces this one inside JAX's programs."""
        return self

    @property
    @abc.abstractmethod
    def reference(self) -> "AbstractMethod":
        """More accurate method by which the error of this one is measured."""

    @abc.abstractmethod
    def finer(self, times: int = 1) -> "AbstractMethod":
        """Method with steps halved, or tolerances divided by `FINER`, `times` times."""

    @abc.abstractmethod
    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Parts, tangents: Tangents = ()) -> Stretch:
        """Advance state `y` at `phase`, and tangent vectors, by one of `parts` equal parts of a revolution."""


def _outcome_at(y: State, excursion: Scalar) -> Int[Array, ""]:
    """Outcome code of an integration that reached a state."""
    finite = jnp.isfinite(sum(jnp.sum(jnp.abs(c)) for c in y))
    return jnp.where(finite, jnp.where(excursion <= ESCAPE, FINISHED, OUTSIDE), NOT_FINITE)


class FixedSteps(AbstractMethod):
    """Method with equal steps, shortened near abrupt changes of the law; the strobe map is as smooth as the field."""

    solver: str = eqx.field(static=True)
    """Name of the method, one of `EQUAL`."""
    steps: int | Int[Array, "*levels"]
    """Number of steps per revolution, an array if one program is to serve all numbers."""

    def __check_init__(self):
        if isinstance(self.steps, int) and self.steps < 1:
            raise ArgumentError("steps", said=f"must be at least 1 per revolution, but {self.steps} was given.")

    @property
    def reference(self) -> "FixedSteps":
        return self.finer()

    def finer(self, times: int = 1) -> "FixedSteps":
        return FixedSteps(self.solver, self.steps << times)

    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Parts, tangents: Tangents = ()) -> Stretch:
        if isinstance(self.steps, int) and isinstance(parts, int) and self.steps % parts:
            raise ArgumentError("parts", said=f"must divide the {self.steps} steps per revolution, but it is {parts}.")
        y, peak, after = steps_through(self.solver, self.steps, pieces, y, phase, parts, tangents)
        return Stretch(y, peak, _outcome_at(y, peak), after)


class AdaptiveSteps(AbstractMethod):
    """Method with steps chosen by diffrax from an error estimate relative to the state and to the system's scale; the
    excursion is only evaluated at the ends of revolutions, or of their parts."""

    solver: dfx.AbstractAdaptiveSolver
    tolerance: float = eqx.field(static=True)
    """Tolerance relative to the state and to the system's scale; also the lower bound of a measured error."""

    @property
    def reference(self) -> "AdaptiveSteps":
        return AdaptiveSteps(self.solver, SHARPER * self.tolerance)

    def finer(self, times: int = 1) -> "AdaptiveSteps":
        return AdaptiveSteps(self.solver, FINER**-times * self.tolerance)

    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Parts, tangents: Tangents = ()) -> Stretch:
        field, system, scale = pieces
        moving = any(drift is not None for _, drift in tangents)
        form, row = split(field, lambda leaf: moving and eqx.is_inexact_array(leaf))
        length = REVOLUTION / jnp.asarray(parts, dtype=float)

        def move(start: tuple[State, list[Array]]) -> tuple[State, tuple[Array, Array]]:
            y, row = start
            solution = dfx.diffeqsolve(
                TERM,
                self.solver,
                t0=phase,
                t1=phase + length,
                dt0=jnp.minimum(REVOLUTION / FIRST_STEPS, length),
                y0=divide(y, scale),
                args=ScaledField(form.filled(row), scale),
                stepsize_controller=dfx.PIDController(self.tolerance, self.tolerance, pcoeff=0.3, icoeff=0.4),
                saveat=dfx.SaveAt(t1=True),
                adjoint=dfx.ForwardMode(),
                max_steps=MOST_STEPS,
                throw=False,
            )
            assert solution.ys is not None
            y = multiply(tuple(c[-1] for c in solution.ys), scale)
            excursion = jax.lax.stop_gradient(jnp.asarray(system.excursion(y), dtype=float))
            failed = jnp.full((), OTHER)
            for name in OUTCOMES[TOO_MANY:OTHER]:
                failed = jnp.where(solution.result == getattr(dfx.RESULTS, name), OUTCOMES.index(name), failed)
            well = solution.result == dfx.RESULTS.successful
            return y, (excursion, jnp.where(well, _outcome_at(y, excursion), failed))

        zero = list(map(jnp.zeros_like, row))
        filled = lambda drift: [z if d is None else d for z, d in zip(zero, drift or zero, strict=True)]
        end, after, (peak, outcome) = with_tangents(move, (y, row), [(t, filled(drift)) for t, drift in tangents])
        return Stretch(end, peak, outcome, after)


class NativeSteps(AbstractMethod):
    """Method in machine code: an embedded explicit pair, or Rodas4, with an individual step size for each lane; within
    JAX's programs, and for a law that cannot be translated, `in_jax` replaces it."""

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
        return AdaptiveSteps(dfx.Kvaerno5() if self.pair == IMPLICIT else dfx.Tsit5(), self.tolerance)

    @property
    def reference(self) -> "NativeSteps":
        return NativeSteps(SHARPER * self.tolerance, self.error, self.pair)

    @property
    def implicit(self) -> "NativeSteps":
        """Implicit method with these tolerances, for stiff laws."""
        return NativeSteps(self.tolerance, self.error, IMPLICIT)

    def advance(self, *args: Any, **kwargs: Any) -> Stretch:
        return self.in_jax.advance(*args, **kwargs)

    def finer(self, times: int = 1) -> "NativeSteps":
        factor = FINER**-times
        return NativeSteps(factor * self.tolerance, factor * self.error, self.pair)

    def __str__(self) -> str:
        return (
            f"machine code, {self.pair} with a tolerance of {self.tolerance:.2g}, error of a revolution at most "
            f"{self.error:.2g}"
        )


EQUAL = (*EXPLICIT, IMPLICIT)
"""Names of the methods with equal steps."""
_ADAPTIVE: dict[str, dfx.AbstractAdaptiveSolver] = {
    "tsit5": dfx.Tsit5(),
    "kvaerno3": dfx.Kvaerno3(),
    "kvaerno5": dfx.Kvaerno5(),
}
DEFAULT_STEPS = 1024


def method(solver: str | None = None, steps: int | None = None, tolerance: float | None = None) -> AbstractMethod:
    """Make an integration method by name, with equal or adaptive steps.

    **Arguments:**

    - `solver`: with equal steps `rk4` (classical, the default), `tsit5`, or `rodas4` for stiff laws; with a tolerance
        diffrax's `tsit5` (the default) or, for stiff laws, `kvaerno3` and `kvaerno5`.
    - `steps`: equal steps per revolution, by default 1024.
    - `tolerance`: if given, steps are adaptive with this relative and absolute tolerance, the latter in units of the
        system's own scale.

    **Returns:** the `method` argument of other functions. **Raises:** `ValueError` for an unknown name, or both `steps`
    and `tolerance`.
    """
    if steps is not None and tolerance is not None:
        raise ArgumentError("steps", "tolerance", said="must not both be given: steps are equal or adaptive.")
    names = EQUAL if tolerance is None else tuple(_ADAPTIVE)
    chosen = names[0] if solver is None else solver
    if chosen not in names:
        steps_are = "equal steps" if tolerance is None else "a tolerance"
        raise ArgumentError("solver", said=f"must be one of {', '.join(names)} with {steps_are}, but is '{chosen}'.")
    if tolerance is None:
        return FixedSteps(chosen, DEFAULT_STEPS if steps is None else steps)
    _require_tolerance(tolerance)
    return AdaptiveSteps(_ADAPTIVE[chosen], tolerance)


def _require_tolerance(tolerance: float) -> None:
    if not 0 < tolerance < 1:
        raise ArgumentError("tolerance", said=f"must lie between 0 and 1, but {tolerance} was given.")


def native(
    tolerance: float = DEFAULT_TOLERANCE, error: float = DEFAULT_ERROR, pair: str = DEFAULT_PAIR
) -> AbstractMethod:
    """Make an integration method in machine code, compiled from the traced law.

    **Arguments:** largest estimated error of a step, relative to the state and to the system's scale; largest measured
    error of a revolution in units of the scale, beyond which a lane is run again with smaller tolerances; embedded
    explicit pair (`tsit5`, `dopri5`, `bosh3`, `dopri8`), or the L-stable `rodas4`, to which lanes that need too many or
    too short explicit steps are switched automatically.

    **Returns:** the `method` argument of other functions. **Raises:** `ValueError` for a tolerance that is not between
    0 and 1, an error that is not positive, and an unknown pair.
    """
    _require_tolerance(tolerance)
    if not error > 0:
        raise ArgumentError("error", said=f"must be positive, but {error} was given.")
    if pair not in PAIRS:
        raise ArgumentError("pair", said=f"must be one of {', '.join(PAIRS)}, but '{pair}' was given.")
    return NativeSteps(tolerance, error, pair)
