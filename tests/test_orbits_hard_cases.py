"""Orbits and bifurcation points where things go wrong, or nearly: each must say so, or still be right."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import preliminary
from laws import numbers
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import jaxcage as jc


METHOD = jc.method("rodas4", steps=512)


class Well(eqx.Module):
    """x'' = c - k x + e x^2 - b x^3 - d x' + f cos(tau)."""

    c: jax.Array
    k: jax.Array
    e: jax.Array
    b: jax.Array
    d: jax.Array
    f: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (self.c - self.k * x + self.e * x**2 - self.b * x**3 - self.d * u + self.f * jnp.cos(tau),)


def well(c=0.0, k=1.0, e=0.0, b=0.0, d=0.2, f=0.1):
    return jc.ForcedOscillator(Well(**numbers(c=c, k=k, e=e, b=b, d=d, f=f)), coordinates=1)


def orbit_of(system, speed=1.0, guess=(0.1, 0.0)):
    return jc.periodic_orbit(system, speed, guess=guess, method=METHOD)


# A constant force on a free mass drifts, and M - I is singular; over the rim of its well it is gone in finite time;
# just past the fold of the well nothing singular happens, but there is no orbit.
NO_ORBIT = {
    "drift": dict(c=1.0, k=0.0),
    "blow-up": dict(c=1.0, k=0.0, e=1.0),
    "past the fold": dict(c=0.4, k=1.0, e=1.0),
}


@pytest.mark.parametrize("name", NO_ORBIT)
def test_no_orbit(name):
    orbit = orbit_of(well(**NO_ORBIT[name]))
    assert not bool(orbit.converged) and not bool(orbit.stable)
    assert orbit.status == "no orbit"
    assert np.all(np.isnan(orbit.state)) and np.all(np.isnan(orbit.multipliers))
    assert np.all(np.isnan(orbit.monodromy))
    assert str(orbit).startswith("No orbit found")


class Pendulum(eqx.Module):
    """x'' + 2 b x' + w0^2 sin x = g w0^2 cos(w t) with w = 2 pi, w0 = 1.5 w and b = w0/4 (J. R. Taylor, Classical
    Mechanics, 2005, chapter 12)."""

    g: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        natural = 1.5 * speed
        return (-natural / 2 * u + natural**2 * (self.g * jnp.cos(tau) - jnp.sin(x)),)


@pytest.mark.wide
def test_period_doubling_from_beyond_a_superstable_orbit():
    """Newton's method finds nothing from an orbit with the multiplier .18: the branch leads there (SciPy's DOP853 and
    bisection put it at 1.08208437)."""
    system = jc.ForcedOscillator(Pendulum(jnp.asarray(1.0805)), coordinates=1)
    orbit = jc.periodic_orbit(system, 2 * np.pi, 4, guess=(-np.pi / 2, 0.0), revolutions=400)
    assert 0.17 < orbit.multipliers[0].real < 0.19
    point = jc.bifurcation(system, "period-doubling", orbit, "g")
    assert point.status == "converged" and abs(point.value - 1.08208437) < 1e-7


class Turning(eqx.Module):
    """A pendulum with a constant torque: x'' = -0.2 x' - 0.5 sin x + T + 0.4 cos(w t)."""

    torque: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.2 * u - 0.5 * jnp.sin(x) + self.torque + 0.4 * jnp.cos(tau),)


def shot(speed, torque, guess):
    """State and multipliers of the orbit that turns once a period, and the torque if the guess has one: at a fold. By
    SciPy's DOP853 and MINPACK."""

    def rates(t, y, torque):
        x, u, *slopes = y
        j = np.array([[0.0, 1.0], [-0.5 * np.cos(x), -0.2]])
        force = -0.2 * u - 0.5 * np.sin(x) + torque + 0.4 * np.cos(speed * t)
        return [u, force, *(j @ np.reshape(slopes, (2, 2))).ravel()]

    def image(z, torque):
        start = [*z, 1.0, 0.0, 0.0, 1.0]
        end = solve_ivp(rates, (0, 2 * np.pi / speed), start, "DOP853", rtol=1e-12, atol=1e-12, args=(torque,)).y[:, -1]
        return end[:2], end[2:].reshape(2, 2)

    def off(w):
        (x, u), m = image(w[:2], w[2] if len(w) > 2 else torque)
        return [x - w[0] - 2 * np.pi, u - w[1], *([np.linalg.det(m - np.eye(2))] if len(w) > 2 else [])]

    found = fsolve(off, guess, xtol=1e-12)
    return found, np.linalg.eigvals(image(found[:2], found[2] if len(found) > 2 else torque)[1])


