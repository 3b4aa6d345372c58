"""Edges of lasting chaos by survival regression, against maps whose escape rate is known."""

import numpy as np
import pytest

from jaxcage.analysis import hazard


HORIZON = 300
LAW = np.array([np.log(1 / HORIZON) + 0.2, 1.2, -0.5, 0.25])
"""log kappa at the middle, and its slopes."""


def escapes(x: np.ndarray, rng: np.random.Generator, curvature: float = 0.0) -> np.ndarray:
    """When lanes leave the unit interval under tent maps of slope 2 exp(kappa), which lose 1 - exp(-kappa) in each step
    and keep their uniform density; in blocks of ten steps, infinity for lanes that stay."""
    kappa = np.exp(LAW[0] + x @ LAW[1:] + curvature * x[:, 0] ** 2)
    y, times = rng.random(len(x)), np.full(len(x), np.inf)
    for n in range(1, HORIZON + 1):
        y = 2 * np.exp(kappa) * np.minimum(y, 1 - y)
        times[(y > 1) & np.isinf(times)] = 10 * np.ceil(n / 10)
    return times


def covariates(rng: np.random.Generator, lanes: int) -> np.ndarray:
    return np.column_stack([rng.uniform(-1.5, 1.5, lanes), rng.normal(size=(lanes, 2)).clip(-2, 2)])


def test_the_law_of_open_tent_maps_is_recovered():
    """Every coefficient within two of its standard errors in about 95 of 100 seeds."""
    within, fits = np.zeros(4), 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        x = covariates(rng, 300)
        found = hazard(escapes(x, rng), HORIZON, x, block=10)
        within += np.abs(found.coefficients - LAW) < 2 * np.sqrt(np.diag(found.covariance))
        fits += found.p_value > 0.05
    assert np.all(within >= 90) and fits >= 85


def test_lanes_that_fail_or_are_calm_at_the_beginning_do_not_count():
    rng = np.random.default_rng(0)
    x = covariates(rng, 400)
    times = escapes(x, rng)
    found = hazard(times, HORIZON, x, block=10, t0=20)
    more = hazard(
        np.concatenate([times, [np.nan, 0.0, 20.0]]), HORIZON, np.vstack([x, np.ones((3, 3))]), block=10, t0=20
    )
    np.testing.assert_allclose(more.coefficients, found.coefficients, rtol=1e-6)
    assert more.lanes == found.lanes == np.sum(times > 20)
    assert np.all(np.abs(found.coefficients - LAW) < 3 * np.sqrt(np.diag(found.covariance)))


def test_a_law_that_is_not_log_linear_is_found_out():
    rng = np.random.default_rng(1)
    x = covariates(rng, 1000)
    assert hazard(escapes(x, rng, curvature=-1.5), HORIZON, x, block=10).p_value < 1e-3


def test_too_few_escapes_are_refused():
    times = np.where(np.arange(50) < 4, 100.0, np.inf)
    with pytest.raises(ValueError, match="at least 10 escapes .* of 50 chaotic lanes 4 escaped"):
        hazard(times, HORIZON, np.zeros((50, 1)), block=10)
