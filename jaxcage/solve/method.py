"""Methods: a diffrax solver together with how it chooses its steps, and the advance through a part of a revolution."""

import abc
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Int

from .._errors import ArgumentError
from .._types import Scalar, State
from ..models import (
    ESCAPE,
    AbstractField,
    AbstractLinearisation,
    ScaledField,
    divide,
    multiply,
)
from .kernel import REVOLUTION, Pieces, can_be_kernel, steps_through
from .layout import PAIRS
from .outcomes import RESULTS, outcome_code
from .solvers import ClassicalRK4, NewmarkBeta, Rodas3, Rodas4
from .steps import with_tangents


FIRST_STEPS = 64
"""The first of adaptive steps is a revolution over so many."""
MOST_WATCHED = 4096
"""Most adaptive steps from sample to sample, where values of each step are stored."""
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
    """A part of a revolution: where it ended, how far out it went on the way, and how it went."""

    y: State
    peak: Scalar
    result: RESULTS


Tangents = tuple[State, ...]


class Moved(NamedTuple):
    """A lane after a revolution; or many, their axis last."""

    y: State
    tangents: Tangents
    peak: Scalar
    """Largest excursion on the way."""
    outcome: Int[Array, "*lanes"]


def moved_by(advance: Callable[[Any], Stretch], start: Any, tangents: Sequence[Any]) -> Moved:
    """One lane moved by `advance` from its start, the tangent vectors there by the derivative of that."""

    def move(start: Any) -> tuple[State, tuple[Any, ...]]:
        stretch = advance(start)
        return stretch.y, (jnp.asarray(stretch.peak, dtype=float), outcome_code(stretch.result))

    y, after, (peak, code) = with_tangents(move, start, tangents)
    return Moved(y, after, peak, code)


def _evaluate(tau: Any, y: Any, field: Any) -> State:
    return field(tau, y)


def _nothing(tau: Any, y: Any, field: Any) -> State:
    del tau, field
    return tuple(jnp.zeros_like(c) for c in y)


TERM = dfx.ODETerm(_evaluate)
"""The diffrax term of every field: the field itself travels as `args`, where solvers can use its structure."""
ALL_IMPLICIT = dfx.MultiTerm(dfx.ODETerm(_nothing), TERM)
"""The same for solvers that split their terms: everything in the implicit one."""


def _term(solver: dfx.AbstractSolver) -> Any:
    return ALL_IMPLICIT if isinstance(solver, dfx.KenCarp3 | dfx.KenCarp4 | dfx.KenCarp5) else TERM


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
        """The same with steps at most half as long, `times` over, for what it is to be confirmed by."""

    @abc.abstractmethod
    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Int[Array, ""] | Scalar) -> Stretch:
        """Go one `parts`-th of a revolution from state `y` at `phase`."""


def result_at(result: Any, y: State, excursion: Scalar, limit: Scalar) -> RESULTS:
    """The result of a state that a solver returned with one of diffrax's results."""
    finite = jnp.isfinite(sum(jnp.sum(jnp.abs(c)) for c in y))
    state = RESULTS.where(excursion <= limit, RESULTS.successful, RESULTS.outside)  # pyright: ignore
    state = RESULTS.where(finite, state, RESULTS.not_finite)  # pyright: ignore
    if result is dfx.RESULTS.successful:  # what is known to be well is not promoted: that takes ten small programs
        return state  # pyright: ignore
    before = RESULTS.promote(result)
    return RESULTS.where(before == RESULTS.successful, state, before)  # pyright: ignore


