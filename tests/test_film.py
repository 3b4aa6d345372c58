"""The rib film against quadrature of the pressure (26), closed forms, limits, and Reynolds' equation on lands of finite
width, whose solver `literature` compares with closed forms, finite volumes and printed tables.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import preliminary
from reynolds import film_force
from scipy.integrate import quad
from short_bearing import short_film_force as force

from jaxcage import replace
from jaxcage.forces import arc_centre, film_drive, film_resistance


MODELS = "fixed_half", "positive_pressure", "full"
SMOOTHING = 1e-9


def polar_state(eps, phi, eps_rate, phi_rate):
    """Position and velocity over clearance, unit vectors along the radius and along +phi."""
    radial = np.array([np.cos(phi), np.sin(phi)])
    tangential = np.array([-np.sin(phi), np.cos(phi)])
    return eps * radial, eps_rate * radial + eps * phi_rate * tangential, radial, tangential


def random_states(count=12):
    """Eccentricity ratio, angle and their rates."""
    rng = np.random.default_rng(20160912)
    eps, phi = rng.uniform(0.02, 0.96, count), rng.uniform(-np.pi, np.pi, count)
    rates = rng.normal(scale=0.4, size=count), rng.normal(scale=0.8, size=count)
    return [tuple(map(float, state)) for state in zip(eps, phi, *rates, strict=True)]


def pressure(alpha, eps, eps_rate, phi_rate, omega):
    """(26) in clean form, integrated over the land width; forces have the unit mu R L^3 / c^2."""
    drive = (omega - 2 * phi_rate) * eps * np.sin(alpha) - 2 * eps_rate * np.cos(alpha)
    return 0.5 * drive / (1 + eps * np.cos(alpha)) ** 3


def arcs(model, eps, eps_rate, phi_rate, omega):
    if model == "fixed_half":
        return [(0.0, np.pi)]
    if model == "full":
        return [(0.0, np.pi), (np.pi, 2 * np.pi)]
    # The drive is a sine wave in alpha: it is positive over the half circle after its zero.
    start = np.arctan2(2 * eps_rate, (omega - 2 * phi_rate) * eps)
    return [(start, start + np.pi / 2), (start + np.pi / 2, start + np.pi)]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("state", random_states())
def test_force_is_the_integral_of_the_pressure(model, state):
    eps, phi, eps_rate, phi_rate = state
    omega = 1.3
    ends = arcs(model, eps, eps_rate, phi_rate, omega)
    if model == "positive_pressure":
        inside = np.linspace(ends[0][0], ends[-1][1], 101)[1:-1]
        assert np.all(pressure(inside, eps, eps_rate, phi_rate, omega) > 0)
        assert np.all(pressure(inside + np.pi, eps, eps_rate, phi_rate, omega) < 0)

    def integral(direction):
        def push(alpha):  # counted from the widest gap, opposite to the displacement
            return -pressure(alpha, eps, eps_rate, phi_rate, omega) * direction(alpha + phi + np.pi)

        return sum(quad(push, a, b, epsabs=0, epsrel=1e-12, limit=200)[0] for a, b in ends)

    r, v, *_ = polar_state(eps, phi, eps_rate, phi_rate)
    expected = np.array([integral(np.cos), integral(np.sin)])
    found = np.asarray(force(model, r, v, omega))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.linalg.norm(expected))


def matrix(model, r, v, omega=1.0):
    n = tuple(np.asarray(r) / np.hypot(*r))
    m = film_resistance(model, *r, n, arc_centre(model, n, film_drive(*r, *v, omega), SMOOTHING * omega))
    return np.array([[m.xx, m.xy], [m.xy, m.yy]], dtype=float)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("state", random_states(4))
def test_velocity_coefficients(model, state):
    r, v, *_ = polar_state(*state)
    m = matrix(model, r, v)
    derivative = np.asarray(jax.jacfwd(force, argnums=2)(model, r, v))
    np.testing.assert_allclose(derivative, -m, rtol=0, atol=1e-10 * np.abs(m).max())
    assert np.all(np.linalg.eigvalsh(m) > 0)
    if model != "positive_pressure":  # the damping matrix read off (27): radial, cross and tangential
        _, _, radial, tangential = polar_state(*state)
        eps2, half = state[0] ** 2, model == "fixed_half"
        isotropic = (0.5 if half else 1.0) * np.pi / (1 - eps2) ** 1.5
        skew = -2 * state[0] / (1 - eps2) ** 2 if half else 0.0
        expected = isotropic * (1 + 2 * eps2) / (1 - eps2), skew, isotropic
        found = radial @ m @ radial, radial @ m @ tangential, tangential @ m @ tangential
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-9)


CENTRE = np.zeros(2)
VELOCITY = np.array([0.3, -0.2])
J = np.array([[0.0, 1.0], [-1.0, 0.0]])  # dP/dr over omega


@pytest.mark.parametrize("model, share", [(m, 1.0 if m == "full" else 0.5) for m in MODELS])
def test_force_at_the_centre_is_the_limit(model, share):
    centre = force(model, CENTRE, VELOCITY)
    np.testing.assert_allclose(centre, -share * np.pi * VELOCITY, rtol=1e-12)
    for angle in (0.0, 1.0, 4.0):
        near = 1e-7 * np.array([np.cos(angle), np.sin(angle)])
        np.testing.assert_allclose(force(model, near, VELOCITY), centre, rtol=0, atol=1e-6)


def test_gradients_at_the_centre_in_closed_form():
    gradient = {m: np.asarray(jax.jacfwd(force, argnums=1)(m, CENTRE, VELOCITY)) for m in MODELS}
    np.testing.assert_allclose(gradient["full"], -np.pi / 2 * J, atol=1e-12)
    # The trailing half turns with the displacement: its part of the slope averages to zero.
    np.testing.assert_allclose(gradient["fixed_half"], -np.pi / 4 * J, atol=1e-9)
    speed = np.linalg.norm(VELOCITY)
    along = np.outer(VELOCITY, VELOCITY) / speed**2
    # -1/2 of n (n.omega J r + 6 (v.n) (n.r)) over the half circle about v, on which
    # cos^3 gives 4/3 and cos sin^2 gives 2/3.
    squeeze = 6 * speed * (4 / 3 * along + 2 / 3 * (np.eye(2) - along))
    expected = -0.5 * (np.pi / 2 * J + squeeze)
    np.testing.assert_allclose(gradient["positive_pressure"], expected, atol=1e-12)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("state", random_states(3))
def test_supply_pressure_pushes_with_its_projected_area(model, state):
    """Thrust 2 R L p_0 of (27): a uniform pressure over the half circle that carries the film."""
    omega = 1.3
    r, v, *_ = polar_state(*state)
    thrust = -2 * np.array(arc_centre(model, tuple(r / np.hypot(*r)), film_drive(*r, *v, omega), SMOOTHING * omega))
    eps, phi, eps_rate, phi_rate = state
    ends = arcs(model, eps, eps_rate, phi_rate, omega)
    lo, hi = ends[0][0] + phi + np.pi, ends[-1][1] + phi + np.pi
    expected = -np.array([np.sin(hi) - np.sin(lo), np.cos(lo) - np.cos(hi)])
    np.testing.assert_allclose(thrust, expected, atol=1e-12)
    assert np.linalg.norm(thrust) == pytest.approx(0.0 if model == "full" else 2.0, abs=1e-12)


EPS = np.linspace(0.0, 1.5, 1501)


@pytest.mark.wide
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("angle", [0.0, 2.2])
def test_land_force_at_rest_is_finite_and_monotone_through_contact(model, angle):
    built = replace(preliminary("1a"), **{"film.model": model})
    cage = built.cage_at(1000.0)
    x, y = np.cos(angle), np.sin(angle)

    def both(eps):
        r = eps * built.clearance
        found = cage.forces(0.0, r * x, r * y, 0.0, 0.0)
        return jnp.stack([jnp.stack(found[name][:2]) for name in ("film", "contact")])

    film, contact = np.moveaxis(np.asarray(jax.vmap(both)(jnp.asarray(EPS))), 1, 0)
    size = np.linalg.norm(film + contact, axis=-1)
    assert np.all(np.isfinite(size))
    assert np.all(np.diff(size) > 0)
    inward = -(film + contact) @ np.array([x, y])
    assert np.all(np.diff(inward) >= (0.0 if model != "full" else -1e-12))
    onset = float(built.contact.onset)
    assert np.all(contact[onset - 1e-3 > EPS] == 0)
    # Beyond the onset the film grows with the drive alone, in proportion to eps.
    there = np.linalg.norm(film, axis=-1) / EPS.clip(1e-9)
    np.testing.assert_allclose(there[onset + 1e-3 < EPS], there[-1], rtol=1e-9)


# --- lands of finite width ------------------------------------------------------------------


def test_squeeze_of_a_long_film_in_closed_form():
    """Full film, no rotation: -12 pi eps'/(1 - eps^2)^(3/2) in units of mu R L (R/c)^2."""
    at = lambda lam: 4 * lam**2 * film_force((0.5, 0.0), (0.1, 0.0), lam, 0.0, cavitation="full", profiles=8)
    np.testing.assert_allclose(2 * at(20.0) - at(10.0), [-1.2 * np.pi / 0.75**1.5, 0.0], atol=0.01)


