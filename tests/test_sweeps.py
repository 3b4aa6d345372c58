"""Sweeps: lanes do not depend on how they are spread; followed chaos, confirmation, hysteresis, ramps."""

import json
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from helpers import raw_sweep

import jaxcage as jc
from jaxcage.analysis import summary
from jaxcage.lanes import ramp_revolutions, ramp_up_down


def duffing(tau, q, v, speed):
    """Hardening Duffing x'' + 0.1 x' + x + x^3 = 0.3 cos(speed t)."""
    del speed
    (x,), (u,) = q, v
    return (-0.1 * u - x - x**3 + 0.3 * jnp.cos(tau),)


HARDENING = jc.ForcedOscillator(duffing, coordinates=1)
UEDA = jc.ForcedOscillator(lambda tau, q, v, speed: (-0.05 * v[0] - q[0] ** 3 + 7.5 * jnp.cos(tau),), coordinates=1)
FAST = jc.method("rk4", steps=128)


def test_lanes_do_not_depend_on_their_neighbours_or_chunks():
    """300 lanes in three chunks, and the same speeds in pieces: bit for bit the same."""
    speeds = np.linspace(1.0, 2.0, 150)
    options = {"discard": 5, "revolutions": 20, "blocks": 4, "keep": 8, "method": FAST}
    initial_states = [(0.1, 0.0), (1.0, 0.5)]
    whole = raw_sweep(HARDENING, speeds, initial_states=initial_states, **options)
    pieces = [raw_sweep(HARDENING, speeds[i::2], initial_states=initial_states, **options) for i in (0, 1)]
    for i, piece in enumerate(pieces):
        assert np.array_equal(whole["strobe"][i::2], piece["strobe"])
        assert np.array_equal(whole["block_growth"][i::2], piece["block_growth"])


@pytest.fixture(scope="module")
def followed():
    """Ueda's oscillator, whose chaos is an attractor at some speeds and a transient at others."""
    return jc.sweep(UEDA, np.linspace(0.9, 1.2, 60), discard=30, revolutions=60, blocks=6, horizon=700, method=FAST)


def test_chaos_is_followed_to_the_horizon(followed):
    """What is called a transient is calm at the end, what is called chaotic is not."""
    label, escape, horizon = followed["label"].values, followed["escape"].values, followed.attrs["horizon"]
    assert set(np.unique(label)) >= {"chaotic", "transient"}
    assert np.all(np.isinf(escape[label == "chaotic"]))
    assert np.all(np.isfinite(escape[label == "transient"]))
    assert np.all((escape[label == "transient"] > 30) & (escape[label == "transient"] <= horizon))
    assert horizon >= 700 and "chaos continued to" in summary(followed)
    late = raw_sweep(
        UEDA,
        followed["speed"].values,
        initial_states=followed["last"].values,
        discard=0,
        revolutions=60,
        blocks=6,
        method=FAST,
    )
    assert np.mean(late["label"].values[label == "chaotic"] == "chaotic") > 0.9  # a few more escape later
    assert np.all(late["label"].values[label == "transient"] != "chaotic")


def test_labels_are_confirmed_by_finer_steps(followed):
    """Steps too coarse for Ueda's oscillator: what they call chaotic is corrected, and it is said how often."""
    lanes, changed, moved = json.loads(followed.attrs["confirmed"])[0]
    assert 0 < lanes <= followed["label"].size and changed + moved <= lanes
    coarse = jc.method("rk4", steps=16)
    length = {"discard": 200, "revolutions": 60, "blocks": 6}
    rough, sure = (
        jc.sweep(UEDA, followed["speed"].values, confirm=c, horizon=0, method=coarse, **length) for c in (False, True)
    )
    where = (rough["label"] != sure["label"]).values
    assert rough.attrs["confirmed"] == "[]"
    assert json.loads(sure.attrs["confirmed"])[0][1] >= np.sum(where) > 0
    assert np.all(sure["error"].values[where] < rough["error"].values[where])


def test_ramp_follows_its_speed_and_agrees_with_steady_runs_when_slow():
    run = jc.ramp(HARDENING, 1.0, 1.1, revolutions=400, samples=8, start=(0.1, 0.0), method=FAST)
    assert run.speed[0] == 1.0 and run.speed[-1] == pytest.approx(1.1, abs=1e-4)
    # time of a ramp linear in phase: integral of dtau / speed
    exact = 2 * np.pi * 400 / 0.1 * np.log(run.speed[-1] / run.speed[0])
    assert run.time[-1] == pytest.approx(exact, rel=1e-6)
    steady = jc.simulate(HARDENING, 1.1, revolutions=1, samples=8, discard=400, start=(0.1, 0.0), method=FAST)
    assert np.max(np.abs(run.state[-8:, 0] - steady.state[:, 0])) < 5e-3


