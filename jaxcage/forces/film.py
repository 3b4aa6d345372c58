"""Oil film between cage and guiding rib: short-bearing (Ocvirk) forces, paper eqs. (25)-(28).

With the clearance c as unit of length, r = (x, y) the cage centre, v its velocity, n = (cos, sin) the direction to a
point of the rib and H = 1 - r.n the film thickness there, the short-bearing pressure is proportional to P.n / H^3 with
    P = 2 v/c - omega (-y, x),
the squeeze plus half the entrainment of the film. The force of one land on the cage is then
    F = -(S/2) M P,   M = integral over the pressurised arc of n n^T / H^3,   S = mu R L (L/c)^2,
and the three film models differ only in the arc: the fixed half circle behind the line of centres (the paper's (27)),
the half circle in which the pressure is positive, or the whole circle. M is symmetric and positive definite, so the
damping matrix (S/c) M never feeds energy in. The film's velocity coefficients are its entries: the force is linear in
velocity for a fixed arc, and the moving ends of the positive arc contribute nothing because the pressure vanishes
there.

Beyond the onset of land contact the film keeps the coefficients that it has at the onset: they would become infinite at
the clearance circle.
"""

from typing import Literal, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from .._arguments import require_above_zero, require_at_least
from .._parameters import choice, count, parameter
from .._pytrees import Scalar
from .elementary import inverse_root, smooth_norm
from .law import AbstractForce, AbstractLaw, Force, GuidedCage, Motion


Vector = tuple[Scalar, Scalar]
FilmModel = Literal["fixed_half", "positive_pressure", "full"]


class Resistance(NamedTuple):
    """The symmetric matrix M = integral of n n^T / H^3 over the pressurised arc, dimensionless."""

    xx: Scalar
    xy: Scalar
    yy: Scalar


def film_scale(viscosity: Scalar, radius: Scalar, width: Scalar, clearance: Scalar) -> Array:
    """S = mu R L (L/c)^2 [N s]: the film force of one land per unit of speed, (27) with its misprint corrected.

    The paper prints (R_c/C_r)^2 in the tangential force; the short-bearing solution has (l_c/C_r)^2 in both.

    **Arguments:** dynamic viscosity [Pa s], land radius [m], width of one land [m], radial clearance [m].
    """
    require_at_least(0, viscosity=viscosity)
    require_above_zero(radius=radius, width=width)
    return jnp.asarray(viscosity * radius * width * (width / clearance) ** 2)


def _arc_parts(half: bool, square: Scalar) -> tuple[Scalar, Scalar]:
    """1/(1 - eps^2), and the isotropic part of M over half the circle or the whole one, at the square of eps."""
    inverse = 1 / (1 - square)
    return inverse, (jnp.pi / 2 if half else jnp.pi) * inverse * jnp.sqrt(inverse)


def fixed_half_resistance(x: Scalar, y: Scalar, direction: Vector) -> Resistance:
    """M over the half circle that trails the line of centres (alpha from 0 to pi), as in (27).

    With r' = (-y, x) it is isotropic I + radial r r^T - skew (n r'^T + r' n^T).

    **Arguments:** position over clearance, and its direction as a unit vector, regularised where the arc loses it (at
    the centre).
    """
    nx, ny = direction
    inverse, isotropic = _arc_parts(True, x * x + y * y)
    radial, skew = 3 * isotropic * inverse, 2 * inverse * inverse
    return Resistance(
        isotropic + radial * x * x + 2 * skew * nx * y,
        radial * x * y - skew * (nx * x - ny * y),
        isotropic + radial * y * y - 2 * skew * nx * y,
    )


def full_resistance(x: Scalar, y: Scalar) -> Resistance:
    """M over the whole circle: pressure of both signs (full Sommerfeld condition)."""
    inverse, isotropic = _arc_parts(False, x * x + y * y)
    radial = 3 * isotropic * inverse
    return Resistance(isotropic + radial * x * x, radial * x * y, isotropic + radial * y * y)


