"""Speeds, centrifugal force and guidance gap: paper eqs. (7)-(9) and (11)-(13).

Speeds are positive counter-clockwise.
"""

import jax.numpy as jnp
from jaxtyping import Array

from .._arguments import require_above_zero
from .._types import Scalar


def raceway_surface_speed(angular_speed: Scalar, raceway_diameter: Scalar) -> Array:
    """Surface speed of a raceway, v = omega d/2, (7).

    **Arguments:** speed of the ring [rad/s], diameter of its raceway [m].

    **Returns:** surface speed [m/s].
    """
    require_above_zero(raceway_diameter=raceway_diameter)
    return jnp.asarray(angular_speed * raceway_diameter / 2)


def cage_speed(inner_speed: Scalar, outer_speed: Scalar, roller_diameter: Scalar, pitch_diameter: Scalar) -> Array:
    """Speed of the set of rollers, and so of the cage, in pure rolling, (8).

    **Arguments:** speeds of inner and outer ring [rad/s], roller and pitch diameter [m].

    **Returns:** w_c = [w_i (1 - d_w/d_m) + w_o (1 + d_w/d_m)]/2 [rad/s].
    """
    require_above_zero(roller_diameter=roller_diameter, pitch_diameter=pitch_diameter)
    ratio = roller_diameter / pitch_diameter
    return jnp.asarray((inner_speed * (1 - ratio) + outer_speed * (1 + ratio)) / 2)


def cage_speed_ratio(roller_diameter: Scalar, pitch_diameter: Scalar) -> Array:
    """Cage speed over shaft speed with the outer ring at rest, from (8): (1 - d_w/d_m)/2 [1]."""
    require_above_zero(roller_diameter=roller_diameter, pitch_diameter=pitch_diameter)
    return jnp.asarray((1 - roller_diameter / pitch_diameter) / 2)


def centrifugal_force(roller_mass: Scalar, cage_speed: Scalar, pitch_diameter: Scalar) -> Array:
    """Centrifugal force of one roller, F_cen = m w_c^2 d_m/2, (9).

    **Arguments:** mass of a roller [kg], absolute cage speed [rad/s], pitch diameter [m].

    **Returns:** force on the outer raceway [N].
    """
    require_above_zero(pitch_diameter=pitch_diameter)
    return jnp.asarray(roller_mass * cage_speed**2 * pitch_diameter / 2)


def guidance_gap(rib_diameter: Scalar, cage_diameter: Scalar) -> Array:
    """Cage guidance gap C_r = d_g - d_c, (12) [m].

    It is diametral; (13) and (25)-(27) use it as if it were radial.
    """
    require_above_zero(rib_diameter=rib_diameter, cage_diameter=cage_diameter)
    return jnp.asarray(rib_diameter - cage_diameter)


def guiding_radius(rib_diameter: Scalar, guidance_gap: Scalar) -> Array:
    """Radius of the cage's guiding lands, R = (d_g - C_r)/2, from (12) [m]."""
    require_above_zero(rib_diameter=rib_diameter, guidance_gap=guidance_gap)
    return jnp.asarray((rib_diameter - guidance_gap) / 2)
