"""J. C. Nicholas, L. E. Barrett and M. E. Leader, Experimental-theoretical comparison of instability onset speeds for a
three mass rotor supported by step journal bearings, ASME J. Mech. Des. 102 (1980) 344, table 6, set A: bearings with
two axial grooves of 20 degrees at the horizontal split, L/D = 1, S = 5.3 and 4.3: eccentricity ratios 0.03 and 0.04,
whirl threshold omega sqrt(c/g) = 2.1. J. C. Nicholas (1994) gives 2.05 for a vanishing load.
"""

import jax.numpy as jnp
import pytest

from jaxcage.analysis import whirl_threshold
from jaxcage.validation._film import grooved_bearing


@pytest.mark.parametrize("number, eps", [(5.3, 0.03), (4.3, 0.04)])
def test_whirl_threshold_of_two_axial_grooves(number: float, eps: float):
    slenderness, guess = jnp.asarray(1.0), jnp.asarray(1.5)
    at = jnp.asarray(eps)
    for _ in range(4):
        at = at * grooved_bearing(at, slenderness, guess).sommerfeld / number
    found = grooved_bearing(at, slenderness, guess)
    assert float(found.sommerfeld) == pytest.approx(number, rel=1e-4)
    assert float(at) == pytest.approx(eps, abs=0.006)
    threshold = whirl_threshold(found.stiffness, found.damping)
    assert float(threshold.speed) == pytest.approx(2.1, abs=0.05)
    assert 0.45 < float(threshold.whirl_ratio) < 0.52


def test_whirl_threshold_of_a_vanishing_load():
    found = grooved_bearing(jnp.asarray(1e-3), jnp.asarray(1.0), jnp.asarray(1.5))
    threshold = whirl_threshold(found.stiffness, found.damping)
    assert float(threshold.speed) == pytest.approx(2.05, abs=0.06)
