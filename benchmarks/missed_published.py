"""Oscillators of which some or all special points are printed, and some of which none is."""

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from scipy.optimize import root_scalar

import jaxcage as jc
from jaxcage.validation import DUFFING_DOUBLINGS, DUFFING_FOLDS, VAN_DER_POL_LET_GO, Number

from .missed_models import Planted, Point, numbers


class Duffing(eqx.Module):
    """x'' = -d x' + k x - x^3 + p cos(tau)."""

    d: Array
    k: Array
    p: Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-self.d * u + self.k * x - x**3 + self.p * jnp.cos(tau),)


def duffing(**values: float) -> jc.ForcedOscillator:
    return jc.ForcedOscillator(Duffing(**numbers(**values)), coordinates=1)


class Mathieu(eqx.Module):
    """x'' + 2 z x' + (p - 2 cos 2t) x + x^3 = 0 with tau = 2t."""

    p: Array
    z: Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-2 * self.z * u - (self.p - 2 * jnp.cos(tau)) * x - x**3,)


def mathieu_edge(sign: int, ends: tuple[float, float], damping: float) -> float:
    """Where the trace of the undamped equation, at p - z^2, is +-2 cosh(z pi): by Hill's determinant."""
    n = np.arange(-30, 31)

    def determinant(p: float) -> float:
        """Of exp((damping + i m) t) times a series in exp(2 i n t), m = 0 for periods of pi and 1 of 2 pi; scaled."""
        rate = damping + 1j * (2 * n + (sign < 0))
        diagonal = rate**2 + p - damping**2
        near = 1.0 / np.abs(diagonal + 1.0)[:, None]
        rows = np.diag(diagonal) - np.eye(n.size, k=1) - np.eye(n.size, k=-1)
        return float(np.linalg.det(rows * near).real)

    return root_scalar(determinant, bracket=ends, xtol=1e-14).root


class Pendulum(eqx.Module):
    """Taylor's: x'' + 2 b x' + w0^2 sin x = p w0^2 cos(w t) with w = 2 pi, w0 = 1.5 w, b = w0/4."""

    p: Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        natural = 1.5 * speed
        return (-natural / 2 * u + natural**2 * (self.p * jnp.cos(tau) - jnp.sin(x)),)


class VanDerPol(eqx.Module):
    """x'' - .3 (1 - x^2) x' + x = p cos(tau)."""

    p: Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (0.3 * (1 - x * x) * u - x + self.p * jnp.cos(tau),)


TAYLOR = Number(1.0663, 1e-4, "J. R. Taylor, Classical Mechanics (2005), table 12.1, cut off")
EDGES = (
    ("branch-point", 1, (-0.6, -0.3)),
    ("period-doubling", -1, (-0.2, 0.0)),
    ("period-doubling", -1, (1.7, 1.9)),
)
"""Of Mathieu's equation: kind, sign of the multiplier, where it is looked for."""


def known(kind: str, number: Number) -> Point:
    """A printed point."""
    return Point(kind, number.value, number.tolerance)


def swept(
    name: str,
    start: tuple[float, float],
    speed: float,
    ends: tuple[float, float],
    points: tuple[Point, ...] = (),
    **law: float,
) -> Planted:
    """Duffing's equation over speed; where no point is printed there may be any."""
    return Planted(name, duffing(**law), start, speed, *ends, points, bool(points), parameter="speed", spin=300)


def forced(
    name: str,
    law: Any,
    start: tuple[float, float],
    force: float,
    ends: tuple[float, float],
    speed: float,
    *points: Point,
) -> Planted:
    """An equation over its force, from the orbit that a simulation leads to; there may be other points."""
    system = jc.ForcedOscillator(law, coordinates=1)
    return Planted(name, system, start, force, *ends, points, False, speed=speed, spin=300)


def published() -> list[Planted]:
    """Oscillators from the literature."""
    thresholds = [Point(kind, mathieu_edge(sign, ends, 0.1), 1e-11) for kind, sign, ends in EDGES]
    mathieu = jc.ForcedOscillator(Mathieu(**numbers(p=0.5, z=0.1)), coordinates=1)
    first = known("period-doubling", DUFFING_DOUBLINGS[1][1])
    folds = tuple(known("fold", DUFFING_FOLDS[way]) for way in ("up", "down"))
    double_well, ueda = Duffing(**numbers(d=0.3, k=1.0, p=0.25)), Duffing(**numbers(d=0.05, k=0.0, p=1.0))
    taylor, let_go = known("period-doubling", TAYLOR), known("Neimark-Sacker", VAN_DER_POL_LET_GO)
    return [
        swept("hardening Duffing", (0.9, 0.0), 0.8, (0.5, 2.5), folds, d=0.1, k=-1.0, p=0.3),
        swept("hardening Duffing, strong", (1.5, 0.0), 1.1, (0.25, 1.2), d=0.1, k=-1.0, p=3.0),
        swept("softening well", (1.1, 0.0), 1.0, (0.5, 2.0), d=0.2, k=1.0, p=0.1),
        forced("double well", double_well, (1.0, 0.0), 0.25, (0.1, 0.35), 1.2, first),
        forced("Ueda", ueda, (1.0, 0.0), 1.0, (0.1, 12.0), 1.0),
        Planted("Mathieu", mathieu, (0.0, 0.0), 0.5, -0.8, 2.5, tuple(thresholds), speed=2.0),
        forced("pendulum", Pendulum(**numbers(p=1.05)), (-math.pi / 2, 0.0), 1.05, (0.9, 1.08), 2 * math.pi, taylor),
        forced("van der Pol", VanDerPol(**numbers(p=1.2)), (0.5, 1.5), 1.2, (0.9, 1.6), 1.3, let_go),
    ]
