"""Time histories at constant speed and through a speed ramp, both made of parts of the strobe map's revolution."""

import dataclasses
import math
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._arguments import require_at_least, shown
from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from .._types import Scalar, State
from ..models import INSTEAD, AbstractForcedSystem, require_known, require_speeds
from ..solve import FIRST_STEP
from ._engine import CHUNK, RETRIES, SURE, Lanes, cores
from ._method import REVOLUTION, AbstractMethod, FixedSteps
from ._native import IMPLICIT, NativeSteps, native
from ._results import INACCURATE, OUTCOMES, codes_of


TOLERANCE = 1e-8
"""Of time histories, if nothing else is asked for: what is lost in one sample grows from there to the next."""
SERVED_BADLY = [OUTCOMES.index(name) for name in ("dt_min_reached", "max_steps_reached")]


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """States at equally spaced phases."""

    time: Float[np.ndarray, " n"]
    """Time from the first sample [s]."""
    tau: Float[np.ndarray, " n"]
    """Phase [rad], 0 at the beginning of the run (before any discarded revolutions)."""
    state: Float[np.ndarray, "n dim"]
    """State in SI units; NaN from the sample after a failure."""
    speed: Float[np.ndarray, " n"]
    """Speed at each sample [rad/s]."""
    samples: int
    """Samples per revolution."""
    peak: float
    """Largest excursion of the first sample and at any step after it, between the samples too; for a cage eps."""
    outcome: str
    """`successful`, or the name of what went wrong."""
    error: float = math.nan
    """Largest error of a revolution, in units of the system's scale (for a cage: clearances): how far the ends of its
    parts move, in all, by a method that is more exact. NaN for a trajectory that no integration has made."""

    @property
    def rpm(self) -> Float[np.ndarray, " n"]:
        """Speed in revolutions per minute."""
        return self.speed * 30 / np.pi

    def __str__(self) -> str:
        revolutions = self.time.size / self.samples
        return (
            f"Trajectory of {revolutions:g} revolutions, {self.samples} samples each, "
            f"{self.rpm[0]:.0f} to {self.rpm[-1]:.0f} rpm, {self.outcome}, largest excursion {self.peak:.3f}, "
            f"error of a revolution at most {self.error:.0e}"
        )

    _repr_html_ = notebook_html


def _start(system: AbstractForcedSystem, speed: float, start: State | None) -> State:
    y0 = system.starts(jnp.asarray(speed))[0] if start is None else start
    if len(y0) != system.dimension:
        raise ArgumentError("start", said=f"must be a state of {system.dimension} numbers, but has {len(y0)}.")
    if not np.all(np.isfinite(np.asarray(y0, dtype=float))):
        raise ArgumentError("start", said=f"must be finite numbers, but {shown(y0)} was given.")
    return tuple(jnp.asarray(c, dtype=float) for c in y0)


def require_counts(revolutions: int, samples: int, discard: int) -> None:
    """**Raises:** `ValueError` for what no history can have."""
    require_at_least(1, revolutions=revolutions, samples=samples)
    require_at_least(0, discard=discard)


def _require_divides(method: AbstractMethod, samples: int) -> None:
    """**Raises:** `ValueError` for samples that equal steps do not meet."""
    if isinstance(method, FixedSteps) and method.steps % samples:
        raise ArgumentError(
            "samples", said=f"must divide the {method.steps} steps per revolution of the method, but is {samples}."
        )


class _Ran(NamedTuple):
    """Whole revolutions by one method."""

    states: Float[np.ndarray, "1+samples dim"]
    """[SI]; NaN after a failure."""
    peaks: Float[np.ndarray, " revolutions"]
    errors: Float[np.ndarray, " revolutions"]
    code: int


