"""What the validation computes to hold us against: it solves its equations, and makes its numbers again."""

import math

import numpy as np
import pytest
from helpers import slow_but

from jaxcage.validation import (
    DUFFING_DOUBLINGS,
    EXPONENTS,
    UEDA,
    doubling,
    duffing,
    film_equations,
    film_pressure,
    full_bearing,
    largest_exponent,
    load_integral,
    pendulum,
)


@pytest.mark.parametrize("slenderness, eps", [(1.0, 0.8), (0.25, 0.4)])
def test_finite_volumes_solve_the_complementarity_problem(slenderness: float, eps: float):
    """p >= 0, no cell takes in more than flows out, and both at once nowhere."""
    matrix, source = film_equations(slenderness, eps, 120, 8)
    pressure, _ = film_pressure(slenderness, eps, 120, 8)
    p = pressure.ravel()
    excess = matrix @ p - source
    little = 1e-12 * abs(source).max()
    assert p.min() == 0.0 and excess.min() > -little and np.all((p == 0) | (abs(excess) < little))
    assert 0.3 < np.mean(p > 0) < 0.7


@pytest.mark.parametrize("eps", [0.2, 0.6])
def test_finite_volumes_of_a_short_bearing_are_ocvirks(eps: float):
    """N = 1/(4 pi S lambda^2) = eps sqrt(16 eps^2 + pi^2 (1 - eps^2))/(4 (1 - eps^2)^2); off by lambda^2."""
    found = full_bearing(0.02, eps)
    number = eps * math.sqrt(16 * eps**2 + math.pi**2 * (1 - eps**2)) / (4 * (1 - eps**2) ** 2)
    assert 1 / (4 * math.pi * 0.02**2 * found.sommerfeld) == pytest.approx(number, rel=2e-3)
    angle = math.degrees(math.atan2(math.pi * math.sqrt(1 - eps**2), 4 * eps))
    assert found.angle == pytest.approx(angle, abs=0.05)


def test_error_of_the_finite_volumes():
    found = full_bearing(1.0, 0.6)
    assert 0 < found.sommerfeld_error < 1.2e-4 * found.sommerfeld and 0 < found.angle_error < 2e-3


@pytest.mark.parametrize("zone", [0.1, 0.3])
def test_load_integral_against_a_sum(zone: float):
    """The middles of a million arcs of the circle."""
    angles = (np.arange(10**6) + 0.5) * 2 * np.pi / 10**6
    share = np.maximum(1 - (1 - np.cos(angles)) / (2 * zone), 0.0) ** (10 / 9) * np.cos(angles)
    assert load_integral(zone) == pytest.approx(share.mean(), rel=1e-9)


BRACKETS = {1: (0.262, 0.27), 2: (0.285, 0.288), 4: (0.2908, 0.2912), 8: (0.29196, 0.29205)}


@pytest.mark.wide
@pytest.mark.parametrize("periods", BRACKETS)
def test_shooting_finds_the_doublings_of_the_table(periods: int):
    _, number = DUFFING_DOUBLINGS[periods]
    found = doubling(lambda g: duffing(0.3, g, 1.2), periods, BRACKETS[periods], (1.0, 0.0))
    assert found == pytest.approx(number.value, abs=number.tolerance)


OSCILLATORS = {
    "Ueda x'' + .05 x' + x^3 = 7.5 sin t": UEDA,
    "Duffing x'' + .25 x' - x + x^3 = .4 cos t": duffing(0.25, 0.4, 1.0),
    "pendulum x'' + .05 x' + sin x = .6 cos .7t": pendulum(0.05, 0.6, 0.7),
    "Duffing x'' + .3 x' - x + x^3 = .5 cos 1.2t": duffing(0.3, 0.5, 1.2),
    "Duffing x'' + .15 x' - x + x^3 = .3 cos t": duffing(0.15, 0.3, 1.0),
    "pendulum x'' + .5 x' + sin x = 1.5 cos 2t/3": pendulum(0.5, 1.5, 2 / 3),
}


@pytest.mark.wide
@pytest.mark.parametrize(
    "name", slow_but(OSCILLATORS, "Duffing x'' + .3 x' - x + x^3 = .5 cos 1.2t", "Ueda x'' + .05 x' + x^3 = 7.5 sin t")
)
def test_ensembles_find_the_exponents_of_the_table(name: str):
    """A smaller one than the table's."""
    number = EXPONENTS[name]
    found, error = largest_exponent(OSCILLATORS[name], starts=1024, discard=50, periods=150, steps=64)
    assert error < 6e-4 and abs(found - number.value) < number.tolerance + 3 * error
