"""Periodic orbits and bifurcation points of systems whose answers are published, exact, or found without JAX.

Laws are modules as a user would write them. Numbers, their sources and tolerances are those of the validation page;
"DOP853" is SciPy's at a tolerance of 1e-12 with Newton's method on the variational equations, sharing nothing with this
library.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from laws import double_well, hardening, numbers
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import jaxcage as jc
from jaxcage.validation import (
    DUFFING_DOUBLINGS,
    DUFFING_FOLDS,
    DUFFING_SLOPES,
    VAN_DER_POL_LET_GO,
    Number,
)


METHOD = jc.method("rk4", steps=1024)
FINE = jc.method("rk4", steps=2048)


def agrees(ours, number: Number) -> bool:
    return bool(abs(ours - number.value) <= number.tolerance)


@pytest.mark.wide
def test_orbits_in_other_units_are_the_same():
    """Both wells of an oscillator, and in thousandths: Newton's method starts at its guess, not between the two."""

    def law(tau, q, v, speed):
        return (-0.3 * v[0] + q[0] - 1e6 * q[0] ** 3 + 0.26e-3 * jnp.cos(tau),)

    small = jc.ForcedOscillator(law, coordinates=1, scale=1e-3)
    for well in (1.0, -1.0):
        whole = jc.periodic_orbit(double_well(), 1.2, guess=(well, 0.0), revolutions=400, method=METHOD)
        assert float(whole.state[0]) * well > 0
        found = jc.periodic_orbit(small, 1.2, guess=1.001e-3 * whole.state, method=METHOD)
        np.testing.assert_allclose(1e3 * found.state, whole.state, rtol=1e-9)
        np.testing.assert_allclose(found.multipliers, whole.multipliers, rtol=1e-8)


@pytest.mark.parametrize("periods", DUFFING_DOUBLINGS)
def test_period_doubling_cascade_of_the_double_well_duffing(periods):
    inside, expected = DUFFING_DOUBLINGS[periods]
    system = double_well(inside)
    orbit = jc.periodic_orbit(system, 1.2, periods, guess=(1.0, 0.0), revolutions=400, method=METHOD)
    assert bool(orbit.stable) and -1 < orbit.multipliers[0].real < -0.3
    # Damping is all that shrinks areas, whatever the orbit.
    assert abs(jnp.linalg.slogdet(orbit.monodromy)[1] + 0.3 * 2 * jnp.pi * periods / 1.2) < 1e-8
    point = jc.bifurcation(system, "period-doubling", orbit, "g", speed=1.2, periods=periods, method=METHOD)
    assert point.status == "converged"
    assert agrees(point.value, expected)
    assert abs(point.multipliers[0] + 1) < 1e-8
    assert point.transversality > 0
    assert int(point.periods) == periods


@pytest.mark.wide
def test_gradient_of_the_first_period_doubling():
    """DOP853 and differences; scaling x shows that the force at any edge goes with b^(-1/2)."""
    system = double_well(0.262)
    orbit = jc.periodic_orbit(system, 1.2, 1, guess=(1.0, 0.0), revolutions=400, method=METHOD)

    def edge(system):
        point = jc.bifurcation(system, "period-doubling", orbit, "g", speed=1.2, method=METHOD)
        return point.value, point

    gradient, point = eqx.filter_grad(edge, has_aux=True)(system)
    law = gradient.acceleration
    # The third: both stiffnesses multiplied by one number.
    found = {"m": law.m, "d": law.d, "k": law.k + law.b}
    assert all(agrees(found[name], slope) for name, slope in DUFFING_SLOPES.items())
    assert abs(law.b + point.value / 2) < 1e-10
    # The equation multiplied by a number.
    assert abs(law.m + 0.3 * law.d + law.k + law.b - point.value) < 1e-10
    assert law.g == 0.0  # the parameter that is solved for


# State on the branch: speed from which it is followed, simulated from this start.
FOLDS = {"up": (1.7, (0.6, 2.4)), "down": (1.4, (-0.3, 0.05))}


@pytest.mark.parametrize("name", FOLDS)
def test_folds_of_the_hardening_duffing(name):
    speed, start = FOLDS[name]
    system = hardening()
    orbit = jc.periodic_orbit(system, speed, 1, guess=start, revolutions=400, method=METHOD)
    assert bool(orbit.stable)
    point = jc.bifurcation(system, "fold", orbit, method=METHOD)
    assert point.status == "converged"
    assert agrees(point.value, DUFFING_FOLDS[name]) and point.value == point.speed
    assert abs(point.multipliers[0] - 1) < 1e-6
    assert float(point.angle) < 1e-6
    # The other multiplier follows from the damping.
    assert abs(point.multipliers[1].real - jnp.exp(-0.1 * 2 * jnp.pi / point.speed)) < 1e-6
    assert abs(jnp.linalg.norm(point.direction) - 1) < 1e-12


