"""Load distribution of roller bearings with clearance: Sjoevall's integral J_r, T. A. Harris, Rolling Bearing Analysis,
table of line contacts (exponent 1.1, ours 10/9), and NSK's load factors (CAT. No. E728g, section 5).
"""

from typing import Any

import jax
import pytest
from scipy.optimize import brentq

import jaxcage.bearing as jb


ROLLERS, CLEARANCE = 400, 4e-6


def thin_rollers(clearance):
    return jb.Bearing(0.05, 0.11, 0.04, ROLLERS, 5e-4, 0.027, 0.0921, 0.065, clearance, 3e-4)


@jax.jit
def shared(load):
    found = jb.load_distribution(thin_rollers(CLEARANCE), load)
    return found.shaft_shift, found.max_load


@pytest.mark.parametrize("zone, printed", [(0.1, 0.1268), (0.2, 0.1737), (0.3, 0.2055), (0.4, 0.2286)])
def test_load_distribution_integral(zone: float, printed: float):
    """J_r = F/(Z Q_max) where the load zone parameter 1/2 - G_r/(4 delta_s) is `zone`."""
    off = lambda load: 0.5 * (1 - CLEARANCE / (2 * float(shared(load)[0]))) - zone
    load: Any = brentq(off, 10.0, 1e6, xtol=1e-3)
    assert load / (ROLLERS * float(shared(load)[1])) == pytest.approx(printed, rel=0.006)


def test_load_factor_without_clearance():
    """Q_max Z/F = 4.08 of NSK, 1/0.2453 of Harris."""
    factor = float(jb.load_distribution(thin_rollers(0.0), 4450.0).max_load) * ROLLERS / 4450
    assert factor == pytest.approx(4.08, abs=0.006)
    assert 1 / factor == pytest.approx(0.2453, rel=0.003)
