"""Reynolds' equation (25) on a land of finite width, in NumPy and SciPy: the reference for the short film.

With the clearance c as unit of length, r = (x, y) the cage's centre, n the direction to a point of the rib, H = 1 - r.n
the film thickness and P = 2 v - omega (-y, x), the pressure p in units of mu (L/2c)^2 satisfies
    lambda^2 d/dtheta (H^3 dp/dtheta) + H^3 d^2p/deta^2 = -6 P.n,   p = 0 at eta = 2 z/L = -1 and 1,
with the slenderness lambda = L/(2R). At lambda = 0 it is the short film.

Across the land the pressure is a sum of even polynomials (`axial_profiles`). Around it there are finite volumes on
stations that follow the cage: theta is the Moebius transform of a uniform angle gamma,
    exp(i theta) = (w + a)/(1 + a* w),   w = exp(i gamma),   a = r/(1 + sqrt(1 - r^2)),
which along the line of centres is Sommerfeld's substitution.

Cavitation: `reynolds` has p >= 0, and where p > 0 the equation holds (Swift and Stieber), by an active set; `guembel`
cuts off the linear solution where it is negative; `full` keeps it. Everything may be complex, so that derivatives are
imaginary parts after a tiny imaginary step; they hold the set of nodes with pressure fixed, which at its edge, where
p = 0, changes the force in second order only.
"""

import functools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial, legendre
from scipy.sparse import csc_matrix, csr_array, diags_array, kron
from scipy.sparse.linalg import spsolve
from scipy.special import roots_jacobi


class AxialProfiles(NamedTuple):
    """Integrals over half a land, eta from 0 to 1, of (1 - eta^2) times Lagrange polynomials, made symmetric."""

    mass: np.ndarray
    """Integrals of the squares; those of products of different functions vanish."""
    stiffness: np.ndarray
    """Integrals of the products of the derivatives."""
    integral: np.ndarray


@functools.cache
def axial_profiles(count: int) -> AxialProfiles:
    """The first `count` functions, through Gauss points of the weight (1 - eta^2)^2."""
    points = roots_jacobi(2 * count - 1, 2, 2)[0]
    points[count - 1] = 0.0

    def basis(i: int) -> Polynomial:
        whole = math.prod((Polynomial([-p, 1.0]) for p in np.delete(points, i)), start=Polynomial([1.0, 0.0, -1.0]))
        return whole / whole(points[i])

    single = [basis(i) for i in range(2 * count - 1)]
    pairs = [single[count - 1], *(single[count - 1 + j] + single[count - 1 - j] for j in range(1, count))]
    at, weight = legendre.leggauss(4 * count + 4)
    value, slope = (np.array([f(at) for f in of]) for of in (pairs, [p.deriv() for p in pairs]))
    return AxialProfiles(value**2 @ weight / 2, slope * (weight / 2) @ slope.T, value @ weight / 2)


def _stations(x: Any, y: Any, gamma: np.ndarray, follow: bool) -> tuple[np.ndarray, ...]:
    """n, d theta/d gamma and H at angles gamma."""
    wx, wy = np.cos(gamma), np.sin(gamma)
    if not follow:
        return wx, wy, np.ones_like(wx), 1 - x * wx - y * wy
    inside = 1 - (x * x + y * y)
    ax, ay = x / (1 + np.sqrt(inside)), y / (1 + np.sqrt(inside))
    real, imaginary = 1 + ax * wx + ay * wy, ax * wy - ay * wx  # of 1 + a* w
    square = real**2 + imaginary**2
    nx = ((wx + ax) * real + (wy + ay) * imaginary) / square
    ny = ((wy + ay) * real - (wx + ax) * imaginary) / square
    return nx, ny, (1 - ax * ax - ay * ay) / square, inside / (1 + x * wx + y * wy)


def film_force(
    r: Any,
    v: Any,
    slenderness: float,
    omega: float = 1.0,
    *,
    cavitation: str = "reynolds",
    stations: int = 256,
    profiles: int = 3,
    held: np.ndarray | None = None,
) -> np.ndarray:
    """Force on the cage, shape (2,), in units of mu R L^3/c^2, times 1/s.

    **Arguments:** position and velocity over clearance; L/(2R); cage speed; stations around and functions across; which
    stations axial grooves hold at zero pressure: if given, stations stay at the angles 2 pi i/stations from x.
    """
    (x, y), (u, w) = r, v
    px, py = 2 * u + omega * y, 2 * w - omega * x
    cell, axial = 2 * np.pi / stations, axial_profiles(profiles)
    place = lambda shift: _stations(x, y, cell * (np.arange(stations) + shift), held is None)
    (nx, ny, stretch, thick), (_, _, wide, high) = place(0.0), place(0.5)
    after = slenderness**2 * high**3 / wide / cell**2
    rows = np.arange(stations)
    beside = csr_array((-after, (rows, (rows + 1) % stations)), (stations, stations))
    around = diags_array(after + np.roll(after, 1)) + beside + beside.T
    matrix = csr_array(kron(around, diags_array(axial.mass)) + kron(diags_array(stretch * thick**3), axial.stiffness))
    source = np.outer(6 * stretch * (px * nx + py * ny), axial.integral).ravel()
    free = np.ones(source.size, bool) if held is None else np.repeat(~held, profiles)
    pressure = _pressure(matrix, source, free, cavitation == "reynolds")
    if cavitation == "guembel":
        pressure = np.where(pressure.real > 0, pressure, 0.0)
    push = -0.25 * cell * stretch * (pressure.reshape(stations, profiles) @ axial.integral)
    return np.array([push @ nx, push @ ny])


def _pressure(matrix: csr_array, source: np.ndarray, free: np.ndarray, positive: bool) -> np.ndarray:
    """The pressure at the free nodes; if `positive`, on the active set that is found from where the source is."""
    little = 1e-13 * abs(source).max()
    wet = free & (source.real > 0) if positive else free
    for _ in range(2 * source.size):
        p = np.zeros_like(source)
        p[wet] = np.asarray(spsolve(csc_matrix(matrix[wet][:, wet]), source[wet]))
        excess = (matrix @ p - source).real
        after = free & np.where(wet, p.real * matrix.diagonal().real >= -little, excess < -little)
        if not positive or np.array_equal(after, wet):
            return p
        wet = after
    raise RuntimeError("The film's edge was not found.")
