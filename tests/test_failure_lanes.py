"""A lane driven to failure is NaN in its own place and leaves every other lane untouched."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxcage.analysis import Plan
from jaxcage.integrate import OUTCOMES, method
from jaxcage.models import case
from jaxcage.sweep import rpm, sweep
from jaxcage.sweep._engine import run_lanes


MODEL = case("1a")
C = 0.45e-3
HEALTHY = (0.4 * C, 0.3 * C, 0.0, 0.0)
OTHER = (0.0, -0.5 * C, 0.0, 0.0)
SETTINGS = dict(discard=12, revolutions=16, blocks=4, keep=8, method=method("rodas4", steps=128))
FIELDS = "strobe", "last", "block_growth", "peak", "outcome"


def bytes_of(result, field, keep):
    return np.ascontiguousarray(np.asarray(getattr(result, field))[keep]).tobytes()


def assert_same_bytes(first, second, keep):
    for field in FIELDS:
        assert bytes_of(first, field, keep) == bytes_of(second, field, keep), field


def assert_failed(result, lane):
    assert result.outcome[lane] != 0
    assert result.outcome[lane] < len(OUTCOMES)
    assert result.label[lane] == "failed"
    assert np.all(np.isnan(result.last[lane])) and np.all(np.isnan(result.strobe[lane]))
    assert np.all(np.isnan(result.exponents[lane]))


BAD_STARTS = {
    "outside": ((1.5 * C, 0.0, 0.0, 0.0), "outside"),
    "far outside": ((0.0, -400.0 * C, 0.0, 0.0), "outside"),
    "not a number": ((float("nan"), 0.0, 0.0, 0.0), "not_finite"),
    "no velocity": ((0.0, 0.0, float("nan"), 0.0), "not_finite"),
    "infinite": ((0.0, 0.0, float("inf"), 0.0), "not_finite"),
    "absurdly fast": ((0.0, 0.0, 1e200, 0.0), None),
}


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("bad", BAD_STARTS)
def test_bad_start_fails_alone(bad, place):
    speeds = rpm(1.0) * np.array([9000.0, 15000.0])
    start, outcome = BAD_STARTS[bad]
    states = [HEALTHY, OTHER, (0.1 * C, -0.2 * C, 0.0, 0.1)]
    healthy = sweep(MODEL, speeds, starts=states, **SETTINGS)
    assert not np.any(healthy.failed)
    states[place] = start
    mixed = sweep(MODEL, speeds, starts=states, **SETTINGS)
    others = np.s_[:, [i for i in range(3) if i != place]]
    assert_same_bytes(mixed, healthy, others)
    np.testing.assert_array_equal(mixed.label[others], healthy.label[others])
    for k in range(speeds.size):
        assert_failed(mixed, (k, place))
        if outcome is not None:
            assert OUTCOMES[mixed.outcome[k, place]] == outcome
    share = np.sum(mixed.label == "chaotic", axis=1) / 2
    np.testing.assert_array_equal(mixed.chaotic_share, share)


@pytest.mark.parametrize("place", [0, 3])
def test_absurd_speed_fails_alone(place):
    """1e9 rpm among speeds of the paper; the engine is called as a sweep calls it, in any order."""
    plan = Plan(discard=12, block=4, blocks=4, keep=8, exponents=1)
    speeds = rpm(1.0) * np.array([9000.0, 12000.0, 15000.0, 18000.0])
    states = np.broadcast_to(OTHER, (4, 4)).copy()
    healthy = run_lanes(MODEL, SETTINGS["method"], plan, speeds, states)
    absurd = speeds.copy()
    absurd[place] = 1e9 * np.pi / 30
    mixed = run_lanes(MODEL, SETTINGS["method"], plan, absurd, states)
    others = [i for i in range(4) if i != place]
    for now, then in zip(mixed, healthy, strict=True):
        kept = np.ascontiguousarray(now[..., others]), np.ascontiguousarray(then[..., others])
        assert kept[0].tobytes() == kept[1].tobytes()
    assert np.all(healthy.outcome == 0)
    assert mixed.outcome[place] != 0
    assert np.all(np.isnan(mixed.last[:, place])) and np.all(np.isnan(mixed.growth[..., place]))


def test_absurd_speed_in_a_sweep():
    speeds = np.append(rpm(1.0) * np.array([9000.0, 15000.0]), 1e9 * np.pi / 30)
    calm = np.append(rpm(1.0) * np.array([9000.0, 15000.0]), 18000.0 * np.pi / 30)
    mixed = sweep(MODEL, speeds, starts=[OTHER, HEALTHY], **SETTINGS)
    healthy = sweep(MODEL, calm, starts=[OTHER, HEALTHY], **SETTINGS)
    assert_same_bytes(mixed, healthy, np.s_[:2])
    for start in (0, 1):
        assert_failed(mixed, (2, start))
    assert np.isnan(mixed.chaotic_share[2]) and not np.any(np.isnan(mixed.chaotic_share[:2]))


def test_lane_without_damping_fails_alone():
    """Zero damping and a destabilising coupling: whirl grows until the state leaves the model."""
    where = lambda m: (m.support.damping, m.support.cross_stiffness, m.contact.stiffness)
    zeros = tuple(jnp.asarray(v) for v in (0.0, 8e6, 1e4))
    model = eqx.tree_at(where, MODEL, zeros)
    speeds = rpm(1.0) * np.array([1500.0, 9000.0])
    result = sweep(model, speeds, starts=[HEALTHY, OTHER], **(SETTINGS | dict(discard=60)))
    assert np.all(result.failed)
    assert np.all(result.label == "failed")
    assert set(result.outcome.ravel()) <= {OUTCOMES.index(n) for n in ("outside", "not_finite")}


@pytest.mark.parametrize("exponents", [0, 1, 4])
def test_failed_lanes_whatever_is_observed(exponents):
    speeds = rpm(1.0) * np.array([9000.0])
    settings = SETTINGS | dict(exponents=exponents)
    mixed = sweep(MODEL, speeds, starts=[HEALTHY, (2 * C, 0.0, 0.0, 0.0)], **settings)
    healthy = sweep(MODEL, speeds, starts=[HEALTHY, OTHER], **settings)
    assert_same_bytes(mixed, healthy, np.s_[:, 0])
    assert_failed(mixed, (0, 1))
    if exponents == 4:
        assert np.all(np.isfinite(mixed.exponents[0, 0]))


@pytest.mark.parametrize("tolerance", [1e-6])
def test_bad_start_fails_alone_with_adaptive_steps(tolerance):
    speeds = rpm(1.0) * np.array([9000.0])
    settings = SETTINGS | dict(method=method(tolerance=tolerance))
    bad = (float("nan"), 0.0, 0.0, 0.0)
    mixed = sweep(MODEL, speeds, starts=[bad, HEALTHY], **settings)
    healthy = sweep(MODEL, speeds, starts=[OTHER, HEALTHY], **settings)
    assert_same_bytes(mixed, healthy, np.s_[:, 1])
    assert_failed(mixed, (0, 0))


def test_summary_counts_failures_apart():
    speeds = rpm(1.0) * np.array([15000.0])
    result = sweep(MODEL, speeds, starts=[HEALTHY, (1.5 * C, 0.0, 0.0, 0.0)], **SETTINGS)
    text = str(result)
    assert "1 failed" in text and "1 lanes failed: outside" in text
