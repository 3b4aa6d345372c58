"""Run-up and run-down: continuous ramps of the speed, with the size of the motion along them."""

import math

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from .._arguments import MOST
from .._errors import ArgumentError, NoResult
from ..analysis import runs
from ..models import AbstractForcedSystem
from ..quantities import averaged
from ..solve import AbstractMethod, Trajectory, ramp
from .observe import centres_of


SAMPLES = 32
"""Number of samples per revolution."""
SETTLE = 100
"""Number of revolutions at the first speed before a ramp begins."""
SURE = 3.0
"""Smallest difference between up and down that counts, as a multiple of the scatter within windows."""
WORTH = 0.05
"""Smallest difference that counts, as a fraction of the size of the orbit."""
WAYS = ("up", "down")


def ramp_revolutions(model: AbstractForcedSystem, first: float, last: float, seconds: float) -> int:
    """Number of revolutions of a ramp from `first` to `last` [rad/s] in `seconds`, by the logarithmic mean speed, since
    the speed changes by equal amounts per revolution."""
    low, high = (abs(float(model.turning_speed(speed))) for speed in (first, last))
    return math.ceil(seconds * (high - low) / (2 * math.pi * math.log(high / low)))


def ramp_up_down(
    model: AbstractForcedSystem,
    first: float,
    last: float,
    rate: float,
    *,
    windows: int = 100,
    settle: int = SETTLE,
    method: AbstractMethod | None = None,
) -> xr.Dataset:
    """Ramp the speed of a cage or a whole bearing up and down again in one continuous motion.

    **Arguments:** model; lowest and highest speed [rad/s]; mean rate [rad/s^2]; approximate number of windows into
    which each ramp is divided; revolutions at the first speed before each ramp; method as in `ramp`.

    **Returns:** a data set over `way` (up, down) and `window`, at ascending speeds: `size` of the motion of the cage
    centre [m], its `scatter` between the halves of a window, `eccentricity` ratio, and the quantities of the model.

    **Raises:** `ValueError` for speeds that do not ascend, and for a rate that is not positive or leaves no revolution
    for each half of a window; `NoResult` if a ramp fails.
    """
    if not (0 < first < last):
        raise ArgumentError("first", "last", said=f"must be positive and ascend, but are {first:g} and {last:g} rad/s.")
    if not (rate > 0 and math.isfinite(rate)):
        raise ArgumentError("rate", said=f"must be positive and finite, but {rate:g} rad/s^2 was given.")
    revolutions = ramp_revolutions(model, first, last, (last - first) / rate)
    each = 2 * (revolutions // (2 * windows))
    if each < 2 or revolutions > MOST:
        end, limit = ("most", 2 * windows) if each < 2 else ("least", MOST)
        said = f"must leave two revolutions for each of {windows} windows, and at most {MOST} in all, but "
        said += f"{rate * 30 / math.pi:.4g} rpm/s make {revolutions}: choose at {end} "
        raise ArgumentError("rate", said=f"{said}{rate * revolutions / limit * 30 / math.pi:.3g} rpm/s.")
    windows = round(revolutions / each)
    revolutions = each * windows
    options = {"revolutions": revolutions, "samples": SAMPLES, "method": method}
    up = _finished(ramp(model, first, last, discard=settle, **options), "up")
    begin = -SAMPLES - len(up.beside[:1])  # first sample of the last revolution
    end = tuple(float(c) for c in up.state[begin])
    down = _finished(ramp(model, float(up.speed[begin]), first, discard=settle, start=end, **options), "down")
    ways = [_windows(model, up, windows), _windows(model, down, windows).isel(window=slice(None, None, -1))]
    found = xr.concat(ways, "way").assign_coords(way=list(WAYS))
    return found.assign_attrs(revolutions=revolutions, seconds=float(up.time[-1] - up.time[0]))


def apart(found: xr.Dataset) -> Bool[np.ndarray, " windows"]:
    """True for windows with hysteresis: sizes up and down that differ by three times the scatter of the windows around
    (chaos alone is not hysteresis) and 5 % of the larger orbit, in at least two neighbouring windows."""
    a, b = found["size"].values
    scatter = np.hypot(*(_around(x) for x in found["scatter"].values))
    beyond = np.abs(a - b) > np.maximum(SURE * scatter, WORTH * np.maximum(a, b))
    beside = np.zeros_like(beyond)
    beside[1:] |= beyond[:-1]
    beside[:-1] |= beyond[1:]
    return beyond & beside


def stretches_apart(found: xr.Dataset) -> list[tuple[float, float]]:
    """First and last speed [rpm] of each run of windows that differ."""
    rpm = found["rpm"].values[0]
    return [(float(rpm[first]), float(rpm[last])) for first, last in runs(apart(found))]


def _around(x: Float[np.ndarray, " windows"]) -> Float[np.ndarray, " windows"]:
    """Running median over five windows, so that a jump within one of them does not count as scatter."""
    return np.median(np.lib.stride_tricks.sliding_window_view(np.pad(x, 2, mode="edge"), 5), axis=1)


def _finished(run: Trajectory, way: str) -> Trajectory:
    if run.outcome != "successful":
        at = run.rpm[int(np.argmin(np.isfinite(run.state[:, 0])))]
        raise NoResult(f"The ramp {way} failed at {at:.0f} rpm ({run.outcome}): try more --steps.")
    return run


def _windows(model: AbstractForcedSystem, run: Trajectory, count: int) -> xr.Dataset:
    """Data set of a ramp over its windows, in temporal order."""
    n = len(run.state) - len(run.beside[:1])
    place = centres_of(model, run.speed[:n], run.state[:n])
    clearance = float(model.clearance)  # pyright: ignore[reportAttributeAccessIssue]
    size = lambda parts: clearance * np.max(np.ptp(parts, axis=1), axis=1)
    half = size(place.reshape(2 * count, -1, 2)).reshape(count, 2)
    of_window = lambda unit, text, x: (("window",), x, {"units": unit, "long_name": text})
    found = {
        "size": of_window("m", "size of the motion of the cage centre", size(place.reshape(count, -1, 2))),
        "scatter": of_window("m", "difference of the halves of a window", np.abs(half[:, 1] - half[:, 0])),
        "eccentricity": of_window("1", "largest eccentricity ratio", run.peaks[:n, -1].reshape(count, -1).max(axis=1)),
    }
    speed = run.speed[:n].reshape(count, -1).mean(axis=1)
    if model.quantities:
        each = n // count
        sums = np.diff(run.integrals[::each][: count + 1], axis=0)
        largest = run.peaks[:n].reshape(count, each, -1).max(axis=1)
        rows = [model.reference(float(w)) for w in speed]
        numbers = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
        given = model.quantities, model.beside, model.watched, sums[:, None], largest[:, None], numbers
        for quantity, values, _ in averaged(*given, each / run.samples):
            found[quantity.name] = of_window(quantity.unit, quantity.text, values)
    rpm = {"units": "rpm", "long_name": model.speed_text}
    return xr.Dataset(found, {"rpm": (("window",), speed * 30 / np.pi, rpm)})
