"""One impact of a roller on a bar (14): energy, the Hertz impact in closed form, derivatives of its spectrum. The
spectrum itself, and the force of all rollers on a cage, stand beside the second implementation in `test_reference`.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import gamma

from jaxcage.forces import PocketImpact, RollerPassImpact, impact_history, pulse_spectrum


IMPACT = PocketImpact(contact_stiffness=2e8, bar_stiffness=2.5e6, bar_mass=4e-3, approach_ratio=0.6)
ROLLER, SPEED = 0.0423, 0.18


def impact_time_scale(impact, v0):
    """Time [s] in which the contact and the bar take up the roller: their Hertzian and harmonic times in series."""
    k, kc, _ = constants(impact)
    depth = (19 / 18 * ROLLER * v0**2 / k) ** (9 / 19)
    return np.sqrt((depth / v0) ** 2 + ROLLER / kc)


def history(impact=IMPACT, v0=SPEED, times=8.0, **options):
    duration = times * impact_time_scale(impact, v0)
    return impact_history(impact, ROLLER, jnp.asarray(v0), duration, **options)


def constants(impact):
    return float(impact.contact_stiffness), float(impact.bar_stiffness), float(impact.bar_mass)


# Where the contact closes within a step, p^(10/9) costs a fixed-step method order: the errors below
# belong to the default 511 x 4 steps, and to 16 times as many.
@pytest.mark.wide
@pytest.mark.parametrize("samples, tolerance", [(512, 3e-5), (4089, 1e-6)])
def test_energy_of_an_impact(samples, tolerance):
    """That of the contact and of the bar by their forces: 9/19 Q d and Q^2/(2 K_c)."""
    h = history(samples=samples, substeps=4 if samples == 512 else 8)
    k, kc, mc = constants(IMPACT)
    assert np.min(h.bar_force) < -0.01 * np.max(h.contact_force)  # the bar swings back, as in fig. 5
    kinetic = 0.5 * ROLLER * h.roller_velocity**2 + 0.5 * mc * h.bar_velocity**2
    energy = kinetic + 0.5 * h.bar_force**2 / kc + 9 / 19 * h.contact_force ** (19 / 10) / k ** (9 / 10)
    np.testing.assert_allclose(energy, 0.5 * ROLLER * SPEED**2, rtol=tolerance)
    depth = np.maximum(h.roller_position - h.bar_position, 0.0)
    np.testing.assert_allclose(h.contact_force, k * depth ** (10 / 9), rtol=1e-12)
    np.testing.assert_allclose(h.bar_force, kc * h.bar_position, rtol=1e-12)


RIGID = PocketImpact(contact_stiffness=1e4, bar_stiffness=1e10, bar_mass=1.0, approach_ratio=0.6)


@pytest.mark.wide
def test_rigid_bar_gives_the_hertz_impact_in_closed_form():
    """m v^2/2 = (9/19) K d^(19/9), and the time 2 (d/v) sqrt(pi) G(1 + 1/p)/G(1/2 + 1/p)."""
    v0, k = SPEED, 1e4
    h = history(RIGID, samples=4097, substeps=1)
    depth = (19 / 18 * ROLLER * v0**2 / k) ** (9 / 19)
    # The bar gives way by 4e-7 of the depth.
    assert float(h.contact_force.max()) == pytest.approx(k * depth ** (10 / 9), rel=1e-5)
    p = 19 / 9
    duration = 2 * depth / v0 * np.sqrt(np.pi) * gamma(1 + 1 / p) / gamma(0.5 + 1 / p)
    depths = np.asarray(h.roller_position - h.bar_position)
    after = int(np.argmax((depths <= 0) & (np.asarray(h.time) > 0.5 * duration)))
    before = after - 1
    share = depths[before] / (depths[before] - depths[after])
    left = float(h.time[before]) + share * float(h.time[after] - h.time[before])
    assert left == pytest.approx(duration, rel=1e-5)
    assert float(h.roller_velocity[-1]) == pytest.approx(-v0, rel=1e-5)


Z, CLEARANCE = 13, 0.3e-3


PULSE = {  # what shapes a pulse
    "contact_stiffness": 2e8,
    "bar_stiffness": 1e5,  # soft enough for the roller to meet the bar twice
    "bar_mass": 4e-3,
    "approach_ratio": 0.6,
    "omega": 900.0,
    "roller_mass": ROLLER,
    "pocket_clearance": CLEARANCE,
}


@jax.jit
def one_number(logarithms):
    """A mixture of the coefficients, of the logarithms of what shapes a pulse."""
    *oscillator, omega, roller, clearance = jnp.exp(logarithms)
    law = RollerPassImpact(PocketImpact(*oscillator), harmonics=8)
    cosine, sine = pulse_spectrum(law, omega, Z, roller, clearance)
    return jnp.sum(cosine * jnp.cos(jnp.arange(9.0))) + jnp.sum(sine * jnp.sin(jnp.arange(9.0) ** 2))


@pytest.mark.wide
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_derivatives_of_the_pulse_spectrum_by_all_that_shapes_it(mode):
    at, h = jnp.log(jnp.array(list(PULSE.values()))), 2e-4
    found, basis = mode(one_number)(at), np.eye(len(PULSE))
    ahead = lambda k: np.array([float(one_number(at + k * h * e)) for e in basis])
    expected = (8 * (ahead(1) - ahead(-1)) - (ahead(2) - ahead(-2))) / (12 * h)
    assert np.all(np.abs(expected) > 1e-3 * np.abs(expected).max())
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_an_impact_that_cannot_be_resolved_is_not_a_number():
    law = RollerPassImpact(PocketImpact(1e4, 1e10, 1e-5, 0.1), harmonics=1)
    assert np.all(np.isnan(jax.jit(lambda play: jnp.stack(pulse_spectrum(law, 900.0, Z, ROLLER, play)))(1e-6)))