def run_steps(
    solver: dfx.AbstractSolver,
    steps: Int[Array, ""] | int,
    pieces: Pieces,
    y: State,
    phase: Scalar,
    parts: Int[Array, ""] | Scalar,
) -> Stretch:
    """One `parts`-th of a revolution of so many equal steps, in a single lane."""
    if isinstance(steps, int) and isinstance(parts, int):
        if steps % parts:
            raise ArgumentError("parts", said=f"must divide the {steps} steps per revolution, but it is {parts}.")
    if can_be_kernel(solver):
        y, peak, result, _ = steps_through(solver, steps, pieces, y, phase=phase, parts=parts)
        return Stretch(y, peak, result_at(result, y, peak, ESCAPE))
    return _by_solver(solver, steps // parts, REVOLUTION / jnp.asarray(steps, dtype=float), pieces, y, phase)


def _by_solver(solver: Any, count: Any, h: Scalar, pieces: Pieces, y: State, phase: Scalar) -> Stretch:
    """The same with a diffrax solver's own step."""
    field, system, scale = pieces
    term = _term(solver)
    if isinstance(solver, dfx.AbstractImplicitSolver):  # its Newton tolerance is one number for all components
        field, y = ScaledField(field, scale), divide(y, scale)
        unscale = lambda state: multiply(state, scale)
    else:
        unscale = lambda state: state

    def step(i: Array, carry: tuple) -> tuple:
        y, peak, result, state = carry
        t0 = phase + i.astype(float) * h
        y, _, _, state, outcome = solver.step(term, t0, t0 + h, y, field, state, False)
        if outcome is not dfx.RESULTS.successful:  # solvers that cannot fail say so without tracing anything
            result = dfx.RESULTS.where(result == dfx.RESULTS.successful, outcome, result)
        excursion = jax.lax.stop_gradient(jnp.asarray(system.excursion(unscale(y))))
        return y, jnp.maximum(peak, excursion), result, state  # the maximum keeps a NaN

    state = solver.init(term, phase, phase + h, y, field)
    start = (y, jnp.zeros(()), dfx.RESULTS.successful, state)
    y, peak, result, _ = jax.lax.fori_loop(0, count, step, start)
    y = unscale(y)
    return Stretch(y, peak, result_at(result, y, peak, ESCAPE))


class BesideField(AbstractField):
    """The field of a model whose quantities beside the state are integrated too: a state is (state, those), arrays."""

    field: Any

    def __call__(self, tau: Scalar, y: Any) -> Any:
        rates, beside, _ = self.field.rates_beside(*y)
        return rates, beside

    def linearise(self, tau: Scalar, y: Any) -> AbstractLinearisation:
        raise ArgumentError(
            "method", said="must be explicit for a whole bearing, such as `native()`, but is a Rosenbrock method."
        )

    def watch(self, y: Any) -> Array:
        """Values of the quantities that are watched."""
        return self.field.rates_beside(*y)[2]


class FixedSteps(AbstractMethod):
    """The same number of equal steps in every revolution: the strobe map is as smooth as the field."""

    solver: dfx.AbstractSolver
    steps: int | Int[Array, "*levels"]
    """An array where one program is to serve all numbers of steps."""

    def __check_init__(self):
        if isinstance(self.steps, int) and self.steps < 1:
            raise ArgumentError("steps", said=f"must be at least 1 per revolution, but {self.steps} was given.")

    @property
    def reference(self) -> "FixedSteps":
        return self.finer()

    def finer(self, times: int = 1) -> "FixedSteps":
        """With twice the steps, `times` over."""
        return FixedSteps(self.solver, self.steps << times)

    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Int[Array, ""] | Scalar) -> Stretch:
        return run_steps(self.solver, self.steps, pieces, y, phase, parts)


class AdaptiveSteps(AbstractMethod):
    """Steps chosen by an error estimate relative to the state and to the system's own scale, as diffrax makes them.

    The largest excursion is that of the ends of revolutions, or of their parts."""

    solver: dfx.AbstractAdaptiveSolver
    rtol: float = eqx.field(static=True, default=1e-6)
    atol: float = eqx.field(static=True, default=1e-6)
    max_steps: int = eqx.field(static=True, default=100_000)

    @property
    def tolerance(self) -> float:
        """Lower bound of a measured error."""
        return self.atol

    @property
    def reference(self) -> "AdaptiveSteps":
        return self._with(SHARPER)

    def finer(self, times: int = 1) -> "AdaptiveSteps":
        """With tolerances 16 times smaller, `times` over."""
        return self._with(16.0**-times)

    def _with(self, factor: float) -> "AdaptiveSteps":
        return AdaptiveSteps(self.solver, factor * self.rtol, factor * self.atol, self.max_steps)

    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Int[Array, ""] | Scalar) -> Stretch:
        field: Any = pieces.field
        system, scale = pieces.system, pieces.scale
        length = REVOLUTION / jnp.asarray(parts, dtype=float)
        watches = isinstance(field, BesideField)
        saved, norm, most = dfx.SubSaveAt(t1=True), optx.rms_norm, self.max_steps
        if watches:  # at each step, and errors of the state alone control the steps
            seen = dfx.SubSaveAt(steps=True, fn=lambda t, y, args: field.watch(multiply(y, scale)))
            saved, norm, most = (saved, seen), lambda y: jnp.max(jnp.abs(y[0])), min(most, MOST_WATCHED)
        solution = dfx.diffeqsolve(
            _term(self.solver),
            self.solver,
            t0=phase,
            t1=phase + length,
            dt0=jnp.minimum(REVOLUTION / FIRST_STEPS, length),
            y0=divide(y, scale),
            args=ScaledField(field, scale),
            stepsize_controller=dfx.PIDController(self.rtol, self.atol, pcoeff=0.3, icoeff=0.4, norm=norm),
            saveat=dfx.SaveAt(subs=saved),
            adjoint=dfx.ForwardMode(),
            max_steps=most,
            throw=False,
        )
        assert solution.ys is not None
        if watches:
            ends, watched = solution.ys
            y = field.field.settled_row(*multiply(tuple(c[-1] for c in ends), scale))
            peaks = jnp.max(jnp.where(jnp.isfinite(watched), watched, -jnp.inf), axis=0)
            return Stretch(y, peaks, result_at(solution.result, y, peaks[0], ESCAPE))
        y = multiply(tuple(c[-1] for c in solution.ys), scale)
        excursion = jax.lax.stop_gradient(jnp.asarray(system.excursion(y), dtype=float))
        return Stretch(y, excursion, result_at(solution.result, y, excursion, ESCAPE))


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

    def advance(self, pieces: Pieces, y: State, phase: Scalar, parts: Int[Array, ""] | Scalar) -> Stretch:
        return self.in_jax.advance(pieces, y, phase, parts)

    def finer(self, times: int = 1) -> "NativeSteps":
        """The same with tolerances 16 times smaller, `times` over."""
        factor = FINER**-times
        return NativeSteps(factor * self.tolerance, factor * self.error, self.pair)

    def __str__(self) -> str:
        return (
            f"machine code, {self.pair} with a tolerance of {self.tolerance:.2g}, error of a revolution at most "
            f"{self.error:.2g}"
        )


