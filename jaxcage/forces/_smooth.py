"""Regularised elementary functions: smooth to the order that Newton on orbits and their derivatives needs."""

import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._arguments import require_above_zero
from .._types import Scalar


def smooth_plus(u: Scalar, width: Scalar) -> Array:
    """max(u, 0), three times continuously differentiable: exact for |u| >= width, a polynomial between.

    The slope rises from 0 to 1 over [-width, width] as the quintic smoothstep, which is C2.

    **Arguments:** `u` and `width` > 0 in one unit.

    **Returns:** a value >= 0 in that unit; it exceeds max(u, 0) by at most 0.16 `width`, at u = 0.
    """
    require_above_zero(width=width)
    t = jnp.clip((u + width) * (0.5 / width), 0.0, 1.0)
    return jnp.where(u >= width, u, 2 * width * t**4 * (t * (t - 3) + 2.5))


def smooth_plus_slope(u: Scalar, width: Scalar) -> Array:
    """Derivative of `smooth_plus`: the quintic smoothstep from 0 to 1."""
    require_above_zero(width=width)
    t = jnp.clip((u + width) * (0.5 / width), 0.0, 1.0)
    return t**3 * (t * (6 * t - 15) + 10)


def smooth_norm(x: Scalar, y: Scalar, length: Scalar) -> Array:
    """sqrt(x^2 + y^2 + length^2): the distance from the origin, differentiable at the origin."""
    return jnp.sqrt(x * x + y * y + length * length)


def inverse_root(x: Scalar) -> Array:
    """1/sqrt(x) for x > 0. Of the division XLA makes a call, for which LLVM leaves the whole kernel to run lane by
    lane: half as fast, for the whole bearing without tangent vectors."""
    return jnp.sqrt(x) / x


@jax.custom_jvp
def _inverse_ninth_root(p: Array) -> Array:
    """p^(-1/9) for p > 0, to rounding: a guess within 3 % from the bits of p, then three steps of third order.

    Made of products alone, it runs along the lanes; a logarithm and an exponential call libm once for each lane.
    """
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


def root_9(p: Scalar) -> Array:
    """p^(1/9) for p >= 0, with finite derivatives of every order at p = 0 (where they are taken as zero)."""
    p = jnp.asarray(p, dtype=float)
    touching = p > 0
    safe = jnp.where(touching, p, 1.0)
    root = _inverse_ninth_root(safe)
    root2 = root * root
    root4 = root2 * root2
    return jnp.where(touching, safe * (root4 * root4), 0.0)


def power_10_9(p: Scalar) -> Array:
    """p^(10/9) for p >= 0, in the same sense."""
    p = jnp.asarray(p, dtype=float)
    return p * root_9(p)
