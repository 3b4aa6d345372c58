"""Spectra by orders against signals whose lines are known."""

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.analysis import (
    OrderSpectrum,
    dominant_orders,
    order_spectrum,
    whirl_spectrum,
)


def trajectory(signals, revolutions=20, samples=64, extra=0, speed=500.0):
    """Columns from functions of the phase."""
    tau = 2 * np.pi * np.arange(revolutions * samples + extra) / samples
    state = np.stack([f(tau) for f in signals], axis=1)
    return jc.Trajectory(
        time=tau / speed,
        tau=tau,
        state=state,
        speed=np.full(len(tau), speed),
        samples=samples,
        peak=0.0,
        outcome="successful",
    )


@pytest.mark.parametrize("window", ["hann", "flattop", "boxcar"])
@pytest.mark.parametrize("extra", [0, 1, 17])
def test_sine_at_order_one_shows_its_amplitude(window, extra):
    spectrum = order_spectrum(trajectory([lambda t: 3e-4 * np.sin(t + 0.3) + 2e-3], extra=extra), window=window)
    assert spectrum.at(1) == pytest.approx(3e-4, rel=1e-10)
    assert spectrum.at(0) == pytest.approx(2e-3, rel=1e-10)
    assert spectrum.at(3) < 1e-15
    assert spectrum.order[-1] == 32
    assert spectrum.resolution == pytest.approx(1 / 20)


def test_line_between_bins_reads_as_the_windows_say():
    halfway = 1 + 0.5 / 20
    run = trajectory([lambda t: np.sin(halfway * t)])
    hann, flat, box = (np.max(order_spectrum(run, window=w).amplitude) for w in ("hann", "flattop", "boxcar"))
    assert hann == pytest.approx(0.849, abs=2e-3)  # sinc(1/2)/(1 - 1/4)
    assert flat == pytest.approx(1.0, abs=2e-3)
    assert box == pytest.approx(2 / np.pi, abs=0.03)


@pytest.mark.parametrize("order", [0.5, 0.487, 1.013, 2.23791])
def test_dominant_order_is_interpolated_between_bins(order):
    run = trajectory([lambda t: 0.02 * np.sin(order * t) + 5.0], revolutions=64)
    (line,) = dominant_orders(order_spectrum(run), 1)
    assert line.order == pytest.approx(order, abs=2e-5)
    assert line.amplitude == pytest.approx(0.02, rel=1e-3)


def test_dominant_orders_are_ranked_and_the_mean_left_out():
    lines = ((1, 1.0), (0.5, 2.0), (3, 0.3), (7, 1e-3))
    run = trajectory([lambda t: 9.0 + sum(a * np.sin(k * t) for k, a in lines)])
    lines = dominant_orders(order_spectrum(run))
    np.testing.assert_allclose([p.order for p in lines], [0.5, 1, 3], atol=1e-6)
    np.testing.assert_allclose([p.amplitude for p in lines], [2, 1, 0.3], rtol=1e-6)
    assert dominant_orders(order_spectrum(run), floor=1e-4)[-1].order == pytest.approx(7)
    assert dominant_orders(OrderSpectrum(np.arange(9.0), np.zeros(9), "hann")) == ()


def test_whirl_spectrum_tells_forward_from_backward():
    x = lambda t: 2e-5 * np.cos(0.5 * t) + 1e-5 * np.cos(t) + 3e-5
    y = lambda t: 2e-5 * np.sin(0.5 * t) - 1e-5 * np.sin(t)
    spectrum = whirl_spectrum(trajectory([x, y]))
    assert spectrum.at(0.5) == pytest.approx(2e-5, rel=1e-10)
    assert spectrum.at(-1) == pytest.approx(1e-5, rel=1e-10)
    assert spectrum.at(0) == pytest.approx(3e-5, rel=1e-10)
    assert max(spectrum.at(-0.5), spectrum.at(1)) < 1e-15
    first, second = dominant_orders(spectrum)
    assert first.order == pytest.approx(0.5) and second.order == pytest.approx(-1)