@pytest.mark.wide
def test_orbits_that_turn_by_whole_revolutions():
    """A pendulum that turns once a period, and the fold at which it falls out of step, by SciPy's shooting."""
    system = jc.ForcedOscillator(Turning(jnp.asarray(0.3)), coordinates=1, angles=(0,), initial_states=((0.0, 1.5),))
    orbit = jc.periodic_orbit(system, 1.5, revolutions=60)
    assert orbit.status == "converged" and bool(orbit.stable) and abs(orbit.state[0]) < np.pi
    state, multipliers = shot(1.5, 0.3, np.array(orbit.state))
    np.testing.assert_allclose(orbit.state, state, atol=1e-6)
    np.testing.assert_allclose(np.sort_complex(orbit.multipliers), np.sort_complex(multipliers), atol=1e-5)
    branch = jc.branch(system, orbit, "torque", lower=0.1, upper=0.6)
    assert branch.ended == ("closed", "closed") and [p.kind for p in branch.special] == ["fold", "fold"]
    fold = max(branch.special, key=lambda p: p.value)
    (*_, torque), _ = shot(1.5, 0.3, [*fold.state, fold.value])
    assert abs(fold.value - torque) < fold.error + 1e-8
    exact = jc.bifurcation(system, "fold", fold, "torque")
    assert abs(exact.value - torque) < exact.error + 1e-8


@pytest.mark.wide
def test_orbits_at_angles_that_differ_by_revolutions_are_one():
    states = ((0.1, 0.0), (0.1 + 2 * np.pi, 0.0), (0.1 - 4 * np.pi, 0.0))
    system = jc.ForcedOscillator(Turning(jnp.asarray(0.0)), coordinates=1, angles=(0,), initial_states=states)
    found = jc.synchronous_orbits(system, 2.0, 2.2, count=3, discard=100)
    (only,) = found.stretches
    assert only.met == 9 and found.missed == 0 and len(found.coexisting(2.1)) == 1


def test_angles_must_be_coordinates_in_which_the_law_repeats():
    law = lambda tau, q, v, speed: (-q[0] - 0.1 * v[0] + jnp.cos(tau),)
    for angles, sentence in (((0,), "in which the law repeats after 2 pi"), ((1,), "from 0 to 0, but 1 is among them")):
        with pytest.raises(ValueError, match=sentence):
            jc.ForcedOscillator(law, coordinates=1, angles=angles)


class Planted(eqx.Module):
    """A driven orbit p(tau) around which the state turns by `turn` revolutions a period.

    In the turning frame it grows with the rates g and g - s, or turns by b: the multipliers are those of
    exp([[g, -b], [b, g - s]] T), with the opposite sign for half a turn. g(a) vanishes at a = 1.
    """

    a: jax.Array
    slope: jax.Array
    touch: jax.Array
    bend: jax.Array
    s: jax.Array
    b: jax.Array
    turn: jax.Array
    square: jax.Array

    def __call__(self, tau, y, speed):
        away = self.a - 1
        growth = away * (self.slope + away * (self.touch + away * self.bend))
        p, drift = (jnp.cos(tau), 0.5 * jnp.sin(tau)), (-speed * jnp.sin(tau), 0.5 * speed * jnp.cos(tau))
        x, z = y[0] - p[0], y[1] - p[1]
        c, s = jnp.cos(self.turn * tau), jnp.sin(self.turn * tau)
        e, f = c * x + s * z, -s * x + c * z
        cubic = e * e + f * f
        de = (growth - cubic) * e - self.b * f + self.square * e * e
        df = (growth - self.s - cubic) * f + self.b * e
        spin = self.turn * speed
        return (c * de - s * df - spin * z + drift[0], s * de + c * df + spin * x + drift[1])


def planted(a=0.9, slope=1.0, touch=0.0, bend=0.0, s=0.0, b=0.0, turn=0.5, square=0.0):
    values = numbers(a=a, slope=slope, touch=touch, bend=bend, s=s, b=b, turn=turn, square=square)
    return jc.ForcedSystem(Planted(**values), dimension=2)


def point_of(kind, a=0.93, speed=1.1, **settings):
    system = planted(a=a, **settings)
    return jc.bifurcation(system, kind, ((0.99, 0.01), a), "a", speed=speed, method=METHOD)


TANGENT = {"hardly crosses": dict(slope=1e-4, bend=1.0), "touches": dict(slope=0.0, touch=-1.0)}
CRITICAL = {"period-doubling": dict(s=0.3), "Neimark-Sacker": dict(b=0.3)}


