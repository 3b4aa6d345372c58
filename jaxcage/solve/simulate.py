"""Time histories at constant speed and through a speed ramp."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least, require_x64, shown
from .._errors import ArgumentError
from .._pytrees import Scalar, State
from ..models import INSTEAD, AbstractForcedSystem, BearingState, bodies_of, require_known, require_speeds, rollers_of
from ..quantities import notebook_html
from .engine import CHUNK, RETRIES, Lanes, errors_of_parts, errors_of_stretches, has_implicit
from .kernel import REVOLUTION
from .method import IMPLICIT, AbstractMethod, FixedSteps, NativeSteps, native
from .outcomes import INACCURATE, OUTCOMES, OUTSIDE, STUCK, TOO_MANY


TOLERANCE = 1e-8
"""Default tolerance of time histories, small because errors grow from sample to sample."""
BEARING_TOLERANCE, BEARING_ERROR = 1e-5, 1e-2
"""Default tolerance for a whole bearing, and largest measured error of a comparable stretch."""
MOST_PARTS = 1000
"""Maximum number of parts between two samples for measuring errors."""
Start = State | BearingState | Float[Array, " dim"] | Float[np.ndarray, " dim"]
"""Initial state [SI]: a tuple of numbers; for a whole bearing an array or a `BearingState`."""


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """Time history that `simulate` and `ramp` return: states in SI units at equally spaced phases, speeds in rad/s;
    with additional integrands also at the end of the last revolution."""

    time: Float[np.ndarray, " n"]
    """Time from the first sample, for a whole bearing from the beginning of the run [s]."""
    tau: Float[np.ndarray, " n"]
    """Phase from the beginning of the run, before any discarded revolutions; for a whole bearing cage angle [rad]."""
    state: Float[np.ndarray, "n dim"]
    """State in SI units; NaN from the sample after a failure."""
    speed: Float[np.ndarray, " n"]
    """Speed at each sample [rad/s]."""
    samples: int
    """Samples per revolution."""
    peak: float
    """Largest excursion from the first sample on, also between samples; for a cage the eccentricity ratio."""
    outcome: str
    """Outcome: `successful`, or the name of a failure."""
    error: float = math.nan
    """Largest error of a stretch that can be compared with a more accurate run (a revolution for a cage), in units of
    the model's scale (clearances for a cage): the sum of the errors of its parts. NaN for a trajectory that was not
    integrated."""
    beside: tuple[str, ...] = ()
    """Names of the additional integrands."""
    integrals: Float[np.ndarray, "points beside"] = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    """Integrals from the beginning of the run, at each sample [SI]."""
    watched: tuple[str, ...] = ()
    """Names of the quantities whose maximum is recorded."""
    peaks: Float[np.ndarray, "parts watched"] = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    """Maxima of the watched quantities between two samples."""
    steps: float = math.nan
    """Mean number of steps per revolution."""

    @property
    def rpm(self) -> Float[np.ndarray, " n"]:
        """Speed at each sample [rpm]."""
        return self.speed * 30 / np.pi

    @property
    def angle(self) -> Float[np.ndarray, " n"]:
        """Rotation angle of the cage of a whole bearing [rad]."""
        return self.integrals[:, self.beside.index("angle")]

    @property
    def rollers(self) -> Float[np.ndarray, "n 5 rollers"]:
        """Roller states of a whole bearing: lag, spin, radius and its rate, orbital speed (`models.Rollers`) [SI]."""
        return rollers_of(self.state)

    @property
    def bodies(self) -> Float[np.ndarray, "n 9"]:
        """States of the cage and inner ring of a whole bearing (`models.Bodies`) [SI]."""
        return bodies_of(self.state)

    @property
    def last(self) -> BearingState:
        """Last state of a whole bearing."""
        return BearingState(*map(jnp.asarray, (self.rollers[-1], self.bodies[-1], self.integrals[-1, :2])))

    def total(self, name: str) -> float:
        """Integral of a quantity over the whole trajectory, by its name in `beside`."""
        i = self.beside.index(name)
        return float(self.integrals[-1, i] - self.integrals[0, i])

    def largest(self, name: str) -> float:
        """Largest value of a quantity, by its name in `watched`."""
        return float(np.max(self.peaks[:, self.watched.index(name)]))

    def __str__(self) -> str:
        away = f"largest excursion {self.peak:.3f}, " if self.peak else ""  # 0 for a system without an edge
        return (
            f"Trajectory of {self.time.size / self.samples:g} revolutions, {self.samples} samples each, "
            f"{self.rpm[0]:.0f} to {self.rpm[-1]:.0f} rpm, {self.outcome}, {away}"
            f"error of a revolution at most {self.error:.0e}"
        )

    _repr_html_ = notebook_html


def _start(system: AbstractForcedSystem, speed: float, start: Start | None) -> np.ndarray:
    """Initial state, followed by the additional integrands."""
    dim = system.dimension
    y0, beside = system.first_state(system.initial_states(jnp.asarray(speed))[0] if start is None else start)
    if y0.shape != (dim,):
        raise ArgumentError("start", said=f"must be a state of {dim} numbers, but has {y0.size}.")
    if not np.all(np.isfinite(y0)):
        raise ArgumentError("start", said=f"must be finite numbers, but {shown(start)} was given.")
    return np.concatenate([y0, beside])


class _Ran(NamedTuple):
    """Results of a run with one method."""

    states: Float[np.ndarray, "1+parts numbers"]
    """States [SI]; NaN after a failure."""
    peaks: Float[np.ndarray, "parts watched"]
    """Maxima in each part; for a model that records the excursion alone, at the first of the parts run at once."""
    errors: Float[np.ndarray, " stretches"]
    code: int
    steps: float
    """Number of steps tried."""


def _run(lanes: Lanes, samples: int, stretch: int, start: np.ndarray, method: AbstractMethod) -> _Ran:
    """Run parts one after the other, each a lane at its own speed: `samples` per revolution, and one error for every
    `stretch` of them."""
    n, speed = lanes.speed.size, lanes.speed
    every, begin = np.arange(n), np.arange(n) % samples
    engine = lanes.engine(0, method, samples)
    scale, (excursion, *_) = lanes.begin(every, np.broadcast_to(start, (n, start.size)))
    y, peaks = np.full((n + 1, start.size), np.nan), np.full((n, len(lanes.system.watched)), np.nan)
    y[0], code = start, 0 if excursion <= 1 or lanes.system.beside else OUTSIDE
    step, done, steps = None, 0, 0.0
    while done < n and code == 0:  # a whole revolution at a time if its speed is constant
        some = samples if done + samples <= n and speed[done + samples - 1] == speed[done] else 1
        at, first = lanes.at(every[done : done + 1]), y[done : done + 1] / scale[done]
        ran = engine(at, first, some, some, method, step=step, begin=begin[done : done + 1])
        y[done + 1 : done + 1 + some], code = ran.strobe[0] * scale[done], int(ran.outcome[0])
        step, steps = ran.step if ran.step[0] else step, steps + float(ran.steps[0])
        peaks[done : done + ran.peaks.shape[1]], done = ran.peaks[0], done + some
    if done == 0:
        y[0] = np.nan  # the initial state is not allowed
    ends = np.flatnonzero(np.all(np.isfinite(y[1:]), axis=1))
    apart = np.zeros(n)
    for some in np.split(ends, range(CHUNK, ends.size, CHUNK)) if ends.size else ():
        states = np.stack([y[some], y[some + 1]], axis=1) / scale[some, None]
        apart[some] = errors_of_parts(engine, lanes.at(some), states, method, begin=begin[some])[:, 0]
    return _Ran(y, peaks, errors_of_stretches(apart, stretch, method), code, steps)


def _methods(method: AbstractMethod, system: AbstractForcedSystem) -> Iterator[AbstractMethod]:
    """Methods to try in turn: the method, finer ones, and implicit ones."""
    every = [method]
    if isinstance(method, NativeSteps) and has_implicit(system) and method.pair != IMPLICIT:
        every.append(method.implicit)
    times = range(1 + RETRIES) if math.isfinite(method.allowed) else range(1)
    return (each.finer(k) for each in every for k in times)


def simulate(
    system: AbstractForcedSystem,
    speed: Scalar,
    *,
    revolutions: int,
    samples: int = 64,
    discard: int = 0,
    start: Start | None = None,
    method: AbstractMethod | None = None,
) -> Trajectory:
    """Simulate a time history at one speed.

    **Arguments:** system, such as a model; speed [rad/s] (of the shaft for a whole bearing); revolutions recorded, and
    discarded before (of the cage for a whole bearing); samples per revolution, which must divide the steps per
    revolution of a method with fixed steps; initial state, by default the model's first one; integration method, by
    default `jaxcage.native(1e-8)`, for a whole bearing `jaxcage.native(1e-5, 1e-2)`.

    **Returns:** `Trajectory`; a run that fails, or is `inaccurate`, is NaN from there on, with the reason in `outcome`.
    If the cage of a whole bearing comes to rest, or leaves its land, the outcome is `outside`.

    **Raises:** `ValueError` for a speed that is not positive, or impossible counts; `RuntimeError` without double
    precision.
    """
    require_x64()
    require_known("simulate", INSTEAD, system=system, speed=speed, start=start)
    options: dict[str, Any] = dict(revolutions=revolutions, samples=samples, discard=discard)
    return ramp(system, speed, speed, **options, start=start, method=method)  # a ramp with equal ends


def ramp(
    system: AbstractForcedSystem,
    first: Scalar,
    last: Scalar,
    *,
    revolutions: int,
    samples: int = 64,
    discard: int = 0,
    start: Start | None = None,
    method: AbstractMethod | None = None,
) -> Trajectory:
    """Simulate a speed ramp, in which the speed changes by the same amount in every revolution.

    Within a revolution the speed changes in `samples` steps or more. The tangential force M e dw/dt of the unbalance is
    neglected: its ratio to M e w^2 is the relative change of speed per radian.

    **Arguments:** system; first and last speed [rad/s]; revolutions of the whole ramp; `discard`, revolutions at the
    first speed before it, which are left out; the rest as in `simulate`.

    **Returns:** `Trajectory` with the speed of each sample. **Raises:** as `simulate`.
    """
    require_x64()
    require_known("ramp", INSTEAD, system=system, first=first, last=last, start=start)
    low, high = float(first), float(last)
    require_speeds(system, (low, high))
    require_at_least(1, revolutions=revolutions, samples=samples)
    require_at_least(0, discard=discard)
    default = native(BEARING_TOLERANCE, BEARING_ERROR) if system.beside else native(TOLERANCE)
    chosen = default if method is None else method
    if isinstance(chosen, FixedSteps) and chosen.steps % samples:
        said = f"must divide the {chosen.steps} steps per revolution of the method, but is {samples}."
        raise ArgumentError("samples", said=said)
    rise = (high - low) / revolutions
    numbers = np.arange(-discard, revolutions)
    rises = np.where(numbers < 0, 0.0, rise)
    first_of = low + rise * np.maximum(numbers, 0)
    comparable = min(system.comparable(low), system.comparable(high))
    parts = min(max(1, math.ceil(REVOLUTION / samples / comparable - 1e-9)), MOST_PARTS)  # between two samples
    places = samples * parts
    speeds = (first_of[:, None] + rises[:, None] * ((np.arange(places) + 0.5) / places)).ravel()
    stretch = max(1, round(comparable * places / REVOLUTION))
    lanes, y0 = Lanes.of([system], speeds), _start(system, low, start)
    runs = (_run(lanes, places, stretch, y0, each) for each in _methods(chosen, system))
    served = lambda ran: ran.code not in (STUCK, TOO_MANY) and not np.any(ran.errors > chosen.allowed)
    first_run = next(runs)
    ran = first_run if served(first_run) else next(filter(served, runs), first_run)
    states, code = ran.states.copy(), ran.code
    if np.any(bad := ran.errors > chosen.allowed):  # states after a stretch with too large an error are not known
        states[int(np.argmax(bad)) * stretch + 1 :] = np.nan
        code = code or INACCURATE

    grid, dim = np.arange(samples) / samples, system.dimension
    speed = (first_of[:, None] + rise * grid).ravel()[discard * samples :]
    tau = REVOLUTION * (np.arange(first_of.size)[:, None] + grid).ravel()[discard * samples :]
    spent = REVOLUTION / samples / (speed[:-1] + 0.5 * rise / samples)
    time, states = np.concatenate([[0.0], np.cumsum(spent)]), states[discard * places :: parts]
    if system.beside:
        tau, speed = np.append(tau, tau[-1] + REVOLUTION / samples), np.append(speed, high)
        time = states[:, dim + system.beside.index("time")]
    else:
        states = states[:-1]
    excursion = lanes.begin(np.arange(speeds.size), ran.states[:-1])[1][::places]
    peak = float(np.fmax.reduce([*ran.peaks[discard * places :, -1], *excursion[discard:]]))
    known = time, tau, states[:, :dim], speed, samples, peak, OUTCOMES[code], float(ran.errors.max())
    return Trajectory(
        *known,
        beside=system.beside,
        integrals=states[:, dim:],
        watched=system.watched,
        peaks=np.fmax.reduce(ran.peaks[discard * places :].reshape(-1, parts, len(system.watched)), axis=1),
        steps=ran.steps / first_of.size,
    )
