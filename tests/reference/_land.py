"""Film and contact of the guiding lands, in the polar coordinates of the physics page, section 4.

All functions take Python floats or complex numbers: an imaginary part carries a derivative (complex step), and only
real parts are compared.
"""

import cmath
import math
from typing import Any


Number = Any
"""A float, or a complex number whose imaginary part is a derivative."""


def ramp(u: Number, width: float) -> Number:
    """max(u, 0), rounded over [-width, width] so that its slope is the quintic smoothstep.

    In s = u/width that slope is 1/2 + (15 s - 10 s^3 + 3 s^5)/16; its integral from -1 has a fourfold root there.
    """
    s = u / width
    if s.real >= 1:
        return u
    return width * (1 + s) ** 4 * (5 + s * (s - 4)) / 32 if s.real > -1 else 0.0 * u


def _arctan(x: Number) -> Number:
    return cmath.atan(x) if isinstance(x, complex) else math.atan(x)


def film_in_polar(model: str, eps: Number, radial: Number, drift: Number, coupling: Number = 1.0) -> tuple:
    """(25)-(28): radial and tangential force on the cage over mu R L (L/c)^2 [1/s].

    **Arguments:** `fixed_half` or `full`; eccentricity ratio; eps' [1/s]; (omega - 2 phi') eps [1/s]; the factor by
    which smoothing at the centre, where the half film loses its direction, weakens the terms that depend on it.
    """
    gap = 1 - eps * eps
    squeeze = math.pi / 2 * (1 + 2 * eps * eps) / (gap * gap * gap**0.5)
    wedge = math.pi / 4 / (gap * gap**0.5)
    if model == "full":
        return -2 * squeeze * radial, 2 * wedge * drift
    across = coupling * eps / (gap * gap)
    return -(drift * across + squeeze * radial), drift * wedge + 2 * across * radial


def pressurised_half(x: Number, y: Number, px: Number, py: Number, room: float) -> tuple:
    """Force over mu R L (L/c)^2 of the half circle with positive pressure [1/s], which is centred on P = (px, py).

    The pressure is proportional to P.n/H^3. With u the direction of P, shortened by |P|/sqrt(|P|^2 + room^2), a = r.u,
    b = r x u and D^2 = 1 - r^2, the integrals of (u.n)^2/H^3 and (u.n)(u x n)/H^3 over that half are elementary.

    **Arguments:** position over clearance; P = 2 v/c - omega (-y, x) [1/s]; `room` [1/s], where P loses its direction.
    """
    size = (px * px + py * py + room * room + 1e-300) ** 0.5
    ux, uy = px / size, py / size
    strength = px * ux + py * uy
    a, b = x * ux + y * uy, y * ux - x * uy
    d2 = 1 - x * x - y * y
    d = d2**0.5
    angle = math.pi / 2 + _arctan(a / d)
    along = (angle + 3 * a / d + 3 * angle * a * a / d2) / (d * d2)
    aside = b * ((3 + 3 * a * angle / d) / d2 - 1 / (1 - b * b)) / d2
    return -strength / 2 * (along * ux - aside * uy), -strength / 2 * (along * uy + aside * ux)


def land_force(of: dict[str, Any], x: Number, y: Number, vx: Number, vy: Number, omega: float) -> tuple:
    """Film, supply pressure and contact together [N].

    **Arguments:** the constants that `Field` works out; position and velocity of the cage relative to the rib over the
    clearance [1, 1/s].
    """
    r = (x * x + y * y) ** 0.5
    cos, sin = (x / r, y / r) if r != 0 else (1.0, 0.0)
    eps = (r * r + of["centre"] ** 2) ** 0.5
    sure = r / eps  # 1 but at the very centre, where the line of centres loses its direction
    excess = ramp(eps - of["onset"], of["touch"])
    share = 1 - excess / eps  # the film's coefficients saturate at the onset of contact
    v_r, v_t = vx * cos + vy * sin, vy * cos - vx * sin
    drift = omega * r - 2 * v_t
    if of["film"] == "positive_pressure":
        px, py = 2 * vx + omega * y, 2 * vy - omega * x
        f_x, f_y = pressurised_half(share * x, share * y, px, py, of["centre"] * omega)
        size = (px * px + py * py + (of["centre"] * omega) ** 2 + 1e-300) ** 0.5
        f_x = of["scale"] * f_x - 2 * of["supply"] * px / size
        f_y = of["scale"] * f_y - 2 * of["supply"] * py / size
        f_r, f_t = 0.0, 0.0
    else:
        f_r, f_t = film_in_polar(of["film"], share * r, v_r, drift, sure)
        half = 1 if of["film"] == "fixed_half" else 0
        f_x, f_y, f_r, f_t = 0.0, 0.0, of["scale"] * f_r, of["scale"] * f_t + 2 * half * of["supply"] * sure
    if excess.real > 0:
        loading = ramp(1 + of["chi"] * of["clearance"] * sure * v_r / of["approach"], 1e-4)
        f_r -= of["stiffness"] * (of["clearance"] * excess) ** (10 / 9) * loading * sure
    return f_x + f_r * cos - f_t * sin, f_y + f_r * sin + f_t * cos
