"""Methods: a diffrax solver together with how it chooses its steps, and the advance through a part of a revolution."""

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
from .kernel import REVOLUTION, Parts, Pieces, Tangents, can_be_kernel, steps_through
from .layout import PAIRS
from .march import with_tangents
from .outcomes import FINISHED, NOT_FINITE, OTHER, OUTCOMES, OUTSIDE, TOO_MANY
from .solvers import ClassicalRK4, Rodas4


FIRST_STEPS, MOST_STEPS = 64, 100_000
"""The first of adaptive steps is a revolution over so many; and the most of them."""
SHARPER = 1e-2
"""Tolerance of the run that measures errors, as a fraction of the tolerance."""
DEFAULT_TOLERANCE = 1e-6
DEFAULT_ERROR = 3e-3
"""Largest error of a revolution, in units of the system's scale (for a cage: clearances)."""
DEFAULT_PAIR = "tsit5"
IMPLICIT = "rodas4"
"""Method of lanes that take too many or too short steps by an explicit one."""
FINER = 16.0
"""Factor between the tolerances of a run and of the one that confirms it."""


class Stretch(NamedTuple):
    """A lane after a part of a revolution; or many, their axis last."""

    y: State
    peak: Scalar
    """Largest excursion on the way."""
    outcome: Int[Array, "*lanes"]
    """Place in `OUTCOMES`."""
    tangents: tuple[State, ...]


def _evaluate(tau: Any, y: Any, field: Any) -> State:
    return field(tau, y)


TERM = dfx.ODETerm(_evaluate)
"""The diffrax term of every field: the field itself travels as `args`, where solvers can use its structure."""


class AbstractMethod(eqx.Module):
    """How to integrate a field over a part of a revolution."""

    @property
    def allowed(self) -> float:
        """Largest measured error of a revolution that is accepted, in units of the scale."""
        return math.inf

    @property
    def in_jax(self) -> "AbstractMethod":
        """The method that stands for this one inside JAX's programs."""
        return self

    @property
    @abc.abstractmethod
    def reference(self) -> "AbstractMethod":
        """The method beside which the error of this one is measured."""

    @abc.abstractmethod
    def finer(self, times: int = 1) -> "AbstractMethod":
        """The same with steps half as long, or tolerances `FINER` times smaller, `times` over, to confirm it by."""

    @abc.abstractmethod
    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Parts, tangents: Tangents = ()) -> Stretch:
        """Go one `parts`-th of a revolution from state `y` at `phase`, with tangent vectors."""


def _outcome_at(y: State, excursion: Scalar) -> Int[Array, ""]:
    """The outcome of an integration that came to a state."""
    finite = jnp.isfinite(sum(jnp.sum(jnp.abs(c)) for c in y))
    return jnp.where(finite, jnp.where(excursion <= ESCAPE, FINISHED, OUTSIDE), NOT_FINITE)


class FixedSteps(AbstractMethod):
    """The same number of equal steps in every revolution: the strobe map is as smooth as the field."""

    solver: dfx.AbstractSolver
    steps: int | Int[Array, "*levels"]
    """An array where one program is to serve all numbers of steps."""

    def __check_init__(self):
        if not can_be_kernel(self.solver):
            said = "must be `Rodas4`, or explicit with a last stage that is the first of the next step"
            raise ArgumentError("solver", said=f"{said}, but is {type(self.solver).__name__}.")
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
    """Steps chosen by an error estimate relative to the state and to the system's own scale, as diffrax makes them.

    The largest excursion is that of the ends of revolutions, or of their parts."""

    solver: dfx.AbstractAdaptiveSolver
    tolerance: float = eqx.field(static=True)
    """Of the error estimate, relative to the state and to the system's scale; and a lower bound of a measured error."""

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
        return AdaptiveSteps(Rodas4() if self.pair == IMPLICIT else dfx.Tsit5(), self.tolerance)

    @property
    def reference(self) -> "NativeSteps":
        return NativeSteps(SHARPER * self.tolerance, self.error, self.pair)

    @property
    def implicit(self) -> "NativeSteps":
        """The same by the implicit method, for stiff laws."""
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


# `scan_kind="lax"`: outside `diffeqsolve`, diffrax's own solvers are differentiable in forward mode only with this.
_SOLVERS: dict[str, dfx.AbstractAdaptiveSolver] = {
    "rodas4": Rodas4(),
    "rk4": ClassicalRK4(scan_kind="lax"),
    "tsit5": dfx.Tsit5(scan_kind="lax"),
    "kvaerno3": dfx.Kvaerno3(),
    "kvaerno5": dfx.Kvaerno5(),
}
DEFAULT_SOLVER = "rk4"
DEFAULT_STEPS = 1024


def method(solver: str = DEFAULT_SOLVER, steps: int | None = None, tolerance: float | None = None) -> AbstractMethod:
    """An integration method by name.

    **Arguments:**

    - `solver`: `rk4` (classical), `rodas4` (ours, for stiff laws), `tsit5`, `kvaerno3`, `kvaerno5` (diffrax's, of which
        the last two are for stiff laws and have adaptive steps only).
    - `steps`: equal steps per revolution, by default 1024.
    - `tolerance`: if given, steps are adaptive with this relative and absolute tolerance, the latter in units of the
        system's own scale.

    **Raises:** `ValueError` for an unknown name, or both `steps` and `tolerance`.
    """
    if solver not in _SOLVERS:
        raise ArgumentError("solver", said=f"must be one of {', '.join(_SOLVERS)}, but '{solver}' was given.")
    if tolerance is None and not can_be_kernel(_SOLVERS[solver]):
        if steps is not None:
            raise ArgumentError("steps", said=f"must not be given for {solver}, whose steps are adaptive: `tolerance`.")
        tolerance = DEFAULT_TOLERANCE
    if tolerance is None:
        return FixedSteps(_SOLVERS[solver], DEFAULT_STEPS if steps is None else steps)
    if steps is not None:
        raise ArgumentError("steps", "tolerance", said="must not both be given: steps are fixed or adaptive.")
    _require_tolerance(tolerance)
    return AdaptiveSteps(_SOLVERS[solver], tolerance)


def _require_tolerance(tolerance: float) -> None:
    if not 0 < tolerance < 1:
        raise ArgumentError("tolerance", said=f"must lie between 0 and 1, but {tolerance} was given.")


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
    _require_tolerance(tolerance)
    if not error > 0:
        raise ArgumentError("error", said=f"must be positive, but {error} was given.")
    if pair not in PAIRS:
        raise ArgumentError("pair", said=f"must be one of {', '.join(PAIRS)}, but '{pair}' was given.")
    return NativeSteps(tolerance, error, pair)