RATE = 0.01
"""By which the clock decays in a revolution."""
TURN = 2.0 * np.pi * (np.sqrt(5.0) - 1.0)
"""Angle by which the second oscillator goes on in a revolution, incommensurate with it."""
LENGTH: dict[str, Any] = dict(
    initial_states=None, discard=30, revolutions=60, blocks=6, method=jc.method("rk4", steps=128), confirm=False
)


def ueda_until(tau, y, speed):
    """Ueda's oscillator, chaotic until its clock has come down to 1 and heavily damped from then on, beside an
    oscillator that turns by an irrational part of a revolution, or rests."""
    del speed
    x, u, clock, p, q = y
    damping = 0.05 + 3.0 * jax.nn.sigmoid((1.0 - clock) / (0.2 * RATE))
    turn = TURN / (2 * jnp.pi)
    return u, -damping * u - x**3 + 7.5 * jnp.cos(tau), -RATE / (2 * jnp.pi) * clock, -turn * q, turn * p


def lanes_that_end_after(revolutions: np.ndarray, turning: bool) -> xr.Dataset:
    """A lane for each, in which chaos ends after so many revolutions; its end never closes if the other one turns."""
    initial_states = [
        (0.1 + 0.01 * i, 0.2, float(np.exp(RATE * n)), float(turning), 0.0) for i, n in enumerate(revolutions)
    ]
    system = jc.ForcedSystem(ueda_until, dimension=5)
    return jc.sweep(system, np.array([1.0]), **LENGTH | dict(initial_states=initial_states), horizon=1200)


@pytest.mark.parametrize("turning", [False, True], ids=["periodic", "quasi-periodic"])
def test_lanes_leave_chaos_when_its_clock_says_so(turning):
    """Within the observed part, in every part of a stage, long before they close, and not before the horizon."""
    ends = np.array([*range(100, 1000, 47), 2000, 5000])
    found = lanes_that_end_after(ends, turning)
    label = found["label"].values[0]
    assert np.all(np.isin(label[ends > 120], ("chaotic", "transient")))
    escape, leaves = found["escape"].values[0], ends < found.attrs["horizon"]
    assert np.array_equal(np.isfinite(escape), leaves)
    late = escape[leaves] - ends[leaves]
    assert np.all((late > -30) & (late <= 60)), late
    assert np.all(label[leaves & (ends > 120)] == "transient")


def test_exponents_of_the_last_revolutions_leave_the_rest_as_it_is():
    options = dict(discard=100, revolutions=100, confirm=False, horizon=0, initial_states=1)
    whole, last = (jc.sweep(HARDENING, np.array([0.8, 1.5]), exponent_revolutions=n, **options) for n in (0, 10))
    assert last.sizes["growth_block"] == 2 and set(last.label.values.ravel()) == {"periodic-1"}
    for name, tolerance in {"strobe": 1e-4, "exponents": 0.05, "steps": 4.0}.items():
        np.testing.assert_allclose(last[name].values, whole[name].values, atol=tolerance)
    with pytest.raises(ValueError, match="`exponent_revolutions` must be 0 or above 95 with a horizon, but is 10"):
        jc.sweep(HARDENING, np.array([0.8, 1.5]), exponent_revolutions=10, **options | {"horizon": 3000})


def test_a_ramp_takes_as_long_as_its_rate_says():
    first, last, seconds = 300.0, 1500.0, 7.0
    count = ramp_revolutions(HARDENING, first, last, seconds)
    speed = first + (last - first) * (np.arange(64 * count) + 0.5) / (64 * count)
    assert np.sum(2 * np.pi / 64 / speed) == pytest.approx(seconds, rel=1e-3)


@pytest.mark.wide
def test_at_a_crawl_it_is_the_orbit_at_that_speed():
    model, method = jc.case("1a"), jc.method("rk4", steps=256)
    found = ramp_up_down(model, *jc.rpm(15000, 15001), jc.rpm(0.5), windows=4, settle=200, method=method)
    run = jc.simulate(model, jc.rpm(15000), revolutions=200, samples=32, discard=200, method=method)
    size = float(np.max(np.ptp(run.state[:, :2], axis=0)))
    assert found["size"].values == pytest.approx(size, rel=0.05)


def test_the_largest_eccentricity_of_a_run_up_is_that_between_samples_too():
    model, ends = jc.case("1a"), jc.rpm(15000, 15100)
    found = ramp_up_down(model, *ends, jc.rpm(3135), windows=2, settle=0)
    run = jc.ramp(model, *ends, revolutions=found.attrs["revolutions"], samples=32)
    sampled = np.max(np.hypot(*run.state[:, :2].T)) / float(model.clearance)
    assert found["eccentricity"].values[0].max() == pytest.approx(run.peak, rel=1e-9) and run.peak > 1.0001 * sampled
