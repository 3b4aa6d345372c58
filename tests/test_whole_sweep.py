"""Sweeps of the whole bearing: lanes against single runs, exponents against two runs, failures, symmetry."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_whole_motion import SPEED, bearing

import jaxcage as jc
from jaxcage.models.whole import BearingState, rolling_start, state_scale
from jaxcage.solve import FINISHED, SAMPLES, SPACING, STALLED, Bearings, limits_of


SHORT = {"discard": 0, "revolutions": 1, "blocks": 1}


def lanes_of(model, states):
    """Lanes of one bearing at one speed, and its states in units of the scale."""
    scale = state_scale(model, jnp.asarray(SPEED))
    scale = scale._replace(rollers=scale.rollers[:, 0])
    scale = jax.tree.map(lambda x: np.stack([x] * len(states), axis=-1), scale)
    at = model.at_speed(jnp.asarray(SPEED))
    slowest = np.full(len(states), STALLED * abs(float(at.rolling_cage_speed)))
    bearings = Bearings(at, scale, slowest, over_angle=True)
    return bearings, bearings.packed(np.arange(len(states)), jax.tree.map(lambda *x: np.stack(x), *states))


def run_samples(bearings, y, samples, tolerance, direction=None):
    """The lanes from sample to sample."""
    tangents = None if direction is None else np.tile(direction, (len(y), 1))
    options = dict(tangents=tangents, step=1e-4)
    return bearings.run(np.arange(len(y)), y, SPACING, samples, samples, tolerance, limits_of(1.0), **options)


def in_units(model, state):
    """A state over its magnitudes, in one row as the engine has it."""
    unit = state_scale(model, jnp.asarray(SPEED))
    return np.concatenate([np.ravel((state.rollers / unit.rollers).T), state.bodies / unit.bodies])


@pytest.fixture(scope="module")
def start():
    """A state with contacts of all kinds: a revolution on from the cage near its lowest place."""
    return jc.simulate_bearing(bearing(), SPEED, revolutions=1, samples=32).last


def along():
    """A direction of tangent vectors, in units of the state."""
    return np.random.default_rng(1).normal(size=5 * 13 + 9)


@pytest.mark.wide
def test_a_lane_is_a_simulation(start):
    """From one state over an eighth of a revolution, both by tight steps."""
    model = bearing()
    bearings, y = lanes_of(model, [start, rolling_start(model, SPEED, 1), rolling_start(model, SPEED)])
    ran = run_samples(bearings, y, 2, 1e-9, along())
    run = jc.simulate_bearing(model, SPEED, revolutions=1, samples=32, start=start, tolerance=1e-9)
    k = 2 * 32 // SAMPLES
    expected = BearingState(jnp.asarray(run.rollers[k]), jnp.asarray(run.bodies[k]), jnp.zeros(2))
    assert np.all(ran.mark == FINISHED) and run.outcome == "successful"
    moved = np.abs(in_units(model, expected) - in_units(model, start)).max()
    apart = np.abs(ran.state[0, :74] - in_units(model, expected)).max()
    assert apart < 1e-5 < 1e-2 < moved
    _, _, clock, integrals = bearings.unpacked([0], ran.state[:1])
    assert clock[0, 1] == pytest.approx(run.time[k], rel=1e-8)
    np.testing.assert_allclose(integrals[0, :-1], run.integrals[k] - run.integrals[0], rtol=1e-6, atol=1e-9)


@pytest.mark.wide
def test_growth_is_that_of_the_distance_of_two_runs(start):
    """Over an eighth of a revolution, the logarithm of the tangent's length against runs a little apart."""
    model, direction, little = bearing(), along(), 1e-7
    bearings, y = lanes_of(model, [start] * 3)
    y[1, :74] += little * direction
    y[2, :74] -= little * direction
    ran = run_samples(bearings, y, 2, 1e-9, direction)
    apart = np.linalg.norm(ran.state[1, :74] - ran.state[2, :74])
    expected = np.log(apart / (2 * little * np.linalg.norm(direction)))
    assert abs(expected) > 0.1
    assert ran.growth[0].sum() - np.log(np.linalg.norm(direction)) == pytest.approx(expected, abs=2e-3)


