"""Integration methods: order, stability, adaptive steps, derivatives of the strobe map."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import preliminary, slow_but
from reference import confirmed, field as second_field
from scipy.integrate import solve_ivp

from jaxcage.models import FirstOrderField, ForcedOscillator, ForcedSystem
from jaxcage.solve import FixedSteps, method, rosenbrock_step, strobe_map


def stacked(state):
    return jnp.stack([jnp.asarray(c) for c in state])


def acceleration(tau, q, v, speed):
    """Two coupled coordinates, nonlinear in both, damping that depends on phase and position."""
    (x, y), (u, w) = q, v
    return (
        -(0.4 + 0.3 * jnp.sin(tau)) * u - x - x**3 + 0.5 * y + 0.8 * jnp.cos(tau),
        -0.2 * (1 + y**2) * w - 2 * y + 0.5 * x * w + 0.6 * jnp.sin(2 * tau),
    )


def rates(tau, y, speed):
    """Forced van der Pol with a third, slower component."""
    x, u, z = y
    return (u, 1.5 * (1 - x**2) * u - x + 0.7 * jnp.cos(tau) + 0.3 * z, -0.5 * z + jnp.sin(tau) * x**2)


SECOND_ORDER = ForcedOscillator(acceleration, coordinates=2)
FIRST_ORDER = ForcedSystem(rates, dimension=3)
SYSTEMS = {"second order": (SECOND_ORDER, 1.3), "first order": (FIRST_ORDER, 0.8)}


def reference(system, speed, start):
    field = eqx.filter_jit(system.at_speed(speed))

    def f(tau, y):
        return np.asarray(stacked(field(jnp.asarray(tau), tuple(map(jnp.asarray, y)))))

    start = [float(c) for c in start]
    solution = solve_ivp(f, (0.0, 2 * np.pi), start, method="DOP853", rtol=1e-13, atol=1e-14)
    return solution.y[:, -1]


def one_revolution(system, speed, chosen, start):
    return eqx.filter_jit(lambda y: stacked(strobe_map(system, speed, chosen)(y).y))(start)


@pytest.mark.wide
@pytest.mark.parametrize("kind, steps", [("second order", (64, 128, 256)), ("first order", (256, 512, 1024))])
def test_observed_order(kind, steps):
    system, speed = SYSTEMS[kind]
    start = system.initial_states(speed)[1]
    exact = reference(system, speed, start)
    ends = [one_revolution(system, speed, FixedSteps("rodas4", n), start) for n in steps]
    errors = np.array([np.linalg.norm(np.asarray(end) - exact) for end in ends])
    assert errors[-1] > 1e-12  # still above rounding, so that the slopes mean something
    slopes = np.log2(errors[:-1] / errors[1:])
    np.testing.assert_allclose(slopes[-1], 4, atol=0.15)


# --- stability -------------------------------------------------------------------------------


@jax.jit
def one_step(re, im):
    """One step of size 1 on y' = z y, with z = re + i im as a system of two components."""
    field = FirstOrderField(lambda tau, y: (re * y[0] - im * y[1], im * y[0] + re * y[1]), 1.0)
    end, *_ = rosenbrock_step(field, 0.0, lambda _: 1.0, (jnp.ones(()), jnp.zeros(())))
    return stacked(end)


def stability(z):
    """The stability function R(z)."""
    return complex(*one_step(float(np.real(z)), float(np.imag(z))))


def test_rodas4_is_l_stable():
    # Stiffly accurate: R(z) falls as 1/z on the left.
    far = [abs(stability(z)) for z in (-1e3, -1e5, -1e7)]
    assert far[-1] < 1e-5 and far[0] > 30 * far[1] > 900 * far[2]
    assert abs(stability(1e6j)) < 1e-4
    axis = [abs(stability(1j * y)) for y in np.geomspace(1e-2, 1e4, 60)]
    assert max(axis) <= 1 + 1e-12
    z = -0.05 + 0.1j
    error = abs(stability(z) - np.exp(z))
    half = abs(stability(z / 2) - np.exp(z / 2))
    assert np.log2(error / half) == pytest.approx(5, abs=0.15)


def test_rodas4_integrates_cubic_polynomials_exactly():
    """To rounding: a wrong digit in a coefficient leaves an error that no number of steps reduces."""
    field = FirstOrderField(lambda tau, y: (1 + 2 * tau + 3 * tau**2 + 4 * tau**3,), 1.0)
    (end,), *_ = rosenbrock_step(field, 0.0, lambda _: 1.0, (jnp.zeros(()),))
    assert float(end) == pytest.approx(4, abs=1e-13)


# --- the cage --------------------------------------------------------------------------------

CAGE, SPEED = preliminary("1a"), 15000 * np.pi / 30
START = CAGE.initial_states(SPEED)[0]
FIELD = second_field(CAGE, SPEED)
UNIT = FIELD.scale

# Steps, and a revolution's error in units of the clearance.
EQUAL, ADAPTIVE = (dict(steps=512), 1e-8), (dict(tolerance=1e-7), 1e-5)
NAMED = [("rodas4", *EQUAL), ("tsit5", *EQUAL), *slow_but([("kvaerno5", *ADAPTIVE), ("tsit5", *ADAPTIVE)])]


@pytest.mark.wide
@pytest.mark.parametrize("name, steps, error", NAMED)
def test_named_solvers_agree_on_a_revolution_of_the_cage(name, steps, error):
    end = one_revolution(CAGE, SPEED, method(name, **steps), START)
    expected = confirmed(FIELD, [float(c) for c in START]).strobe[-1]
    np.testing.assert_allclose(end / UNIT, expected / UNIT, rtol=0, atol=error)


@pytest.mark.wide
@pytest.mark.parametrize("name", ["rodas4", "tsit5"])
def test_fixed_steps_of_every_solver_are_forward_differentiable(name):
    """Exponents, orbits and gradients need it: along one tangent against central differences."""
    direction = np.array([0.3, -0.5, 0.2, 0.7])
    start = jnp.asarray(stacked(START) / UNIT)
    chosen = method(name, steps=512)  # near the land they move with the state, which the derivative leaves out

    @jax.jit
    def image(z):
        return stacked(strobe_map(CAGE, SPEED, chosen)(tuple(z * UNIT)).y) / UNIT

    _, slope = jax.jvp(image, (start,), (jnp.asarray(direction),))
    h = 1e-5
    difference = (image(start + h * direction) - image(start - h * direction)) / (2 * h)
    size = float(jnp.linalg.norm(difference))
    np.testing.assert_allclose(slope, difference, rtol=0, atol=3e-5 * size)
