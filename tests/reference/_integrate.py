"""Revolutions by SciPy, and the growth of a tangent vector by the complex step.

Steps are limited to a part of a revolution, so that a short touch of the land is not stepped over: what lasts less than
the distance of two stages, some 1e-4 revolutions, moves the cage by less than 1e-7 of the clearance. All numbers are
integrated over the field's scale.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from ._field import Field


REVOLUTION = 2 * math.pi
STEPS = 512
"""Fewest steps of a revolution."""
TOLERANCE = 1e-11
PARTS = 32
"""Parts of a revolution, after each of which a tangent is made 1 long again."""
ESCAPE = 2.0
"""Eccentricity ratio beyond which the cage is outside."""
STEP = 1e-20
"""Imaginary part that carries a tangent: its square is lost beside 1."""


class TooLong(RuntimeError):
    """The field was evaluated more often than allowed."""


class Outside(ArithmeticError):
    """The cage left the model for good: its integration ends where the state grows without bound."""


class Revolutions(NamedTuple):
    """Strobe states and what happened between them."""

    strobe: np.ndarray
    """States at the beginning and after every revolution, in SI units, shape (revolutions + 1, dimension)."""
    peak: np.ndarray
    """Largest eccentricity ratio of every revolution."""
    evaluations: int


def _counted(f: Callable, budget: float) -> tuple[Callable, list[int]]:
    count = [0]

    def counted(tau: float, z: np.ndarray) -> Sequence[float]:
        count[0] += 1
        if count[0] > budget:
            raise TooLong(f"The field was evaluated more than {budget:g} times.")
        return f(tau, z)

    return counted, count


def _one(
    field: Field,
    f: Callable,
    z: np.ndarray,
    method: str,
    tolerance: float,
    steps: int,
    span: tuple[float, float] = (0.0, REVOLUTION),
) -> tuple[np.ndarray, np.ndarray]:
    """Phases and states at every step of one revolution, or of a part of it; states over the scale, a tangent perhaps
    behind them."""
    done = solve_ivp(f, span, z, method=method, rtol=tolerance, atol=0.1 * tolerance, max_step=REVOLUTION / steps)
    if not done.success or not np.all(np.isfinite(done.y)):
        if np.max(field.excursion(done.y[: field.scale.size] * field.scale[:, None])) > ESCAPE:
            raise Outside(f"{method} left at tau = {done.t[-1]:g}: {done.message}")
        raise FloatingPointError(f"{method} stopped at tau = {done.t[-1]:g}: {done.message}")
    return done.t, done.y


def _largest(field: Field, tau: np.ndarray, y: np.ndarray) -> float:
    """Largest eccentricity ratio, by cubics through eps^2 and its slope at the ends of every step."""
    n, eps = field.coordinates, field.excursion(y)
    apart, moving = (y[i : i + 2] - (y[i + 2 : i + 4] if n == 4 else 0.0) for i in (0, n))
    slope = 2 * np.sum(apart * moving, axis=0) / (field.clearance**2 * field.omega)
    h, g0, g1, d0, d1 = np.diff(tau), eps[:-1] ** 2, eps[1:] ** 2, slope[:-1], slope[1:]
    over = (d0 > 0) & (d1 < 0)
    h, g0, g1, d0, d1 = (x[over] for x in (h, g0, g1, d0, d1))
    # g0 + h d0 s + b s^2 + a s^3 with the maximum where 3 a s^2 + 2 b s + h d0 = 0
    a, b = 2 * (g0 - g1) + h * (d0 + d1), 3 * (g1 - g0) - h * (2 * d0 + d1)
    s = h * d0 / (np.sqrt(np.maximum(b * b - 3 * a * h * d0, 0.0)) - b)
    between = g0 + s * (h * d0 + s * (b + a * s))
    return float(np.sqrt(max(np.max(eps) ** 2, np.max(between, initial=0.0))))


def _scaled(field: Field) -> Callable:
    """The field of states over the scale."""
    unit = field.scale

    def scaled(tau: float, z: np.ndarray) -> np.ndarray:
        rate = np.array(field(tau, (z * unit).tolist())) / unit
        # A trial step far outside can ask for the root of a negative film: the integrator then has to shorten it.
        return np.full(unit.size, np.nan) if np.iscomplexobj(rate) else rate

    return scaled


def revolutions(
    field: Field,
    state: Sequence[float] | np.ndarray,
    count: int = 1,
    *,
    method: str = "DOP853",
    tolerance: float = TOLERANCE,
    steps: int = STEPS,
    budget: float = math.inf,
) -> Revolutions:
    """Integrate `count` revolutions from phase 0.

    **Arguments:** field; state in SI units; SciPy's name of an integrator; relative tolerance, the absolute one being a
    tenth of it in units of the scale; fewest steps of a revolution; most evaluations of the field.

    **Raises:** `TooLong`; `ValueError` or `ArithmeticError` where the integrator gives up.
    """
    unit = field.scale
    f, used = _counted(_scaled(field), budget)
    z = np.asarray(state, dtype=float) / unit
    strobe, peak = [z * unit], []
    for _ in range(count):
        tau, y = _one(field, f, z, method, tolerance, steps)
        z = y[:, -1]
        strobe.append(z * unit)
        peak.append(_largest(field, tau, y * unit[:, None]))
    return Revolutions(np.array(strobe), np.array(peak), used[0])


class Samples(NamedTuple):
    """A time history."""

    state: np.ndarray
    """States at equally spaced phases, the first at phase 0, and one at the very end, in SI units."""
    peak: float
    """Largest eccentricity ratio."""


def sampled(
    field: Field, state: Sequence[float] | np.ndarray, count: int, samples: int, budget: float = math.inf
) -> Samples:
    """`count` revolutions from phase 0 with so many samples in each.

    **Raises:** as `revolutions`.
    """
    unit, edges = field.scale, np.linspace(0.0, REVOLUTION, samples + 1)
    f, _ = _counted(_scaled(field), budget)
    z = np.asarray(state, dtype=float) / unit
    found, peak = [z * unit], 0.0
    for span in [*zip(edges[:-1], edges[1:], strict=True)] * count:
        tau, y = _one(field, f, z, "DOP853", TOLERANCE, STEPS, span)
        z, peak = y[:, -1], max(peak, _largest(field, tau, y * unit[:, None]))
        found.append(z * unit)
    return Samples(np.array(found), peak)


def growth(
    field: Field,
    state: Sequence[float] | np.ndarray,
    count: int,
    *,
    direction: Sequence[float] | np.ndarray | None = None,
    method: str = "DOP853",
    tolerance: float = 1e-9,
    steps: int = STEPS,
    budget: float = math.inf,
) -> np.ndarray:
    """Logarithm of the growth of a tangent vector in each of `count` revolutions: its mean is the largest exponent.

    The variational equation is integrated with the state; its right-hand side is the imaginary part of the field at
    y + i h w, exact to rounding. The vector is made 1 long again many times in a revolution: the
    tolerance is that of such a vector, and one that has shrunk a lot is lost in it.

    **Arguments:** as for `revolutions`, and the vector at the beginning, in units of the scale.
    """
    unit = field.scale
    n = unit.size

    def stacked(tau: float, z: np.ndarray) -> np.ndarray:
        rate = np.array(field(tau, ((z[:n] + 1j * STEP * z[n:]) * unit).tolist())) / unit
        return np.concatenate([rate.real, rate.imag / STEP])

    f, _ = _counted(stacked, budget)
    w = np.random.default_rng(0).normal(size=n) if direction is None else np.asarray(direction, dtype=float)
    z = np.concatenate([np.asarray(state, dtype=float) / unit, w / np.linalg.norm(w)])
    found = []
    edges = np.linspace(0.0, REVOLUTION, PARTS + 1)
    for span in [*zip(edges[:-1], edges[1:], strict=True)] * count:
        z = _one(field, f, z, method, tolerance, steps, span)[1][:, -1]
        size = np.linalg.norm(z[n:])
        z[n:] /= size
        found.append(math.log(size))
    return np.reshape(found, (count, PARTS)).sum(axis=1)


class Confirmed(NamedTuple):
    """Results of two integrators, and how far they are apart."""

    strobe: np.ndarray
    """States at the beginning and after every revolution, in SI units."""
    peak: float
    """Largest eccentricity ratio."""
    spread: float
    """Largest difference of a state at a strobe, over the scale."""


PAIR = (("LSODA", 1e-11), ("DOP853", 1e-11), ("Radau", 1e-10))
"""Integrators and their tolerances, the last one for what is stiff."""


def confirmed(
    field: Field, state: Sequence[float] | np.ndarray, count: int = 1, budget: float = 2e5, sharper: float = 1.0
) -> Confirmed:
    """Integrate `count` revolutions twice, by the first two of `PAIR` that need at most `budget` evaluations each, with
    tolerances that are `sharper` times smaller.

    **Raises:** `Outside` where two of them say that the cage leaves; `TooLong` where no two of them finish.
    """
    found: list[Revolutions] = []
    left = 0
    for method, tolerance in PAIR:
        try:
            found.append(revolutions(field, state, count, method=method, tolerance=tolerance / sharper, budget=budget))
        except Outside:
            left += 1
        except (TooLong, ValueError, ArithmeticError):
            continue
        if left == 2:
            raise Outside("Two integrators say that the cage leaves.")
        if len(found) == 2:
            first, second = found
            apart = np.abs(first.strobe - second.strobe) / field.scale
            return Confirmed(first.strobe, float(np.max(first.peak)), float(np.max(apart)))
    raise TooLong(f"No two integrators finish {count} revolutions within {budget:g} evaluations.")
