"""Run-up and run-down of a machine: true ramps of the speed, and how far the cage moves on its way."""

import dataclasses
import math

import numpy as np
from jaxtyping import Bool, Float

from .._errors import ArgumentError, NoResult
from ..analysis import relative_state
from ..analysis._zones import runs
from ..models import CageModel
from ..solve import AbstractMethod, Trajectory, ramp


SAMPLES = 32
"""Phases of a revolution at which the motion is read."""
SETTLE = 100
"""Revolutions at the first speed before a ramp begins."""
SURE = 3.0
"""So many times the scatter within the windows is a difference between them."""
WORTH = 0.05
"""Smaller parts of an orbit are no difference."""


@dataclasses.dataclass(frozen=True)
class Ramped:
    """What one ramp shows, in windows of equally many revolutions, at ascending speeds."""

    rpm: Float[np.ndarray, " windows"]
    """Mean cage speed of each."""
    size: Float[np.ndarray, " windows"]
    """The larger of the vertical and the horizontal motion, from one end to the other [m]."""
    scatter: Float[np.ndarray, " windows"]
    """How much the halves of the window differ [m]."""
    eccentricity: Float[np.ndarray, " windows"]
    """Largest eccentricity ratio."""


@dataclasses.dataclass(frozen=True)
class RampUpDown:
    """The speed raised and lowered again at the same pace."""

    up: Ramped
    down: Ramped
    revolutions: int
    """Of each ramp."""
    seconds: float
    """Of each ramp."""
    rate_rpm_per_s: tuple[float, float]
    """Cage speed gained per second at the lowest speed and at the highest: by equal amounts in every revolution."""

    @property
    def apart(self) -> Bool[np.ndarray, " windows"]:
        """Windows in which the orbits differ between up and down: by more than three times the usual scatter of the
        windows around and 5 % of the larger orbit, in two neighbouring windows at least. What is chaotic scatters and
        is no hysteresis by itself."""
        a, b = self.up, self.down
        scatter = np.hypot(_around(a.scatter), _around(b.scatter))
        limit = np.maximum(SURE * scatter, WORTH * np.maximum(a.size, b.size))
        beyond = np.abs(a.size - b.size) > limit
        beside = np.zeros_like(beyond)
        beside[1:] |= beyond[:-1]
        beside[:-1] |= beyond[1:]
        return beyond & beside

    @property
    def stretches(self) -> list[tuple[float, float]]:
        """First and last speed [rpm] of each run of windows that differ."""
        return [(float(self.up.rpm[first]), float(self.up.rpm[last])) for first, last in runs(self.apart)]


def _around(x: np.ndarray) -> np.ndarray:
    """The middle one of five neighbours: a jump within one of them is no scatter."""
    return np.median(np.lib.stride_tricks.sliding_window_view(np.pad(x, 2, mode="edge"), 5), axis=1)


def ramp_revolutions(first: float, last: float, seconds: float) -> int:
    """Revolutions of a ramp from `first` to `last` [rad/s] that takes so many seconds: the speed rises by equal amounts
    in every revolution, so that its mean over time is the logarithmic one."""
    return math.ceil(seconds * (last - first) / (2 * math.pi * math.log(last / first)))


def ramp_up_down(
    model: CageModel,
    first: float,
    last: float,
    rate: float,
    *,
    windows: int = 100,
    settle: int = SETTLE,
    method: AbstractMethod | None = None,
) -> RampUpDown:
    """Raise the speed and lower it again, the state carried along.

    **Arguments:** model; lowest and highest speed [rad/s]; speed gained per second, in the mean [rad/s^2];
    windows into which each ramp is cut, about; revolutions at the lowest speed beforehand; method as in `ramp`.

    **Raises:** `ValueError` for speeds that do not ascend, and for a rate that is not positive or leaves no
    revolution for each half of a window; `NoResult` if a ramp fails.
    """
    if not (0 < first < last):
        raise ArgumentError("first", "last", said=f"must be positive and ascend, but are {first:g} and {last:g} rad/s.")
    if not (rate > 0 and math.isfinite(rate)):
        raise ArgumentError("rate", said=f"must be positive and finite, but {rate:g} rad/s^2 was given.")
    revolutions = ramp_revolutions(first, last, (last - first) / rate)
    each = 2 * (revolutions // (2 * windows))
    if each < 2:
        slow = rate * revolutions / (2 * windows)
        raise ArgumentError(
            "rate",
            said=f"must leave two revolutions for each of {windows} windows, but {rate * 30 / math.pi:.4g} rpm/s make "
            f"{revolutions} in all: choose at most {slow * 30 / math.pi:.3g} rpm/s of the cage, or fewer windows.",
        )
    windows = round(revolutions / each)
    revolutions = each * windows
    options = {"revolutions": revolutions, "samples": SAMPLES, "method": method}
    up = _finished(ramp(model, first, last, discard=settle, **options), "up")
    end = tuple(float(c) for c in up.state[-SAMPLES])  # at the beginning of the last revolution
    down = _finished(ramp(model, float(up.speed[-SAMPLES]), first, discard=settle, start=end, **options), "down")
    gained = (last - first) / revolutions / (2 * math.pi) * 30 / math.pi
    return RampUpDown(
        _windows(model, up, windows, 1),
        _windows(model, down, windows, -1),
        revolutions,
        float(up.time[-1] - up.time[0]),
        (gained * first, gained * last),
    )


def _finished(run: Trajectory, way: str) -> Trajectory:
    if run.outcome != "successful":
        at = run.rpm[int(np.argmin(np.isfinite(run.state[:, 0])))]
        raise NoResult(f"The ramp {way} failed at {at:.0f} rpm of the cage ({run.outcome}): try more --steps.")
    return run


def _windows(model: CageModel, run: Trajectory, count: int, order: int) -> Ramped:
    q, _ = relative_state(model, run.state)
    halves = q.reshape(2 * count, -1, 2)
    size = lambda parts: np.max(np.ptp(parts, axis=1), axis=1)
    half = size(halves).reshape(count, 2)
    eps = np.max(np.hypot(q[:, 0], q[:, 1]).reshape(count, -1), axis=1) / float(model.clearance)
    parts = (
        run.rpm.reshape(count, -1).mean(axis=1),
        size(q.reshape(count, -1, 2)),
        np.abs(half[:, 1] - half[:, 0]),
        eps,
    )
    return Ramped(*(x[::order] for x in parts))
