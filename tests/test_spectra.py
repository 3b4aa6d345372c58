"""Spectra by orders against signals whose lines are known; the 0-1 test against maps of known kind."""

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.analysis import (
    OrderSpectrum,
    dominant_orders,
    mean_square_displacement,
    order_spectrum,
    whirl_spectrum,
    zero_one,
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


def logistic(a, n=1000, discard=2000, x=0.3):
    values = np.empty(n + discard)
    for i in range(n + discard):
        x = a * x * (1 - x)
        values[i] = x
    return values[discard:]


def circle_map(turn, coupling=0.8, n=1000, discard=500):
    t, values = 0.1, np.empty(n + discard)
    for i in range(n + discard):
        t = t + turn - coupling / (2 * np.pi) * np.sin(2 * np.pi * t)
        values[i] = np.cos(2 * np.pi * t)
    return values[discard:]


@pytest.mark.parametrize("a", [3.7, 3.9, 3.97])
def test_chaotic_logistic_map_reads_one(a):
    assert float(zero_one(logistic(a))) > 0.99


@pytest.mark.parametrize("a", [3.2, 3.5, 3.55, 3.83])  # periods 2, 4, 8 and 3
def test_periodic_logistic_map_reads_zero(a):
    assert abs(float(zero_one(logistic(a)))) < 0.03


@pytest.mark.parametrize("turn", [(5**0.5 - 1) / 2, 0.3028])
def test_quasi_periodic_circle_map_reads_zero(turn):
    assert len(np.unique(np.round(circle_map(turn), 6))) > 900  # it never closes
    assert abs(float(zero_one(circle_map(turn)))) < 0.05


def test_fixed_point_is_exactly_regular_even_with_rounding_noise():
    noise = np.random.default_rng(1).standard_normal(400)
    assert float(zero_one(np.full(400, 0.7))) == 0.0
    assert float(zero_one(np.zeros(400))) == 0.0
    assert float(zero_one(0.7 + 1e-14 * noise)) == 0.0
    assert float(zero_one(1e-14 * noise, scale=1.0)) == 0.0
    assert float(zero_one(1e-14 * noise)) > 0.9  # without a scale, noise is all there is


def test_lanes_shift_and_scale_do_not_matter():
    lanes = np.stack([[logistic(3.9, 400), logistic(3.5, 400)], [circle_map(0.3028, n=400)] * 2])
    together = zero_one(lanes)
    assert together.shape == (2, 2)
    one_by_one = [[float(zero_one(s)) for s in row] for row in lanes]
    np.testing.assert_allclose(together, one_by_one, atol=1e-12)
    np.testing.assert_allclose(zero_one(1e3 - 7 * lanes), together, atol=1e-9)


def test_displacement_equals_the_plain_sum():
    series = logistic(3.9, 200)
    series = series - np.mean(series)
    walk = np.cumsum(series * np.exp(1.3j * np.arange(1, 201)))
    plain = [np.mean(np.abs(walk[n : n + 180] - walk[:180]) ** 2) for n in range(1, 21)]
    np.testing.assert_allclose(mean_square_displacement(series, 1.3), plain, rtol=1e-12)
