"""Drag of the oil on rollers against printed numbers, another table, and the moment of a whole bearing."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import jaxcage as jc
import jaxcage.bearing as jb


RPM = np.pi / 30


def test_drag_of_a_cylinder():
    """The fit agrees with a hand calculation at 6080 and with tabulated points of the measured curve."""
    by_hand = 1.18 + 6.8 / 2334.0 + 1.96 / 77.97 - 2.432 / 14.456
    assert float(jb.cylinder_drag_coefficient(6080.0)) == pytest.approx(by_hand, rel=1e-3)
    points = {1.0: 10.0, 10.0: 3.0, 1e3: 1.0, 1e4: 1.2, 2e5: 1.2}
    for reynolds, coefficient in points.items():
        assert float(jb.cylinder_drag_coefficient(reynolds)) == pytest.approx(coefficient, rel=0.12)
    assert jb.cylinder_drag_coefficient(1e9) == jb.cylinder_drag_coefficient(2e5)


def test_the_factors_of_a_printed_example():
    """SKF's 22208 E at 3500 rpm in 68 mm^2/s: 0.85 and 0.8, with K_Z = 5.5 of spherical roller bearings (page 104)."""
    bearing = jc.replace(jb.listed("NU208").bearing, bore=40e-3, outside_diameter=80e-3)
    heating, starved = jb.rolling_factors(bearing, 68e-6, 3500 * RPM, jb.STARVATION["bath"], k_z=5.5)
    assert float(heating) == pytest.approx(0.85, abs=0.01) and float(starved) == pytest.approx(0.8, abs=0.01)


def test_moment_of_rolling_resistance():
    """NU2310 under 300 N at 6700 rpm in 56 mm^2/s by hand: 740 N mm in plenty of oil, 336 N mm by both factors."""
    given = jb.nu2310(), 300.0, 56e-6, 6700 * RPM, 1.48e-6
    by_hand = 1.48e-6 * 80**2.41 * 300**0.31 * (56 * 6700) ** 0.6
    assert by_hand == pytest.approx(740, rel=2e-3)
    heating, starved = jb.rolling_factors(jb.nu2310(), 56e-6, 6700 * RPM, 3e-8)
    found = float(jb.rolling_moment(*given, 3e-8))
    assert 1e3 * found == pytest.approx(by_hand * float(heating * starved), rel=1e-6) == pytest.approx(336, rel=3e-3)


def test_all_contacts_have_the_power_of_the_whole():
    """Many rollers without clearance: the sum of couple times speed of rolling, both rings, is the moment's power."""
    bearing, load, speed, n = jb.nu2310(), 5000.0, 500.0, 13
    couple = float(jb.rolling_couple(bearing, 56e-6, speed, 1.48e-6, 3e-8))
    largest = load / (n / (2 * np.pi) * quad(lambda a: np.cos(a) ** (19 / 9), -np.pi / 2, np.pi / 2)[0])
    each = lambda a: (largest * np.cos(a) ** (10 / 9)) ** 0.31
    total = couple * n / (2 * np.pi) * quad(each, -np.pi / 2, np.pi / 2)[0]
    spin = speed * 32.5 / 16  # of rolling, against the shaft
    moment = total * (spin + (spin + speed)) / speed
    assert moment == pytest.approx(float(jb.rolling_moment(bearing, load, 56e-6, speed, 1.48e-6, 3e-8)), rel=1e-6)


def test_hot_oil_resists_less_where_it_is_not_missing():
    flooded = [float(jb.rolling_couple(jb.nu2310(), nu, 700.0, 1.48e-6, 0.0)) for nu in (160e-6, 56e-6, 12e-6)]
    assert flooded[0] > flooded[1] > flooded[2] > 0
    model = jc.replace(jc.whole_bearing("nu2310"), **{"drag.rolling_law": "flooded", "drag.drag_law": "cylinder"})
    model = jc.replace(model, drag_coefficient=1.0, rolling_coefficient=1.48e-6, oil_share=0.015)
    at = model.at_speed(jnp.asarray(700.0))
    assert float(at.outer_race.rolling) == pytest.approx(flooded[1], rel=1e-3)
    force = float(at.drag) * (700 * 0.4010 * 40.52e-3) ** 2  # rho C_d/2 D l v^2
    assert force == pytest.approx(0.015 * 870 * 0.951 / 2 * 16e-3 * 27e-3 * 11.375**2, rel=5e-3)
