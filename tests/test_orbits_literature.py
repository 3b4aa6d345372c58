"""Periodic orbits and bifurcation points of systems whose answers are exact; `literature` has the published ones."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from laws import numbers
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import jaxcage as jc


METHOD = jc.method("rk4", steps=1024)


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
