"""Periodic orbits and bifurcation points beside published values and beside SciPy."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from scipy.special import mathieu_a, mathieu_b

from .._types import Scalar, State
from ..integrate import method
from ..models import AbstractForcedSystem, ForcedOscillator, ForcedSystem
from ..orbits import Orbit, bifurcation, periodic_orbit
from ._comparison import Comparison, within, within_share


SCIPY = "SciPy's DOP853 at 1e-12 with Newton's method on the variational equations"
SCALING = "exact: under x -> s x the force at any edge goes with b^(-1/2)"
FEIGENBAUM = "M. J. Feigenbaum (1978): distances of period doublings shrink by 4.669..."
TAYLOR = "J. R. Taylor, Classical Mechanics (2005), table 12.1: period doublings of the driven damped pendulum"
MATHIEU = "characteristic values at q = 1: DLMF chapter 28, computed by SciPy's `mathieu_a` and `mathieu_b`"
LURE = "BifurcationKit and MatCont print 0.63031334 (off their meshes); SciPy's DOP853 0.6303020062"

FINE = method("rodas4", steps=1024)


def _numbers(**values: float) -> dict[str, jax.Array]:
    return {name: jnp.asarray(x, dtype=float) for name, x in values.items()}


class Duffing(eqx.Module):
    """x'' + d x' - k x + b x^3 = g cos(w t)."""

    d: jax.Array
    k: jax.Array
    b: jax.Array
    g: jax.Array

    def __call__(self, tau: Scalar, q: State, v: State, speed: Scalar) -> State:
        return (-self.d * v[0] + self.k * q[0] - self.b * q[0] ** 3 + self.g * jnp.cos(tau),)


class Pendulum(eqx.Module):
    """x'' + 2 b x' + w0^2 sin x = g w0^2 cos(w t) with w = 2 pi, w0 = 1.5 w and b = w0/4."""

    g: jax.Array

    def __call__(self, tau: Scalar, q: State, v: State, speed: Scalar) -> State:
        natural = 1.5 * speed
        return (-natural / 2 * v[0] + natural**2 * (self.g * jnp.cos(tau) - jnp.sin(q[0])),)


class VanDerPol(eqx.Module):
    """x'' - mu (1 - x^2) x' + x = g cos(w t) as two equations."""

    mu: jax.Array
    g: jax.Array

    def __call__(self, tau: Scalar, y: State, speed: Scalar) -> State:
        return (y[1], self.mu * (1 - y[0] ** 2) * y[1] - y[0] + self.g * jnp.cos(tau))


class Mathieu(eqx.Module):
    """x'' + (a - 2 q cos 2t) x = 0 with tau = 2 t."""

    a: jax.Array
    q: jax.Array

    def __call__(self, tau: Scalar, q: State, v: State, speed: Scalar) -> State:
        return (-(self.a - 2 * self.q * jnp.cos(tau)) * q[0],)


class Lure(eqx.Module):
    """x''' + a x'' + x' + x = x^2."""

    a: jax.Array

    def __call__(self, tau: Scalar, y: State, speed: Scalar) -> State:
        return (y[1], y[2], -self.a * y[2] - y[1] - y[0] + y[0] ** 2)


def bifurcation_comparisons() -> list[Comparison]:
    """All comparisons of orbits and their bifurcations."""
    return [*_doublings(), *_pendulum(), *_folds(), *_van_der_pol(), *_mathieu(), *_lure()]


def _duffing(d: float, k: float, g: float) -> ForcedOscillator:
    return ForcedOscillator(Duffing(**_numbers(d=d, k=k, b=1.0, g=g)), coordinates=1)


def _doublings() -> list[Comparison]:
    name = "Duffing x'' + .3 x' - x + x^3 = g cos 1.2t"
    found, rows = [], []
    for periods, inside, theirs in ((1, 0.262, 0.265581786), (2, 0.285, 0.286693158), (4, 0.2908, 0.291089909)):
        system = _duffing(0.3, 1.0, inside)
        orbit = periodic_orbit(system, 1.2, periods, guess=(1.0, 0.0), revolutions=400, method=FINE)
        point = bifurcation(system, "period-doubling", orbit, "g", speed=1.2, periods=periods, method=FINE)
        found.append(float(point.value))
        rows.append(within(f"{name}: g where period {periods} doubles", SCIPY, theirs, point.value, 2e-9))
    ratio = (found[1] - found[0]) / (found[2] - found[1])
    rows.append(within_share(f"{name}: first ratio of distances", FEIGENBAUM, 4.669201609, ratio, 0.05))
    slope = _slope_of_the_first_doubling()
    rows.append(within(f"{name}: slope of the first by the damping", SCIPY, 0.543875937, slope.d, 2e-9))
    rows.append(within(f"{name}: slope of the first by b", SCALING, -found[0] / 2, slope.b, 1e-9))
    return rows


