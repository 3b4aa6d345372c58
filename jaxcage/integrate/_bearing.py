"""Time histories of the whole bearing: over the cage's angle, with slips, forces and losses; or over time."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._checks import require_x64
from .._errors import ArgumentError
from .._form import compiled
from .._types import Scalar
from ..models.whole import (
    LEDGER,
    MEANS,
    PEAKS,
    BearingAtSpeed,
    BearingModel,
    BearingState,
    rolling_start,
    state_scale,
)
from ..solve import INTEGRATED, STUCK, WATCHED, BearingLimits, Bearings, March
from ._bearing_pace import FIRST, LONGEST, SHORTEST, STALLED, TURN, slowness
from ._implicit import film_rate
from ._lanes import By, Controls, Lanes, advance, begin
from ._results import INACCURATE, OUTCOMES, codes_of
from ._simulate import require_counts


SLOWEST = 0.01
"""Least speed of the cage in pure rolling over that of the faster ring: of rings that turn against each other it may
hardly turn, and a revolution of it takes for ever."""
IMBALANCE = 1e-6
"""Of the load, by which a quasi-static ring may be out of balance."""
SHORT = 2
"""Periods of a loaded roller's vibration on its raceway: of slow shafts, parts no longer than these are compared."""
MOST_PARTS = 1000
"""From sample to sample."""
STIFF = 600.0
"""Steps are implicit where the film damps the cage at so many times the rate of a loaded roller on its raceway. An
implicit step takes as long as some thirty explicit ones in machine code (0.4 ms; 12 us)."""
CHOICES = 16
"""In a revolution: so often it is asked whether steps are to be implicit, of as many samples or a multiple."""
HALF = 16.0
"""A tolerance so many times larger makes steps of fourth order about twice as long."""
FINER = 1 / 32
"""A tolerance so many times as large makes steps in machine code, of fifth order, about half as long."""
SURE = 3.0
"""The stated error of steps in machine code, as a multiple of the difference to shorter ones."""
MOST_STEPS_OF_ALL = 200_000.0
"""From sample to sample."""


@dataclasses.dataclass(frozen=True)
class BearingRun:
    """A run of a whole bearing: samples at equal angles of the cage, or at given times, and integrals between them."""

    time: Float[np.ndarray, " n"]
    """[s]."""
    angle: Float[np.ndarray, " n"]
    """Of the cage [rad]."""
    rollers: Float[np.ndarray, "n 5 rollers"]
    """Lag, spin, radius and its rate, orbital speed: rows as in `jaxcage.models.whole.Rollers`, SI."""
    bodies: Float[np.ndarray, "n 9"]
    """Cage and inner ring, as in `jaxcage.models.whole.Bodies`, SI."""
    integrals: Float[np.ndarray, "n integrals"]
    """At each sample, from the beginning: energies [J] and others as in `LEDGER` and `MEANS`."""
    peaks: Float[np.ndarray, "parts peaks"]
    """Largest values between two samples, as in `PEAKS`."""
    outcome: str
    """`successful`, or the name of what went wrong."""
    error: float
    """Three times how far the state at a sample moves if it is reached from the one before it by about twice the steps
    (of a run inside JAX how far, by about half as many), in units of `jaxcage.models.whole.state_scale`: the largest of
    all parts of the state and all samples. Of slow shafts, where motions diverge from sample to sample, the same from
    place to place between them."""
    steps: float
    """Mean number of steps of a revolution (or of the whole stretch of time)."""
    implicit_share: float
    """Part of the run that was made by implicit steps."""

    @property
    def last(self) -> BearingState:
        """The state at the end."""
        clock = np.array([self.angle[-1], self.time[-1]])
        return BearingState(*map(jnp.asarray, (self.rollers[-1], self.bodies[-1], clock)))

    def total(self, name: str) -> float:
        """An integral over the whole run, by its name."""
        i = (*LEDGER, *MEANS).index(name)
        return float(self.integrals[-1, i] - self.integrals[0, i])

    def largest(self, name: str) -> float:
        """The largest value of a quantity that is followed, by its name."""
        return float(np.max(self.peaks[:, PEAKS.index(name)]))


