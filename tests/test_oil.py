"""Viscosity of oils: ASTM D341 and D2270 against published values."""

import numpy as np
import pytest

import jaxcage
import jaxcage.bearing as jb


def celsius(t):
    return t + 273.15


@pytest.mark.parametrize(
    "first, second, target, published, tolerance",
    [
        # olezol.com, "Viscosity-temperature extrapolation ASTM D341": SAE 140, ISO VG 68.
        ((40, 404.0), (100, 28.0), 60, 132.126, 1e-5),
        ((40, 68.0), (80, 14.85), 100, 8.8, 2e-3),
        # "Viscosity vs temperature calculator" (scribd 361017004), ISO VG 32.
        ((40, 32.0), (100, 5.4), 80, 8.5, 5e-3),
    ],
)
def test_walther_against_published_extrapolations(first, second, target, published, tolerance):
    points = (x for t, nu in (first, second) for x in (nu * 1e-6, celsius(t)))
    found = jb.Lubricant(870.0, *points, temperature=celsius(target)).kinematic_viscosity
    assert float(found) * 1e6 == pytest.approx(published, rel=tolerance)


@pytest.mark.parametrize("grade, viscosity", [(32, 0.0278), (56, 0.0487), (78, 0.0679)])
def test_dynamic_viscosity_of_the_published_oils(grade, viscosity):
    assert float(jb.vg(grade).dynamic_viscosity) == pytest.approx(viscosity, abs=5e-5)


# ASTM D2270: L and H as quadratics of the viscosity at 100 C [mm^2/s], with the range of each.
D2270 = [
    (5.0, 6.4, (0.10100, 16.6350, -45.469), (0.04985, 9.1613, -18.557)),
    (6.4, 7.0, (3.35714, -23.5643, 78.466), (0.22619, 7.7369, -16.656)),
    (7.0, 7.7, (0.01191, 21.4750, -72.870), (0.79762, -0.7321, 14.610)),
    (7.7, 9.0, (0.41858, 16.1558, -56.040), (0.05794, 10.5156, -28.240)),
    (9.0, 12.0, (0.88779, 7.5527, -16.600), (0.26665, 6.7015, -10.810)),
    (12.0, 15.0, (0.76720, 10.7972, -38.180), (0.20073, 8.4658, -22.490)),
    (18.0, 22.0, (0.97256, 5.2500, -0.980), (0.24504, 7.4160, -16.730)),
    (28.0, 40.0, (0.87031, 9.7157, -50.770), (0.18411, 10.1015, -46.750)),
]


def viscosity_index(nu_40, nu_100):
    low, high = next((l, h) for a, b, l, h in D2270 if a <= nu_100 < b)
    return 100 * (np.polyval(low, nu_100) - nu_40) / (np.polyval(low, nu_100) - np.polyval(high, nu_100))


def test_viscosity_index_of_the_standards_examples():
    # Examples of ASTM D2270 as evaluated from its tables by the `chemicals` package.
    assert viscosity_index(73.3, 8.86) == pytest.approx(92.43, abs=0.02)
    assert viscosity_index(73.5, 8.86) == pytest.approx(92.03, abs=0.02)


@pytest.mark.parametrize("grade", [32, 46, 56, 68, 78, 100, 150, 220, 460, 680])
def test_oils_by_grade_have_a_viscosity_index_of_about_95(grade):
    nu_100 = float(jb.vg(grade, temperature=373.15).kinematic_viscosity) * 1e6
    assert viscosity_index(grade, nu_100) == pytest.approx(95, abs=1.5)


def test_an_oil_thinner_than_its_law_allows_is_doubted():
    assert jb.vg(32, celsius(100)).doubts() == []
    assert jb.Lubricant(870.0, 2e-6, 313.15, 1e-6, 373.15).doubts() == []
    (said,) = jb.vg(32, celsius(200)).doubts()
    assert "at 200 °C" in said and "above 2 mm²/s" in said


@pytest.mark.parametrize("oil, said", [
    (lambda: jb.vg(-56), "`grade` must be positive and finite, but -56 was given"),
    (lambda: jb.Lubricant(870.0, 56e-6, 313.15, 7e-6, 313.15), "both are 313.15 K"),
    (lambda: jb.Lubricant(870.0, 2e-5, 313.15, 5e-5, 373.15), "must not rise with the temperature, but 2e-05 m.2/s"),
    (lambda: jb.Lubricant(870.0, 5e-5, 373.15, 2e-5, 313.15), "must not rise .* at 373.15 K and .* were given"),
])  # fmt: skip
def test_impossible_oils(oil, said):
    with pytest.raises(ValueError, match=said):
        oil()


def test_a_part_of_a_model_is_compared_when_its_numbers_are_replaced():
    with pytest.raises(ValueError, match="must not rise with the temperature"):
        jaxcage.replace(jaxcage.case("1a"), viscosity_2=1e-4)
