"""A roller between two raceways: paper eqs. (3), (4) and (10)."""

import equinox as eqx
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array

from .._pytrees import Scalar


LINE_CONTACT_EXPONENT = 10 / 9
PALMGREN_CONSTANT = 8.06e10
"""Palmgren's constant [Pa]: 8.06e4 N mm^(-10/9) mm^(-8/9) is 8.06e4 N/mm^2, as 10/9 + 8/9 = 2."""


def _power(x: Scalar, exponent: float) -> Array:
    """x^exponent for x > 0, else 0 with a zero gradient, also for exponents below 1."""
    x = jnp.asarray(x, dtype=float)
    return jnp.where(x > 0, jnp.where(x > 0, x, 1.0) ** exponent, 0.0)


def line_contact_stiffness(palmgren_constant: Scalar, length: Scalar) -> Array:
    """K = C_P l^(8/9) of a steel roller on one raceway (Palmgren).

    **Arguments:** C_P [Pa], length of the roller [m].

    **Returns:** K [N/m^(10/9)].
    """
    return jnp.asarray(palmgren_constant * _power(length, 8 / 9))


def line_contact_load(stiffness: Scalar, approach: Scalar) -> Array:
    """Q = K delta^(10/9), zero where the bodies are apart, (3).

    **Arguments:** K [N/m^(10/9)], approach [m]. **Returns:** load [N].
    """
    return jnp.asarray(stiffness * _power(approach, LINE_CONTACT_EXPONENT))


def line_contact_approach(stiffness: Scalar, load: Scalar) -> Array:
    """delta = (Q/K)^(9/10), the inverse of (3), and (10) with Q_i + F_cen in place of Q.

    **Arguments:** K [N/m^(10/9)], load [N]. **Returns:** approach [m].
    """
    return _power(load / stiffness, 1 / LINE_CONTACT_EXPONENT)


def raceway_loads(approach: Scalar, stiffness: Scalar, centrifugal: Scalar) -> tuple[Array, Array]:
    """Loads of one roller on both raceways under a given approach of the raceways, (3), (4), (10).

    The centrifugal force acts on the outer raceway only: Q_o = Q_i + F_cen. The approach splits as
    delta = (Q_i/K)^0.9 + ((Q_i + F_cen)/K)^0.9, which is solved for the share x of the inner contact,
    x + delta_o(x)/delta = 1. The left side is convex and increasing, and the start is at or above the root, so that
    Newton's method descends to it. A roller that F_cen presses into the outer raceway by more than delta is clear of
    the inner one, Q_i = 0.

    **Arguments:** total approach [m] (negative: apart), stiffness of one raceway [N/m^(10/9)], centrifugal force [N].

    **Returns:** Q_i and Q_o [N].
    """
    total, stiffness, centrifugal = (jnp.asarray(x, dtype=float) for x in (approach, stiffness, centrifugal))
    seat = line_contact_approach(stiffness, centrifugal)
    loaded = total > seat
    # An unloaded roller solves a harmless stand-in, so that no value or gradient is NaN.
    stand_in = jnp.where(loaded, total, 1 + 2 * seat)

    def residual(x: Array, _: None) -> Array:
        load = line_contact_load(stiffness, x * stand_in) + centrifugal
        return x + line_contact_approach(stiffness, load) / stand_in - 1

    solver, start = optx.Newton(rtol=1e-13, atol=1e-13), 1 - seat / stand_in
    share = optx.root_find(residual, solver, start, None, max_steps=64, throw=False).value
    load = jnp.where(loaded, line_contact_load(stiffness, share * stand_in), 0.0)
    return load, load + centrifugal


raceway_loads_of_all = eqx.filter_vmap(raceway_loads, in_axes=(0, None, None))