@pytest.mark.parametrize("name", TANGENT)
@pytest.mark.wide
@pytest.mark.parametrize("kind", CRITICAL)
def test_tangential_crossing(kind, name):
    """Found, but not trusted: its place is not a function of the design."""
    point = point_of(kind, **CRITICAL[kind], **TANGENT[name])
    assert point.status == "tangential"
    assert bool(point.converged) and not bool(point.trusted)
    assert abs(point.value - 1) < 1e-5
    np.testing.assert_allclose(point.transversality, TANGENT[name]["slope"] * 2 * np.pi / 1.1, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("kind", CRITICAL)
def test_crossing_and_its_rate(kind):
    """The multipliers are -exp((g +- i b) T) or, without b, -exp(g T) and -exp((g - s) T): exact."""
    point, period = point_of(kind, speed=0.8, **CRITICAL[kind]), 2 * np.pi / 0.8
    assert point.status == "converged" and abs(point.value - 1) < 1e-8
    np.testing.assert_allclose(point.state, [1.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(point.transversality, period, rtol=1e-6)
    turned = np.pi if kind == "period-doubling" else abs(np.angle(-np.exp(0.3j * period)))
    assert abs(point.angle - turned) < 1e-8


@pytest.mark.wide
@pytest.mark.parametrize("turn", [0.0, 0.5])
@pytest.mark.parametrize("angle", [1.7, 0.02, 0.002])
def test_torus_bifurcation_with_multipliers_close_to_the_real_axis(turn, angle):
    """If the pair is close to 1 or -1, exp(i phi) is a poor unknown, and the product of the pair is not."""
    period = 2 * np.pi / 1.1
    point = point_of("Neimark-Sacker", b=angle / period, turn=turn)
    assert point.status == "converged"
    assert abs(point.value - 1) < 1e-9
    assert abs(point.angle - abs(2 * np.pi * turn - angle)) < 1e-6
    np.testing.assert_allclose(point.transversality, period, rtol=1e-6)


def test_what_is_not_found_or_cannot_be_asked_for():
    point = jc.bifurcation(well(c=1.0, k=0.0), "fold", ((0.1, 0.0), 1.0), method=METHOD)
    assert point.status == "no such point" and np.isnan(point.value) and np.all(np.isnan(point.state))
    assert not bool(point_of("fold", s=0.3, turn=0.0).trusted)  # a pitchfork is crossed by its orbit
    assert point_of("fold", b=0.3, turn=0.0).status in ("no such point", "other kind")  # a torus
    system, start = planted(), ((1.0, 0.0), 0.9)
    find = lambda kind, guess, parameter, speed=1.1: jc.bifurcation(system, kind, guess, parameter, speed=speed)
    nothing = jc.Point("fold", float("nan"), np.zeros(2), parameter="a")
    for asked, sentence in (
        (("hopf", start, "a"), "`kind` must be one of period-doubling, Neimark-Sacker, fold, but 'hopf'"),
        (("fold", start, "x"), "`parameter` must be one of speed, a, .*, but 'x' was given"),
        (("fold", start, "a", None), "`speed` must be given where the parameter is `a`"),
        (("fold", start, lambda s: 2 * s.rates.a), "must pick a number that the system holds"),
        (("fold", nothing, "a"), "`guess` must be one that was found, but this fold was not"),
    ):
        with pytest.raises(ValueError, match=sentence):
            find(*asked)
    with pytest.raises(ValueError, match="`guess` must be a state of 2 numbers"):
        jc.periodic_orbit(system, 1.1, guess=(1.0, 0.0, 0.0))


@pytest.mark.wide
@pytest.mark.parametrize(
    "unbalance, sizes", [(10.0, [0.01862017] * 2 + [9.1993e-6]), (3.0, [0.68762552] * 2 + [0.08096483])]
)
def test_multipliers_of_a_cage_in_contact_are_trusted(unbalance, sizes):
    """The rim is pressed, or just grazed. One multiplier is below 1e-17 of the largest: the determinant is lost to
    rounding, the others are not; the known sizes are those of 4096 steps."""
    model = preliminary("1a")
    model = jc.replace(model, eccentricity=unbalance * jc.parameters(model)["eccentricity"])
    orbit = jc.periodic_orbit(model, jc.rpm(20000.0), revolutions=300)
    np.testing.assert_allclose(jnp.abs(orbit.multipliers[:3]), sizes, rtol=2e-3)
    assert jnp.abs(orbit.multipliers[3]) < 1e-15
    assert orbit.status == "converged" and bool(orbit.stable) and orbit.residual < 1e-10
