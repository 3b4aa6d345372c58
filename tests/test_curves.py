"""Bifurcation points followed in two parameters.

"DOP853" in a comment means: computed with SciPy's DOP853 at a tolerance of 1e-13 and Newton's method, sharing nothing
with this library. "Planted" systems have orbits and multipliers that are known exactly.
"""

import dataclasses

import equinox as eqx
import jax
import numpy as np
import pytest
from laws import about_an_orbit, double_well, hardening, numbers
from literature import DUFFING_DOUBLINGS, DUFFING_FOLDS
from scipy.interpolate import CubicSpline

import jaxcage as jc


METHOD = jc.method("rk4", steps=256)
FINE = jc.method("rk4", steps=1024)


@pytest.fixture(scope="module")
def fold():
    orbit = jc.periodic_orbit(hardening(), 1.7, guess=(0.6, 2.4), revolutions=200, method=METHOD)
    return jc.bifurcation(hardening(), "fold", orbit, method=METHOD)


@pytest.mark.wide
def test_folds_of_the_hardening_duffing_pass_a_cusp(fold):
    """Its force is 0.0513635 by DOP853, with the second derivative of the strobe map by variational equations."""
    curve = jc.curve(hardening(), fold, "speed", "g", lower=0.01, upper=0.6, x_lower=0.5, x_upper=3.0, method=METHOD)
    assert curve.ended == ("range", "range") and np.all(curve.genuine) and curve.kind == "fold"
    assert 0.0513635 < np.min(curve.y_value) < 0.0534 and str(curve).endswith("points, ends: range, range")
    # Both sides of the curve, from the cusp on.
    turn = int(np.argmin(curve.y_value))
    sides = []
    for part in (slice(turn - 1, None, -1), slice(turn + 1, None)):
        force, speed = curve.y_value[part], curve.x_value[part]
        assert np.all(np.diff(force) > 0)
        sides.append(float(CubicSpline(force, speed)(0.3)))
    folds = [DUFFING_FOLDS[side].value for side in ("down", "up")]
    np.testing.assert_allclose(sorted(sides), folds, rtol=0, atol=2e-6)
    # Multipliers are those of Newton's last iterate but one, at a distance of up to 1e-5.
    np.testing.assert_allclose(np.min(np.abs(curve.multipliers - 1), axis=1), 0.0, atol=5e-4)
    product = np.prod(curve.multipliers, axis=1)
    np.testing.assert_allclose(product, np.exp(-0.1 * 2 * np.pi / curve.x_value), rtol=1e-5)


@pytest.mark.wide
def test_curve_by_a_method_with_fewer_steps_than_its_point(fold):
    point, limits = dataclasses.replace(fold, steps=2048), dict(lower=0.29, upper=0.31, x_lower=1.5, x_upper=3.0)
    curve = jc.curve(hardening(), point, "speed", "g", **limits, method=METHOD)
    assert curve.ended == ("range", "range") and set(curve.steps.tolist()) == {256}


@pytest.mark.wide
def test_period_doubling_curve_has_an_exact_scaling():
    """x -> x / sqrt(b): the force of any edge times sqrt(b) is one number. At b = 1 it is DOP853's."""
    system = double_well(0.262)
    orbit = jc.periodic_orbit(system, 1.2, guess=(1.0, 0.0), revolutions=300, method=FINE)
    point = jc.bifurcation(system, "period-doubling", orbit, "g", method=FINE)
    curve = jc.curve(system, point, "g", "b", lower=0.25, upper=4.0, x_lower=0.05, x_upper=1.0, method=FINE)
    assert curve.ended == ("range", "range") and np.ptp(curve.y_value) > 3.7
    _, first = DUFFING_DOUBLINGS[1]
    scaled = curve.x_value * np.sqrt(curve.y_value)
    np.testing.assert_allclose(scaled, first.value, rtol=0, atol=first.tolerance)
    alike = curve.state * np.sqrt(curve.y_value)[:, None]
    np.testing.assert_allclose(alike, np.broadcast_to(alike[0], alike.shape), atol=1e-8)
    assert (curve.x, curve.y) == ("g", "b")
    np.testing.assert_allclose(np.min(np.abs(curve.multipliers + 1), axis=1), 0.0, atol=5e-5)


