"""Driven oscillators written as a user would: exponents against an independent code and exact identities.

The systems have one coordinate; exponents are converted from per revolution of the drive to per
unit time with the drive's period 2 pi / omega.
"""

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import slow_but, wide_but

from jaxcage.integrate import method
from jaxcage.models import ForcedOscillator, ForcedSystem
from jaxcage.sweeps import sweep
from jaxcage.validation import EXPONENTS


COEXISTING = "Duffing x'' + .15 x' - x + x^3 = .3 cos t"
"""It has a periodic orbit beside the chaotic one."""


def ueda(tau, q, v, speed):
    (x,), (u,) = q, v
    return (-0.05 * u - x**3 + 7.5 * jnp.sin(tau),)


def duffing(damping, force):
    def acceleration(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-damping * u + x - x**3 + force * jnp.cos(tau),)

    return acceleration


def pendulum(damping, torque):
    def acceleration(tau, q, v, speed):
        (angle,), (rate,) = q, v
        return (-damping * rate - jnp.sin(angle) + torque * jnp.cos(tau),)

    return acceleration


def starts(count, seed=0):
    return [tuple(map(float, s)) for s in np.random.default_rng(seed).uniform(-1, 1, (count, 2))]


# Law and frequency of the drive by name in the table of numbers.
LITERATURE = {
    "Ueda x'' + .05 x' + x^3 = 7.5 sin t": (ueda, 1.0),
    "Duffing x'' + .25 x' - x + x^3 = .4 cos t": (duffing(0.25, 0.4), 1.0),
    "pendulum x'' + .05 x' + sin x = .6 cos .7t": (pendulum(0.05, 0.6), 0.7),
    "Duffing x'' + .3 x' - x + x^3 = .5 cos 1.2t": (duffing(0.3, 0.5), 1.2),
    COEXISTING: (duffing(0.15, 0.3), 1.0),
    "pendulum x'' + .5 x' + sin x = 1.5 cos 2t/3": (pendulum(0.5, 1.5), 2 / 3),
}


@pytest.mark.wide
@pytest.mark.parametrize("name", slow_but(LITERATURE, "Ueda x'' + .05 x' + x^3 = 7.5 sin t", COEXISTING))
def test_largest_exponent_of_chaotic_oscillators(name):
    law, omega = LITERATURE[name]
    known = EXPONENTS[name]
    result = sweep(
        ForcedOscillator(law, coordinates=1),
        np.array([omega]),
        starts=starts(128),
        discard=150,
        revolutions=1000,
        keep=16,
        method=method("rodas4", steps=64),
    )
    chaotic = result.label == "chaotic"
    assert np.sum(chaotic) >= (64 if name == COEXISTING else 128)
    per_time = omega / (2 * np.pi)
    found = np.mean(result.exponents[chaotic, 0]) * per_time
    error = np.sqrt(np.mean(result.standard_error[chaotic, 0] ** 2) / np.sum(chaotic)) * per_time
    assert error < 1.25 * known.tolerance, f"{found:.5f} +- {error:.5f}"
    assert abs(found - known.value) < known.tolerance + 3 * error


def spectrum(law, omega, steps=256, **options):
    settings = dict(discard=20, revolutions=100, exponents=2, blocks=20)
    oscillator = ForcedOscillator(law, coordinates=1)
    chosen = method("rodas4", steps=steps)
    return sweep(oscillator, np.array([omega]), method=chosen, **(settings | options))


DAMPED = {
    "ueda": (ueda, 1.0, 0.05, 512),
    "duffing": (duffing(0.25, 0.4), 1.0, 0.25, 256),
    "pendulum": (pendulum(0.5, 1.5), 2 / 3, 0.5, 256),
}


