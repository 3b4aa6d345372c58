"""Cosine and sine of the phase from additions and multiplications alone.

Where each lane has a phase of its own, as with steps that are shortened near a contact, a call of the mathematics
library for every lane costs more than the rest of the forces; these polynomials run eight lanes to an instruction.
"""

from typing import Any

import jax
import jax.numpy as jnp

from .._types import Scalar


QUARTER = (1.57079632673412561417, 6.07710050650619224932e-11)
"""pi/2 as the sum of its first 33 bits and the rest."""
# Minimax polynomials on [-pi/4, pi/4] of FDLIBM (Sun Microsystems 1993, k_sin.c and k_cos.c).
SINE = (
    1.58969099521155010221e-10,
    -2.50507602534068634195e-08,
    2.75573137070700676789e-06,
    -1.98412698298579493134e-04,
    8.33333333332248946124e-03,
    -1.66666666666666324348e-01,
)
COSINE = (
    -1.13596475577881948265e-11,
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
)


def _polynomial(coefficients: tuple[float, ...], z: Scalar) -> Scalar:
    value = coefficients[0]
    for c in coefficients[1:]:
        value = value * z + c
    return value


def cos_sin(tau: Scalar) -> tuple[Scalar, Scalar]:
    """Cosine and sine of tau [rad], to a unit in the last place of 1 for |tau| < 1e5."""
    return _cos_sin(jnp.asarray(tau, dtype=float))


@jax.custom_jvp
def _cos_sin(tau: Any) -> Any:
    quarters = jnp.floor(tau * (2 / jnp.pi) + 0.5)
    r = (tau - quarters * QUARTER[0]) - quarters * QUARTER[1]
    z = r * r
    s = r + r * z * _polynomial(SINE, z)
    c = 1 - (0.5 * z - z * z * _polynomial(COSINE, z))
    place = quarters - 4 * jnp.floor(quarters / 4)  # 0, 1, 2 or 3
    odd = (place == 1) | (place == 3)
    cosine, sine = jnp.where(odd, s, c), jnp.where(odd, c, s)
    return jnp.where((place == 1) | (place == 2), -cosine, cosine), jnp.where(place >= 2, -sine, sine)


@_cos_sin.defjvp
def _cos_sin_jvp(primals: tuple, tangents: tuple) -> tuple:
    (tau,), (rate,) = primals, tangents
    c, s = _cos_sin(tau)
    return (c, s), (-s * rate, c * rate)
