"""Periodic orbits and bifurcation points beside published values and beside SciPy."""

import math
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from scipy.special import mathieu_a, mathieu_b

from .._types import Scalar, State
from ..integrate import method
from ..models import ForcedOscillator, ForcedSystem
from ..orbits import bifurcation, periodic_orbit
from ._comparison import Comparison, beside, within
from ._literature import (
    DUFFING_DOUBLINGS,
    DUFFING_FOLDS,
    DUFFING_SLOPES,
    FEIGENBAUM,
    SHOOTING,
    VAN_DER_POL_LET_GO,
)
from ._shooting import doubling, pendulum as pendulum_in_scipy


SCALING = "exact: under x -> s x the force at any edge goes with b^(-1/2)"
MATHIEU = "characteristic values at q = 1: DLMF chapter 28, computed by SciPy's `mathieu_a` and `mathieu_b`"
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


def bifurcation_comparisons() -> list[Comparison]:
    """All comparisons of orbits and their bifurcations."""
    return [*_doublings(), *pendulum_comparisons(), *_folds(), *_van_der_pol(), *_mathieu()]


def _duffing(d: float, k: float, g: float) -> ForcedOscillator:
    return ForcedOscillator(Duffing(**_numbers(d=d, k=k, b=1.0, g=g)), coordinates=1)


def _doublings() -> list[Comparison]:
    name = "Duffing x'' + .3 x' - x + x^3 = g cos 1.2t"
    found, rows = [], []
    for periods in (1, 2, 4):
        inside, theirs = DUFFING_DOUBLINGS[periods]
        system = _duffing(0.3, 1.0, inside)
        orbit = periodic_orbit(system, 1.2, periods, guess=(1.0, 0.0), revolutions=400, method=FINE)
        point = bifurcation(system, "period-doubling", orbit, "g", speed=1.2, periods=periods, method=FINE)
        found.append(float(point.value))
        rows.append(beside(f"{name}: g where period {periods} doubles", theirs, point.value))
    ratio = (found[1] - found[0]) / (found[2] - found[1])
    rows.append(beside(f"{name}: first ratio of distances", FEIGENBAUM, ratio))
    slope = _slope_of_the_first_doubling()
    rows.append(beside(f"{name}: slope of the first by the damping", DUFFING_SLOPES["d"], slope.d))
    rows.append(within(f"{name}: slope of the first by b", SCALING, -found[0] / 2, slope.b, 1e-9))
    return rows


def _slope_of_the_first_doubling() -> Duffing:
    system = _duffing(0.3, 1.0, 0.262)
    orbit = periodic_orbit(system, 1.2, 1, guess=(1.0, 0.0), revolutions=400, method=FINE)

    def force(system: ForcedOscillator) -> jax.Array:
        return jnp.asarray(bifurcation(system, "period-doubling", orbit, "g", speed=1.2, method=FINE).value)

    law = eqx.filter_grad(force)(system).acceleration
    assert isinstance(law, Duffing)
    return law


PENDULUM_DOUBLINGS = {1: (1.06, 1.07), 2: (1.075, 1.08), 4: (1.081, 1.0823), 8: (1.0825, 1.0828)}
"""Periods: a drive strength at which the orbit is stable, and one at which it is not."""


def pendulum_comparisons(periods: Sequence[int] = (1, 2, 4)) -> list[Comparison]:
    """The driven pendulum of J. R. Taylor, Classical Mechanics (2005), chapter 12; its doublings by SciPy."""
    rows, speed = [], 2 * math.pi
    natural = 1.5 * speed
    family = lambda g: pendulum_in_scipy(natural / 2, g * natural**2, speed, natural**2)
    for n in periods:
        bracket, start = PENDULUM_DOUBLINGS[n], (-math.pi / 2, 0.0)
        theirs = doubling(family, n, bracket, start)
        system = ForcedOscillator(Pendulum(**_numbers(g=bracket[0])), coordinates=1)
        orbit = periodic_orbit(system, speed, n, guess=start, revolutions=320, method=FINE)
        point = bifurcation(system, "period-doubling", orbit, "g", speed=speed, periods=n, method=FINE)
        rows.append(within(f"pendulum: drive strength where period {n} doubles", SHOOTING, theirs, point.value, 2e-9))
    return rows


def _folds() -> list[Comparison]:
    system, rows = _duffing(0.1, -1.0, 0.3), []
    for speed, start, theirs in ((1.7, (0.6, 2.4), DUFFING_FOLDS["up"]), (1.4, (-0.3, 0.05), DUFFING_FOLDS["down"])):
        orbit = periodic_orbit(system, speed, 1, guess=start, revolutions=400, method=FINE)
        point = bifurcation(system, "fold", orbit, method=FINE)
        name = "Duffing x'' + .1 x' + x + x^3 = .3 cos wt: w at a fold"
        rows.append(beside(name, theirs, point.value))
    return rows


def _van_der_pol() -> list[Comparison]:
    driven = ForcedSystem(VanDerPol(**_numbers(mu=0.3, g=1.2)), dimension=2)
    held = periodic_orbit(driven, 1.3, guess=(-1.3, -0.4), method=FINE)
    point = bifurcation(driven, "Neimark-Sacker", held, "g", method=FINE)
    name = "van der Pol, mu 0.3, g cos 1.3t: g where it is let go (Neimark-Sacker)"
    return [beside(name, VAN_DER_POL_LET_GO, point.value)]


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
