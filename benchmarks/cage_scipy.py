"""Work of a process for the SciPy rivals. Nothing here imports JAX."""

import numpy as np
from scipy.integrate import odeint, solve_ivp

from .cage_numba import rates, rates_jacobian


Work = tuple[str, np.ndarray, np.ndarray, int, float]
"""Solver, states, constants, revolutions, tolerance."""


def warm_up(_: int) -> None:
    """Compile in a worker."""
    for solver in ("LSODA", "Radau"):
        advance((solver, np.zeros((1, 4)), np.full((1, 14), 0.5), 1, 1e-3))


def advance(work: Work) -> np.ndarray:
    """End states of some lanes."""
    solver, start, numbers, revolutions, tolerance = work
    end = lsoda if solver == "LSODA" else radau
    pairs = zip(start, numbers, strict=True)
    return np.array([end(z, p, 2 * np.pi * revolutions, tolerance) for z, p in pairs]).reshape(start.shape)


def lsoda(z: np.ndarray, p: np.ndarray, until: float, tolerance: float) -> np.ndarray:
    """By `odeint`: a third of the time of `solve_ivp(method="LSODA")`, which steps in Python."""
    return odeint(
        rates, z, (0.0, until), (p,), rates_jacobian, rtol=tolerance, atol=tolerance, tfirst=True, mxstep=10**6
    )[-1]


def radau(z: np.ndarray, p: np.ndarray, until: float, tolerance: float) -> np.ndarray:
    """By `solve_ivp`; NaN where it gives up."""
    found = solve_ivp(rates, (0.0, until), z, "Radau", args=(p,), jac=rates_jacobian, rtol=tolerance, atol=tolerance)
    return found.y[:, -1] if found.success else np.full(4, np.nan)
