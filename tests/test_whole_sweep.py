"""Sweeps of the whole bearing: lanes against single runs, exponents against two runs, failures."""

import jax.numpy as jnp
import numpy as np
import pytest
from test_whole_motion import SPEED, bearing

import jaxcage as jc
from jaxcage.lanes import Plan, Run, run_lanes
from jaxcage.models import INTEGRATED, bodies_of, rollers_of, rolling_start, state_scale
from jaxcage.solve import FINISHED, Lanes


SHORT = {"discard": 0, "revolutions": 1, "blocks": 1}


def run_samples(model, states, samples, tolerance, direction=None, **more):
    """Lanes of one bearing at one speed from sample to sample; their first states in units of the scale too."""
    lanes, every = Lanes.of([model], np.full(len(states), SPEED)), np.arange(len(states))
    y = np.array([[*state.row, *state.clock, *np.zeros(len(INTEGRATED))] for state in states])
    y = y / lanes.begin(every, y)[0]
    method, tangents = jc.native(tolerance), None
    if direction is not None:
        tangents = np.tile(direction, (len(y), 1, 1))
    engine = lanes.engine(0 if direction is None else 1, method, 16)
    return engine(lanes, y, samples, samples, method, tangents=tangents, **{"step": 1e-4} | more), y


def in_units(model, state):
    """A state over its magnitudes, in one row as the engine has it."""
    return np.asarray(state.row) / np.asarray(state_scale(model, jnp.asarray(SPEED)).row)


@pytest.fixture(scope="module")
def start():
    """A state with contacts of all kinds: a revolution on from the cage near its lowest place."""
    return jc.simulate(bearing(), SPEED, revolutions=1, samples=32).last


def along():
    """A direction of tangent vectors, in units of the state."""
    return np.random.default_rng(1).normal(size=5 * 13 + 9)


@pytest.mark.wide
def test_a_lane_is_a_simulation(start):
    """From one state over an eighth of a revolution, both by tight steps."""
    model = bearing()
    ran, _ = run_samples(model, [start, rolling_start(model, SPEED, 1), rolling_start(model, SPEED)], 2, 1e-9, along())
    run = jc.simulate(model, SPEED, revolutions=1, samples=32, start=start, method=jc.native(1e-9, 1e-2))
    assert np.all(ran.outcome == FINISHED) and run.outcome == "successful"
    unit = np.asarray(state_scale(model, SPEED).row)
    moved = np.abs(run.state[4] / unit - in_units(model, start)).max()
    assert np.abs(ran.strobe[0, :, :74] - run.state[2:5:2] / unit).max() < 1e-5 < 1e-2 < moved
    angle, seconds, *integrals = ran.state[0, 74:]
    assert angle == pytest.approx(float(run.angle[4]), abs=1e-12) and seconds == pytest.approx(run.time[4], rel=1e-8)
    np.testing.assert_allclose(integrals, run.integrals[4, 2:] - run.integrals[0, 2:], rtol=1e-6, atol=1e-9)
    largest = ran.peaks[0].max(axis=0)
    np.testing.assert_allclose(largest[1:4], run.peaks[:4].max(axis=0)[1:4], rtol=1e-3)


