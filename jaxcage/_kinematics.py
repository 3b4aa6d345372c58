"""Speeds of the cage from dimensions: nothing here loads JAX."""

import math
from typing import Any

from ._errors import InputError


FASTEST = 300.0
"""Surface speed of the cage at its land [m/s] beyond which no cage runs: rho v^2 alone is 765 MPa of hoop stress in
brass, twice what it bears, and what is given in rpm for rad/s is 9.5 times as fast as meant."""


def cage_speed_ratio(inner_raceway_diameter: Any, roller_diameter: Any) -> Any:
    """Cage speed over shaft speed, from (8): (1 - d_w/d_m)/2 with d_m = d_i + d_w [1]."""
    return (1 - roller_diameter / (inner_raceway_diameter + roller_diameter)) / 2


def land_radius(rib_diameter: Any, guidance_gap: Any) -> Any:
    """Radius of the guiding surface of a cage within the outer ring's ribs, (d_g - C_r)/2 [m]."""
    return (rib_diameter - guidance_gap) / 2


def require_cage_rpm(option: str, cage: float, radius: float) -> None:
    """Compare a speed of the cage [rpm] with that at which its land, of a radius [m], runs at `FASTEST`.

    **Raises:** `InputError` about the option.
    """
    limit = FASTEST / radius * 30 / math.pi
    if not 0 < cage <= limit:
        raise InputError(
            f"Option {option} must be above 0 and leave the cage at most {limit:.0f} rpm, which is {FASTEST:g} m/s at "
            f"its land, but {cage:g} rpm of the cage were given; speeds of the shaft are written "
            '"20000 rpm shaft".'
        )
