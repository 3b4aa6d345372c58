"""Support, unbalance and roller impacts against hand-written NumPy, SciPy and closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import preliminary
from scipy.integrate import solve_ivp
from scipy.special import gamma

import jaxcage as jc
from jaxcage.bearing import load_distribution
from jaxcage.forces import (
    ElasticRib,
    PocketImpact,
    RollerPassImpact,
    Support,
    SynchronousImpact,
    approach_speed,
    effective_eccentricity,
    impact_history,
    pulse_spectrum,
    pulse_train,
)


POINTS = np.random.default_rng(7).normal(scale=2e-4, size=(5, 2))


def cage_with(speed=900.0, **parts):
    model = jc.replace(preliminary("1a"), **parts)
    return model, model.cage_at(speed)


# --- support ---------------------------------------------------------------------------------


@pytest.mark.parametrize("r", POINTS)
def test_support_in_the_cage_against_numpy(r):
    """Isotropic cubic stiffness, K_x and K_y apart, damping; cross-coupling that circulates and as (20) prints it."""
    (x, y), (vx, vy), k3, kxy, odd = r, (0.1, -0.3), 1e13, -40.0, 3e10
    hardening = k3 * (x**2 + y**2)
    for cross, push in (
        ("circulatory", (-kxy * y, kxy * x)),
        ("as_printed", (-kxy * y, -kxy * x) - odd * r[::-1] ** 3),
    ):
        given = Support(3e4, 5e4, 3.0, cubic_stiffness=k3, cross_stiffness=kxy, cross_cubic=odd, cross=cross)
        expected = np.array([-(3e4 + hardening) * x - 3.0 * vx, -(5e4 + hardening) * y - 3.0 * vy]) + push
        _, cage = cage_with(support=given)
        np.testing.assert_allclose(cage.forces(0.0, x, y, vx, vy)["support"][:2], expected, rtol=1e-13)


def support_alone(x, y, *given, **kwargs):
    """Force of a support at rest."""
    _, cage = cage_with(support=Support(*given, **kwargs))
    return jnp.stack(cage.forces(0.0, x, y, 0.0, 0.0)["support"][:2])


def work_around_circle(cross, radius, linear, points=64):
    """Work of a cross-coupling once counter-clockwise around a circle."""
    t = 2 * np.pi * np.arange(points) / points
    x, y = radius * np.cos(t), radius * np.sin(t)
    at = lambda x, y: support_alone(x, y, 0.0, 0.0, 0.0, cross_stiffness=linear, cross=cross)
    fx, fy = np.asarray(jax.vmap(at)(x, y)).T
    return np.mean(fy * x - fx * y) * 2 * np.pi


def test_circulatory_coupling_pumps_and_the_printed_one_does_not():
    radius, linear = 2e-4, 700.0
    pumped = work_around_circle("circulatory", radius, linear)
    assert pumped == pytest.approx(2 * np.pi * radius**2 * linear, rel=1e-12)
    assert abs(work_around_circle("as_printed", radius, linear)) < 1e-12 * pumped


def test_isotropic_spring_is_conservative_and_radial():
    potential = lambda r: 0.5 * 3e4 * (r @ r) + 0.25 * 1e13 * (r @ r) ** 2
    for r in POINTS:
        found = support_alone(*r, 3e4, 3e4, 0.0, cubic_stiffness=1e13)
        np.testing.assert_allclose(found, -jax.grad(potential)(jnp.asarray(r)), rtol=1e-12)


def test_readings_of_the_cubic_stiffness():
    def stiffness(reading, gap):
        support = Support(3e4, 5e4, 0.0, cubic_stiffness=1e13, cubic_ratio=5.0, cubic=reading)
        return float(cage_with(support=support, guidance_gap=gap)[1].law("support").cubic)

    assert stiffness("absolute", 4.5e-4) == 1e13
    relative = [stiffness("dimensionless", c) for c in (4.5e-4, 6e-4)]
    np.testing.assert_allclose(relative, [5.0 * 4e4 / c**2 for c in (4.5e-4, 6e-4)], rtol=1e-13)
    assert relative[1] / relative[0] == pytest.approx((4.5 / 6) ** 2)  # a larger gap softens it


@pytest.mark.parametrize("reading, name", [("absolute", "cubic_stiffness"), ("dimensionless", "cubic_ratio")])
def test_a_linear_support_is_a_cubic_term_of_zero(reading, name):
    model = jc.replace(jc.case("1a"), **{"support.cubic": reading, name: 0.0, "cross_stiffness": 0.0})
    support, (x, y) = model.support, POINTS[0]
    held = model.cage_at(900.0).forces(0.0, x, y, 0.0, 0.0)["support"][:2]
    np.testing.assert_allclose(held, (-support.stiffness_x * x, -support.stiffness_y * y), rtol=1e-13)
    with pytest.raises(ValueError, match=name):
        jc.replace(model, **{name: -1.0})


def test_elastic_rib_feels_the_reaction_of_what_acts_between():
    """Momentum: the internal forces cancel in M_C a_C + M_O a_O."""
    rib = ElasticRib(mass=2.0, stiffness=1e6, damping=50.0)
    model, cage = cage_with(rib=rib, supply_pressure=2e4)
    q, v, tau, speed = (1e-4, -2e-4, 3e-5, 1e-5), (0.1, -0.2, 0.02, 0.05), 0.7, 900.0
    rates = [float(c) * speed for c in model.at_speed(speed)(tau, (*q, *v))]
    assert rates[:4] == pytest.approx(v, rel=1e-12)
    mass = float(model.cage_mass)
    found = [mass * rates[4 + i] + 2.0 * rates[6 + i] for i in (0, 1)]
    held = -1e6 * np.array(q[2:]) - 50.0 * np.array(v[2:])
    unbalance = mass * 23e-6 * speed**2 * np.array([np.cos(tau), np.sin(tau)])
    driven = np.add(cage.forces(tau, *q[:2], *v[:2])["impact"][:2], unbalance)
    weight = np.array([0.0, -(mass + 2.0) * 9.81])
    np.testing.assert_allclose(found, driven + held + weight, rtol=1e-10)


# --- unbalance -------------------------------------------------------------------------------


@pytest.mark.parametrize("gap, factor", [(0.45e-3, 4.44), (0.60e-3, 3.33)])
def test_readings_of_the_unbalance(gap, factor):
    e = 23e-6
    assert float(effective_eccentricity("physical", e, gap, 1e-3)) == e
    printed = float(effective_eccentricity("as_printed", e, gap, 1e-3))
    assert printed / e == pytest.approx(factor, abs=5e-3)
    # (20): 2 M rho omega^2 with the number rho = e/C_r and lengths in millimetres.
    assert printed * 1e3 == pytest.approx(2 * e / gap, rel=1e-13)


def test_unbalance_force_turns_with_the_cage():
    tau = np.array([0.0, 0.4, np.pi / 2, 4.0])
    model, cage = cage_with(1200.0)
    found = np.array([cage.forces(t, 0.0, 0.0, 0.0, 0.0)["unbalance"][:2] for t in tau])
    size = float(model.cage_mass) * 23e-6 * 1200.0**2
    np.testing.assert_allclose(found, size * np.stack([np.cos(tau), np.sin(tau)], 1), atol=1e-12)


# --- synchronous impact ----------------------------------------------------------------------


@pytest.mark.parametrize("tau", [0.0, 0.3, 2.0, 5.5])
def test_synchronous_force_against_15_as_printed(tau):
    q, theta = 31.0, 0.7
    f_x = q * (np.sin(tau) + np.sin(np.pi - tau)) * np.cos(theta)
    f_y = q * (np.sin(tau) - np.sin(np.pi - tau)) * np.sin(theta)
    impact = SynchronousImpact(amplitude=2 * q * np.cos(theta), exponent=1.5, reference_speed=900.0)
    found = cage_with(impact=impact)[1].forces(tau, 0.0, 0.0, 0.0, 0.0)["impact"][:2]
    np.testing.assert_allclose(found, (f_x, f_y), atol=1e-13 * q)


# --- roller-bar impact (14) ------------------------------------------------------------------

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


def solve_14(impact, roller, v0, times):
    """The two-mass oscillator by SciPy: times, contact force."""
    k, kc, mc = constants(impact)

    def rates(_, y):
        q = k * max(y[0] - y[1], 0.0) ** (10 / 9)
        return [y[2], y[3], -q / roller, (q - kc * y[1]) / mc]

    span, start = (0.0, times[-1]), [0.0, 0.0, v0, 0.0]
    options = dict(method="DOP853", rtol=1e-11, atol=1e-15, max_step=times[-1] / 500)
    y = solve_ivp(rates, span, start, t_eval=times, **options).y
    return k * np.maximum(y[0] - y[1], 0.0) ** (10 / 9), y


# Where the contact closes within a step, p^(10/9) costs a fixed-step method order: the errors below
# belong to the default 511 x 4 steps, and to 16 times as many.
@pytest.mark.wide
@pytest.mark.parametrize("samples, tolerance", [(512, 3e-4), (4089, 1e-5)])
def test_impact_against_scipy_and_its_energy(samples, tolerance):
    h = history(samples=samples, substeps=4 if samples == 512 else 8)
    q, y = solve_14(IMPACT, ROLLER, SPEED, np.asarray(h.time))
    k, kc, mc = constants(IMPACT)
    np.testing.assert_allclose(h.contact_force, q, atol=tolerance * q.max())
    np.testing.assert_allclose(h.bar_force, kc * y[1], atol=tolerance * q.max())
    assert np.min(h.bar_force) < -0.01 * q.max()  # the bar swings back, as in fig. 5
    depth = np.maximum(h.roller_position - h.bar_position, 0.0)
    kinetic = 0.5 * ROLLER * h.roller_velocity**2 + 0.5 * mc * h.bar_velocity**2
    energy = kinetic + 0.5 * kc * h.bar_position**2 + 9 / 19 * k * depth ** (19 / 9)
    np.testing.assert_allclose(energy, 0.5 * ROLLER * SPEED**2, rtol=tolerance / 10)


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


# --- roller passes ---------------------------------------------------------------------------


Z, CLEARANCE, HALF_ANGLE = 13, 0.3e-3, 0.7


def single_pulse(impact, omega, samples=4001):
    """Q_cw(t) of one impact by SciPy, at times up to the end of the window the package uses."""
    v0 = float(approach_speed(impact.approach_ratio, omega, CLEARANCE))
    duration = 8 * impact_time_scale(impact, v0)
    t = np.linspace(0, duration, samples)
    return t, solve_14(impact, ROLLER, v0, t)[0]


def superposed(impact, omega, tau):
    """Force of all rollers by adding shifted pulses, several revolutions back."""
    t, q = single_pulse(impact, omega)
    reach = int(np.ceil(omega * t[-1] / (2 * np.pi))) + 1
    total = np.zeros((2, tau.size))
    zones = (
        (-np.pi / 2 - HALF_ANGLE, 1.0, (np.cos(HALF_ANGLE), -np.sin(HALF_ANGLE))),
        (-np.pi / 2 + HALF_ANGLE, -1.0, (np.cos(HALF_ANGLE), np.sin(HALF_ANGLE))),
    )
    for start, sign, direction in zones:
        for j in range(-reach * Z, 2 * Z):
            since = (tau - (start + 2 * np.pi * j / Z)) / omega
            pulse = np.interp(since, t, q, left=0.0, right=0.0)
            total += sign * pulse * np.array(direction)[:, None]
    return total


OMEGAS = 500.0, 2880.0  # 4800 rpm, and 27500 rpm where pulses overlap


def train(omega, harmonics=24):
    law = RollerPassImpact(oscillator=IMPACT, harmonics=harmonics)
    return pulse_train(law, omega, HALF_ANGLE, Z, ROLLER, CLEARANCE)


@pytest.mark.wide
@pytest.mark.parametrize("omega", OMEGAS)
def test_pulse_train_has_the_spectrum_of_the_superposed_pulses(omega):
    tau = 2 * np.pi * np.arange(Z * 512) / (Z * 512)
    force = superposed(IMPACT, omega, tau)
    spectrum, coefficients = np.fft.rfft(force, axis=1) / tau.size, train(omega)
    peak = np.abs(force).max()
    # Nothing lies between the multiples of Z.
    others = np.ones(spectrum.shape[1], bool)
    others[::Z] = False
    assert np.abs(spectrum[:, others]).max() < 1e-12 * peak
    passes = spectrum[:, : 25 * Z : Z]
    cosine, sine = 2 * passes.real, -2 * passes.imag
    cosine[:, 0] /= 2
    # The pulses are laid on the grid by linear interpolation of 4001 samples.
    found = np.array([coefficients.a_x, coefficients.a_y])
    np.testing.assert_allclose(found, cosine, atol=1e-4 * peak)
    found = np.array([coefficients.b_x, coefficients.b_y])
    np.testing.assert_allclose(found, sine, atol=1e-4 * peak)


@pytest.mark.parametrize("omega", OMEGAS)
def test_mean_force_of_the_pulse_train_is_impulse_times_rate(omega):
    coefficients = train(omega)
    v0 = approach_speed(IMPACT.approach_ratio, omega, CLEARANCE)
    # the roller's change of momentum, exact whatever the shape of the pulse
    duration = 8 * impact_time_scale(IMPACT, float(v0))
    impulse = ROLLER * (float(v0) - solve_14(IMPACT, ROLLER, float(v0), np.linspace(0, duration, 9))[1][2, -1])
    mean = -2 * np.sin(HALF_ANGLE) * impulse * Z * omega / (2 * np.pi)
    assert float(coefficients.a_y[0]) == pytest.approx(mean, rel=1e-9)
    assert abs(float(coefficients.a_x[0])) < 1e-12 * abs(mean)
    assert float(coefficients.b_x[0]) == 0.0 == float(coefficients.b_y[0])


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


@pytest.mark.wide
def test_roller_pass_reaches_the_cage_with_the_half_angle_of_the_loaded_zone():
    law = RollerPassImpact(oscillator=IMPACT)
    model, cage = cage_with(impact=law)
    bearing = model.bearing
    angle = load_distribution(bearing, model.load).half_angle
    sizes = bearing.n_rollers, bearing.roller_mass, bearing.pocket_clearance
    expected = pulse_train(law, 900.0, angle, *sizes)
    k = bearing.n_rollers * np.arange(len(expected.a_x))
    for tau in (0.0, 1.0, 4.4):
        rows = [np.array([expected.a_x, expected.a_y]), np.array([expected.b_x, expected.b_y])]
        force = rows[0] @ np.cos(k * tau) + rows[1] @ np.sin(k * tau)
        found = cage.forces(tau, 0.0, 0.0, 0.0, 0.0)["impact"]
        np.testing.assert_allclose(found[:2], force, rtol=1e-11, atol=1e-11)