@compiled
def _begun(model: BearingModel, speed: Scalar, state: BearingState, step: Scalar) -> Lanes:
    """Two lanes of the same: one runs by steps of the tolerance, the other by about half as many."""
    states = jax.tree.map(lambda x: jnp.stack([jnp.asarray(x, dtype=float)] * 2, axis=-1), state)
    return begin(model.at_speed(speed), states, step)


@compiled
def _run(
    model: BearingModel,
    speed: Scalar,
    lanes: Lanes,
    spans: Float[Array, " parts"],
    limits: tuple[Scalar, Scalar, Scalar],
    tolerance: Scalar,
    by: By,
    implicit: bool,
) -> tuple[Lanes, tuple[Array, ...]]:
    """One span after the other; what there was at each end, peaks, errors and steps between."""
    at, scale = model.at_speed(speed), state_scale(model, speed)
    slowest = jnp.abs(at.rolling_cage_speed) * (STALLED if by == "angle" else 0.0)
    controls = Controls(tolerance * jnp.array([1.0, HALF]), limits[1], limits[2], slowest)

    def part(lanes: Lanes, span: Array) -> tuple[Lanes, tuple[Array, ...]]:
        together = lambda x: jnp.stack([x[..., 0]] * 2, axis=-1)
        fresh = lanes._replace(
            packed=together(lanes.packed),
            rates=together(lanes.rates),
            peaks=jnp.full_like(lanes.peaks, -jnp.inf),
            steps=0 * lanes.steps,
            error=0 * lanes.error,
            outcome=together(lanes.outcome),
        )
        failed = (fresh.outcome != 0) & (fresh.outcome != INACCURATE)
        after = advance(at, scale, fresh, jnp.where(failed, 0.0, span), controls, by, implicit)
        apart = jax.tree.map(lambda x, s: jnp.max(jnp.abs(x[..., 0] - x[..., 1]) / s), after.state, scale)
        error = jnp.maximum(apart.rollers, apart.bodies)
        return after, (after.packed[:, 0], after.peaks[:, 0], error, after.steps[0])

    return jax.lax.scan(part, lanes, spans)


@compiled
def _film_is_stiff(model: BearingModel, speed: Scalar, state: BearingState) -> Array:
    """True if implicit steps pay from here on."""
    scale = state_scale(model, speed)
    return film_rate(model.at_speed(speed), state) > STIFF * jnp.max(scale.rollers[3] / scale.rollers[2])


_rolling = compiled(rolling_start)


@compiled
def _laws(model: BearingModel, speed: Scalar) -> tuple[BearingAtSpeed, BearingState]:
    """The laws at a speed, and the magnitudes of the state: of one roller, and with an axis of one lane."""
    scale = state_scale(model, speed)
    scale = scale._replace(rollers=scale.rollers[:, 0])
    return model.at_speed(speed), jax.tree.map(lambda x: x[..., None], scale)


