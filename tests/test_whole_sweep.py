"""Sweeps of the whole bearing: lanes against single runs, exponents against two runs, failures, symmetry."""

import numpy as np
import pytest
from test_whole_motion import SPEED, bearing

import jaxcage as jc
from jaxcage.models import rolling_start
from jaxcage.solve import FINISHED, Lanes


SHORT = {"discard": 0, "revolutions": 1, "blocks": 1}
TIGHT = jc.native(1e-9, 1e-2)
SIXTEENTH = 2 * np.pi / 16


def an_eighth(model, states, tangents=None):
    """Lanes of one bearing from states [SI] over an eighth of a revolution, with a tangent of each, by tight steps."""
    lanes = Lanes.of([model], np.full(len(states), SPEED))
    which, y = np.arange(len(states)), lanes.completed(np.stack(states))
    scale, _ = lanes.begin(which, y)
    engine = lanes.engine(0 if tangents is None else 1, TIGHT, samples=16)
    how = {} if tangents is None else {"tangents": np.repeat(tangents[None, None], len(states), axis=0)}
    ran = engine(lanes.numbers(engine, which), y, 2, 2, TIGHT, **how)
    assert np.all(ran.mark == FINISHED)
    return ran, scale[0, : model.dimension]


@pytest.fixture(scope="module")
def start():
    """A state with contacts of all kinds: a revolution on from the cage near its lowest place."""
    return jc.simulate(bearing(), SPEED, revolutions=1, samples=32).last


@pytest.mark.wide
def test_a_lane_is_a_simulation(start):
    """From one state over an eighth of a revolution, both by tight steps."""
    model = bearing()
    others = (rolling_start(model, SPEED, 1), rolling_start(model, SPEED))
    ran, scale = an_eighth(model, [s.row for s in (start, *others)])
    run = jc.simulate(model, SPEED, revolutions=1, samples=32, start=start, method=TIGHT)
    dim, k = model.dimension, 4
    moved = np.abs((run.state[k] - run.state[0]) / scale).max()
    apart = np.abs((ran.state[0, :dim] - run.state[k]) / scale).max()
    assert run.outcome == "successful" and apart < 1e-5 < 1e-2 < moved
    np.testing.assert_allclose(ran.state[0, dim + 2 :], run.integrals[k, 2:], rtol=1e-6, atol=1e-9)


@pytest.mark.wide
def test_growth_is_that_of_the_distance_of_two_runs(start):
    """Over an eighth of a revolution, the logarithm of the tangent's length against runs a little apart."""
    model, little = bearing(), 1e-7
    direction = np.random.default_rng(1).normal(size=model.dimension)
    scale = np.asarray([float(x) for x in model.scale(SPEED)])
    row = np.asarray(start.row)
    ran, scale = an_eighth(model, [row + sign * little * direction * scale for sign in (0, 1, -1)], direction)
    apart = np.linalg.norm((ran.state[1] - ran.state[2])[: model.dimension] / scale)
    expected = np.log(apart / (2 * little * np.linalg.norm(direction)))
    assert abs(expected) > 0.1
    assert ran.growth[0].sum() - np.log(np.linalg.norm(direction)) == pytest.approx(expected, abs=2e-3)


@pytest.mark.wide
def test_slow_shafts_run_through():
    """At 1000 rpm a sixteenth of a revolution takes 9 ms, in which neighbouring motions diverge by a factor of 100."""
    found = jc.sweep(bearing(), jc.rpm(1000.0), starts=1, discard=1, revolutions=1, blocks=1)
    assert found.outcome.item() == "successful" and found.error.item() < 0.05 and found.exponents.item() > 50


@pytest.fixture(scope="module")
def swept():
    """A lane that fails, since its cage hardly turns, beside one that does not."""
    model = bearing(eccentricity=0.0)
    starts = [rolling_start(model, SPEED, 1), rolling_start(model, SPEED, turning=0.01)]
    return model, starts, jc.sweep(model, np.array([SPEED, 1.1 * SPEED]), starts=starts, **SHORT)


@pytest.mark.wide
def test_a_lane_that_fails_spoils_no_other(swept):
    model, starts, both = swept
    assert list(both.outcome.values[0]) == ["successful", "outside"] and both.label.values[0, 1] == "failed"
    alone = jc.sweep(model, SPEED, starts=starts[:1], **SHORT)
    for name in ("cage_slip", "pocket_force_max_N", "friction_power_W", "whirl_ratio", "exponents", "error"):
        good, bad = both[name].values[0]
        np.testing.assert_array_equal(good, alone[name].values[0, 0])
        assert np.all(np.isnan(bad)) and np.all(np.isfinite(good))


def test_measures_of_a_sweep_are_those_of_a_run(swept):
    """Over a revolution from the same state; two runs drift apart in it, but their means do not."""
    model, starts, both = swept
    run = jc.simulate(model, SPEED, revolutions=1, samples=32, start=starts[0])
    expected, found = jc.measures(model, run), both.isel(speed=0, start=0)
    assert found.cage_slip.item() == pytest.approx(expected.value("cage_slip"), abs=2e-4)
    assert found.eccentricity_std.item() == pytest.approx(expected.value("eccentricity_std"), rel=0.1)
    for name in ("eccentricity_mean", "power_film_W", "friction_power_W"):
        assert found[name].item() == pytest.approx(expected.value(name), rel=1e-2)
    for name in ("pocket_impulse_N_s", "land_impulse_N_s", "pocket_wear_mm3_per_h"):
        assert found[name].item() == pytest.approx(expected.value(name), rel=0.05)


def test_what_cannot_be_swept():
    with pytest.raises(ValueError, match="dynamic"):
        jc.sweep(bearing(**{"ring.ring_motion": "quasi_static"}), SPEED)
    model = bearing()
    for options in ({"starts": 4}, {"blocks": 3}, {"exponents": 2}, {"discard": -1}):
        with pytest.raises(ValueError, match=next(iter(options))):
            jc.sweep(model, SPEED, **options)
    with pytest.raises(ValueError, match="ascending"):
        jc.sweep(model, np.array([SPEED, SPEED]))
    few = rolling_start(model, SPEED)
    few = few._replace(rollers=few.rollers[:, :12])
    with pytest.raises(ValueError, match="74 numbers"):
        jc.sweep(model, SPEED, starts=[few])


@pytest.mark.wide
def test_designs_in_one_batch_are_those_one_by_one():
    """Two loads over a short window: as each alone, but for rounding that chaos makes large."""
    models = [bearing(load=load) for load in (4450.0, 2000.0)]
    options = dict(SHORT, starts=[rolling_start(models[0], SPEED, 1)], method=jc.native(1e-6, 1e-2))
    both = jc.sweep(models, SPEED, **options)
    for i, model in enumerate(models):
        alone, found = jc.sweep(model, SPEED, **options), both.isel(design=i)
        assert found.cage_slip.item() == pytest.approx(alone.cage_slip.item(), abs=1e-4)
        assert found.friction_power_W.item() == pytest.approx(alone.friction_power_W.item(), rel=1e-2)
    assert abs(both.friction_power_W[0].item() / both.friction_power_W[1].item() - 1) > 1e-3
