"""A full journal bearing of finite length a second time, in NumPy and SciPy: nothing here comes from the package.

Reynolds' equation on a grid that is even in the angle theta from the widest gap and across half of the land,
    d/dtheta (H^3 dp/dtheta) + (D/L)^2 H^3 d^2p/dzeta^2 = 6 dH/dtheta,  H = 1 + eps cos theta,  p in mu omega (R/c)^2,
by finite volumes of five points. Oil is fed without pressure at the widest gap, p = 0 there and at the ends, and the
film breaks off with p = dp/dn = 0 (Swift and Stieber): p >= 0, and where p > 0 the equation holds. It is the bearing of
A. A. Raimondi and J. Boyd, ASLE Transactions 1 (1958) 194; their printed numbers could not be opened and are not used.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, csr_array, diags_array, kron
from scipy.sparse.linalg import spsolve


class FullBearing(NamedTuple):
    """Two numbers, each with its own error."""

    sommerfeld: float
    """S = mu N (R/c)^2 L D/W, N in revolutions per second."""
    sommerfeld_error: float
    angle: float
    """From the load line to the smallest gap in the direction of rotation [deg]."""
    angle_error: float


GRIDS = ((240, 16), (480, 32), (960, 64))
"""Intervals around and across half of the land."""


@functools.cache
def full_bearing(slenderness: float, eps: float) -> FullBearing:
    """Extrapolated from the two finest of three grids whose errors fall by four.

    Their own error is the larger of what the extrapolation adds to the finest grid and of what it differs by from that
    of the two coarsest: the film's edge lies between nodes, so that the error scatters a little.

    **Arguments:** L/D; eccentricity over clearance.
    """
    wet, forces = None, []
    for around, across in GRIDS:
        pressure, wet = film_pressure(slenderness, eps, around, across, wet)
        forces.append(_number_and_angle(pressure))
    coarse, middle, fine = np.array(forces)
    best, before = fine + (fine - middle) / 3, middle + (middle - coarse) / 3
    error = np.maximum(abs(best - fine), abs(best - before))
    return FullBearing(float(best[0]), float(error[0]), float(best[1]), float(error[1]))


def film_pressure(
    slenderness: float, eps: float, around: int, across: int, wet: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Pressure at the inner nodes, shape (around - 1, across), and where it is positive.

    The set of nodes that carry pressure is changed until it is right; that of a coarser grid, `wet`, is a good first.
    """
    matrix, source = film_equations(slenderness, eps, around, across)
    if wet is None:
        on = np.repeat(np.arange(1, around) < 0.55 * around, across)
    else:
        rows = np.minimum(np.arange(1, around) * (wet.shape[0] + 1) // around, wet.shape[0]).clip(1) - 1
        on = wet[rows][:, np.arange(across) * wet.shape[1] // across].ravel()
    for _ in range(2 * around):
        p = np.zeros(source.size)
        p[on] = np.asarray(spsolve(csc_matrix(matrix[on][:, on]), source[on]))
        after = np.where(on, p > 0, source - matrix @ p > 0)
        if np.array_equal(after, on):
            break
        on = after
    else:
        raise RuntimeError("The film's edge was not found.")
    return p.reshape(around - 1, across), on.reshape(around - 1, across)


def film_equations(slenderness: float, eps: float, around: int, across: int) -> tuple[csr_array, np.ndarray]:
    """Matrix and right-hand side over the inner nodes: flow out of a cell, and what the wedge brings in."""
    h, k = 2 * math.pi / around, 1 / across
    theta = h * np.arange(1, around)
    face = (1 + eps * np.cos(h * (np.arange(around) + 0.5))) ** 3 / h
    along = _tridiagonal(-face[1:-1], face[:-1] + face[1:])
    size = np.full(across, k)  # of the cells across: half of one at the middle of the land
    size[0] = k / 2
    step = np.full(across, 2 / k)
    step[0] = 1 / k
    over = _tridiagonal(np.full(across - 1, -1 / k), step)
    thick = (1 + eps * np.cos(theta)) ** 3 * h / slenderness**2
    matrix = kron(along, diags_array(size)) + kron(diags_array(thick), over)
    gap = 1 + eps * np.cos(h * (np.arange(around) + 0.5))
    source = 6 * np.outer(gap[:-1] - gap[1:], size).ravel()
    return matrix.tocsr(), source


def _tridiagonal(beside: np.ndarray, middle: np.ndarray):
    return diags_array([beside, middle, beside], offsets=[-1, 0, 1])  # pyright: ignore[reportArgumentType]


def _number_and_angle(p: np.ndarray) -> tuple[float, float]:
    """S = 1/(pi f) and the attitude angle [deg], where W = f mu omega R L (R/c)^2; trapezoids both ways."""
    around, across = p.shape[0] + 1, p.shape[1]
    theta = 2 * math.pi / around * np.arange(1, around)
    mean = (p[:, 0] / 2 + p[:, 1:].sum(axis=1)) / across
    radial, tangential = (2 * math.pi / around * float(mean @ f(theta)) for f in (np.cos, np.sin))
    return 1 / (math.pi * math.hypot(radial, tangential)), math.degrees(math.atan2(tangential, -radial))