@pytest.mark.parametrize(
    "cavitation, short", [("full", "full"), ("reynolds", "positive_pressure"), ("guembel", "positive_pressure")]
)
def test_short_film_is_the_limit_of_narrow_lands(cavitation: str, short: str):
    r, v = (0.55, -0.2), (0.12, 0.05)
    expected = np.array(force(short, r, v))
    found = film_force(r, v, 1e-5, cavitation=cavitation, stations=1024, profiles=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=3e-5 * np.linalg.norm(expected))


def short_film_excess(eps: float, slenderness: float, cavitation: str = "reynolds") -> float:
    """|F_short|/|F| - 1 of a cage that does not whirl, both on the same stations."""
    size = lambda lam: np.linalg.norm(film_force((eps, 0.0), (0.0, 0.0), lam, cavitation=cavitation, stations=1024))
    return float(size(0.0) / size(slenderness) - 1)


@pytest.mark.parametrize("width, percent", [(1.45, (0.0182, 0.083, 0.380)), (6.5, (0.362, 1.64, 7.30))])
def test_error_of_the_short_film_at_the_lands_of_the_published_bearing(width: float, percent: tuple[float, ...]):
    """The identified land and the widest that fits [mm], at a radius of 46 mm; eps 0.4, 0.8 and 0.95."""
    found = [100 * short_film_excess(eps, width / 92.0) for eps in (0.4, 0.8, 0.95)]
    np.testing.assert_allclose(found, percent, rtol=0.02)


def test_half_speed_whirl_makes_no_pressure():
    np.testing.assert_allclose(film_force((0.3, 0.1), (-0.05, 0.15), 0.05), 0.0, atol=1e-14)