def simulate_bearing(
    model: BearingModel,
    speed: Scalar,
    *,
    revolutions: int,
    discard: int = 0,
    samples: int = 64,
    start: BearingState | None = None,
    tolerance: float = 1e-5,
    allowed: float = 1e-2,
    implicit: bool | None = None,
) -> BearingRun:
    """Time history of the whole bearing at one shaft speed, over revolutions of the cage.

    **Arguments:** model; shaft speed [rad/s], of either sign; revolutions of the cage recorded, and discarded before;
    samples per revolution; initial state, by default `rolling_start(model, speed)`; largest estimated error of a step
    and largest measured error between two samples, in units of `state_scale`; whether steps are implicit, by default
    where a slow shaft's thick oil makes the cage stiff (not for a quasi-static ring, which moves with all rollers).

    **Returns:** `BearingRun`. Steps are as short as the tolerance requires. From sample to sample the run is made a
    second time with about twice the steps: one that is off by more than `allowed`, or whose steps cannot be short
    enough, is `inaccurate`. Rollers that rattle in their pockets make neighbouring motions diverge within a revolution
    or two: longer stretches cannot be compared. Of slow shafts (NU2310 below 4000 rpm) it is made from place to place
    between samples, two periods of a loaded roller's vibration apart. A cage that comes to rest, or leaves its land,
    is `outside`: follow it over time, with `bearing_over_time`.

    **Raises:** `ValueError` for a speed that is zero or not a number, or at which rings that turn against each other
    leave the cage next to rest, and for impossible counts.
    """
    require_x64()
    value = float(speed)
    if not np.isfinite(value) or value == 0:
        raise ArgumentError("speed", said=f"must be a speed other than 0, but {value:g} rad/s was given.")
    require_counts(revolutions, samples, discard)
    rolling, fastest = float(model.rolling_cage_speed(value)), max(abs(value), abs(float(model.outer_speed)))
    if abs(rolling) < SLOWEST * fastest:
        raise ArgumentError(
            "speed",
            said=f"must make the cage turn at {SLOWEST:g} of the faster ring's speed at least, {SLOWEST * fastest:.3g} "
            f"rad/s, but with the outer ring at {float(model.outer_speed):.6g} rad/s {value:.6g} rad/s of the shaft "
            f"make it {rolling:.3g} rad/s: `bearing_over_time` follows it over time.",
        )
    state = _rolling(model, jnp.asarray(value)) if start is None else start
    parts = _parts(model, value, samples)
    places = samples * parts
    span = np.full(places * (discard + revolutions), TURN / places)
    limits = (FIRST, LONGEST, SHORTEST)
    run = _recorded(model, value, state, span, limits, tolerance, allowed, "angle", places, discard, implicit)
    return run if parts == 1 else _thinned(run, parts)


def _parts(model: BearingModel, speed: float, samples: int) -> int:
    """From sample to sample: 1 but for slow shafts."""
    scale = state_scale(model, speed)
    scale = scale._replace(rollers=scale.rollers[:, 0])
    if float(slowness(model.at_speed(speed), scale)) == 1:
        return 1
    short = SHORT * TURN * float(scale.rollers[2] / scale.rollers[3] * abs(model.rolling_cage_speed(speed)))
    return min(math.ceil(TURN / samples / short), MOST_PARTS) if short > 0 else 1


def _thinned(run: BearingRun, parts: int) -> BearingRun:
    """A run with every so many of its samples."""
    arrays = {name: getattr(run, name)[::parts] for name in ("time", "angle", "rollers", "bodies", "integrals")}
    peaks = run.peaks.reshape(-1, parts, run.peaks.shape[1]).max(axis=1)
    return dataclasses.replace(run, **arrays, peaks=peaks)


def bearing_over_time(
    model: BearingModel,
    speed: Scalar,
    times: Float[np.ndarray, " n"],
    *,
    start: BearingState,
    tolerance: float = 1e-5,
    allowed: float = 1e-2,
    implicit: bool | None = None,
) -> BearingRun:
    """Time history with time as independent variable: for starting, coasting and free flight.

    **Arguments:** model; shaft speed [rad/s]; ascending times of the samples, the first that of `start` [s];
    the rest as in `simulate_bearing`.

    **Returns:** `BearingRun`.
    """
    require_x64()
    spans = np.diff(np.asarray(times, dtype=float))
    if spans.size < 1 or not np.all(spans > 0):
        raise ArgumentError("times", said="must be two or more that grow.")
    whole = float(np.sum(spans))
    limits = (whole * 1e-5, whole, whole * 1e-10)
    return _recorded(model, float(speed), start, spans, limits, tolerance, allowed, "time", spans.size, 0, implicit)


