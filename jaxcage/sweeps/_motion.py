"""How far a cage moves in its rib, and at which frequency it whirls: what probes on a machine read."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Complex, Float

from ..analysis import OrderSpectrum, Sweep, dominant_orders
from ..models import CageModel
from ..solve import AbstractMethod, Lanes, histories, native


SAMPLES = 32
"""Phases of a revolution at which the motion is read: the size of a circle at cage frequency is read up to 0.5 % too
small, that of one at the fourth order up to 8 %."""
REVOLUTIONS = 32
"""Revolutions read: orders are told apart by 1/32, and interpolated between."""


@dataclasses.dataclass(frozen=True)
class Motion:
    """Motion of the cage centre relative to its rib at each speed, from each start; NaN where a lane failed."""

    horizontal: Float[np.ndarray, "speeds starts"]
    """From one end to the other [m], as a probe reads it."""
    vertical: Float[np.ndarray, "speeds starts"]
    """From one end to the other [m]."""
    whirl_order: Float[np.ndarray, "speeds starts"]
    """Order of the largest line in the spectrum of x + i y, a multiple of the cage speed: negative where it whirls
    against the rotation; NaN where the centre stands still."""

    @property
    def size(self) -> Float[np.ndarray, "speeds starts"]:
        """The larger of both [m]: what is called the size of an orbit."""
        return np.maximum(self.horizontal, self.vertical)


def motions(
    models: Sequence[CageModel],
    found: Sequence[Sweep],
    *,
    revolutions: int = REVOLUTIONS,
    method: AbstractMethod | None = None,
) -> list[Motion]:
    """The motion after each of some sweeps, over revolutions that begin where it ended.

    **Arguments:** models that differ in their numbers only, and the sweep of each over the same speeds; revolutions;
    integration method, by default `jaxcage.native()`. A lane that is not known to its error is NaN.
    """
    chosen = native() if method is None else method
    last = np.stack([swept.last for swept in found])
    count, speeds, starts, dim = last.shape
    speed = np.concatenate([np.repeat(swept.speed, starts) for swept in found])
    which = np.repeat(np.arange(count), speeds * starts)
    label = np.concatenate([swept.observed_label.ravel() for swept in found])
    state = np.empty((label.size, revolutions * SAMPLES, dim))
    for lanes, read in ((label == "periodic-1", 1), (label != "periodic-1", revolutions)):
        if np.any(lanes):  # of what repeats itself every revolution one tells all
            some = Lanes.of(models, speed[lanes], which[lanes])
            seen, off = histories(some, last.reshape(-1, dim)[lanes], SAMPLES, read, chosen)
            seen = np.where((off <= chosen.allowed)[:, None, None], seen, np.nan)
            state[lanes] = np.tile(seen, (1, revolutions // read, 1))
    q = state[..., :2] if dim == 4 else state[..., :2] - state[..., 2:4]
    across = np.ptp(q, axis=1)
    order = np.array([_order(x + 1j * y, revolutions) for x, y in np.moveaxis(q, 2, 1)])
    shape = (count, speeds, starts)
    parts = (across[:, 0].reshape(shape), across[:, 1].reshape(shape), order.reshape(shape))
    return [Motion(*each) for each in zip(*parts, strict=True)]


def _order(path: Complex[np.ndarray, " samples"], revolutions: int) -> float:
    """Order of the largest line, by a Hann window."""
    if not np.all(np.isfinite(path)) or np.max(np.abs(path - path[0])) == 0:
        return float("nan")
    n = path.size
    weights = np.hanning(n + 1)[:-1]
    weights /= weights.sum()
    lines = np.abs(np.fft.fftshift(np.fft.fft(weights * (path - weights @ path))))
    order = np.fft.fftshift(np.fft.fftfreq(n, revolutions / n))
    peaks = dominant_orders(OrderSpectrum(order, lines, "hann"), 1)
    return peaks[0].order if peaks else float("nan")
