"""Reports of a run of the whole bearing: forces and slips of each roller, around the bearing; spectra."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from reference import WholeBearing
from test_whole_motion import SPEED, bearing

import jaxcage as jc
from jaxcage.analysis import (
    OrderSpectrum,
    bearing_spectra,
    measures,
    named_lines,
)
from jaxcage.models import bearing_orders, roller_history, rolling_start


pytestmark = pytest.mark.wide
SAMPLES = 32


@pytest.fixture(scope="module")
def run():
    """Two revolutions from inside the clearance."""
    model = bearing()
    start = rolling_start(model, SPEED, cage=1)
    ran = jc.simulate(model, SPEED, revolutions=2, samples=SAMPLES, start=start)
    return model, ran, roller_history(model, ran)


def test_pocket_forces_are_those_of_the_second_implementation(run):
    """Force of all pockets on the cage, and of the land: together they move its mass centre."""
    model, ran, history = run
    theirs = WholeBearing(model, SPEED)
    e, weight = float(model.eccentricity), float(model.cage_mass * model.gravity)
    for i in (5, 17, 40, 63):
        _, bodies = theirs.rates(float(ran.angle[i]), ran.rollers[i], ran.bodies[i])
        out = np.exp(1j * ran.angle[i])
        pull = complex(bodies[2], bodies[3]) + (1j * bodies[4] - ran.bodies[i, 4] ** 2) * e * out
        expected = float(model.cage_mass) * pull + 1j * weight
        found = complex(*(history.pocket_on_cage[i] + history.land_on_cage[i]))
        assert found == pytest.approx(expected, rel=1e-8)
    assert np.abs(history.pocket_force).max() > 10


def test_impulse_wear_and_torque_are_integrals(run):
    model, ran, history = run
    found = measures(model, ran).value
    spent = ran.time[-1] - ran.time[0]
    assert found("pocket_impulse_N_s") == pytest.approx(found("pocket_force_mean_sum_N") * spent / 2, rel=1e-12)
    land = np.hypot(*history.land_on_cage.T)
    assert found("land_impulse_N_s") == pytest.approx(land[1:] @ np.diff(ran.time) / 2, rel=0.15)  # few samples for it
    rubbed = ran.total("pocket_friction") / float(model.pockets.pocket_friction)  # mu N v: the sliding is fast
    assert ran.total("pocket_rubbing") == pytest.approx(rubbed, rel=1e-4)
    wear = 6e-4 * rubbed / spent / 0.93e9 * 1e9 * 3600
    assert found("pocket_wear_mm3_per_h") == pytest.approx(wear, rel=1e-4)
    assert found("land_wear_mm3_per_h") == pytest.approx(0.0, abs=1e-9) and found("eccentricity_max") < 0.97
    assert found("friction_torque_N_m") * SPEED == pytest.approx(found("friction_power_W"), rel=1e-12)


def test_the_land_wears_where_it_is_touched():
    """A cage pressed on its land, which damps nothing, sliding at some 18 m/s: friction over its coefficient rubs."""
    model = bearing(**{"lubricant.density": 0.0, "restitution": 1.0})
    start = rolling_start(model, SPEED, cage=1)
    start = start._replace(bodies=start.bodies.at[0:2].set(jnp.array([0.0, -0.999 * float(model.clearance)])))
    ran = beginning(jc.simulate(model, SPEED, revolutions=1, samples=128, start=start), 2)
    assert ran.total("land_rubbing") > 1e-3
    friction = float(model.land_friction) * ran.total("land_rubbing")
    assert ran.total("land_contact") == pytest.approx(friction, rel=1e-5)
    speed = float(model.rolling_cage_speed(SPEED) * model.land_radius)
    pressed = ran.total("land_force") / np.hypot(1, float(model.land_friction))
    assert pressed * speed == pytest.approx(ran.total("land_rubbing"), rel=2e-2)


def test_the_synchronous_force_of_a_known_one(run):
    """Harmonics of a run whose pocket force is 7 cos(theta - 0.3) + 2 horizontally and 3 sin(2 theta) vertically."""
    model, ran, _ = run
    theta = ran.angle - ran.angle[0]
    time = theta / 400.0
    fx, fy = 7 * np.cos(theta - 0.3) + 2, 3 * np.sin(2 * theta)
    integrals = ran.integrals.copy()
    integrals[:, :2] = np.column_stack([ran.angle, time])
    running = lambda f: np.concatenate([[0.0], np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(time))])
    for name, f in (("x", fx), ("y", fy)):
        for part, wave in (("cos", np.cos(theta)), ("sin", np.sin(theta))):
            integrals[:, ran.beside.index(f"pocket_{name}_{part}")] = running(f * wave)
    found = measures(model, dataclasses.replace(ran, time=time, integrals=integrals))
    for name, force in (("synchronous_force_x_N", 7.0), ("synchronous_force_y_N", 0.0)):
        assert found[name].value == pytest.approx(force, rel=1e-9, abs=1e-9)
        assert found[name].error == pytest.approx(0.0, abs=1e-9)


def test_slips_where_the_outer_ring_turns():
    """A cage that turns clockwise hardly slips; rollers that roll without turning have no spin to compare with."""
    model = bearing(outer_speed=-SPEED)
    ran = jc.simulate(model, SPEED, revolutions=1, samples=SAMPLES)
    assert ran.total("cage_speed") < 0 and abs(measures(model, ran).value("cage_slip")) < 0.05
    model = bearing(outer_speed=SPEED * float(model.inner_radius / model.outer_radius))
    ran = jc.simulate(model, SPEED, revolutions=1, samples=SAMPLES)
    assert measures(model, ran).value("roller_slip_max") == 0
    assert not np.any(roller_history(model, ran).roller_slip)


def beginning(found, n):
    """The first samples of a run, or of a history."""
    each = {f.name: getattr(found, f.name) for f in dataclasses.fields(found)}
    return dataclasses.replace(found, **{k: x[:n] for k, x in each.items() if isinstance(x, np.ndarray)})


def test_orders_of_rolling_and_names_of_lines(run):
    model, ran, history = run
    orders = bearing_orders(model, ran)
    rolling = 1 / 0.401037
    assert orders["inner ring"] == pytest.approx(rolling, rel=0.03)
    assert orders["roller pass, outer ring"] == 13
    assert orders["roller pass, inner ring"] == pytest.approx(13 * (rolling - 1), rel=0.05)
    assert orders["roller spin"] == pytest.approx(81.04 / 16, rel=0.02)
    assert set(bearing_spectra(history)) == {"cage_place", "pocket_force"}
    order = np.arange(0, 30, 0.1)
    lines = OrderSpectrum(order, np.exp(-(((order - 13) / 0.15) ** 2)) + 0.5 * np.exp(-(((order - 8) / 0.15) ** 2)))
    assert [line.name for line in named_lines(lines, orders)] == ["roller pass, outer ring", None]
    with pytest.raises(ValueError, match="2 revolutions"):
        bearing_spectra(beginning(history, 40))
