"""Elementary functions of the force laws: smooth, so that Newton's method on orbits has the derivatives it needs, and
made of additions, multiplications and few roots, so that they vectorise."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._pytrees import Scalar


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


def smooth_plus(u: Scalar, width: Scalar) -> Array:
    """max(u, 0), three times continuously differentiable: exact for |u| >= width, a polynomial between.

    The slope rises from 0 to 1 over [-width, width] as the quintic smoothstep, which is C2.

    **Arguments:** `u` and `width` > 0 in one unit.

    **Returns:** a value >= 0 in that unit; it exceeds max(u, 0) by at most 0.16 `width`, at u = 0.
    """
    t = jnp.clip((u + width) * (0.5 / width), 0.0, 1.0)
    return jnp.where(u >= width, u, 2 * width * t**4 * (t * (t - 3) + 2.5))


def smooth_norm(x: Scalar, y: Scalar, length: Scalar) -> Array:
    """sqrt(x^2 + y^2 + length^2): the distance from the origin, differentiable at the origin."""
    return jnp.sqrt(x * x + y * y + length * length)


def inverse_root(x: Scalar) -> Array:
    """1/sqrt(x) for x > 0, in a form for which XLA emits no function call, which LLVM could not vectorise."""
    return jnp.sqrt(x) / x


@jax.custom_jvp
def _inverse_ninth_root(p: Array) -> Array:
    """p^(-1/9) for p > 0 to rounding: a guess within 3 % from the bits of p, then three third-order iterations."""
    bits = jax.lax.bitcast_convert_type(p, jnp.int64)
    ninth = (bits.astype(float) * (1 / 9)).astype(jnp.int64)
    root = jax.lax.bitcast_convert_type(0x4709D0369D036C00 - ninth, jnp.float64)
    for _ in range(3):
        defect = 1 - p * _ninth_power(root)
        root = root + root * defect * (1 / 9 + defect * (5 / 81))
    return root


def _ninth_power(y: Array) -> Array:
    y2 = y * y
    y4 = y2 * y2
    return y4 * y4 * y


@_inverse_ninth_root.defjvp
def _inverse_ninth_root_jvp(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    (p,), (p_dot,) = primals, tangents
    root = _inverse_ninth_root(p)
    return root, root * _ninth_power(root) * (-1 / 9) * p_dot


def power_10_9(p: Scalar) -> Array:
    """p^(10/9) for p >= 0, with finite derivatives of every order at p = 0; those of p^(1/9) are zero there."""
    p = jnp.asarray(p, dtype=float)
    touching = p > 0
    safe = jnp.where(touching, p, 1.0)
    root = _inverse_ninth_root(safe)
    root2 = root * root
    root4 = root2 * root2
    return p * jnp.where(touching, safe * (root4 * root4), 0.0)


def _polynomial(coefficients: tuple[float, ...], z: Scalar) -> Scalar:
    value = coefficients[0]
    for c in coefficients[1:]:
        value = value * z + c
    return value


def cos_sin(tau: Scalar) -> tuple[Scalar, Scalar]:
    """Cosine and sine of tau [rad], to a unit in the last place of 1 for |tau| < 1e5, by polynomials, which vectorise
    over lanes; the mathematics library would be called once per lane."""
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
