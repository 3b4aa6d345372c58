"""Measures of orbits whose every measure is known."""

import dataclasses

import numpy as np
import pytest
from helpers import preliminary

import jaxcage as jc
from jaxcage.analysis import cage_forces, measures
from jaxcage.models.cage_quantities import winding


SPEED = 1000.0
GAP = 0.45e-3


def orbit(radius=1e-4, ratio=1.0, centre=(0.0, 0.0), flatten=1.0, revolutions=8, samples=64, speed=SPEED):
    """Centre on an ellipse at `ratio` times the cage speed."""
    tau = 2 * np.pi * np.arange(revolutions * samples) / samples
    a, w = ratio * tau, ratio * speed
    position = [centre[0] + radius * np.cos(a), centre[1] + flatten * radius * np.sin(a)]
    velocity = [-radius * w * np.sin(a), flatten * radius * w * np.cos(a)]
    return trajectory(tau, np.stack(position + velocity, axis=1), speed, samples)


def trajectory(tau, state, speed: float | np.ndarray = SPEED, samples=64, peak=0.0, outcome="successful"):
    speed = np.broadcast_to(np.asarray(speed, dtype=float), tau.shape).copy()
    return jc.Trajectory(
        time=tau / speed,
        tau=tau,
        state=state,
        speed=speed,
        samples=samples,
        peak=peak,
        outcome=outcome,
    )


@pytest.mark.parametrize("ratio", [1.0, 0.5, -0.25])
@pytest.mark.parametrize("centre", [(0.0, 0.0), (2e-5, -3e-5)])
def test_circular_orbit(ratio, centre):
    m = measures(preliminary("1a"), orbit(ratio=ratio, centre=centre))
    assert m.value("whirl_ratio") == pytest.approx(ratio, rel=1e-9)
    assert m.value("rms") == pytest.approx(1e-4, rel=1e-9)
    assert m.value("peak_displacement") == pytest.approx(1e-4, rel=1e-9)
    assert m.value("velocity_scatter") < 1e-12


@pytest.mark.parametrize("ratio", [1.0, -2.0])
def test_the_whirl_of_a_flat_ellipse_is_whole_after_whole_revolutions(ratio):
    """Its angular velocity varies fourfold, so that the step after the last sample, which is not recorded, counts."""
    m = measures(preliminary("1a"), orbit(ratio=ratio, flatten=0.5, revolutions=2))
    assert m.value("whirl_ratio") == m.value("rib_whirl_ratio") == pytest.approx(ratio, abs=1e-4)


def test_ellipse_and_its_velocity_scatter():
    """rms^2 = (a^2 + b^2)/2; |v| = a w sqrt(sin^2 + k^2 cos^2) with k = b/a."""
    m = measures(preliminary("1a"), orbit(flatten=0.5, samples=256))
    assert m.value("rms") == pytest.approx(1e-4 * np.sqrt(1.25 / 2), rel=1e-9)
    assert m.value("whirl_ratio") == pytest.approx(1.0, abs=1e-3)
    a = np.linspace(0, 2 * np.pi, 100001)[:-1]
    pace = np.sqrt(np.sin(a) ** 2 + 0.25 * np.cos(a) ** 2)
    assert m.value("velocity_scatter") == pytest.approx(np.std(pace) / np.mean(pace), rel=1e-3)
    assert m.value("peak_displacement") == pytest.approx(1e-4, rel=1e-9)


@pytest.mark.parametrize("peak, eps", [(0.0, 0.5), (0.8, 0.8), (1.1, 1.1)])
def test_film_thickness_uses_the_largest_eps_of_any_step(peak, eps):
    run = dataclasses.replace(orbit(radius=0.5 * GAP), peak=peak)
    m = measures(preliminary("1a"), run)
    assert m.value("largest_eps") == pytest.approx(eps)
    assert m.value("minimum_film_thickness") == pytest.approx(max(GAP * (1 - eps), 0.0), abs=1e-18)


def test_synchronous_impact_and_its_impulse():
    """A |sin tau|: peak A, impulse 4 A/omega in a revolution."""
    m = measures(preliminary("1a"), orbit(samples=256))
    assert m.value("peak_impact_force") == pytest.approx(109.9051, rel=1e-12)
    assert m.value("impact_impulse") == pytest.approx(4 * 109.9051 / SPEED, rel=1e-4)
    assert m.value("peak_contact_force") == 0.0 and m.value("contact_impulse") == 0.0


def test_steady_contact_force_and_its_impulse():
    """Whirl at a constant penetration of 0.01 c: K p^(10/9), no damping at restitution 1."""
    model = preliminary("1a")
    m = measures(model, orbit(radius=0.98 * GAP))
    expected = 68992.2 / GAP ** (10 / 9) * (0.01 * GAP) ** (10 / 9)
    assert m.value("peak_contact_force") == pytest.approx(expected, rel=1e-3)
    assert m.value("mean_contact_force") == pytest.approx(m.value("peak_contact_force"), rel=1e-9)
    assert m.value("contact_impulse") == pytest.approx(m.value("mean_contact_force") * 2 * np.pi / SPEED, rel=1e-9)


@pytest.mark.parametrize("eps, kept", [(0.0, 0.0), (0.5, 0.5), (0.99, 0.97)])
def test_drag_power_is_that_of_the_sheared_film(eps, kept):
    model = preliminary("1a")
    radius, width, viscosity = (92.1e-3 - GAP) / 2, 4.2679e-3, 870 * 56e-6
    one = 2 * np.pi * viscosity * SPEED**2 * radius**3 * width / (GAP * np.sqrt(1 - kept**2))
    m = measures(model, orbit(radius=eps * GAP))
    assert m.value("drag_power") == pytest.approx(2 * one, rel=1e-3)


@pytest.mark.wide
def test_energy_balance_of_a_synchronous_orbit():
    """On a closed orbit the impacts and the unbalance put in what film and support take out."""
    model, speed = preliminary("1a"), 16000 * np.pi / 30
    run = jc.simulate(model, speed, revolutions=4, discard=400, samples=128)
    forces, velocity = cage_forces(model, run), run.state[:, 2:]
    power = {name: float(np.mean(np.sum(f * velocity, axis=1))) for name, f in forces.items()}
    assert power["impact"] + power["unbalance"] > 1.0
    assert sum(power.values()) == pytest.approx(0.0, abs=1e-3 * abs(power["impact"]))
    assert abs(power["weight"]) < 1e-4
    m = measures(model, run)
    assert m.value("film_power") == pytest.approx(-power["film"], rel=1e-9)
    assert m.value("whirl_ratio") == pytest.approx(1.0, abs=0.01)


def test_whirl_that_cannot_be_told_is_none():
    """To and fro through the mean centre, or by less than the run's error; a hundred circles with one such pass can."""
    model, circle = preliminary("1a"), orbit(samples=64)
    for error, samples in ((np.nan, 63), (1e-8, 64)):
        line = dataclasses.replace(orbit(flatten=1e-9, samples=samples), error=error)
        assert np.isnan(measures(model, line).value("whirl_ratio"))
    assert np.isnan(measures(model, dataclasses.replace(circle, error=2e-4 / GAP)).value("whirl_ratio"))
    assert measures(model, dataclasses.replace(circle, error=0.5e-4 / GAP)).value("whirl_ratio") == pytest.approx(1.0)
    once, whole = (np.array([[1.0, 0.0], [-1.0, 1e-12]]), np.linspace(0, 200 * np.pi, 6400)[:, None])
    passed = np.concatenate([np.hstack([np.cos(whole), np.sin(whole)]), once])
    assert winding(passed, np.zeros(2))[1] == 1
