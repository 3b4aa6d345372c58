"""Period doublings and exponents of driven oscillators a second time, in NumPy and SciPy: nothing is the package's.

An oscillator x'' = f(t, x, x') is given by f and its derivatives with respect to x and x', which are written by hand.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


class Oscillator(NamedTuple):
    """x'' = f(t, x, x') with period 2 pi over `frequency`; functions of numbers or of arrays."""

    acceleration: Callable[[Any, Any, Any], Any]
    by_position: Callable[[Any, Any, Any], Any]
    damping: float
    """Minus the derivative with respect to x', a constant."""
    frequency: float


def duffing(damping: float, force: float, frequency: float) -> Oscillator:
    """x'' + d x' - x + x^3 = g cos wt."""
    push = lambda t, x, v: -damping * v + x - x * x * x + force * math.cos(frequency * t)
    return Oscillator(push, lambda t, x, v: 1 - 3 * x * x, damping, frequency)


def pendulum(damping: float, torque: float, frequency: float, stiffness: float = 1.0) -> Oscillator:
    """x'' + d x' + k sin x = g cos wt."""
    push = lambda t, x, v: -damping * v - stiffness * np.sin(x) + torque * math.cos(frequency * t)
    return Oscillator(push, lambda t, x, v: -stiffness * np.cos(x), damping, frequency)


UEDA = Oscillator(
    lambda t, x, v: -0.05 * v - x * x * x + 7.5 * math.sin(t), lambda t, x, v: -3 * x * x, 0.05, frequency=1.0
)
"""x'' + .05 x' + x^3 = 7.5 sin t."""


def doubling(
    family: Callable[[float], Oscillator],
    periods: int,
    bracket: tuple[float, float],
    start: tuple[float, float],
    tolerance: float = 1e-12,
) -> float:
    """Parameter at which an orbit of `periods` periods of the drive has the multiplier -1.

    DOP853 on the variational equations; Newton's method on the orbit, Brent's on 1 + tr M + det M.

    **Arguments:** parameter -> oscillator; periods; parameters on both sides, at the first of which the orbit is stable
    and is reached from `start` by simulation; tolerance of the integration.
    """
    at = np.array(start, dtype=float)
    first = family(bracket[0])
    span = 2 * math.pi / first.frequency
    for _ in range(8):
        at = _integrate(first, at, 40 * periods * span, 1e-9)[0]

    def orbit(oscillator: Oscillator) -> np.ndarray:
        nonlocal at
        for _ in range(20):
            end, matrix = _integrate(oscillator, at, periods * span, tolerance)
            step = np.linalg.solve(matrix - np.eye(2), at - end)
            at = at + step
            if np.abs(step).max() < 1e-10:
                return matrix
        raise RuntimeError("Newton's method did not find the orbit.")

    def characteristic(parameter: float) -> float:
        matrix = orbit(family(parameter))
        return float(1 + np.trace(matrix) + np.linalg.det(matrix))

    found: Any = brentq(characteristic, *bracket, xtol=1e-13)
    return found


def _integrate(oscillator: Oscillator, at: np.ndarray, span: float, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """State after `span` and its derivative with respect to the state before."""
    f, slope, damping, _ = oscillator

    def rates(t: float, y: np.ndarray) -> list[float]:
        k = slope(t, y[0], y[1])
        return [y[1], f(t, y[0], y[1]), y[3], k * y[2] - damping * y[3], y[5], k * y[4] - damping * y[5]]

    done = solve_ivp(rates, (0.0, span), [*at, 1, 0, 0, 1], method="DOP853", rtol=tolerance, atol=tolerance)
    end = done.y[:, -1]
    return end[:2], np.array([[end[2], end[4]], [end[3], end[5]]])


def largest_exponent(
    oscillator: Oscillator, starts: int = 2048, discard: int = 150, periods: int = 500, steps: int = 128
) -> tuple[float, float]:
    """Largest exponent per unit of time of the chaotic motion, and its standard error.

    Classical Runge-Kutta steps of the equation and one tangent vector, from many starts at once in the square of side
    2; the error is that of the mean over starts. Those that end on a periodic orbit, with a negative exponent, are left
    out.
    """
    f, slope, damping, frequency = oscillator
    span = 2 * math.pi / frequency
    step = span / steps
    y = np.zeros((4, starts))
    y[:2] = np.random.default_rng(7).uniform(-1, 1, (2, starts))
    y[2] = 1.0

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.stack([y[1], f(t, y[0], y[1]), y[3], slope(t, y[0], y[1]) * y[2] - damping * y[3]])

    growth = np.zeros(starts)
    for period in range(discard + periods):
        for i in range(steps):
            t = i * step
            k1 = rates(t, y)
            k2 = rates(t + step / 2, y + step / 2 * k1)
            k3 = rates(t + step / 2, y + step / 2 * k2)
            y = y + step / 6 * (k1 + 2 * k2 + 2 * k3 + rates(t + step, y + step * k3))
        length = np.hypot(y[2], y[3])
        y[2:] /= length
        if period >= discard:
            growth += np.log(length)
    each = growth / (periods * span)
    chaotic = each[each > 0]
    return float(chaotic.mean()), float(chaotic.std(ddof=1) / math.sqrt(chaotic.size))