def _run(lanes: Lanes, start: np.ndarray, samples: int, method: AbstractMethod) -> _Ran:
    """The lanes one after the other, each over one sample of a revolution at its own speed."""
    n, speed = lanes.speed.size, lanes.speed
    every, begin = np.arange(n), np.arange(n) % samples
    engine = lanes.engine(0, method, samples)
    numbers = lanes.numbers(engine, every)
    scale, (excursion, *_) = lanes.begin(every, np.broadcast_to(start, (n, start.size)))
    y, peaks = np.full((n + 1, start.size), np.nan), np.full(-(-n // samples), np.nan)
    y[0], code = start, 0 if excursion <= 1 else OUTCOMES.index("outside")
    step, done = np.array([FIRST_STEP]), 0
    while done < n and code == 0:  # of a speed that does not change a revolution at a time
        some = samples if speed[min(done + samples, n) - 1] == speed[done] and done + samples <= n else 1
        at = engine.picked(numbers, every[done : done + 1])
        ran = engine(at, y[done : done + 1] / scale[done], some, some, method, step=step, begin=begin[done : done + 1])
        y[done + 1 : done + 1 + some], code = ran.strobe[0] * scale[done], int(codes_of(ran.mark)[0])
        k, step = done // samples, ran.step if ran.step[0] else step
        peaks[k], done = np.nanmax([peaks[k], ran.peak[0]]), done + some
    if done == 0:
        y[0] = np.nan  # it may not start there
    peaks = np.maximum(peaks, lanes.begin(every[::samples], y[:-1:samples])[1])
    whole = np.flatnonzero(np.all(np.isfinite(y[1:]), axis=1))
    apart = np.zeros(n)
    for some in np.split(whole, range(CHUNK, whole.size, CHUNK)) if whole.size else ():
        at, starts = engine.picked(numbers, some), y[some] / scale[some]
        again = engine(at, starts, 1, 1, method.reference, threads=cores(), begin=begin[some]).state
        apart[some] = SURE * np.max(np.abs(again - y[some + 1] / scale[some]), axis=1)
    least = getattr(method, "tolerance", 0.0)
    errors = np.maximum(np.pad(apart, (0, -n % samples)).reshape(-1, samples).sum(axis=1), least)
    return _Ran(y, peaks, errors, code)


def _tried(lanes: Lanes, start: np.ndarray, samples: int, method: AbstractMethod) -> _Ran:
    """The run by the method, or by a finer one where its error is too large, or an implicit one where that serves."""
    again = [method.finer(k) for k in range(1, RETRIES + 1)] if math.isfinite(method.allowed) else []
    if isinstance(method, NativeSteps) and method.pair != IMPLICIT:
        again += [method.implicit, *(method.implicit.finer(k) for k in range(1, RETRIES + 1))]
    served = lambda ran: ran.code not in SERVED_BADLY and not np.any(ran.errors > method.allowed)
    first = ran = _run(lanes, start, samples, method)
    while not served(ran) and again:
        ran = _run(lanes, start, samples, again.pop(0))
    return ran if served(ran) else first


def _trajectory(ran: _Ran, speeds: np.ndarray, rise: float, samples: int, discard: int, allowed: float) -> Trajectory:
    grid = np.arange(samples) / samples
    speed = (speeds[:, None] + rise * grid).ravel()[discard * samples :]
    tau = REVOLUTION * (np.arange(speeds.size)[:, None] + grid).ravel()[discard * samples :]
    step = REVOLUTION / samples
    time = np.concatenate([[0.0], np.cumsum(step / (speed[:-1] + 0.5 * rise / samples))])
    state, code = ran.states[:-1].copy(), ran.code
    if np.any(bad := ran.errors > allowed):
        state[int(np.argmax(bad)) * samples + 1 :] = np.nan
        code = code or INACCURATE
    peak = float(np.nanmax(ran.peaks[discard:], initial=-np.inf))
    peak = peak if np.isfinite(peak) else math.nan
    return Trajectory(
        time, tau, state[discard * samples :], speed, samples, peak, OUTCOMES[code], float(ran.errors.max())
    )


def simulate(
    system: AbstractForcedSystem,
    speed: Scalar,
    *,
    revolutions: int,
    samples: int = 64,
    discard: int = 0,
    start: State | None = None,
    method: AbstractMethod | None = None,
) -> Trajectory:
    """Time history at one speed.

    **Arguments:** system; speed [rad/s]; revolutions recorded and discarded before; samples per revolution (they must
    divide the steps per revolution of a method with fixed steps); initial state, by default the system's first start;
    integration method, by default `jaxcage.native(1e-8)`.

    **Returns:** `Trajectory`; a run that fails, or is `inaccurate`, is NaN from there on and says why in `outcome`.

    **Raises:** `ValueError` for a speed that is not positive, or impossible counts.
    """
    require_x64()
    require_known("simulate", INSTEAD, system, speed, start)
    options: dict[str, Any] = dict(revolutions=revolutions, samples=samples, discard=discard)
    return ramp(system, speed, speed, **options, start=start, method=method)  # one that does not rise


def ramp(
    system: AbstractForcedSystem,
    first: Scalar,
    last: Scalar,
    *,
    revolutions: int,
    samples: int = 64,
    discard: int = 0,
    start: State | None = None,
    method: AbstractMethod | None = None,
) -> Trajectory:
    """Time history of a true speed ramp: the speed changes continuously, by the same amount in every revolution.

    Within a revolution the speed rises in `samples` steps. The tangential force M e dw/dt of the unbalance is left out:
    its ratio to M e w^2 is the relative change of speed in one radian.

    **Arguments:** system; first and last speed [rad/s]; number of revolutions of the whole ramp; `discard`:
    revolutions at the first speed before it, which are left out; the rest as in `simulate`.

    **Returns:** `Trajectory` with the speed of each sample.
    """
    require_x64()
    require_known("ramp", INSTEAD, system, first, last, start)
    low, high = float(first), float(last)
    require_speeds(system, (low, high))
    require_counts(revolutions, samples, discard)
    chosen = native(TOLERANCE) if method is None else method
    _require_divides(chosen, samples)
    rise = (high - low) / revolutions
    numbers = np.arange(-discard, revolutions)
    rises = np.where(numbers < 0, 0.0, rise)
    first_of = low + rise * np.maximum(numbers, 0)
    speeds = (first_of[:, None] + rises[:, None] * ((np.arange(samples) + 0.5) / samples)).ravel()
    start_at = np.array([float(c) for c in _start(system, low, start)])
    ran = _tried(Lanes.of([system], speeds), start_at, samples, chosen)
    return _trajectory(ran, first_of, rise, samples, discard, chosen.allowed)