def _recorded(
    model: BearingModel,
    speed: float,
    state: BearingState,
    spans: np.ndarray,
    limits: tuple[float, float, float],
    tolerance: float,
    allowed: float,
    by: By,
    samples: int,
    discard: int,
    implicit: bool | None,
) -> BearingRun:
    """The run, and its last revolution again."""
    if model.ring.ring_motion == "quasi_static":
        if implicit:
            raise ArgumentError("implicit", said="must be False or None for a quasi-static inner ring, but is True.")
        course: Any = _InJax(model, speed, state, limits, tolerance, by)
    else:
        course = _Native(model, speed, state, limits, tolerance, by)
    parts, first, stiff = [], course.numbers[None], []
    pieces = np.split(spans, len(spans) // samples * (CHOICES if samples % CHOICES == 0 else 1))
    for piece in pieces:
        stiff.append(course.is_stiff() if implicit is None else implicit)
        if stiff[-1] and isinstance(course, _Native):
            course = _InJax(model, speed, course.state, limits, tolerance, by, course.numbers, course.outcome)
        if not stiff[-1] and isinstance(course, _InJax) and model.ring.ring_motion != "quasi_static":
            course = _Native(model, speed, course.state, limits, tolerance, by, course.numbers, course.outcome)
        parts.append(course.go(piece, stiff[-1]))
    numbers, peaks, errors, steps = (np.concatenate(part) for part in zip(*parts, strict=True))
    numbers = np.concatenate([first, numbers])[discard * samples :]
    error, code = float(errors.max()), course.outcome
    if code == 0 and not error <= allowed:
        code = INACCURATE
    heavy = float(model.load + model.ring.ring_mass * model.gravity)
    if code == 0 and peaks[:, PEAKS.index("ring_imbalance")].max() > IMBALANCE * heavy:
        code = OUTCOMES.index("nonlinear_divergence")
    n, m = numbers.shape[1] - len(LEDGER) - len(MEANS), len(numbers)
    return BearingRun(
        time=numbers[:, n - 1],
        angle=numbers[:, n - 2],
        rollers=numbers[:, : n - 11].reshape(m, 5, -1),
        bodies=numbers[:, n - 11 : n - 2],
        integrals=numbers[:, n:],
        peaks=peaks[discard * samples :],
        outcome=OUTCOMES[code],
        error=error,
        steps=float(steps.sum() * samples / len(spans)),
        implicit_share=float(np.mean(stiff)),
    )


Found = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""State and integrals at the end of each span, peaks in it, its error, its steps."""


class _Native:
    """A run in machine code, by explicit steps."""

    def __init__(
        self,
        model: BearingModel,
        speed: float,
        state: BearingState,
        limits: tuple[float, float, float],
        tolerance: float,
        by: By,
        numbers: np.ndarray | None = None,
        outcome: int = 0,
    ):
        at, scale = _laws(model, jnp.asarray(speed))
        slowest = abs(float(at.rolling_cage_speed)) * (STALLED if by == "angle" else 0.0)
        self.outcome, self._tolerance, self._limits = outcome, tolerance, BearingLimits(*limits, MOST_STEPS_OF_ALL)
        self._bearings = Bearings(at, scale, np.array([slowest]), over_angle=by == "angle")
        self._about = model, jnp.asarray(speed)
        row = jax.tree.map(lambda x: np.asarray(x, dtype=float)[None], state)
        self._y, self._step = self._bearings.packed([0], row), limits[0]
        if numbers is not None:
            self._y[0, -len(INTEGRATED) : -1] = numbers[-len(INTEGRATED) + 1 :]
        self.numbers = self._numbers(self._y)[0]

    def _numbers(self, y: np.ndarray) -> np.ndarray:
        """State and integrals in SI units, as `packed` has them."""
        rollers, bodies, clock, integrals = self._bearings.unpacked(np.zeros(len(y), int), y)
        return np.concatenate([rollers.reshape(len(y), -1), bodies, clock, integrals[:, :-1]], axis=1)

    @property
    def state(self) -> BearingState:
        """The state that the run has reached."""
        n = self.numbers.size - len(LEDGER) - len(MEANS)
        parts = self.numbers[: n - 11].reshape(5, -1), self.numbers[n - 11 : n - 2], self.numbers[n - 2 : n]
        return BearingState(*map(jnp.asarray, parts))

    def is_stiff(self) -> bool:
        """True if implicit steps pay from here on."""
        return self.outcome == 0 and bool(_film_is_stiff(*self._about, self.state))

    def go(self, spans: np.ndarray, implicit: bool) -> Found:
        """One span after the other."""
        count, watched, self._begin = len(spans), len(WATCHED), self._y
        strobe = np.full((count, self._y.shape[1] + watched), np.nan)
        steps, begun = np.zeros(count), 0
        even = bool(np.allclose(spans, spans[0], rtol=1e-9, atol=0))
        while begun < count and self.outcome == 0:
            some = count if even else 1
            ran = self._run(self._y, spans[begun], some, self._tolerance, self._step)
            strobe[begun : begun + some], steps[begun : begun + some] = ran.strobe[0], ran.steps[0] / some
            self._y, self._step, begun = ran.state, float(ran.step[0]), begun + some
            self.outcome = INACCURATE if ran.mark[0] == STUCK else int(codes_of(ran.mark)[0])
        y, peaks = strobe[:, :-watched], strobe[:, -watched:]
        error = self._apart(y, spans)
        numbers = self._numbers(y)
        self.numbers = numbers[-1] if self.outcome == 0 else np.full_like(numbers[-1], np.nan)
        seen: dict[str, np.ndarray] = dict(zip(WATCHED, peaks.T, strict=True))
        none = np.zeros(count)
        return numbers, np.stack([seen.get(name, none) for name in PEAKS], axis=1), error, steps

    def _run(self, y: np.ndarray, span: Any, strobes: int, tolerance: float, step: Any, width: int = 1) -> March:
        lanes = np.zeros(len(y), int)
        return self._bearings.run(lanes, y, span, strobes, strobes, tolerance, self._limits, step=step, width=width)

    def _apart(self, ends: np.ndarray, spans: np.ndarray) -> np.ndarray:
        """Error of each span, from the same by shorter steps, in units of the scale."""
        dim = self._bearings.units.shape[1]
        begins = np.concatenate([self._begin, ends[:-1]])
        whole = np.flatnonzero(np.all(np.isfinite(ends), axis=1))
        error = np.zeros(len(spans))
        if whole.size:
            sharp = self._run(begins[whole], spans[whole], 1, FINER * self._tolerance, self._step, width=8)
            error[whole] = SURE * np.max(np.abs(sharp.state - ends[whole])[:, :dim], axis=1)
        return error


class _InJax:
    """A run inside JAX: by implicit steps, or with a quasi-static ring, which moves with all rollers."""

    def __init__(
        self,
        model: BearingModel,
        speed: float,
        state: BearingState,
        limits: tuple[float, float, float],
        tolerance: float,
        by: By,
        numbers: np.ndarray | None = None,
        outcome: int = 0,
    ):
        self._about, self._by = (model, jnp.asarray(speed)), by
        self._limits, self._tolerance = tuple(map(jnp.asarray, limits)), jnp.asarray(tolerance)
        self._lanes = _begun(*self._about, state, self._limits[0])
        if numbers is not None:
            integrals = len(LEDGER) + len(MEANS)
            packed = self._lanes.packed.at[-integrals:].set(jnp.asarray(numbers[-integrals:])[:, None])
            self._lanes = self._lanes._replace(packed=packed, outcome=jnp.full_like(self._lanes.outcome, outcome))

    @property
    def numbers(self) -> np.ndarray:
        """State and integrals, as `packed` has them."""
        return np.asarray(self._lanes.packed)[:, 0]

    @property
    def state(self) -> BearingState:
        """The state that the run has reached."""
        return jax.tree.map(lambda x: x[..., 0], self._lanes.state)

    @property
    def outcome(self) -> int:
        """Its place in `OUTCOMES`."""
        return int(self._lanes.outcome[0])

    def is_stiff(self) -> bool:
        """True if implicit steps pay from here on."""
        model, _ = self._about
        return model.ring.ring_motion != "quasi_static" and bool(_film_is_stiff(*self._about, self.state))

    def go(self, spans: np.ndarray, implicit: bool) -> Found:
        """One span after the other."""
        given = self._lanes, jnp.asarray(spans), self._limits, self._tolerance, self._by, implicit
        self._lanes, found = _run(*self._about, *given)
        numbers, peaks, error, steps = map(np.asarray, found)
        return numbers, peaks, error, steps
