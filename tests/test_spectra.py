"""Spectra by orders against signals whose lines are known."""

import numpy as np
import pytest

from jaxcage.analysis import OrderSpectrum, dominant_orders, spectrum_of


def spectrum(signal, revolutions=20, samples=64):
    """Spectrum of a function of the phase."""
    return spectrum_of(signal(2 * np.pi * np.arange(revolutions * samples) / samples), samples)


def test_sine_at_order_one_shows_its_amplitude():
    found = spectrum(lambda t: 3e-4 * np.sin(t + 0.3) + 2e-3)
    assert found.at(1) == pytest.approx(3e-4, rel=1e-10)
    assert found.at(0) == pytest.approx(2e-3, rel=1e-10)
    assert found.at(3) < 1e-15
    assert found.order[-1] == 32
    assert found.resolution == pytest.approx(1 / 20)


def test_line_between_bins_reads_as_the_window_says():
    halfway = 1 + 0.5 / 20
    assert np.max(spectrum(lambda t: np.sin(halfway * t)).amplitude) == pytest.approx(0.849, abs=2e-3)


@pytest.mark.parametrize("order", [0.5, 0.487, 1.013, 2.23791])
def test_dominant_order_is_interpolated_between_bins(order):
    (line,) = dominant_orders(spectrum(lambda t: 0.02 * np.sin(order * t) + 5.0, revolutions=64), 1)
    assert line.order == pytest.approx(order, abs=2e-5)
    assert line.amplitude == pytest.approx(0.02, rel=1e-3)


def test_dominant_orders_are_ranked_and_the_mean_left_out():
    added = ((1, 1.0), (0.5, 2.0), (3, 0.3), (7, 1e-3))
    found = spectrum(lambda t: 9.0 + sum(a * np.sin(k * t) for k, a in added))
    lines = dominant_orders(found)
    np.testing.assert_allclose([p.order for p in lines], [0.5, 1, 3], atol=1e-6)
    np.testing.assert_allclose([p.amplitude for p in lines], [2, 1, 0.3], rtol=1e-6)
    assert dominant_orders(found, floor=1e-4)[-1].order == pytest.approx(7)
    assert dominant_orders(OrderSpectrum(np.arange(9.0), np.zeros(9))) == ()