class Planted(eqx.Module):
    """The orbit (cos, sin) with the multipliers of exp([[g + s, -b], [b, g - s]] T), g = a - b^2 / 5.

    With a turn of half a revolution a period they have the opposite sign.
    """

    a: jax.Array
    b: jax.Array
    s: jax.Array
    turn: jax.Array

    def __call__(self, tau, y, speed):
        def rates(e, f):
            growth = self.a - self.b**2 / 5 - (e * e + f * f)
            return (growth + self.s) * e - self.b * f, (growth - self.s) * f + self.b * e

        return about_an_orbit(tau, y, speed, self.turn, rates)


SPEED = 1.2


@pytest.mark.wide
@pytest.mark.parametrize("s, turn", [(0.0, 0.0), (0.25, 0.5)])
def test_torus_curve_goes_on_as_neutral_saddles_beyond_a_strong_resonance(s, turn):
    """The pair is -exp(+-i r T) with r^2 = b^2 - s^2, for half a turn, real for b < s; without a turn exp(+-i b T)."""
    system = jc.ForcedSystem(Planted(**numbers(a=0.1, b=0.35, s=s, turn=turn)), dimension=2)
    point = jc.bifurcation(system, "Neimark-Sacker", ((1.0, 0.0), 0.35**2 / 5 + 0.01), "a", speed=SPEED, method=METHOD)
    assert abs(point.value - 0.35**2 / 5) < 1e-8
    curve = jc.curve(system, point, "a", "b", lower=0.1, upper=0.45, x_lower=-1.0, x_upper=1.0, method=METHOD)
    assert curve.ended == ("range", "range")
    np.testing.assert_allclose(curve.x_value, curve.y_value**2 / 5, rtol=0, atol=1e-8)
    np.testing.assert_allclose(curve.state, np.broadcast_to([1.0, 0.0], curve.state.shape), atol=1e-7)
    assert np.array_equal(curve.genuine, curve.y_value > s)
    np.testing.assert_allclose(np.abs(curve.multipliers[curve.genuine]), 1.0, atol=1e-4)
    if s:
        assert 5 < np.sum(curve.genuine) < curve.genuine.size - 5
        root = np.sqrt(s**2 - curve.y_value[~curve.genuine] ** 2) * 2 * np.pi / SPEED
        saddles = curve.multipliers[~curve.genuine]
        np.testing.assert_allclose(saddles, -np.exp(np.stack([root, -root], axis=1)), rtol=1e-3)


@pytest.mark.wide
def test_bad_arguments(fold):
    limits = dict(lower=0.2, upper=0.4, x_lower=1.0, x_upper=3.0, method=METHOD)
    for system, y, wrong, sentence in (
        (hardening(), "g", dict(lower=0.4, upper=0.2), "`x_lower` and `x_upper` must be in ascending order"),
        (hardening(), "g", dict(upper=np.inf), "`x_lower` and `x_upper` must be in ascending order and finite"),
        (hardening(), "stiffness", {}, "`y` must be one of speed, m, d, k, b, g, but 'stiffness'"),
        (hardening(), "speed", {}, "`x` and `y` must be the parameter of the point, speed, and another one, but"),
        (hardening(d=2.0), "g", {}, "`point` must be a fold of the system, but Newton's method finds none there"),
        (hardening(0.02), "g", {}, "must have the system's g between them, 0.02, but are 0.2 and 0.4"),
        (hardening(), "g", dict(x_upper=1.2), "`point` must begin from 1 to 1.2"),
    ):
        with pytest.raises(ValueError, match=sentence):
            jc.curve(system, fold, "speed", y, **(limits | wrong))
    with pytest.raises(ValueError, match="`x` and `y` must be the parameter of the point, speed, and another"):
        jc.curve(hardening(), fold, "g", "b", **limits)