# `scan_kind="lax"`: outside `diffeqsolve`, diffrax's own solvers are differentiable in forward mode only with this.
_EXPLICIT: dict[str, Any] = {"scan_kind": "lax"}
# Newton instead of diffrax's VeryChord, which with equal steps calls it divergence when it starts at the solution.
_IMPLICIT: dict[str, Any] = {"scan_kind": "lax", "root_finder": optx.Newton(rtol=1e-8, atol=1e-8)}
_SOLVERS: dict[str, tuple[type[dfx.AbstractSolver], dict[str, Any]]] = {
    "rodas3": (Rodas3, {}),
    "rodas4": (Rodas4, {}),
    "newmark": (NewmarkBeta, {}),
    "rk4": (ClassicalRK4, _EXPLICIT),
    "tsit5": (dfx.Tsit5, _EXPLICIT),
    "kvaerno3": (dfx.Kvaerno3, _IMPLICIT),
    "kvaerno5": (dfx.Kvaerno5, _IMPLICIT),
    "kencarp4": (dfx.KenCarp4, _IMPLICIT),
}
"""By name, with the options that equal steps need."""
_ADAPTIVE = {name: kind for name, (kind, _) in _SOLVERS.items() if issubclass(kind, dfx.AbstractAdaptiveSolver)}
DEFAULT_SOLVER = "rk4"
DEFAULT_STEPS = 1024


def make_fixed(solver: str, steps: int) -> FixedSteps:
    """Equal steps of a solver by name.

    **Raises:** `ValueError` for a name that is not known.
    """
    if solver not in _SOLVERS:
        raise ArgumentError("solver", said=f"must be one of {', '.join(_SOLVERS)}, but '{solver}' was given.")
    kind, options = _SOLVERS[solver]
    return FixedSteps(kind(**options), steps)


def method(solver: str = DEFAULT_SOLVER, steps: int | None = None, tolerance: float | None = None) -> AbstractMethod:
    """An integration method by name.

    **Arguments:**

    - `solver`: `rodas3`, `rodas4` (ours, structured), `rk4` (classical), `newmark` (the paper's), `tsit5`, `kvaerno3`,
        `kvaerno5`, `kencarp4` (diffrax's).
    - `steps`: equal steps per revolution, by default 1024.
    - `tolerance`: if given, steps are adaptive with this relative and absolute tolerance, the latter in units of the
        system's own scale.

    **Raises:** `ValueError` for an unknown name, or both `steps` and `tolerance`.
    """
    if tolerance is None:
        return make_fixed(solver, DEFAULT_STEPS if steps is None else steps)
    if solver not in _ADAPTIVE:
        raise ArgumentError("solver", said=f"must be one of {', '.join(_ADAPTIVE)}, but '{solver}' was given.")
    if steps is not None:
        raise ArgumentError("steps", "tolerance", said="must not both be given: steps are fixed or adaptive.")
    if not 0 < tolerance < 1:
        raise ArgumentError("tolerance", said=f"must lie between 0 and 1, but {tolerance} was given.")
    return AdaptiveSteps(_ADAPTIVE[solver](), tolerance, tolerance)


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
