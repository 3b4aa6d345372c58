"""Bifurcation points followed in two parameters, with codimension-2 points in their places.

"DOP853" in a comment means: computed with SciPy's DOP853 at a tolerance of 1e-13 and Newton's method, sharing nothing
with this library. "Planted" systems have orbits and multipliers that are known exactly.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but
from literature import DUFFING_DOUBLINGS, DUFFING_FOLDS
from scipy.interpolate import CubicSpline

import jaxcage as jc


METHOD = jc.method("rk4", steps=256)
FINE = jc.method("rk4", steps=1024)


def numbers(**values):
    return {name: jnp.asarray(x, dtype=float) for name, x in values.items()}


class Duffing(eqx.Module):
    """x'' + d x' - k x + b x^3 = g cos(w t): double-well for k > 0, hardening for k < 0."""

    d: jax.Array
    k: jax.Array
    b: jax.Array
    g: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-self.d * u + self.k * x - self.b * x**3 + self.g * jnp.cos(tau),)


def duffing(d=0.1, k=-1.0, g=0.3, b=1.0):
    return jc.ForcedOscillator(Duffing(**numbers(d=d, k=k, b=b, g=g)), coordinates=1)


@pytest.fixture(scope="module")
def fold():
    orbit = jc.periodic_orbit(duffing(), 1.7, guess=(0.6, 2.4), revolutions=200, method=METHOD)
    return jc.bifurcation(duffing(), "fold", orbit, method=METHOD)


@pytest.mark.wide
def test_folds_of_the_hardening_duffing_end_in_a_cusp(fold):
    """Speed and force of the cusp by DOP853, with the second derivative of the strobe map by variational equations; the
    folds at a force of 0.3 likewise."""
    curve = jc.curve(duffing(), fold, "speed", "g", lower=0.01, upper=0.6, x_lower=0.5, x_upper=3.0, method=METHOD)
    assert curve.ended == ("range", "range") and np.all(curve.genuine) and curve.kind == "fold"
    (cusp,) = curve.special
    assert cusp.kind == "cusp"
    assert abs(cusp.x_value - 1.0901095) < 1e-7 and abs(cusp.y_value - 0.0513635) < 1e-7
    assert cusp.y_value < np.min(curve.y_value) < cusp.y_value + 0.002
    # Both sides of the curve, from the cusp on.
    turn = int(np.argmin(curve.y_value))
    sides = []
    for part in (slice(turn - 1, None, -1), slice(turn + 1, None)):
        force, speed = curve.y_value[part], curve.x_value[part]
        assert np.all(np.diff(force) > 0)
        sides.append(float(CubicSpline(force, speed)(0.3)))
    folds = [DUFFING_FOLDS[side].value for side in ("down", "up")]
    np.testing.assert_allclose(sorted(sides), folds, rtol=0, atol=2e-6)
    # Multipliers are those of Newton's last iterate but one, at a distance of up to 1e-5.
    np.testing.assert_allclose(np.min(np.abs(curve.multipliers - 1), axis=1), 0.0, atol=5e-4)
    product = np.prod(curve.multipliers, axis=1)
    np.testing.assert_allclose(product, np.exp(-0.1 * 2 * np.pi / curve.x_value), rtol=1e-5)


@pytest.mark.wide
def test_fold_curve_is_made_of_folds(fold):
    """Each is found again on its own, without the curve."""
    curve = jc.curve(duffing(), fold, "speed", "g", lower=0.2, upper=0.4, x_lower=1.0, x_upper=3.0, method=METHOD)
    point_of = eqx.filter_jit(
        jax.vmap(lambda g, w, y: jc.bifurcation(duffing(g=g), "fold", ((y[0], y[1]), w), method=METHOD).value)
    )
    found = point_of(*(jnp.asarray(c[1:-1]) for c in (curve.y_value, curve.x_value, curve.state)))
    np.testing.assert_allclose(found, curve.x_value[1:-1], rtol=0, atol=1e-9)
    assert found.size > 10 and np.ptp(found) > 0.1