@pytest.mark.wide
def test_rates_in_machine_code_are_those_of_the_model(start):
    """A step so short that it is the rate: beside the field that JAX evaluates."""
    model, h = bearing(), 1e-7
    states = [start, rolling_start(model, SPEED, 1)]
    ran, y = run_samples(model, states, 1, 1e-3, step=h, turn=h)
    found = ran.state[:, :74]
    rates = [model.at_speed(jnp.asarray(SPEED)).rates(s) for s in states]
    for row, before, rate in zip(found, y, rates, strict=True):
        expected = in_units(model, rate.state) / abs(float(rate.state.clock[0]))
        np.testing.assert_allclose((row - before[:74]) / h, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


@pytest.mark.wide
def test_growth_is_that_of_the_distance_of_two_runs(start):
    """Over an eighth of a revolution, the logarithm of the tangent's length against runs a little apart."""
    model, direction, little = bearing(), along(), 1e-7
    unit = np.asarray(state_scale(model, SPEED).row) * little * direction
    moved = lambda sign: start._replace(
        rollers=start.rollers + sign * rollers_of(unit), bodies=start.bodies + sign * bodies_of(unit)
    )
    ran, _ = run_samples(model, [start, moved(1), moved(-1)], 2, 1e-9, direction)
    apart = np.linalg.norm(ran.state[1, :74] - ran.state[2, :74])
    expected = np.log(apart / (2 * little * np.linalg.norm(direction)))
    assert abs(expected) > 0.1
    assert ran.growth[0].sum() - np.log(np.linalg.norm(direction)) == pytest.approx(expected, abs=2e-3)


@pytest.mark.wide
def test_slow_shafts_run_through():
    """At 1000 rpm a sixteenth of a revolution takes 9 ms, in which neighbouring motions diverge by a factor of 100."""
    found = jc.sweep(bearing(), jc.rpm(1000.0), initial_states=1, discard=1, revolutions=1, blocks=1)
    assert found.outcome.item() == "successful" and found.error.item() < 0.05 and found.exponents.item() > 50


@pytest.mark.wide
def test_a_light_cage_in_cold_oil_runs_through():
    """45 g in 150 mm^2/s: at its land, where the second state begins, the film stops it in a millionth of a turn."""
    light = bearing(cage_mass=0.045, cage_inertia=8e-5, guidance_gap=0.35e-3, viscosity_1=150e-6)
    found = jc.sweep(light, jc.rpm(1500.0), initial_states=2, discard=0, revolutions=1, blocks=1)
    assert (found["outcome"] == "successful").all()


@pytest.mark.wide
def test_exponents_of_the_last_revolutions():
    """Followed over four of 16, all else over all; means are those of a run that follows them from the beginning."""
    options = dict(discard=0, revolutions=16, blocks=16, method=jc.native(1e-4, 1e-2))
    model = bearing()
    followed = lambda n: run_lanes(Plan.over_speed(model, SPEED, 1), Run.of(model, exponent_revolutions=n, **options))
    few, every = followed(4), followed(16)
    assert (few.sizes["growth_block"], every.sizes["growth_block"]) == (4, 16)
    assert few.sizes["block"] == every.sizes["block"] == 16
    late = every.block_growth.values[..., 4:, 0]
    assert few.exponents.item() == pytest.approx(late.mean(), abs=4 * late.std() / np.sqrt(4))
    assert few.friction_power_W.item() == pytest.approx(every.friction_power_W.item(), rel=0.05)


@pytest.fixture(scope="module")
def swept():
    """A lane that fails, since its cage hardly turns, beside one that does not."""
    model = bearing(eccentricity=0.0)
    initial_states = [rolling_start(model, SPEED, 1), rolling_start(model, SPEED, turning=0.01)]
    return (
        model,
        initial_states,
        jc.sweep(model, np.array([SPEED, 1.1 * SPEED]), initial_states=initial_states, **SHORT),
    )


@pytest.mark.wide
def test_a_lane_that_fails_spoils_no_other(swept):
    model, initial_states, both = swept
    assert list(both.outcome.values[0]) == ["successful", "outside"] and both.label.values[0, 1] == "failed"
    alone = jc.sweep(model, SPEED, initial_states=initial_states[:1], **SHORT)
    for name in ("cage_slip", "pocket_force_max_N", "friction_power_W", "whirl_ratio", "exponents"):
        good, bad = both[name].values[0]
        np.testing.assert_array_equal(good, alone[name].values[0, 0])
        assert np.all(np.isnan(bad)) and np.all(np.isfinite(good))


def test_measures_of_a_sweep_are_those_of_a_run(swept):
    """Over a revolution from the same state; two runs drift apart in it, but their means do not."""
    model, initial_states, both = swept
    run = jc.simulate(model, SPEED, revolutions=1, samples=32, start=initial_states[0])
    expected, found = jc.measures(model, run), both.isel(speed=0, initial_state=0)
    assert found.cage_slip.item() == pytest.approx(expected.value("cage_slip"), abs=2e-4)
    assert found.eccentricity_std.item() == pytest.approx(expected.value("eccentricity_std"), rel=0.1)
    for name in ("eccentricity_mean", "power_film_W", "friction_power_W"):
        assert found[name].item() == pytest.approx(expected.value(name), rel=1e-2)
    for name in ("pocket_impulse_N_s", "land_impulse_N_s", "pocket_wear_mm3_per_h"):
        assert found[name].item() == pytest.approx(expected.value(name), rel=0.05)


def test_what_cannot_be_swept():
    model = bearing()
    for method in (jc.method("rk4"), jc.native(pair="rodas4")):
        with pytest.raises(ValueError, match="must be `native`"):
            jc.sweep(model, SPEED, method=method)
    for options in ({"initial_states": 4}, {"blocks": 3}, {"exponents": 2}, {"discard": -1}):
        with pytest.raises(ValueError, match=next(iter(options))):
            jc.sweep(model, SPEED, **options)
    with pytest.raises(ValueError, match="ascending"):
        jc.sweep(model, np.array([SPEED, SPEED]))
    few = rolling_start(model, SPEED)
    few = few._replace(rollers=few.rollers[:, :12])
    with pytest.raises(ValueError, match="74 numbers"):
        jc.sweep(model, SPEED, initial_states=[few])


@pytest.mark.wide
def test_designs_in_one_batch_are_those_one_by_one():
    """Two loads over a short window: as each alone, but for rounding that chaos makes large."""
    models = [bearing(load=load) for load in (4450.0, 2000.0)]
    options = dict(SHORT, initial_states=[rolling_start(models[0], SPEED, 1)], method=jc.native(1e-6, 1e-2))
    both = jc.sweep(models, SPEED, **options)
    for i, model in enumerate(models):
        alone, found = jc.sweep(model, SPEED, **options), both.isel(design=i)
        assert found.cage_slip.item() == pytest.approx(alone.cage_slip.item(), abs=1e-4)
        assert found.friction_power_W.item() == pytest.approx(alone.friction_power_W.item(), rel=1e-2)
    assert abs(both.friction_power_W[0].item() / both.friction_power_W[1].item() - 1) > 1e-3
