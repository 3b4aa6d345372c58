"""Driven oscillators of one coordinate, written as a user would: exact exponents and states."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxcage.models import ForcedOscillator, ForcedSystem
from jaxcage.solve import method
from jaxcage.sweeps import sweep


def duffing(damping, force):
    def acceleration(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-damping * u + x - x**3 + force * jnp.cos(tau),)

    return acceleration


def starts(count, seed=0):
    return [tuple(map(float, s)) for s in np.random.default_rng(seed).uniform(-1, 1, (count, 2))]


def spectrum(law, omega, steps=256, **options):
    settings = dict(discard=20, revolutions=100, exponents=2, blocks=20)
    oscillator = ForcedOscillator(law, coordinates=1)
    chosen = method("rodas4", steps=steps)
    return sweep(oscillator, np.array([omega]), method=chosen, **(settings | options))


def test_sum_of_exponents_is_minus_damping_times_period():
    result = spectrum(duffing(0.25, 0.4), 1.0, confirm=False, horizon=0)
    assert np.all(result.exponents[..., 0] > 0.3)
    total = np.sum(result.exponents, axis=-1)
    np.testing.assert_allclose(total, -0.25 * 2 * np.pi, atol=1e-6)
    # Whatever the trajectory does: block by block, too.
    blocks = np.sum(result.block_growth, axis=-1)
    np.testing.assert_allclose(blocks, -0.25 * 2 * np.pi, atol=1e-5)


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
