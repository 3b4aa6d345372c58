"""Crises whose place and law are known: tent maps with a planted law, the logistic map beyond 4."""

import numpy as np
import pytest

from jaxcage.analysis import crisis


HORIZON = 400
PLACE, SLOPE, POWER, AMPLITUDE = 100.0, 1.5, 1.5, 2e-3


def tents(seed: int, lanes: int = 240, bend: float = 0.0):
    """Speeds, designs and escape times, in blocks of 5, of tent maps of slope 2 exp(kappa), which lose 1 - exp(-kappa)
    in each step and keep their uniform density; kappa is the planted law, or bent off it."""
    rng = np.random.default_rng(seed)
    speed, x = PLACE + rng.uniform(-1, 10, lanes), rng.normal(size=(lanes, 1)).clip(-2, 2)
    away = np.maximum(speed - PLACE - SLOPE * x[:, 0], 0.0)
    kappa = AMPLITUDE * away**POWER * np.exp(-bend * away)
    y, times = rng.random(lanes), np.full(lanes, np.inf)
    for n in range(1, HORIZON + 1):
        y = 2 * np.exp(kappa) * np.minimum(y, 1 - y)
        y[~np.isfinite(y) | (y <= 0)] = rng.random()  # slope 2 runs out of binary digits
        times[(y > 1) & np.isinf(times)] = 5 * np.ceil(n / 5)
        y = np.where(y > 1, 0.3, y)
    return speed, x, times


def logistic(seed: int, lanes: int = 600, horizon: int = 1000):
    """r and escape times of the logistic map beyond r = 4: kappa is sqrt(r - 4) / pi to leading order."""
    rng = np.random.default_rng(seed)
    r, y, times = rng.uniform(4.0, 4.01, lanes), rng.uniform(0.1, 0.9, lanes), np.full(lanes, np.inf)
    for n in range(1, horizon + 1):
        y = np.where(np.isfinite(times), 0.5, r * y * (1 - y))
        times[(y > 1) & np.isinf(times)] = n
    return r, times


def test_place_power_and_slope_of_a_planted_crisis_are_within_their_errors():
    inside, held, fits = np.zeros(3), 0, 0
    for seed in range(8):
        speed, x, times = tents(seed)
        found = crisis(times, HORIZON, speed, x, block=5, beyond="above", draws=15, seed=seed)
        off = np.array([found.speed - PLACE, found.power - POWER, found.slope[0] - SLOPE])
        error = np.array([found.speed_error, found.power_error, found.slope_error[0]])
        inside += np.abs(off) < 2 * error
        held += found.interval[0] < PLACE < found.interval[1]
        fits += found.p_value > 0.02
        assert np.all(error < [1.0, 0.4, 0.3])
    assert np.all(inside >= 6) and held >= 6 and fits >= 7


def test_the_logistic_map_ends_at_four_with_the_power_of_one_half():
    r, times = logistic(0)
    found = crisis(times, 1000, r, block=1, beyond="above", t0=20, draws=30)
    assert abs(found.speed - 4) < 3 * found.speed_error < 1e-3
    assert found.interval[0] < 4 < found.interval[1] and np.ptp(found.interval) < 2e-3
    assert abs(found.power - 0.5) < 3 * found.power_error < 0.3
    assert found.mean_life(4.005) == pytest.approx(np.pi / np.sqrt(0.005), rel=0.2)
    assert found.mean_life(3.99) == np.inf and found.slope.size == 0
    assert "mean life ~ distance^-(0." in str(found)


def test_a_crisis_below_is_one_above_in_the_mirror():
    speed, x, times = tents(0)
    above = crisis(times, HORIZON, speed, x, block=5, beyond="above", draws=2)
    below = crisis(times, HORIZON, -speed, x, block=5, beyond="below", draws=2)
    assert below.speed == pytest.approx(-above.speed) and below.slope == pytest.approx(-above.slope)
    assert below.power == pytest.approx(above.power) and below.mean_life(-110.0) == pytest.approx(
        above.mean_life(110.0)
    )


def test_a_law_that_is_no_power_is_found_out():
    speed, x, times = tents(0, 3000, bend=0.6)
    assert crisis(times, HORIZON, speed, x, block=5, beyond="above", draws=2).p_value < 1e-3


def test_lanes_that_failed_or_were_calm_do_not_count():
    speed, x, times = tents(1)
    more = np.append(times, [np.nan, 0.0])
    beside = crisis(
        more, HORIZON, np.append(speed, [101, 102]), np.vstack([x, x[:2]]), block=5, beyond="above", draws=2
    )
    alone = crisis(times, HORIZON, speed, x, block=5, beyond="above", draws=2)
    assert beside.lanes == alone.lanes and beside.speed == pytest.approx(alone.speed)


def test_what_cannot_be_told_is_refused():
    with pytest.raises(ValueError, match="at least 10 escapes after 0 revolutions, but 4 of 50"):
        crisis(np.where(np.arange(50) < 4, 100.0, np.inf), 200, np.arange(50.0), block=10, beyond="above")
    with pytest.raises(ValueError, match="`beyond` must be above or below, but 'left'"):
        crisis(np.full(50, 100.0), 200, np.arange(50.0), block=10, beyond="left")
