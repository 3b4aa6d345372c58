"""Drag of the oil on rollers by its viscosity: a cylinder across a stream, and SKF's moment of rolling resistance.

Rolling resistance: SKF, *General catalogue*, pages 88 to 97, M_rr = phi_ish phi_rs R_1 d_m^2.41 F^0.31 (nu n)^0.6 in
N mm, with d_m = (d + D)/2 and lengths in mm, F in N, nu in mm^2/s, n in rpm. phi_ish is that of the heating of the oil
in the inlet, phi_rs that of starvation. It was fitted to bearings of normal clearance with a constant load above the
makers' minimum; below that it is extrapolated. With starvation its maximum over the viscosity is near 50 mm^2/s in a
bearing of 80 mm at 7000 rpm: thicker oil does not come back to the rollers in time.
"""

import math

import jax.numpy as jnp
from jaxtyping import Array

from .._pytrees import Scalar
from .geometry import Bearing


STARVATION = {"flooded": 0.0, "bath": 3e-8, "spot": 6e-8}
"""SKF's constant K_rs by the supply of oil: none is missing; low bath or jet; grease, or oil by drops and with air."""
CAGED = 5.1
"""SKF's constant K_Z of cylindrical roller bearings with a cage."""
LOAD_POWER = 0.31
"""Exponent of the load in the moment of rolling resistance."""


def cylinder_drag_coefficient(reynolds: Scalar) -> Array:
    """Drag coefficient C_d of a long smooth cylinder across a stream: F = C_d (rho/2) v^2 D l.

    Fit of measurements for Reynolds numbers v D/nu from 1e-4 to 2e5, at whose ends it stops (F. M. White, *Viscous
    Fluid Flow*, 2nd ed. 1991). Rollers travel in each other's wake and may have less.
    """
    re = jnp.clip(reynolds, 1e-4, 2e5)
    return 1.18 + 6.8 * re**-0.89 + 1.96 * re**-0.5 - 4e-4 * re / (1 + 3.64e-7 * re**2)


def rolling_factors(
    bearing: Bearing, viscosity: Scalar, speed: Scalar, starvation: Scalar, k_z: Scalar = CAGED
) -> tuple:
    """SKF's factors phi_ish and phi_rs of heating and starvation.

    **Arguments:** bearing; kinematic viscosity [m^2/s]; speed of one ring relative to the other [rad/s]; K_rs, one of
    `STARVATION`; K_Z, of the kind of bearing.
    """
    d, outside, nu, n = (
        1e3 * bearing.bore,
        1e3 * bearing.outside_diameter,
        1e6 * viscosity,
        jnp.abs(speed) * 30 / jnp.pi,
    )
    heating = 1 / (1 + 1.84e-9 * (n * (d + outside) / 2) ** 1.28 * nu**0.64)
    starved = jnp.exp(-starvation * nu * n * (d + outside) * jnp.sqrt(k_z / (2 * (outside - d))))
    return heating, starved


def rolling_moment(
    bearing: Bearing, load: Scalar, viscosity: Scalar, speed: Scalar, coefficient: Scalar, starvation: Scalar
) -> Array:
    """SKF's moment of rolling resistance M_rr of a cylindrical roller bearing [N m].

    **Arguments:** as `rolling_factors`, with the radial load [N], and R_1, which follows from the series.
    """
    diameter = 1e3 * (bearing.bore + bearing.outside_diameter) / 2
    flow = 1e6 * viscosity * jnp.abs(speed) * 30 / jnp.pi
    heating, starved = rolling_factors(bearing, viscosity, speed, starvation)
    return 1e-3 * heating * starved * coefficient * diameter**2.41 * load**LOAD_POWER * flow**0.6


def rolling_couple(
    bearing: Bearing, viscosity: Scalar, speed: Scalar, coefficient: Scalar, starvation: Scalar
) -> Array:
    """The couple c of rolling resistance between a roller and a ring, c Q^0.31 at a contact load Q [N m/N^0.31].

    Local form of `rolling_moment`: all contacts together take its power under any load, where the load is shared as
    without clearance, Q = Q_max cos^(10/9) over half of the rollers, and Q is the same on both rings. Then
    M_rr = c (d_m/D) sum Q^0.31 with the pitch diameter d_m. SKF states nothing of outer contacts that centrifugal force
    alone loads.

    **Arguments:** as `rolling_moment`.
    """
    mean = lambda power: math.gamma((power + 1) / 2) / math.gamma(power / 2 + 1) / (2 * math.sqrt(math.pi))
    carried = bearing.n_rollers * mean(10 / 9 + 1)  # load over that of the roller at the bottom
    summed = bearing.n_rollers * mean(10 / 9 * LOAD_POWER) / carried**LOAD_POWER
    whole = rolling_moment(bearing, 1.0, viscosity, speed, coefficient, starvation)
    return whole * bearing.roller_diameter / (bearing.pitch_diameter * summed)
