"""Order spectra: over multiples of the cage speed, so that order 1 is synchronous at every speed.

A time history is sampled evenly in phase, so that its spectrum is over orders even if the speed varies.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Inexact


class Peak(NamedTuple):
    """One line of a spectrum."""

    order: float
    amplitude: float
    name: str | None = None
    """Name of the bearing frequency within one bin of it, if there is one."""


@dataclasses.dataclass(frozen=True)
class OrderSpectrum:
    """Amplitude spectrum over orders, with a Hann window: a sine is up to 15 % too small if it is between two bins."""

    order: Float[np.ndarray, " orders"]
    """Multiples of the cage speed, ascending."""
    amplitude: Float[np.ndarray, " orders"]
    """Amplitudes in the unit of the signal; the mean at order 0."""

    @property
    def resolution(self) -> float:
        """Spacing of the orders, one over the number of revolutions."""
        return float(self.order[1] - self.order[0])

    def at(self, order: float | int) -> float:
        """Amplitude at the order nearest to `order`."""
        return float(self.amplitude[np.argmin(np.abs(self.order - order))])


def spectrum_of(signal: Inexact[np.ndarray, " n"], samples: int) -> OrderSpectrum:
    """Amplitude spectrum of a signal at evenly spaced angles, up to half the samples per revolution: one-sided, but of
    a complex signal x + i y also over negative orders, which turn backward.

    The mean is subtracted first, to avoid leakage into the lowest orders, and inserted at order 0.

    **Arguments:** values over whole revolutions, so that integer orders fall on bins; samples per revolution.
    """
    n = len(signal)
    weights = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    mean = np.sum(weights * signal) / np.sum(weights)
    if np.iscomplexobj(signal):
        lines = np.abs(np.fft.fft(weights * (signal - mean))) / np.sum(weights)
        return OrderSpectrum(np.fft.fftshift(np.fft.fftfreq(n, 1 / samples)), np.fft.fftshift(lines))
    amplitude = np.abs(np.fft.rfft(weights * (signal - mean))) / np.sum(weights)
    amplitude[0] = abs(mean)
    amplitude[1 : (n + 1) // 2] *= 2  # the other half of a real line is at the negative order
    return OrderSpectrum(np.fft.rfftfreq(n, 1 / samples), amplitude)


def _hann_line(ratio: float) -> tuple[float, float]:
    """Offset in bins and amplitude factor of a line: r is the ratio of its larger neighbour to it.

    The main lobe of the Hann window is sinc(d)/(1 - d^2), so the ratio of two neighbours gives the offset
    d = (2 r - 1)/(r + 1) exactly for a single line (T. Grandke, IEEE Trans. Instrum. Meas. 32 (1983) 350).
    """
    d = min(max((2 * ratio - 1) / (ratio + 1), 0.0), 0.5)
    return d, (1 - d * d) / float(np.sinc(d))


def dominant_orders(spectrum: OrderSpectrum, count: int = 5, *, floor: float | int = 0.01) -> tuple[Peak, ...]:
    """Largest lines of a spectrum, in descending order and without the mean, interpolated between the bins.

    **Arguments:** spectrum; maximum number of lines; smallest amplitude, as a fraction of the largest.
    """
    order = spectrum.order
    a = np.where(order == 0, 0.0, spectrum.amplitude)
    inner = np.arange(1, len(a) - 1)
    peaks = inner[(a[inner] > a[inner - 1]) & (a[inner] >= a[inner + 1])]
    if len(peaks) == 0:
        return ()
    peaks = peaks[a[peaks] >= floor * np.max(a[peaks])]
    lines = []
    for k in peaks:
        sign = 1 if a[k + 1] >= a[k - 1] else -1
        shift, factor = _hann_line(float(a[k + sign] / a[k]))
        place = order[k] + sign * shift * spectrum.resolution
        lines.append(Peak(float(place), float(a[k] * factor)))
    return tuple(sorted(lines, key=lambda line: -line.amplitude)[:count])