def _slope_of_the_first_doubling() -> Duffing:
    system = _duffing(0.3, 1.0, 0.262)
    orbit = periodic_orbit(system, 1.2, 1, guess=(1.0, 0.0), revolutions=400, method=FINE)

    def force(system: ForcedOscillator) -> jax.Array:
        return bifurcation(system, "period-doubling", orbit, "g", speed=1.2, method=FINE).value

    law = eqx.filter_grad(force)(system).acceleration
    assert isinstance(law, Duffing)
    return law


def _pendulum() -> list[Comparison]:
    rows, speed = [], 2 * math.pi
    for periods, inside, theirs in ((1, 1.06, 1.0663), (2, 1.075, 1.0793), (4, 1.081, 1.0821)):
        system = ForcedOscillator(Pendulum(**_numbers(g=inside)), coordinates=1)
        orbit = periodic_orbit(system, speed, periods, guess=(-math.pi / 2, 0.0), revolutions=200, method=FINE)
        point = bifurcation(system, "period-doubling", orbit, "g", speed=speed, periods=periods, method=FINE)
        rows.append(
            within(f"pendulum: drive strength where period {periods} doubles", TAYLOR, theirs, point.value, 1e-4)
        )
    return rows


def _folds() -> list[Comparison]:
    system, rows = _duffing(0.1, -1.0, 0.3), []
    for speed, start, theirs, tolerance in ((1.7, (0.6, 2.4), 1.77971952, 2e-8), (1.4, (-0.3, 0.05), 1.3242362, 1e-7)):
        orbit = periodic_orbit(system, speed, 1, guess=start, revolutions=400, method=FINE)
        point = bifurcation(system, "fold", orbit, method=FINE)
        name = "Duffing x'' + .1 x' + x + x^3 = .3 cos wt: w at a fold"
        rows.append(within(name, SCIPY, theirs, point.value, tolerance))
    return rows


def _van_der_pol() -> list[Comparison]:
    rows = []
    for mu, period, log_multiplier in ((1.0, 6.6632868593, -7.05893281), (0.1, 6.2871112723, math.log(0.5330692592))):
        system = ForcedSystem(VanDerPol(**_numbers(mu=mu, g=0.0)), dimension=2)
        fine = method("rodas4", steps=2048)
        orbit = periodic_orbit(system, 0.97, guess=(1.8, 0.4), revolutions=20, period="free", method=fine)
        name = f"van der Pol, mu {mu:g}"
        rows.append(within(f"{name}: period", SCIPY, period, orbit.period, 1e-9))
        logarithm = jnp.log(orbit.multipliers[1].real)
        rows.append(within(f"{name}: logarithm of the multiplier", SCIPY, log_multiplier, logarithm, 1e-8))
    driven = ForcedSystem(VanDerPol(**_numbers(mu=0.3, g=1.2)), dimension=2)
    held = periodic_orbit(driven, 1.3, guess=(-1.3, -0.4), method=FINE)
    point = bifurcation(driven, "torus", held, "g", method=FINE)
    name = "van der Pol, mu 0.3, g cos 1.3t: g where it is let go (torus)"
    return [*rows, within(name, SCIPY, 1.0175566306, point.value, 1e-9)]


def _mathieu() -> list[Comparison]:
    system = ForcedOscillator(Mathieu(**_numbers(a=1.0, q=1.0)), coordinates=1)
    values = {
        "b1": ("period-doubling", mathieu_b(1, 1)),
        "a1": ("period-doubling", mathieu_a(1, 1)),
        "a0": ("branch-point", mathieu_a(0, 1)),
        "b2": ("branch-point", mathieu_b(2, 1)),
        "a2": ("branch-point", mathieu_a(2, 1)),
    }
    rows = []
    for name, (kind, theirs) in values.items():
        point = bifurcation(system, kind, ((0.0, 0.0), float(theirs) + 0.03), "a", speed=2.0, method=FINE)
        rows.append(within(f"Mathieu's equation: {name}", MATHIEU, float(theirs), point.value, 1e-8))
    return rows


def _lure() -> list[Comparison]:
    system: AbstractForcedSystem = ForcedSystem(Lure(**_numbers(a=0.65)), dimension=3)
    start, speed = (-0.373, 0.0, 0.577), 2 * math.pi / 6.36
    orbit: Orbit = periodic_orbit(system, speed, guess=start, period="free", method=FINE)
    point = bifurcation(system, "period-doubling", orbit, "a", period="free", method=FINE)
    name = "Lur'e x''' + a x'' + x' + x = x^2: a where the period doubles"
    return [
        within(name, LURE, 0.63031334, point.value, 2e-5),
        within(name, SCIPY, 0.6303020062, point.value, 1e-9),
    ]
