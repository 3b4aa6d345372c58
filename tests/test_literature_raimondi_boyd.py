"""A. A. Raimondi and J. Boyd, A solution for the finite journal bearing and its application to analysis and design III,
ASLE Transactions 1 (1958) 194: full bearings, fed with oil without pressure at the widest gap.

S = mu N (R/c)^2/P with N in revolutions per second and P = W/(L D) is 1/(4 pi lambda^2 f) of our force f and
slenderness lambda = L/D; their angle runs from the load line to the smallest gap in the direction of rotation, as ours.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxcage.forces import film_drive, film_pressure_field, pressure_force


# L/D, eps, S, attitude angle [deg].
TABLE = [
    (1.0, 0.2, 0.631, 74.02),
    (1.0, 0.4, 0.264, 63.10),
    (1.0, 0.6, 0.121, 50.58),
    (1.0, 0.8, 0.0446, 36.24),
    (0.5, 0.2, 2.03, 74.94),
    (0.5, 0.4, 0.779, 61.45),
    (0.5, 0.6, 0.319, 48.14),
    (0.5, 0.8, 0.0923, 33.31),
    (0.25, 0.2, 7.57, 75.18),
    (0.25, 0.4, 2.83, 60.86),
    (0.25, 0.6, 1.07, 46.72),
    (0.25, 0.8, 0.261, 31.04),
]
STATIONS = 256
WIDEST = np.arange(STATIONS) == STATIONS // 2


@jax.jit
def force(eps, slenderness):
    drive = film_drive(eps, jnp.zeros(()), 0.0, 0.0, 1.0)
    field = film_pressure_field(eps, jnp.zeros(()), *drive, slenderness, stations=STATIONS, profiles=2, grooves=WIDEST)
    return jnp.stack(pressure_force(field))


@pytest.mark.parametrize("slenderness, eps, number, angle", TABLE)
def test_full_bearing(slenderness: float, eps: float, number: float, angle: float):
    """Their grid gives three digits of S; it is good to about 1 %."""
    radial, tangential = map(float, force(jnp.asarray(eps), jnp.asarray(slenderness)))
    size = math.hypot(radial, tangential)
    assert 1 / (4 * math.pi * slenderness**2 * size) == pytest.approx(number, rel=0.015)
    assert math.degrees(math.atan2(tangential, -radial)) == pytest.approx(angle, abs=0.6)
