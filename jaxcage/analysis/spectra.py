"""Spectra by orders: multiples of the cage speed, so that order 1 is synchronous at every speed.

A trajectory is sampled evenly in phase, so its spectrum is over orders even when the speed ramps.
"""

import dataclasses
from typing import Literal, NamedTuple, get_args

import numpy as np
from jaxtyping import Complex, Float

from .._errors import ArgumentError
from ..solve import Trajectory


Window = Literal["hann", "flattop", "boxcar"]


class Peak(NamedTuple):
    """One line of a spectrum."""

    order: float
    amplitude: float


@dataclasses.dataclass(frozen=True)
class OrderSpectrum:
    """Amplitudes by order of the speed.

    One-sided (orders >= 0) for one component: a sine of amplitude a shows a. Two-sided for the
    motion of a centre in the plane: a forward circle of radius a at w times the speed shows a at
    order w, a backward one at order -w.
    """

    order: Float[np.ndarray, " orders"]
    """Order, a multiple of the cage speed, ascending."""
    amplitude: Float[np.ndarray, " orders"]
    """Amplitude in the unit of the component; the mean at order 0."""
    window: Window

    @property
    def resolution(self) -> float:
        """Distance of neighbouring orders, one over the number of revolutions."""
        return float(self.order[1] - self.order[0])

    def at(self, order: float | int) -> float:
        """Amplitude at the bin nearest to `order`."""
        return float(self.amplitude[np.argmin(np.abs(self.order - order))])


def _whole_revolutions(trajectory: Trajectory) -> Float[np.ndarray, "n dim"]:
    """The last samples that make whole revolutions, so that integer orders fall on bins."""
    revolutions = len(trajectory.tau) // trajectory.samples
    if revolutions < 2:
        raise ArgumentError(
            "trajectory",
            said="must last for at least 2 revolutions, "
            f"but it has {len(trajectory.tau)} samples at {trajectory.samples} per revolution.",
        )
    return trajectory.state[-revolutions * trajectory.samples :]


def _transform(
    signal: Float[np.ndarray, " n"] | Complex[np.ndarray, " n"], window: Window
) -> Complex[np.ndarray, " n"]:
    """Windowed transform, scaled so that exp(i k x) with amplitude a gives |a| in its bin.

    The mean is taken out first, which keeps its skirts out of the lowest orders, and put back.
    """
    if window not in get_args(Window):
        choices = ", ".join(get_args(Window))
        raise ArgumentError("window", said=f"must be one of {choices}, but '{window}' was given.")
    from scipy.signal import get_window  # takes a second to import

    weights = get_window(window, len(signal))
    mean = np.sum(weights * signal) / np.sum(weights)
    lines = np.fft.fft(weights * (signal - mean)) / np.sum(weights)
    lines[0] = mean
    return lines


def order_spectrum(trajectory: Trajectory, component: int = 0, *, window: Window = "hann") -> OrderSpectrum:
    """Amplitude spectrum of one component of the state.

    **Arguments:**

    - `trajectory`: at least 2 revolutions; only whole revolutions are used, the last ones.
    - `component`: index into the state.
    - `window`: `hann` tells near lines apart but shows a line halfway between two bins 15 % low;
        `flattop` reads every amplitude to 0.1 % but is wide; `boxcar` is exact for integer orders
        alone.

    **Returns:** the one-sided spectrum, up to half the samples per revolution.

    **Raises:** `ValueError` for a trajectory that is too short, or an unknown window.
    """
    return spectrum_of(_whole_revolutions(trajectory)[:, component], trajectory.samples, window)


def spectrum_of(signal: Float[np.ndarray, " n"], samples: int, window: Window = "hann") -> OrderSpectrum:
    """One-sided amplitude spectrum of a quantity at evenly spaced angles.

    **Arguments:** values over whole revolutions; samples per revolution; window as in `order_spectrum`.
    """
    n = len(signal)
    amplitude = np.abs(_transform(signal, window)[: n // 2 + 1])
    amplitude[1 : (n + 1) // 2] *= 2  # the other half of a real line is at the negative order
    return OrderSpectrum(np.fft.rfftfreq(n, 1 / samples), amplitude, window)


def whirl_spectrum(
    trajectory: Trajectory, components: tuple[int, int] = (0, 1), *, window: Window = "hann"
) -> OrderSpectrum:
    """Two-sided spectrum of x + i y: forward whirl at positive orders, backward at negative ones.

    **Arguments:** as `order_spectrum`, with the two components that are x and y of a centre.
    """
    x, y = _whole_revolutions(trajectory)[:, list(components)].T
    order = np.fft.fftshift(np.fft.fftfreq(len(x), 1 / trajectory.samples))
    return OrderSpectrum(order, np.abs(np.fft.fftshift(_transform(x + 1j * y, window))), window)


def _hann_line(ratio: float) -> tuple[float, float]:
    """Offset in bins and amplitude factor of a line: r is the ratio of its larger neighbour to it.

    The main lobe of the Hann window is sinc(d)/(1 - d^2), so the ratio of two neighbours gives the
    offset d = (2 r - 1)/(r + 1) exactly for a single line (T. Grandke, IEEE Trans. Instrum. Meas.
    32 (1983) 350).
    """
    d = min(max((2 * ratio - 1) / (ratio + 1), 0.0), 0.5)
    return d, (1 - d * d) / float(np.sinc(d))


def dominant_orders(spectrum: OrderSpectrum, count: int = 5, *, floor: float | int = 0.01) -> tuple[Peak, ...]:
    """The largest lines of a spectrum, largest first, the mean left out.

    With the Hann window order and amplitude are interpolated between the bins.

    **Arguments:** the spectrum; how many lines at most; the smallest amplitude that counts, as a
    part of the largest.
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
        shift, factor = 0.0, 1.0
        sign = 1 if a[k + 1] >= a[k - 1] else -1
        if spectrum.window == "hann":
            shift, factor = _hann_line(float(a[k + sign] / a[k]))
        place = order[k] + sign * shift * spectrum.resolution
        lines.append(Peak(float(place), float(a[k] * factor)))
    return tuple(sorted(lines, key=lambda line: -line.amplitude)[:count])
