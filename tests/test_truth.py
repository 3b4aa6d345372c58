"""What the default method says is so: labels and exponents that were those of the steps once, and errors as stated.

Every sweep of case 1a and of what differs from it in its numbers runs by the same compiled programs.
"""

import numpy as np
import pytest
import reference

import jaxcage as jc
from jaxcage.integrate._controlled import DEFAULT_ERROR


MODEL = jc.case("1a")
SHORT = dict(discard=20, revolutions=20, confirm=False, horizon=0)


def replaced(**numbers) -> jc.CageModel:
    return jc.replace(MODEL, **numbers)


def assert_closes(model, sweep, i, j):
    """The state in which a periodic lane ends returns by the reference, too."""
    period = int(sweep.label[i, j].partition("-")[2])
    field = reference.field(model, float(sweep.speed[i]))
    back = reference.revolutions(field, sweep.last[i, j], period).strobe[-1]
    np.testing.assert_allclose(back / field.scale, sweep.last[i, j] / field.scale, rtol=0, atol=DEFAULT_ERROR)


def test_an_orbit_that_fixed_steps_called_chaotic_is_periodic():
    found = jc.sweep(MODEL, jc.rpm(18200, 18400, 3), horizon=0)
    assert set(found.label.ravel()) <= {"periodic-2", "periodic-4"}
    assert np.all(np.abs(found.exponents + 0.07) < 0.05)
    assert_closes(MODEL, found, 1, 0)


def test_a_stiff_land_is_periodic():
    model = replaced(stiffness=5e9)
    found = jc.sweep(model, jc.rpm(18000), horizon=0)
    assert found.label.tolist() == [["periodic-2"] * 3]
    assert_closes(model, found, 0, 0)


def test_a_stiff_land_that_is_touched_early_is_periodic_or_not_known():
    found = jc.sweep(replaced(stiffness=1e10, onset=0.6), jc.rpm(6000), horizon=0)
    assert set(found.label.ravel()) <= {"periodic-3", "inaccurate"}
    sure = found.label == "periodic-3"
    assert found.exponents[sure] == pytest.approx(-0.040, abs=5e-3)


def test_an_exponent_on_a_soft_support_is_that_of_the_motion():
    model = replaced(stiffness_x=1e7, stiffness_y=1e7)
    found = jc.sweep(model, jc.rpm(600), discard=100, revolutions=100, horizon=0)
    assert found.exponents == pytest.approx(-0.321, abs=0.01)
    field = reference.field(model, float(found.speed[0]))
    direction = [0.3, 0.5, -0.6, 0.4]
    grown = reference.growth(field, found.last[0, 0], 12, direction=direction, tolerance=1e-8)
    assert np.mean(grown[4:]) == pytest.approx(found.exponents[0, 0, 0], abs=0.03)


@pytest.mark.parametrize("wide", [False, True])
def test_errors_of_successful_lanes_are_stated_and_within_the_tolerance(wide):
    finished = 0
    for seed in range(3):
        drawn = reference.random_model(seed, wide)
        same = [n for n in jc.parameters(MODEL) if n in jc.parameters(drawn)]
        model = jc.replace(MODEL, **{n: jc.parameters(drawn)[n] for n in same})
        found = jc.sweep(model, reference.random_speeds(seed, 3, wide), **SHORT)
        error = found.error[~found.failed]
        assert np.all(error > 0) and np.all(error <= DEFAULT_ERROR)
        assert np.all(np.isnan(found.last[found.failed])) and np.all(found.label[found.failed] != "chaotic")
        finished += error.size
    assert finished > 20


def test_a_hopeless_design_leaves_its_neighbours_as_they_are():
    designs = [MODEL, replaced(stiffness=1e16, onset=0.3), replaced(eccentricity=2e-5)]
    speeds = jc.rpm(9000, 15000, 2)
    starts = [(0.6 * float(MODEL.clearance), 0.0, 0.0, 0.0)]
    beside = jc.sweep_designs(designs, speeds, starts=starts, **SHORT)
    assert not np.any(np.isin(beside[1].label, ("chaotic", "undecided", "quasi-periodic")))
    alone = jc.sweep_designs([designs[0], designs[2], designs[2]], speeds, starts=starts, **SHORT)
    for here, there in ((beside[0], alone[0]), (beside[2], alone[2])):
        for name in ("strobe", "block_growth", "outcome", "error", "peak"):
            assert np.array_equal(getattr(here, name), getattr(there, name)), name