def half_circle_resistance(x: Scalar, y: Scalar, ux: Scalar, uy: Scalar) -> Resistance:
    """M over the half circle centred on the unit vector u = (ux, uy), in closed form.

    It is half the Hessian, with respect to a = r.u and b = r x u, of the Sommerfeld integral
    G = (2/D) (pi/2 + arctan(a/D)), D^2 = 1 - a^2 - b^2.
    """
    a, b = x * ux + y * uy, y * ux - x * uy
    inverse = 1 / (1 - (x * x + y * y))
    root = jnp.sqrt(inverse)
    arc = 1 / (1 - b * b)
    g = 2 * root * (jnp.pi / 2 + jnp.arctan(a * root))
    v = (2 + a * g) * inverse
    m_aa = 0.5 * (g + 3 * a * v) * inverse
    m_ab = 0.5 * b * (3 * v - 2 * arc) * inverse
    q = (2 * a * arc + g) * inverse
    slope = 2 * inverse * (2 * a * arc * (inverse + arc) + g * inverse)  # (dq/db - q/D^2) / b
    m_bb = 0.5 * (q + b * b * (slope + q * inverse))
    return Resistance(
        m_aa * ux * ux - 2 * m_ab * ux * uy + m_bb * uy * uy,
        (m_aa - m_bb) * ux * uy + m_ab * (ux * ux - uy * uy),
        m_aa * uy * uy + 2 * m_ab * ux * uy + m_bb * ux * ux,
    )


def film_drive(x: Scalar, y: Scalar, vx: Scalar, vy: Scalar, omega: Scalar) -> tuple[Array, Array]:
    """P = 2 v - omega (-y, x): squeeze and entrainment, in clearances per second."""
    return jnp.asarray(2 * vx + omega * y), jnp.asarray(2 * vy - omega * x)


def film_resistance(
    model: FilmModel,
    x: Scalar,
    y: Scalar,
    direction: Vector,
    px: Scalar,
    py: Scalar,
    omega: Scalar,
    smoothing: Scalar,
) -> Resistance:
    """M of one of the three film models at position (x, y) over clearance, for the drive P = (px, py).

    `direction` is the unit vector of (x, y). `smoothing`, a small length over clearance, times `omega` regularises the
    direction of P where P = 0.
    """
    if model == "fixed_half":
        return fixed_half_resistance(x, y, direction)
    if model == "full":
        return full_resistance(x, y)
    per_norm = inverse_root(px * px + py * py + (smoothing * omega) ** 2 + 1e-300)  # 1e-300: no 0/0 at rest
    return half_circle_resistance(x, y, px * per_norm, py * per_norm)


def supply_force(
    model: FilmModel, direction: Vector, px: Scalar, py: Scalar, omega: Scalar, smoothing: Scalar
) -> tuple[Array, Array]:
    """Thrust -2 u of a uniform gauge pressure on the pressurised half circle centred on u, in units of R L p_0.

    The paper's last term of (27): +2 R L p_0 along +phi, since the fixed half is centred on -phi. Zero for `full`.
    """
    nx, ny = direction
    if model == "full":
        return jnp.zeros_like(jnp.asarray(nx)), jnp.zeros_like(jnp.asarray(nx))
    if model == "fixed_half":
        return jnp.asarray(-2 * ny), jnp.asarray(2 * nx)
    factor = -2 * inverse_root(px * px + py * py + (smoothing * omega) ** 2 + 1e-300)
    return factor * px, factor * py


def short_film_force(
    model: FilmModel, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar, omega: Scalar, smoothing: Scalar = 1e-9
) -> tuple[Array, Array]:
    """Force of the film in units of S = mu R L^3 / c^2, times 1/s: -(1/2) M P.

    **Arguments:** `model`; position and velocity of the cage centre over clearance [-, 1/s]; cage speed [rad/s];
    `smoothing`, a small length over clearance.

    **Returns:** (F_x, F_y) / S [1/s].
    """
    px, py = film_drive(x, y, vx, vy, omega)
    per_eps = 1 / smooth_norm(x, y, smoothing)
    m = film_resistance(model, x, y, (x * per_eps, y * per_eps), px, py, omega, smoothing)
    return -(m.xx * px + m.xy * py) / 2, -(m.xy * px + m.yy * py) / 2