@pytest.mark.wide
def test_period_doubling_curve_has_an_exact_scaling():
    """x -> x / sqrt(b): the force of any edge times sqrt(b) is one number. At b = 1 it is DOP853's."""
    system = duffing(d=0.3, k=1.0, g=0.262)
    orbit = jc.periodic_orbit(system, 1.2, guess=(1.0, 0.0), revolutions=300, method=FINE)
    point = jc.bifurcation(system, "period-doubling", orbit, "g", method=FINE)
    curve = jc.curve(system, point, "g", "b", lower=0.25, upper=4.0, x_lower=0.05, x_upper=1.0, method=FINE)
    assert curve.ended == ("range", "range") and np.ptp(curve.y_value) > 3.7
    _, first = DUFFING_DOUBLINGS[1]
    scaled = curve.x_value * np.sqrt(curve.y_value)
    np.testing.assert_allclose(scaled, first.value, rtol=0, atol=first.tolerance)
    alike = curve.state * np.sqrt(curve.y_value)[:, None]
    np.testing.assert_allclose(alike, np.broadcast_to(alike[0], alike.shape), atol=1e-8)
    assert curve.special == () and (curve.x, curve.y) == ("g", "b")
    np.testing.assert_allclose(np.min(np.abs(curve.multipliers + 1), axis=1), 0.0, atol=5e-5)


class Cusp(eqx.Module):
    """x' = -x^3 + (a - m) x + (b - n), and beside it what the drive makes of u."""

    a: jax.Array
    b: jax.Array
    m: jax.Array
    n: jax.Array

    def __call__(self, tau, y, speed):
        x, u = y
        return (-(x**3) + (self.a - self.m) * x + self.b - self.n, -0.5 * u + jnp.cos(tau))


@pytest.mark.parametrize("x, m, n", wide_but([("a", 1.5, -0.7), ("a", 0.0, 0.0), ("b", 0.0, 2.0)], ("a", 0.0, 0.0)))
def test_fold_curve_through_an_exact_cusp(x, m, n):
    """a = m + 3 s^2, b = n - 2 s^3 with s the state: 4 (a - m)^3 = 27 (b - n)^2, with the cusp at (m, n)."""
    speed, s = 1.5, 0.5
    a, b = m + 3 * s * s, n - 2 * s**3
    system = jc.ForcedSystem(Cusp(**numbers(a=a, b=b, m=m, n=n)), dimension=2)
    guess = ((s, 0.5 / (0.25 + speed**2)), (a if x == "a" else b) + 0.001)
    point = jc.bifurcation(system, "fold", guess, x, speed=speed, method=METHOD)
    limits = {"a": (m - 1, m + 2.0), "b": (n - 1.0, n + 1.2)}
    y = "b" if x == "a" else "a"
    (x_lower, x_upper), (lower, upper) = limits[x], limits[y]
    curve = jc.curve(system, point, x, y, lower=lower, upper=upper, x_lower=x_lower, x_upper=x_upper, method=METHOD)
    at = {x: curve.x_value, y: curve.y_value}
    np.testing.assert_allclose(at["a"], m + 3 * curve.state[:, 0] ** 2, rtol=0, atol=1e-7)
    np.testing.assert_allclose(at["b"], n - 2 * curve.state[:, 0] ** 3, rtol=0, atol=1e-7)
    assert curve.state[:, 0].min() < -0.5 < 0.5 < curve.state[:, 0].max()
    (cusp,) = curve.special
    assert cusp.kind == "cusp"
    found = {x: cusp.x_value, y: cusp.y_value}
    assert abs(found["a"] - m) < 1e-8 and abs(found["b"] - n) < 1e-8


class Planted(eqx.Module):
    """The orbit (cos, sin) with the multipliers of exp([[g + s, -b], [b, g - s]] T), g = a - b^2 / 5.

    With a turn of half a revolution a period they have the opposite sign.
    """

    a: jax.Array
    b: jax.Array
    s: jax.Array
    turn: jax.Array
    cube: jax.Array

    def __call__(self, tau, y, speed):
        cos, sin, along, across = jnp.cos(tau), jnp.sin(tau), jnp.cos(self.turn * tau), jnp.sin(self.turn * tau)
        x, v = y[0] - cos, y[1] - sin
        e, f = along * x + across * v, -across * x + along * v
        growth, cubic, spin = self.a - self.b**2 / 5, self.cube * (e * e + f * f), self.turn * speed
        de = (growth + self.s - cubic) * e - self.b * f
        df = (growth - self.s - cubic) * f + self.b * e
        return (along * de - across * df - spin * v - speed * sin, across * de + along * df + spin * x + speed * cos)


