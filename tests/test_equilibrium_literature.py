"""Equilibrium and whirl of a short bearing against published closed forms and printed digits.

Friswell et al. (Dynamics of Rotating Machines, 2010, p. 177) take u across the load and v on the load line, with the
rotation from u to v, as our x and y with the load along -y: their matrices are ours entry by entry, and those that ROSS
(`CylindricalBearing`) prints. Half a turn of both axes changes nothing.
"""

import jax
import numpy as np
import pytest
from helpers import preliminary, unforced
from scipy.optimize import brentq
from short_bearing import (
    LARGEST_WHIRLING,
    attitude_angle,
    eccentricity_ratio,
    film_coefficients,
    load_number,
    whirl_threshold,
)

from jaxcage import replace
from jaxcage.analysis import measures
from jaxcage.forces import film_scale
from jaxcage.solve import simulate


def friswell(eps):
    """Friswell et al. (2010), p. 177, with v against the load: K c/W and C c omega/W."""
    q = 1 - eps**2
    h = 1 / (np.pi**2 * q + 16 * eps**2) ** 1.5
    p2 = np.pi**2
    kxx = 4 * h * (p2 * (2 - eps**2) + 16 * eps**2)
    kxy = h * np.pi * (p2 * q**2 - 16 * eps**4) / (eps * np.sqrt(q))
    kyx = -h * np.pi * (p2 * q * (1 + 2 * eps**2) + 32 * eps**2 * (1 + eps**2)) / (eps * np.sqrt(q))
    kyy = 4 * h * (p2 * (1 + 2 * eps**2) + 32 * eps**2 * (1 + eps**2) / q)
    cxx = h * 2 * np.pi * np.sqrt(q) * (p2 * (1 + 2 * eps**2) - 16 * eps**2) / eps
    cxy = -8 * h * (p2 * (1 + 2 * eps**2) - 16 * eps**2)
    cyy = h * 2 * np.pi * (p2 * q**2 + 48 * eps**2) / (eps * np.sqrt(q))
    return np.array([[kxx, kxy], [kyx, kyy]]), np.array([[cxx, cxy], [cxy, cyy]])


def threshold(eps):
    c = film_coefficients(eps)
    return whirl_threshold(c.stiffness, c.damping)


@pytest.mark.parametrize("film", ["fixed_half", "positive_pressure"])
@pytest.mark.parametrize("eps", [1e-3, 0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95])
def test_autodiff_coefficients_are_friswells_closed_forms(eps, film):
    ours = film_coefficients(eps, film)
    stiffness, damping = friswell(eps)
    np.testing.assert_allclose(ours.stiffness, stiffness, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(ours.damping, damping, rtol=1e-8, atol=1e-8)
    assert float(ours.load_number) == pytest.approx(float(load_number(eps)), rel=1e-12)
    assert float(ours.attitude_angle) == pytest.approx(float(attitude_angle(eps)), rel=1e-12)


def test_bearing_of_50_mm_radius():
    """R 50, L 25 mm, c 100 um, 1000 N, 3000 rpm, 20 mPa s: digits printed by an independent program."""
    eps = eccentricity_ratio(1000.0 / (film_scale(0.02, 0.05, 0.025, 1e-4) * 3000.0 * np.pi / 30))
    assert float(eps) == pytest.approx(0.6757879254, abs=6e-11)
    assert np.degrees(attitude_angle(eps)) == pytest.approx(40.58502207, abs=6e-9)


@pytest.mark.wide
def test_smallest_threshold():
    eps = np.linspace(0.4, 0.5, 10001)
    speed = np.asarray(jax.vmap(threshold)(eps).speed)
    place = np.argmin(speed)
    assert speed[place] == pytest.approx(2.53171, abs=6e-6)
    assert eps[place] == pytest.approx(0.45697, abs=2e-5)
    slope = jax.grad(lambda e: threshold(e).speed)(eps[place])
    assert abs(float(slope)) < 1e-3


def test_no_whirl_from_the_largest_eccentricity_on():
    assert LARGEST_WHIRLING == pytest.approx(0.756030, abs=6e-7)
    assert float(threshold(LARGEST_WHIRLING - 1e-9).speed) > 1e4
    found = jax.vmap(threshold)(np.linspace(LARGEST_WHIRLING + 1e-12, 0.99, 50))
    assert np.all(np.isinf(found.speed)) and np.all(np.isnan(found.whirl_ratio))


def test_full_film_whirls_at_every_speed_at_half_speed():
    c = film_coefficients(0.5, "full")
    assert np.degrees(c.attitude_angle) == pytest.approx(90.0)
    assert float(c.load_number) == pytest.approx(np.pi * 0.5 / (2 * 0.75**1.5), rel=1e-12)
    found = whirl_threshold(c.stiffness, c.damping)
    assert float(found.speed) < 1e-6


@pytest.mark.parametrize("eps", [0.02, 0.3, 0.6, 0.74])
def test_eigenvalues_cross_the_axis_at_rouths_threshold(eps):
    c, found = film_coefficients(eps), threshold(eps)
    for factor, sign in ((0.99, -1), (1.0, 0), (1.01, 1)):
        m = (factor * found.speed) ** 2
        matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-c.stiffness / m, -c.damping / m]])
        values = np.linalg.eigvals(matrix)
        worst = values[np.argmax(values.real)]
        if sign == 0:
            assert abs(worst.real) < 1e-10
            assert abs(worst.imag) == pytest.approx(float(found.whirl_ratio), rel=1e-9)
        else:
            assert np.sign(worst.real) == sign and abs(worst.real) > 1e-6


@pytest.mark.wide
@pytest.mark.parametrize("film", ["fixed_half", "positive_pressure"])
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_simulated_whirl_decays_and_grows_as_the_eigenvalues_say(factor, film):
    """A push of 1e-3 c from the equilibrium, within 1 % of the threshold: rate, and whirl between 0.500 and 0.524."""
    model = replace(unforced(preliminary("1a")), cage_mass=0.02, **{"film.model": film})
    c, law = float(model.clearance), model.film
    size = law.n_lands * float(film_scale(model.lubricant.dynamic_viscosity, model.land_radius, law.land_width, c))
    number = lambda speed: float(model.cage_mass) * 9.81 / (size * speed)
    edge = lambda speed: float(threshold(eccentricity_ratio(number(speed))).speed) * np.sqrt(9.81 / c)
    speed = factor * brentq(lambda w: edge(w) - w, 350.0, 700.0)
    eps = eccentricity_ratio(number(speed))
    angle, found = float(attitude_angle(eps)), film_coefficients(eps, film)
    m = speed**2 * c / 9.81
    k, d = (np.asarray(x) / m for x in (found.stiffness, found.damping))
    values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-k, -d]]))
    worst = values[np.argmax(values.real)]
    rest = eps * c * np.array([np.sin(angle), -np.cos(angle)])
    start = (rest[0] + 1e-3 * c, rest[1], 0.0, 0.0)
    run = simulate(model, speed, revolutions=60, discard=20, start=start)
    away = np.linalg.norm(run.state[:, :2] - rest, axis=1)
    largest = np.max(away.reshape(6, -1), axis=1)  # of ten revolutions each: five turns of whirl
    rate = np.log(largest[-1] / largest[0]) / (50 * 2 * np.pi)
    assert np.sign(rate) == (1 if factor > 1 else -1)
    assert rate == pytest.approx(worst.real, rel=0.05)
    ratio = measures(model, run).value("whirl_ratio")
    assert 0.500 < ratio < 0.524
    assert ratio == pytest.approx(abs(worst.imag), rel=5e-3)
