"""Numbers of a model before anything moves: viscosity, loaded zone, restitution."""

import decimal
import math
from typing import Any

from scipy.optimize import brentq


def viscosity(oil: dict[str, Any]) -> float:
    """Dynamic viscosity [Pa s] of an oil by ASTM D341: lg lg(nu/nu_0 + 0.7) on a straight line over lg T."""

    def height(nu: float) -> float:
        return math.log10(math.log10(nu / oil["reference_viscosity"] + 0.7))

    first, second = oil["temperature_1"], oil["temperature_2"]
    slope = (height(oil["viscosity_2"]) - height(oil["viscosity_1"])) / math.log10(second / first)
    at = height(oil["viscosity_1"]) + slope * math.log10(oil["temperature"] / first)
    return oil["density"] * oil["reference_viscosity"] * (10 ** (10**at) - 0.7)


def hunt_crossley_number(restitution: float) -> float:
    """chi with ln[(1 + chi)/(1 - chi e)] = chi (1 + e), by bisection at 60 digits: the law has a double root at 0."""
    if restitution == 1:
        return 0.0
    with decimal.localcontext(prec=60):
        e = decimal.Decimal(restitution)
        low, high = decimal.Decimal("1e-25"), (1 - decimal.Decimal("1e-45")) / e
        for _ in range(160):
            chi = (low + high) / 2
            if ((1 + chi) / (1 - chi * e)).ln() > chi * (1 + e):
                high = chi
            else:
                low = chi
        return float(low)


def half_angle(bearing: dict[str, Any], load: float) -> float:
    """Half angle of the loaded zone [rad], (2) in clean form: acos(G_r/(2 delta_s)).

    The shift delta_s carries `load` [N] on discrete rollers, one at the bottom, each of two line contacts in series:
    delta = 2 (Q/K)^(9/10), K = C_P l^(8/9), (3)-(4).
    """
    play = bearing["radial_clearance"] / 2
    count = bearing["n_rollers"]
    one = bearing["palmgren_constant"] * bearing["roller_length"] ** (8 / 9)
    cosines = [math.cos(2 * math.pi * i / count) for i in range(count)]

    def carried(shift: float) -> float:
        pressed = [(max(shift * c - play, 0.0) / 2, c) for c in cosines]
        return sum(one * p ** (10 / 9) * c for p, c in pressed)

    alone = play + 2 * (load / one) ** 0.9
    shift = brentq(lambda s: carried(s) / load - 1, play, 1.01 * alone, xtol=1e-18, rtol=1e-14)
    return math.acos(play / shift)
