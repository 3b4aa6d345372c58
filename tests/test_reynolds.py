"""The short film of the package beside Reynolds' equation on lands of finite width.

`literature` compares the solver of the latter with closed forms, finite volumes and printed tables.
"""

import numpy as np
import pytest
from reynolds import film_force

from jaxcage.forces import short_film_force


def test_squeeze_of_a_long_film_in_closed_form():
    """Full film, no rotation: -12 pi eps'/(1 - eps^2)^(3/2) in units of mu R L (R/c)^2."""
    at = lambda lam: 4 * lam**2 * film_force((0.5, 0.0), (0.1, 0.0), lam, 0.0, cavitation="full", profiles=8)
    np.testing.assert_allclose(2 * at(20.0) - at(10.0), [-1.2 * np.pi / 0.75**1.5, 0.0], atol=0.01)


@pytest.mark.parametrize(
    "cavitation, short", [("full", "full"), ("reynolds", "positive_pressure"), ("guembel", "positive_pressure")]
)
def test_short_film_is_the_limit_of_narrow_lands(cavitation: str, short: str):
    r, v = (0.55, -0.2), (0.12, 0.05)
    expected = np.array(short_film_force(short, *r, *v, 1.0))
    found = film_force(r, v, 1e-5, cavitation=cavitation, stations=1024, profiles=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=3e-5 * np.linalg.norm(expected))


def short_film_excess(eps: float, slenderness: float, cavitation: str = "reynolds") -> float:
    """|F_short|/|F| - 1 of a cage that does not whirl, both on the same stations."""
    size = lambda lam: np.linalg.norm(film_force((eps, 0.0), (0.0, 0.0), lam, cavitation=cavitation, stations=1024))
    return float(size(0.0) / size(slenderness) - 1)


@pytest.mark.parametrize("cavitation", ["reynolds", "full"])
def test_short_film_is_off_by_the_square_of_the_slenderness(cavitation: str):
    found = [short_film_excess(0.6, lam, cavitation) for lam in (0.01, 0.02, 0.04)]
    assert found[1] / found[0] == pytest.approx(4, rel=0.04) and found[2] / found[1] == pytest.approx(4, rel=0.04)


@pytest.mark.parametrize("width, percent", [(1.45, (0.0182, 0.083, 0.380)), (6.5, (0.362, 1.64, 7.30))])
def test_error_of_the_short_film_at_the_lands_of_the_published_bearing(width: float, percent: tuple[float, ...]):
    """The identified land and the widest that fits [mm], at a radius of 46 mm; eps 0.4, 0.8 and 0.95."""
    found = [100 * short_film_excess(eps, width / 92.0) for eps in (0.4, 0.8, 0.95)]
    np.testing.assert_allclose(found, percent, rtol=0.02)


def test_half_speed_whirl_makes_no_pressure():
    np.testing.assert_allclose(film_force((0.3, 0.1), (-0.05, 0.15), 0.05), 0.0, atol=1e-14)
