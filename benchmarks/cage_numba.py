"""The cage's equations for numba: rates and their Jacobian, lengths in clearances, phase for time.

A lane's constants `p` come in the order of `problem.constants`. Nothing here imports JAX: worker processes load it.
"""

import math

import numba  # pyright: ignore[reportMissingImports]
import numpy as np


FAST = {"fastmath": True, "cache": False, "error_model": "numpy"}


@numba.njit(**FAST)
def place(p, x, y):
    """Distance from the centre, excess over the onset of contact with its slope, share of (x, y) the film sees."""
    onset, width = p[3], p[4]
    eps = math.sqrt(x * x + y * y + p[5])
    over = eps - onset
    if over <= -width:
        return eps, 0.0, 0.0, 1.0
    if over >= width:
        return eps, over, 1.0, 1 - over / eps
    t = (over + width) * (0.5 / width)
    excess = 2 * width * t**4 * (t * (t - 3) + 2.5)
    return eps, excess, t**3 * (10 + t * (6 * t - 15)), 1 - excess / eps


@numba.njit(**FAST)
def film_matrix(p, nx, ny):
    """Isotropic, radial and skew part of the film's matrix, 1/(1 - e^2) and 1/(e^2 + centre^2)."""
    e2 = nx * nx + ny * ny
    inverse = 1 / (1 - e2)
    iso = (math.pi / 2) * inverse * math.sqrt(inverse)
    per_e2 = 1 / (e2 + p[5])
    return iso, 3 * iso * inverse, 2 * inverse * inverse * math.sqrt(per_e2), inverse, per_e2


@numba.njit(**FAST)
def contact(p, eps, excess, rate):
    """Normal force, and its derivatives by the excess and by the rate of eps."""
    if excess <= 0.0:
        return 0.0, 0.0, 0.0
    root = math.exp(math.log(excess) / 9)
    loading = 1 + p[2] * rate
    norm = math.sqrt(loading * loading + 1e-8)
    hysteresis = 0.5 * (loading + norm)
    law = p[1] * excess * root
    return law * hysteresis, p[1] * (10 / 9) * root * hysteresis, law * p[2] * hysteresis / norm


@numba.njit(**FAST)
def acceleration(cosine, sine, p, x, y, u, v):
    """Acceleration at the phase of this cosine and sine."""
    eps, excess, _, kept = place(p, x, y)
    nx, ny = kept * x, kept * y
    iso, rad, skew, _, _ = film_matrix(p, nx, ny)
    wx, wy = 2 * u + y, 2 * v - x
    a, b = nx * wx + ny * wy, nx * wy - ny * wx
    along, across = rad * a - skew * b, skew * a
    hold = p[8] * (x * x + y * y)
    if excess > 0.0:
        hold += contact(p, eps, excess, (x * u + y * v) / eps)[0] / eps
    ax = p[11] * cosine + p[12] * sine - p[0] * (iso * wx + nx * along + ny * across)
    ay = p[11] * sine - p[13] - p[0] * (iso * wy + ny * along - nx * across)
    return ax - (p[6] + hold) * x - p[10] * y - p[9] * u, ay - (p[7] + hold) * y + p[10] * x - p[9] * v


@numba.njit(**FAST)
def film_slope(wx, wy, nx, ny, ex, ey, iso, rad, skew, inverse, per_e2):
    """Derivative of film matrix times w along a change (ex, ey) of n."""
    a, b = nx * wx + ny * wy, nx * wy - ny * wx
    along, across = rad * a - skew * b, skew * a
    de2 = 2 * (nx * ex + ny * ey)
    d_iso, d_rad = 1.5 * iso * inverse * de2, 2.5 * rad * inverse * de2
    d_skew = skew * (2 * inverse - 0.5 * per_e2) * de2
    da, db = ex * wx + ey * wy, ex * wy - ey * wx
    d_along, d_across = d_rad * a + rad * da - d_skew * b - skew * db, d_skew * a + skew * da
    return (
        d_iso * wx + ex * along + nx * d_along + ey * across + ny * d_across,
        d_iso * wy + ey * along + ny * d_along - ex * across - nx * d_across,
    )


@numba.njit(**FAST)
def jacobian(p, x, y, u, v):
    """Derivatives of the acceleration: by x, y (xx, xy, yx, yy), then by the velocities."""
    eps, excess, slope, kept = place(p, x, y)
    nx, ny = kept * x, kept * y
    iso, rad, skew, inverse, per_e2 = film_matrix(p, nx, ny)
    wx, wy = 2 * u + y, 2 * v - x
    xx, yy = iso + rad * nx * nx + 2 * skew * nx * ny, iso + rad * ny * ny - 2 * skew * nx * ny
    xy = rad * nx * ny - skew * (nx * nx - ny * ny)
    fall = -(slope - excess / eps) / (eps * eps)
    gx, gy = fall * x, fall * y
    ax, ay = film_slope(wx, wy, nx, ny, kept + x * gx, y * gx, iso, rad, skew, inverse, per_e2)
    bx, by = film_slope(wx, wy, nx, ny, x * gy, kept + y * gy, iso, rad, skew, inverse, per_e2)
    r2, bend = x * x + y * y, 2 * p[8]
    qxx = -p[0] * (ax - xy) - p[6] - p[8] * r2 - bend * x * x
    qxy = -p[0] * (bx + xx) - bend * x * y - p[10]
    qyx = -p[0] * (ay - yy) - bend * x * y + p[10]
    qyy = -p[0] * (by + xy) - p[7] - p[8] * r2 - bend * y * y
    vxx, vxy, vyy = -2 * p[0] * xx - p[9], -2 * p[0] * xy, -2 * p[0] * yy - p[9]
    vyx = vxy
    if excess > 0.0:
        rate = (x * u + y * v) / eps
        normal, stiff, damp = contact(p, eps, excess, rate)
        push, cx, cy = normal / eps, x / eps, y / eps
        dx = ((stiff * slope - push) * cx + damp * (u - rate * cx) / eps) / eps
        dy = ((stiff * slope - push) * cy + damp * (v - rate * cy) / eps) / eps
        qxx, qxy, qyx, qyy = qxx - push - x * dx, qxy - x * dy, qyx - y * dx, qyy - push - y * dy
        vxx, vxy, vyx, vyy = vxx - damp * cx * cx, vxy - damp * cx * cy, vyx - damp * cy * cx, vyy - damp * cy * cy
    return qxx, qxy, qyx, qyy, vxx, vxy, vyx, vyy


@numba.njit(**FAST)
def rates(tau, z, p):
    """dz/dtau as SciPy wants it."""
    out = np.empty(4)
    out[0], out[1] = z[2], z[3]
    out[2], out[3] = acceleration(math.cos(tau), math.sin(tau), p, z[0], z[1], z[2], z[3])
    return out


@numba.njit(**FAST)
def rates_jacobian(tau, z, p):
    """d rates / dz as SciPy wants it."""
    j = jacobian(p, z[0], z[1], z[2], z[3])
    out = np.zeros((4, 4))
    out[0, 2] = out[1, 3] = 1.0
    out[2, 0], out[2, 1], out[3, 0], out[3, 1] = j[0], j[1], j[2], j[3]
    out[2, 2], out[2, 3], out[3, 2], out[3, 3] = j[4], j[5], j[6], j[7]
    return out
