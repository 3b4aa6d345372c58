"""Bifurcations of orbits by shooting: Newton's method on a revolution that SciPy integrates, with its monodromy matrix.

The variational equations are integrated with the state, with steps short enough not to pass over the onset of contact.
A fold is no crossing in speed: orbits are given by one component of the state, and the speed is found with the others.
"""

import itertools
from collections.abc import Callable

import numpy as np

from ._field import Field
from ._integrate import STEP, _one


Make = Callable[[float], Field]
"""The field at a speed [rad/s]."""
STEPS = 2048
TOLERANCE = 1e-12
NUDGE = 1e-6
"""Relative change of the speed for the derivative by it."""


def image(field: Field, z: np.ndarray, method: str = "DOP853") -> tuple[np.ndarray, np.ndarray]:
    """A revolution on from z, over the field's scale, and the monodromy matrix."""
    unit, n = field.scale, z.size

    def stacked(tau: float, both: np.ndarray) -> np.ndarray:
        y, tangents = both[:n], both[n:].reshape(n, n)
        rates = [np.array(field(tau, ((y + 1j * STEP * t) * unit).tolist())) / unit for t in tangents]
        return np.concatenate([rates[0].real, *(r.imag / STEP for r in rates)])

    start = np.concatenate([z, np.eye(n).ravel()])
    end = _one(field, stacked, start, method, TOLERANCE, STEPS)[1][:, -1]
    return end[:n], end[n:].reshape(n, n).T


def orbit(make: Make, z: np.ndarray, speed: float, fixed: int | None = None) -> tuple[np.ndarray, float, np.ndarray]:
    """State (over the scale), speed and monodromy matrix of the orbit near z; the speed is kept, or a component."""
    for _ in range(12):
        end, m = image(make(speed), z)
        residual, jacobian = end - z, m - np.eye(z.size)
        if np.max(np.abs(residual)) < 1e-10:
            return z, speed, m
        if fixed is None:
            z = z - np.linalg.solve(jacobian, residual)
            continue
        unit = make(speed).scale
        other = make(speed * (1 + NUDGE))
        moved, _ = image(other, z * unit / other.scale)
        jacobian[:, fixed] = (moved * other.scale / unit - end) / NUDGE
        step = np.linalg.solve(jacobian, residual)
        speed = speed * (1 - step[fixed])
        step[fixed] = 0.0
        z = (z - step) * unit / make(speed).scale
    raise RuntimeError(f"No orbit near {speed:g} rad/s.")


def bifurcation(make: Make, kind: str, state: np.ndarray, speed: float, reach: float = 1e-5) -> float:
    """Speed [rad/s] of the fold, period doubling or Neimark-Sacker bifurcation near `state` (SI) at `speed`.

    By the secant method, from a first step of `reach` of the fixed component over the clearance or of the speed.
    """
    z = np.asarray(state) / make(speed).scale
    fixed = 0 if kind == "fold" else None
    shift = -1.0 if kind == "fold" else 1.0

    def test(m: np.ndarray) -> float:
        if kind != "Neimark-Sacker":
            return float(np.linalg.det(m + shift * np.eye(m.shape[0])))
        return float(np.prod([a * b - 1 for a, b in itertools.combinations(np.linalg.eigvals(m), 2)]).real)

    def moved(z: np.ndarray, speed: float, by: float) -> tuple[np.ndarray, float]:
        return (z + by * np.eye(z.size)[0], speed) if kind == "fold" else (z, speed * (1 + by))

    z, speed, m = orbit(make, z, speed, fixed)
    last, step = test(m), reach
    for _ in range(12):
        z, speed, m = orbit(make, *moved(z, speed, step), fixed)
        value = test(m)
        change = value - last
        step, last = -value * step / change, value
        if abs(step) < 1e-9:
            return speed
    raise RuntimeError(f"No {kind} near {speed:g} rad/s.")