def film_pressure(
    alpha: Scalar, z: Scalar, eps: Scalar, eps_rate: Scalar, phi_rate: Scalar, omega: Scalar, factor: Scalar
) -> Array:
    """Short-bearing pressure (26) in clean form, at angle `alpha` from the widest gap and axial place `z` over width.

    p = factor (1/4 - z^2) [(omega - 2 phi') eps sin(alpha) - 2 eps' cos(alpha)] / (1 + eps cos(alpha))^3, with
    factor = 3 mu L^2 / c^2 [Pa s]. The paper prints 1 + eps cos^3(alpha) and drops mu and the squeeze term.

    **Returns:** gauge pressure [Pa]; of both signs: the film models differ in what they keep of it.
    """
    drive = (omega - 2 * phi_rate) * eps * jnp.sin(alpha) - 2 * eps_rate * jnp.cos(alpha)
    return factor * (0.25 - z * z) * drive / (1 + eps * jnp.cos(alpha)) ** 3


class RibFilm(AbstractLaw):
    """The oil film of the guiding lands: how many, how wide, and which film model."""

    law_name = "film"

    land_width: Scalar = parameter("m", 1e-4, 0.05, "width of one guiding land", kind="drawing")
    smoothing: Scalar = parameter(
        "m", 1e-12, 1e-5, "length that keeps the film differentiable at the centre", kind="fixed", default=1e-9
    )
    supply_pressure: Scalar = parameter(
        "Pa", 0.0, 1e6, "gauge supply pressure p_0 of (27)", kind="operating", default=0.0
    )
    n_lands: int = count(1, 4, "number of guiding lands, each a film of its own", default=2)
    model: FilmModel = choice(
        "fixed_half",
        "positive_pressure",
        "full",
        text="film model: the arc of the short film that carries pressure",
        default="fixed_half",
    )

    def at(self, cage: GuidedCage, speed: Scalar) -> "FilmForce":
        """The film of `cage` in its guide."""
        c, radius, viscosity = cage.clearance, cage.land_radius, cage.lubricant.dynamic_viscosity
        return FilmForce(
            scale=self.n_lands * film_scale(viscosity, radius, self.land_width, c),
            supply_scale=self.n_lands * radius * self.land_width * self.supply_pressure,
            drag=self.n_lands * (2 * jnp.pi) * viscosity * radius**3 * self.land_width / c,
            model=self.model,
        )


class FilmForce(AbstractForce):
    """Force of the film in all lands."""

    scale: Scalar
    """S = mu R L (L/c)^2 of all lands [N s]."""
    supply_scale: Scalar
    """R L p_0 of all lands [N]."""
    drag: Scalar
    """2 pi mu R^3 L/c of all lands [N m s]: the torque per speed of a cage in the middle of its clearance."""
    model: FilmModel = eqx.field(static=True)

    def force(self, motion: Motion) -> Force:
        place, blur = motion.place, motion.land.centre_width
        x, y, omega = place.x, place.y, motion.cage_speed + motion.land_speed
        px, py = film_drive(x, y, place.vx, place.vy, omega)
        kept = 1 - place.excess * place.per_eps
        m = film_resistance(self.model, kept * x, kept * y, (place.nx, place.ny), px, py, omega, blur)
        half = -self.scale / 2
        fx, fy = jnp.asarray(half * (m.xx * px + m.xy * py)), jnp.asarray(half * (m.xy * px + m.yy * py))
        thrust = supply_force(self.model, (place.nx, place.ny), px, py, omega, blur)
        eps = place.eps - place.excess
        torque = self.drag * inverse_root(1 - eps * eps) * (motion.cage_speed - motion.land_speed)
        return fx + self.supply_scale * thrust[0], fy + self.supply_scale * thrust[1], -torque
