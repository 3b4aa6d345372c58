"""The 0-1 test against maps of known kind, and its formulas against plain sums."""

import numpy as np
import pytest

from jaxcage.analysis import mean_square_displacement, zero_one


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


def test_weak_chaos_needs_a_long_series():
    """Logistic map at 3.6, exponent 0.184: the limit that the module states."""
    readings = [float(zero_one(logistic(3.6, n))) for n in (300, 1000, 3000)]
    assert readings[0] < 0.6 and readings[2] > 0.95
    assert readings == sorted(readings)


def test_oversampled_chaos_reads_regular():
    """Every value of a chaotic map drawn out into 40 slowly changing ones."""
    slow = np.interp(np.arange(0, 100, 0.025), np.arange(101), logistic(3.97, 101))
    assert len(slow) == 4000
    assert float(zero_one(slow)) < 0.2 < 0.9 < float(zero_one(slow[::40]))


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


def test_lane_with_a_failure_is_nan_and_alone():
    lanes = np.stack([logistic(3.9, 400), np.full(400, np.nan)])
    lanes[1, :100] = 0.2
    k = zero_one(lanes)
    assert k[0] > 0.98 and np.isnan(k[1])


def test_displacement_equals_the_plain_sum():
    series = logistic(3.9, 200)
    series = series - np.mean(series)
    walk = np.cumsum(series * np.exp(1.3j * np.arange(1, 201)))
    plain = [np.mean(np.abs(walk[n : n + 180] - walk[:180]) ** 2) for n in range(1, 21)]
    np.testing.assert_allclose(mean_square_displacement(series, 1.3), plain, rtol=1e-12)


def test_displacement_of_a_mean_is_the_oscillation_that_centring_removes():
    """V_osc = mean^2 (1 - cos n c)/(1 - cos c), Gottwald and Melbourne's subtracted term."""
    c, lag = 1.3, np.arange(1, 21)
    expected = 0.7**2 * (1 - np.cos(lag * c)) / (1 - np.cos(c))
    np.testing.assert_allclose(mean_square_displacement(np.full(200, 0.7), c), expected, rtol=1e-10)


@pytest.mark.parametrize(
    "arguments, name", [(dict(series=np.zeros(49)), "series"), (dict(frequencies=0), "frequencies")]
)
def test_bad_arguments_are_named(arguments, name):
    with pytest.raises(ValueError, match=f"Argument `{name}`"):
        zero_one(**(dict(series=np.zeros(100)) | arguments))