SPEED = 1.2


def torus_curve(b, lower, upper, s=0.0, turn=0.0):
    system = jc.ForcedSystem(Planted(**numbers(a=0.1, b=b, s=s, turn=turn, cube=1.0)), dimension=2)
    point = jc.bifurcation(system, "Neimark-Sacker", ((1.0, 0.0), b**2 / 5 + 0.01), "a", speed=SPEED, method=METHOD)
    assert abs(point.value - b**2 / 5) < 1e-8
    curve = jc.curve(system, point, "a", "b", lower=lower, upper=upper, x_lower=-1.0, x_upper=1.0, method=METHOD)
    assert curve.ended == ("range", "range")
    np.testing.assert_allclose(curve.x_value, curve.y_value**2 / 5, rtol=0, atol=1e-8)
    np.testing.assert_allclose(curve.state, np.broadcast_to([1.0, 0.0], curve.state.shape), atol=1e-7)
    return curve


def assert_resonances(curve, places):
    """At these values of b, and no others."""
    assert sorted(p.kind for p in curve.special) == sorted(places)
    for point in curve.special:
        b, order = places[point.kind], int(point.kind[2])
        assert abs(point.y_value - b) < 1e-8 and abs(point.x_value - b**2 / 5) < 1e-8
        # At 1:2 the multiplier is double, and known to the square root of rounding.
        away = np.abs(point.multipliers - np.exp(2j * np.pi / order))
        assert np.min(away) < (1e-3 if order == 2 else 1e-7)


@pytest.mark.wide
def test_torus_curve_passes_resonances():
    """The pair exp((g +- i b) T) turns by a third of a circle at b = speed / 3 and a quarter at speed / 4: exact."""
    curve = torus_curve(0.35, 0.2, 0.5)
    assert np.all(curve.genuine)
    assert_resonances(curve, {"1:3 resonance": SPEED / 3, "1:4 resonance": SPEED / 4})
    np.testing.assert_allclose(np.abs(curve.multipliers), 1.0, atol=1e-4)
    assert str(curve).count("resonance") == 2
    assert set(curve.criticality) == {"supercritical"}


@pytest.mark.wide
def test_torus_curve_turns_subcritical_at_a_chenciner_point():
    """The amplitude changes by -cube |z|^3: exact."""
    system = jc.ForcedSystem(Planted(**numbers(a=0.1, b=0.35, s=0.0, turn=0.0, cube=0.7)), dimension=2)
    place = 0.35**2 / 5
    point = jc.bifurcation(system, "Neimark-Sacker", ((1.0, 0.0), place + 0.01), "a", speed=SPEED, method=METHOD)
    np.testing.assert_allclose(point.coefficient, -0.7 * 4 * np.pi / SPEED, rtol=1e-6)
    assert str(point).startswith("supercritical Neimark-Sacker at ")
    curve = jc.curve(system, point, "a", "cube", lower=-0.6, upper=1.0, x_lower=-1.0, x_upper=1.0, method=METHOD)
    (turn,) = curve.special
    assert turn.kind == "Chenciner" and abs(turn.y_value) < 1e-6 and abs(turn.x_value - place) < 1e-8
    expected = np.where(curve.y_value > 0, "supercritical", "subcritical")
    assert np.array_equal(curve.criticality, expected) and len(set(expected)) == 2


class Flip(eqx.Module):
    """e' = p e + g e^3 + e f / 2 and f' = -0.7 f + 0.6 e^2, where e turns by half a revolution a period."""

    p: jax.Array
    g: jax.Array

    def __call__(self, tau, y, speed):
        along, across = jnp.cos(tau / 2), jnp.sin(tau / 2)
        x, z, f = y
        e, k = along * x + across * z, -across * x + along * z
        de, dk = self.p * e + self.g * e**3 + 0.5 * e * f, -0.5 * k
        turned = (along * de - across * dk - speed / 2 * z, across * de + along * dk + speed / 2 * x)
        return (*turned, -0.7 * f + 0.6 * e * e)