@pytest.mark.parametrize("name", wide_but(DAMPED, "duffing"))
def test_sum_of_exponents_is_minus_damping_times_period(name):
    law, omega, damping, steps = DAMPED[name]
    result = spectrum(law, omega, steps, confirm=False, horizon=0)
    assert np.all(result.exponents[..., 0] > 0.3)
    total = np.sum(result.exponents, axis=-1)
    np.testing.assert_allclose(total, -damping * 2 * np.pi / omega, atol=1e-6)
    # Whatever the trajectory does: block by block, too.
    blocks = np.sum(result.block_growth, axis=-1)
    np.testing.assert_allclose(blocks, -damping * 2 * np.pi / omega, atol=1e-5)


def linear(zeta, natural):
    def acceleration(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-2 * zeta * natural * u - natural**2 * x + jnp.cos(tau),)

    return acceleration


@pytest.mark.wide
@pytest.mark.parametrize("omega", [0.4, 1.7])
def test_multipliers_of_the_linear_oscillator_underdamped(omega):
    """exp((-z +- i sqrt(1 - z^2)) w_0 T): both exponents are -z w_0 T in the mean."""
    zeta, natural = 0.05, 1.3
    result = spectrum(linear(zeta, natural), omega, discard=50, revolutions=400, blocks=4)
    decay = -zeta * natural * 2 * np.pi / omega
    np.testing.assert_allclose(np.sum(result.exponents, axis=-1), 2 * decay, atol=1e-7)
    # The tangent vectors turn: over n revolutions what is left of it is of the order of 1/n.
    np.testing.assert_allclose(result.exponents, decay, atol=2 / 400)
    assert np.all(result.label == "periodic-1")


@pytest.mark.wide
@pytest.mark.parametrize("omega", [0.9, 3.0])
def test_multipliers_of_the_linear_oscillator_overdamped(omega):
    """Real multipliers exp((-z +- sqrt(z^2 - 1)) w_0 T), one exponent each."""
    zeta, natural = 1.5, 1.3
    result = spectrum(linear(zeta, natural), omega)
    period = 2 * np.pi / omega
    roots = np.array([-zeta + np.sqrt(zeta**2 - 1), -zeta - np.sqrt(zeta**2 - 1)])
    exact = np.broadcast_to(roots * natural * period, result.exponents.shape)
    np.testing.assert_allclose(result.exponents, exact, rtol=1e-7)
    # Nothing scatters: what is stated is the error of the steps, which it covers.
    assert np.all(result.standard_error < 1e-6 * np.abs(exact))
    assert np.all(result.standard_error > np.abs(result.exponents - exact))


@pytest.mark.wide
def test_steady_state_of_the_linear_oscillator():
    zeta, natural, omega = 0.2, 1.3, 0.9
    result = spectrum(linear(zeta, natural), omega, discard=100)
    response = 1 / (natural**2 - omega**2 + 2j * zeta * natural * omega)
    expected = [response.real, (1j * omega * response).real]
    at = np.broadcast_to(expected, result.last.shape)
    np.testing.assert_allclose(result.last, at, atol=1e-9)


@pytest.mark.wide
def test_first_order_form_gives_the_same_strobe_states():
    """A `ForcedSystem` of the same Duffing oscillator, on its way to periodic motion."""
    law = duffing(0.25, 0.1)

    def rates(tau, y, speed):
        x, u = y
        return (u, *law(tau, (x,), (u,), speed))

    settings = dict(discard=0, revolutions=20, blocks=20, exponents=2, keep=20)
    settings |= dict(starts=starts(4, seed=3), method=method("rodas4", steps=128))
    speed = np.array([1.0])
    second = sweep(ForcedOscillator(law, coordinates=1), speed, **settings)
    first = sweep(ForcedSystem(rates, dimension=2), speed, **settings)
    np.testing.assert_allclose(first.strobe, second.strobe, rtol=0, atol=1e-9)
    np.testing.assert_allclose(first.block_growth, second.block_growth, atol=1e-8)
    assert np.ptp(second.strobe[..., 0]) > 0.1