class Entrained(eqx.Module):
    """x'' - 0.3 (1 - x^2) x' + x = g cos(w t)."""

    g: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (0.3 * (1 - x * x) * u - x + self.g * jnp.cos(tau),)


@pytest.mark.wide
@pytest.mark.parametrize("force", [0.8, 1.2], ids=["unstable side", "stable side"])
def test_torus_bifurcation_of_the_driven_van_der_pol(force):
    """Where a drive of 1.3 rad/s lets go of the oscillator (DOP853)."""
    system = jc.ForcedOscillator(Entrained(**numbers(g=force)), coordinates=1)
    orbit = jc.periodic_orbit(system, 1.3, guess=(-1.3, -0.4), method=METHOD)
    assert bool(orbit.stable) == (force > 1)
    point = jc.bifurcation(system, "Neimark-Sacker", orbit, "g", method=METHOD)
    assert point.status == "converged"
    assert agrees(point.value, VAN_DER_POL_LET_GO)
    np.testing.assert_allclose(jnp.abs(point.multipliers), 1.0, atol=1e-9)
    assert abs(point.angle - np.angle(0.16011959 + 0.98709762j)) < 1e-8
    assert point.transversality < 0  # a stronger drive holds it


class Mathieu(eqx.Module):
    """x'' + 2 z x' + (a - 2 q cos 2t) x = 0 with tau = 2 t."""

    a: jax.Array
    q: jax.Array
    z: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-2 * self.z * u - (self.a - 2 * self.q * jnp.cos(tau)) * x,)


def mathieu(a=1.0, z=0.0):
    return jc.ForcedOscillator(Mathieu(**numbers(a=a, q=1, z=z)), coordinates=1)


def mathieu_trace(a, q=1.0):
    """Trace of the monodromy matrix of the undamped equation over pi."""

    def rates(t, y):
        stiffness = a - 2 * q * np.cos(2 * t)
        return [y[1], -stiffness * y[0], y[3], -stiffness * y[2]]

    end = solve_ivp(rates, (0, np.pi), [1, 0, 0, 1], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return end[0] + end[3]


@pytest.mark.parametrize("a, z", [(-1.0, 0.1), (0.7, 0.6), (5.0, 0.1)])
def test_multipliers_of_damped_mathieu(a, z):
    """x = exp(-z t) y makes it the undamped equation for y at a - z^2: exact."""
    zero = dict(guess=(0.0, 0.0), method=METHOD)
    damped = jc.periodic_orbit(mathieu(a, z), 2.0, **zero)
    undamped = jc.periodic_orbit(mathieu(a - z * z), 2.0, **zero)
    expected = np.sort_complex(np.exp(-z * np.pi) * np.asarray(undamped.multipliers))
    np.testing.assert_allclose(np.sort_complex(np.asarray(damped.multipliers)), expected, rtol=1e-9)
    assert abs(jnp.sum(undamped.multipliers).real - mathieu_trace(a - z * z)) < 1e-8


# Kind, damping, bracket of a, sign of the multiplier.
DAMPED = [
    ("period-doubling", 0.1, (-0.2, 0.0), -1),
    ("period-doubling", 0.2, (1.5, 1.8), -1),
    ("branch-point", 0.1, (-0.6, -0.3), 1),
]


@pytest.mark.wide
@pytest.mark.parametrize("kind, z, bracket, sign", DAMPED)
def test_edges_of_damped_mathieu(kind, z, bracket, sign):
    """A multiplier is +-1 where the undamped trace at a - z^2 is +-2 cosh(z pi); the trace here is SciPy's."""
    exact: Any = brentq(lambda a: mathieu_trace(a - z * z) - sign * 2 * np.cosh(z * np.pi), *bracket, xtol=1e-12)
    system = mathieu(z=z)
    point = jc.bifurcation(system, kind, ((0.0, 0.0), exact + 0.02), "a", speed=2.0, method=METHOD)
    assert abs(point.value - exact) < 1e-8
    order = jnp.argmin(jnp.abs(point.multipliers - sign))
    np.testing.assert_allclose(point.multipliers[order], sign, atol=1e-9)
    np.testing.assert_allclose(point.multipliers[1 - order], sign * np.exp(-2 * z * np.pi), atol=1e-9)
    # mu^2 - s t mu + s^2 = 0 with s = exp(-z pi), and so dmu/da = s t' mu/(2 mu - s t).
    shrink, at, h = np.exp(-z * np.pi), exact - z * z, 1e-3
    differences = [mathieu_trace(at + i * h) for i in (-2, -1, 1, 2)]
    slope = np.dot([1, -8, 8, -1], differences) / (12 * h)
    rate = shrink * slope * sign / (2 * sign - shrink * mathieu_trace(at))
    np.testing.assert_allclose(abs(point.transversality), abs(rate), rtol=1e-6)
    assert point.status == "converged" and bool(point.trusted)