@pytest.mark.wide
def test_period_doubling_curve_turns_subcritical_at_a_generalised_flip():
    """On the centre manifold f = 0.6 e^2 / 0.7, so that over a period e grows by (g + 0.3 / 0.7) T e^3: exact."""
    system = jc.ForcedSystem(Flip(**numbers(p=-0.1, g=0.2)), dimension=3)
    point = jc.bifurcation(system, "period-doubling", ((0.0, 0.0, 0.0), -0.1), "p", speed=SPEED, method=METHOD)
    np.testing.assert_allclose(point.coefficient, -(0.2 + 0.3 / 0.7) * 2 * np.pi / SPEED, rtol=1e-6)
    assert point.criticality == "subcritical" and abs(point.value) < 1e-9
    curve = jc.curve(system, point, "p", "g", lower=-1.0, upper=0.5, x_lower=-1.0, x_upper=1.0, method=METHOD)
    (turn,) = curve.special
    assert turn.kind == "generalised flip" and abs(turn.y_value + 0.3 / 0.7) < 1e-6 and abs(turn.x_value) < 1e-8
    expected = np.where(curve.y_value < -0.3 / 0.7, "supercritical", "subcritical")
    assert np.array_equal(curve.criticality, expected) and len(set(expected)) == 2


@pytest.mark.wide
def test_torus_curve_goes_on_as_neutral_saddles_beyond_a_strong_resonance():
    """The pair is -exp(+-i r T) with r^2 = b^2 - s^2, real for b < s; the angle pi - r T is a third of a circle at
    r = speed / 6, a quarter at speed / 4."""
    s = 0.25
    curve = torus_curve(0.35, 0.1, 0.45, s=s, turn=0.5)
    at = lambda r: np.hypot(r, s)
    assert_resonances(curve, {"1:2 resonance": s, "1:3 resonance": at(SPEED / 6), "1:4 resonance": at(SPEED / 4)})
    assert np.array_equal(curve.genuine, curve.y_value > s)
    assert 5 < np.sum(curve.genuine) < curve.genuine.size - 5
    saddles = curve.multipliers[~curve.genuine]
    root = np.sqrt(s**2 - curve.y_value[~curve.genuine] ** 2) * 2 * np.pi / SPEED
    np.testing.assert_allclose(saddles, -np.exp(np.stack([root, -root], axis=1)), rtol=1e-3)


@pytest.mark.wide
def test_bad_arguments(fold):
    limits = dict(lower=0.2, upper=0.4, x_lower=1.0, x_upper=3.0, method=METHOD)
    pitchfork = eqx.tree_at(lambda p: p.value, fold, fold.value)
    object.__setattr__(pitchfork, "kind", "branch-point")
    with pytest.raises(
        ValueError, match="`point` must be a period-doubling, Neimark-Sacker or fold, but it is a branch-point"
    ):
        jc.curve(duffing(), pitchfork, "speed", "g", **limits)
    for wrong in (dict(lower=0.4, upper=0.2), dict(x_lower=3.0, x_upper=3.0)):
        with pytest.raises(ValueError, match="`x_lower` and `x_upper` must be in ascending order"):
            jc.curve(duffing(), fold, "speed", "g", **(limits | wrong))
    with pytest.raises(ValueError, match="`parameter` must be one of speed, d, k, b, g, but 'stiffness'"):
        jc.curve(duffing(), fold, "speed", "stiffness", **limits)
    with pytest.raises(ValueError, match="`point` must be a fold of the system, but Newton's method finds none there"):
        jc.curve(duffing(d=2.0), fold, "speed", "g", **limits)
    with pytest.raises(ValueError, match="must have the system's g between them, 0.02, but are 0.2 and 0.4"):
        jc.curve(duffing(g=0.02), fold, "speed", "g", **limits)
    with pytest.raises(ValueError, match="`point` must begin from 1 to 1.2"):
        jc.curve(duffing(), fold, "speed", "g", **(limits | dict(x_upper=1.2)))
