"""Ritz-Galerkin discretisation of a film across the land: even polynomials that vanish at its ends.

With eta = 2 z/L from -1 to 1, the pressure is a sum of (1 - eta^2) times Lagrange polynomials through Gauss points of
the weight (1 - eta^2)^2. In that basis the mass matrix is diagonal exactly, unknowns are pressures at points, and one
function, the parabola, is already exact for a short film and in its first correction for a finite length.
"""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.polynomial import Polynomial, legendre
from scipy.special import roots_jacobi

from .._errors import ArgumentError


class AxialProfiles(NamedTuple):
    """Integrals over half a land, eta from 0 to 1, of the symmetric basis functions."""

    eta: Float[np.ndarray, " k"]
    """Points at which the unknowns are the pressure; 0 is the middle of the land."""
    mass: Float[np.ndarray, " k"]
    """Integrals of the squares; those of products of different functions vanish."""
    stiffness: Float[np.ndarray, "k k"]
    """Integrals of the products of the derivatives."""
    integral: Float[np.ndarray, " k"]
    """Integrals of the functions: right-hand side of a uniform source, and weights of the mean pressure."""
    end_slope: Float[np.ndarray, " k"]
    """Derivatives at the land's end, eta = 1: what flows out there."""


@functools.cache
def axial_profiles(count: int) -> AxialProfiles:
    """The first `count` symmetric basis functions.

    **Raises:** `ValueError` for a count outside 1 to 8.
    """
    if not 1 <= count <= 8:
        raise ArgumentError("count", said=f"must lie between 1 and 8, but {count} was given.")
    points = roots_jacobi(2 * count - 1, 2, 2)[0]
    points[count - 1] = 0.0
    wall = Polynomial([1.0, 0.0, -1.0])

    def basis(i: int) -> Polynomial:
        others = np.delete(points, i)
        shape = Polynomial.fromroots(others) if others.size else Polynomial([1.0])
        whole = wall * shape
        return whole / whole(points[i])

    single = [basis(i) for i in range(2 * count - 1)]
    pairs = [single[count - 1], *(single[count - 1 + j] + single[count - 1 - j] for j in range(1, count))]
    at, weight = legendre.leggauss(4 * count + 4)
    value = np.array([p(at) for p in pairs])
    slope = np.array([p.deriv()(at) for p in pairs])
    half = 0.5 * weight
    return AxialProfiles(
        points[count - 1 :],
        value**2 @ half,
        (slope * half) @ slope.T,
        value @ half,
        np.array([p.deriv()(1.0) for p in pairs]),
    )
