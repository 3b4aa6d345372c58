"""Derivatives of orbits, multipliers and bifurcation points: against differences of results found anew.

One law serves all: m x'' + (d + c x^2) x' - k x + b x^3 = g cos(w t).
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc


METHOD = jc.method("rk4", steps=512)
NAMES = ("m", "d", "c", "k", "b", "g", "w")


class Oscillator(eqx.Module):
    m: jax.Array
    d: jax.Array
    c: jax.Array
    k: jax.Array
    b: jax.Array
    g: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        damping = self.d + self.c * x * x
        return ((-damping * u + self.k * x - self.b * x**3 + self.g * jnp.cos(tau)) / self.m,)


def system_of(theta):
    return jc.ForcedOscillator(Oscillator(*(theta[i] for i in range(6))), coordinates=1)


# m, d, c, k, b, g, w, and a state of the orbit meant.
DOUBLE_WELL = np.array([1.0, 0.3, 0.0, 1.0, 1.0, 0.262, 1.2]), (0.41751, 0.32921)
HARDENING = np.array([1.0, 0.1, 0.0, -1.0, 1.0, 0.3, 1.7]), (0.6129, 2.3976)
VAN_DER_POL = np.array([1.0, -0.3, 0.3, -1.0, 0.0, 1.2, 1.3]), (-1.698, -0.21)
ORBITS = {"real pair": DOUBLE_WELL, "complex pair": HARDENING}


def orbit_numbers(theta, guess):
    """State, modulus of the first multiplier, and its real part."""
    orbit = jc.periodic_orbit(system_of(theta), theta[6], guess=guess, method=METHOD)
    mu = orbit.multipliers[0]
    return jnp.stack([*orbit.state, jnp.abs(mu), mu.real])


def differences(f, x, h=2e-4):
    """Jacobian matrix by central differences of fourth order."""
    columns = []
    for i in range(x.size):
        move = h * np.eye(x.size)[i]
        values = [np.asarray(f(jnp.asarray(x + s * move))) for s in (-2, -1, 1, 2)]
        columns.append((values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h))
    return np.stack(columns, axis=-1)


VALUE = jax.jit(orbit_numbers)
FORWARD = jax.jit(jax.jacfwd(orbit_numbers))
REVERSE = jax.jit(jax.jacrev(orbit_numbers))


@pytest.mark.wide
@pytest.mark.parametrize("name", ORBITS)
def test_jacobian_of_state_and_multipliers(name):
    theta, guess = ORBITS[name]
    expected = differences(lambda x: VALUE(x, guess), theta, 1e-4)
    assert np.max(np.abs(expected)) > 1
    size = 1 + np.abs(expected)
    forward, reverse = FORWARD(jnp.asarray(theta), guess), REVERSE(jnp.asarray(theta), guess)
    assert np.max(np.abs(forward - expected) / size) < 1e-8
    np.testing.assert_allclose(reverse, forward, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("periods", [1, 2, 3])
@pytest.mark.parametrize("name", ["double well", "hardening"])
def test_determinant_of_the_monodromy_matrix(name, periods):
    """Liouville: log|det M| = -d 2 pi periods/w, exactly, whatever the orbit."""
    theta, guess = {"double well": DOUBLE_WELL, "hardening": HARDENING}[name]
    system = system_of(jnp.asarray(theta))
    orbit = jc.periodic_orbit(system, theta[6], periods, guess=guess, method=METHOD)
    exact = -theta[1] * 2 * np.pi * periods / theta[6]
    assert abs(jnp.linalg.slogdet(orbit.monodromy)[1] - exact) < 1e-8
    assert abs(jnp.log(jnp.abs(jnp.prod(orbit.multipliers))) - exact) < 1e-8
    assert orbit.status == "converged"


# Kind, its parameter, theta, and an orbit near it: state and value of the parameter.
POINTS = {
    "period-doubling": ("g", DOUBLE_WELL[0], DOUBLE_WELL[1], 0.2655),
    "Neimark-Sacker": ("g", VAN_DER_POL[0], VAN_DER_POL[1], 1.2),
    "fold": ("speed", HARDENING[0], (0.11, 2.71), 1.775),
}


def point_of(theta, kind, guess):
    parameter = POINTS[kind][0]
    return jc.bifurcation(system_of(theta), kind, guess, parameter, speed=theta[6], method=METHOD)


def edge(theta, kind, guess):
    """Value of the parameter."""
    return point_of(theta, kind, guess).value


EDGE_GRADIENT = jax.jit(jax.grad(edge), static_argnums=1)


@pytest.fixture(scope="module")
def found():
    """Each point and a guess at it, found once."""
    points = {}
    for kind, (parameter, theta, state, value) in POINTS.items():
        start = theta.copy()
        start[NAMES.index("w" if parameter == "speed" else parameter)] = value
        orbit = jc.periodic_orbit(system_of(jnp.asarray(start)), start[6], guess=state, method=METHOD)
        point = point_of(jnp.asarray(theta), kind, (tuple(orbit.state), value))
        assert point.status == "converged", kind
        points[kind] = point, (tuple(point.state), point.value)
    return points


@pytest.mark.wide
@pytest.mark.parametrize("kind", POINTS)
def test_gradient_of_a_point(kind, found):
    theta, (_, guess) = POINTS[kind][1], found[kind]
    gradient = EDGE_GRADIENT(jnp.asarray(theta), kind, guess)
    expected = differences(lambda x: edge(x, kind, guess), theta)
    assert np.max(np.abs(expected)) > 0.1
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-8 * max(1, np.max(np.abs(expected))))
    # What is solved for has no influence.
    free = "w" if kind == "fold" else "g"
    assert gradient[NAMES.index(free)] == 0.0


@pytest.mark.wide
def test_hessian_of_a_period_doubling(found):
    """Against differences of gradients; with the force as b^(-1/2), d2g/db2 = 3 g/(4 b^2)."""
    theta, (point, guess) = DOUBLE_WELL[0], found["period-doubling"]
    hessian = jax.jit(jax.hessian(edge), static_argnums=1)(jnp.asarray(theta), "period-doubling", guess)
    expected = differences(lambda x: EDGE_GRADIENT(x, "period-doubling", guess), theta)
    np.testing.assert_allclose(hessian, expected, rtol=0, atol=1e-7)
    np.testing.assert_allclose(hessian, hessian.T, rtol=0, atol=1e-9)
    b = NAMES.index("b")
    assert abs(hessian[b, b] - 0.75 * point.value) < 1e-9


def test_derivatives_of_a_multiplier_against_autodiff():
    """The adjoint through one expansion against JAX's own derivative of the orbit's multipliers."""
    system = system_of(jnp.asarray(DOUBLE_WELL[0]))
    at = lambda s: jnp.abs(jc.periodic_orbit(s, 1.15, guess=DOUBLE_WELL[1], method=METHOD).multipliers[0])
    slope = jax.grad(at)(system)
    names = tuple(jc.parameters(system))
    space = jc.design.DesignSpace(system, np.zeros(len(names)), np.ones(len(names)), names)
    orbit = jc.periodic_orbit(system, 1.15, guess=DOUBLE_WELL[1], method=METHOD)
    got = jc.orbits.orbit_slopes(space, space.place, orbit)
    assert got.multiplier == pytest.approx(float(at(system)), rel=1e-10)
    for name, value in zip(names, got.multiplier_slope, strict=True):
        assert value == pytest.approx(float(jc.parameters(slope)[name]), rel=1e-7, abs=1e-9), name
