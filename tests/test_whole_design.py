"""Designs of the whole bearing beside sweeps of the same runs: objective, change, shares of the variance, budgets."""

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.design import (
    Runs,
    bearing_objective,
    before_and_after,
    drawn_states,
    global_sensitivity,
    mean_gradient,
    statistic,
    tolerance_budget,
)


jc.enable_x64()
SPEED = float(jc.rpm(10000))
MODEL = jc.whole_bearing("nu2310")
RUNS = Runs.of_bearing(SPEED, initial_states=2, discard=2, revolutions=2)
PRICES = {"power": 3.0, "slip": 1.0, "balance": 2.0}


def swept(model: jc.BearingModel):
    """The runs that `RUNS` stands for."""
    states = drawn_states(model, np.array([SPEED]), RUNS.initial_states, 0)
    return jc.sweep(model, SPEED, initial_states=states, **RUNS.settings)


@pytest.mark.wide
def test_the_objective_is_what_the_terms_are_beside_now():
    """It is 1 now; elsewhere each weighted term is over its value now, the balance in closed form."""
    objective, eccentricity = bearing_objective(MODEL, RUNS, PRICES), 12e-6
    other = jc.replace(MODEL, guidance_gap=0.54e-3, eccentricity=eccentricity)
    here, there = swept(MODEL), swept(other)
    ratio = lambda name: float(there[name].mean() / here[name].mean())
    expected = 3 * ratio("friction_power_W") + ratio("cage_slip") + 2 * eccentricity / 23e-6
    found = objective.values(RUNS)([MODEL, other])
    np.testing.assert_allclose(found, [1.0, expected / 6], rtol=1e-3)


@pytest.mark.wide
def test_before_and_after_are_of_the_same_starts():
    """A wider gap drags less (Petroff); the change has the error of differences, start by start."""
    better = jc.replace(MODEL, guidance_gap=0.6e-3, eccentricity=10e-6)
    rows, failed = before_and_after(MODEL, better, RUNS)
    found, runs = {row.name: row for row in rows}, RUNS.run([MODEL, better])
    power, (before, after) = found["friction_power_W"], runs["friction_power_W_blocks"].values[:, 0].mean(axis=-1)
    change = after - before
    assert failed == 0 and power.unit == "W" and power.before == pytest.approx(before.mean())
    assert power.change == pytest.approx(change.mean()) and power.change < 0
    assert power.change_error == pytest.approx(change.std(ddof=1) / np.sqrt(change.size))
    grade = found["balance_grade_mm_per_s"]
    assert grade.before == pytest.approx(23e-3 * float(MODEL.rolling_cage_speed(SPEED)))
    assert grade.change == pytest.approx(-13 / 23 * grade.before)


@pytest.mark.wide
def test_shares_and_budgets():
    """The power over a wide range of gap and a narrow one of the pockets; a budget is slopes times tolerances."""
    vary = {"guidance_gap": (0.4e-3, 0.6e-3), "pocket_clearance": (0.29e-3, 0.31e-3)}
    shares = global_sensitivity(MODEL, vary, statistic(MODEL, "friction_power_W").blocks(RUNS), samples=8)
    # 0.86 and 0.10, with bars of some 0.5 and 0.07
    assert shares.total["guidance_gap"] > 3 * shares.total["pocket_clearance"] > 0 and 0 < shares.scatter < 1
    names = ("guidance_gap", "pocket_clearance")
    runs = Runs(SPEED, discard=1, revolutions=2, blocks=2, exponents=0)
    power = mean_gradient(MODEL, runs, ["friction_power_W"], directions=names, designs=12).statistics[
        "friction_power_W"
    ]
    budget = tolerance_budget(power, dict.fromkeys(names, 0.02))
    expected = 0.02 * power.value * np.abs(power.elasticity)
    assert [budget.deviation[name] for name in names] == pytest.approx(expected)
    assert budget.total == pytest.approx(np.hypot(*expected)) and budget.value == pytest.approx(power.value)


@pytest.mark.parametrize(
    "given, said",
    [
        ({"noise": 1.0}, "`prices` must name some of wear, force"),
        ({"wear": 0.0}, "`prices` must be at least 0 and not all 0"),
    ],
)
def test_refusals(given, said):
    with pytest.raises(ValueError, match=said):
        bearing_objective(MODEL, RUNS, given)


def test_runs_that_cannot_be():
    with pytest.raises(ValueError, match="`revolutions` must be a multiple of 2 above 0, but 3 was given"):
        Runs.of_bearing(SPEED, revolutions=3)