@pytest.mark.wide
def test_slow_shafts_run_through():
    """At 1000 rpm a sixteenth of a revolution takes 9 ms, in which neighbouring motions diverge by a factor of 100."""
    how = dict(starts=1, discard=1, revolutions=1, blocks=1)
    found = jc.sweep_bearing(bearing(), jc.rpm(1000.0), **how)
    assert found.outcome[0, 0] == "successful" and found.error[0, 0] < 0.05 and found.exponent[0, 0] > 50


@pytest.fixture(scope="module")
def swept():
    """A lane that fails, since its cage hardly turns, beside one that does not."""
    model = bearing(eccentricity=0.0)
    starts = [rolling_start(model, SPEED, 1), rolling_start(model, SPEED, turning=0.01)]
    return model, starts, jc.sweep_bearing(model, np.array([SPEED, 1.1 * SPEED]), starts=starts, **SHORT)


@pytest.mark.wide
def test_a_lane_that_fails_spoils_no_other(swept):
    model, starts, both = swept
    assert list(both.outcome[0]) == ["successful", "outside"] and both.state[0, 1] == "failed"
    alone = jc.sweep_bearing(model, SPEED, starts=starts[:1], **SHORT)
    for name in ("cage_slip", "pocket_force_max_N", "friction_power_W", "whirl_ratio", "exponent", "error"):
        good, bad = getattr(both, name)[0]
        np.testing.assert_array_equal(good, getattr(alone, name)[0, 0])
        assert np.all(np.isnan(bad)) and np.all(np.isfinite(good))


@pytest.fixture(scope="module")
def run(swept):
    """The lane that does not fail by itself."""
    model, starts, _ = swept
    return jc.simulate_bearing(model, SPEED, revolutions=1, samples=32, start=starts[0])


def test_measures_of_a_sweep_are_those_of_a_run(swept, run):
    """Over a revolution from the same state; two runs drift apart in it, but their means do not."""
    model, _, both = swept
    expected = jc.bearing_measures(model, run, SPEED)
    assert both.cage_slip[0, 0] == pytest.approx(expected.cage_slip, abs=2e-4)
    assert both.eccentricity_mean[0, 0] == pytest.approx(expected.eccentricity_mean, rel=1e-2)
    assert both.power_parts_W["film"][0, 0] == pytest.approx(expected.power_parts_W["film"], rel=1e-2)
    assert both.friction_power_W[0, 0] == pytest.approx(expected.friction_power_W, rel=1e-2)
    assert both.eccentricity_std[0, 0] == pytest.approx(expected.eccentricity_std, rel=0.1)
    for name in ("pocket_impulse_N_s", "land_impulse_N_s", "pocket_wear_mm3_per_h"):
        assert getattr(both, name)[0, 0] == pytest.approx(getattr(expected, name), rel=0.05)


def test_what_cannot_be_swept():
    with pytest.raises(ValueError, match="dynamic"):
        jc.sweep_bearing(bearing(**{"ring.ring_motion": "quasi_static"}), SPEED)
    model = bearing()
    for options in ({"starts": 4}, {"blocks": 3}, {"exponents": 2}, {"discard": -1}):
        with pytest.raises(ValueError, match=next(iter(options))):
            jc.sweep_bearing(model, SPEED, **options)
    with pytest.raises(ValueError, match="ascending"):
        jc.sweep_bearing(model, np.array([SPEED, SPEED]))
    few = rolling_start(model, SPEED)
    few = few._replace(rollers=few.rollers[:, :12])
    with pytest.raises(ValueError, match="with 13 rollers"):
        jc.sweep_bearing(model, SPEED, starts=[few])


@pytest.mark.wide
def test_designs_in_one_batch_are_those_one_by_one():
    """Two loads over a short window: as each alone, but for rounding that chaos makes large."""
    models = [bearing(load=load) for load in (4450.0, 2000.0)]
    options = dict(SHORT, starts=[rolling_start(models[0], SPEED, 1)], tolerance=1e-6)
    both = jc.sweep_bearings(models, SPEED, **options)
    for model, found in zip(models, both, strict=True):
        alone = jc.sweep_bearing(model, SPEED, **options)
        assert found.cage_slip[0, 0] == pytest.approx(alone.cage_slip[0, 0], abs=1e-4)
        assert found.friction_power_W[0, 0] == pytest.approx(alone.friction_power_W[0, 0], rel=1e-2)
    assert abs(both[0].friction_power_W[0, 0] / both[1].friction_power_W[0, 0] - 1) > 1e-3
