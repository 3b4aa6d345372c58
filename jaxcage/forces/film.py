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

from .._parameters import choice, count, parameter
from .._pytrees import Scalar
from .elementary import inverse_root
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
    return jnp.asarray(viscosity * radius * width * (width / clearance) ** 2)


def half_circle_resistance(x: Scalar, y: Scalar, ux: Scalar, uy: Scalar) -> Resistance:
    """Resistance matrix M over the half circle centred on the unit vector u = (ux, uy), in closed form.

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


def film_drive(x: Scalar, y: Scalar, vx: Scalar, vy: Scalar, omega: Scalar) -> Vector:
    """Film drive P = 2 v - omega (-y, x): squeeze and entrainment, in clearances per second."""
    return 2 * vx + omega * y, 2 * vy - omega * x


def arc_centre(model: FilmModel, direction: Vector, drive: Vector, least: Scalar) -> Vector:
    """Unit vector u to the middle of the pressurised half circle; (0, 0) for `full`.

    **Arguments:** film model; direction of the position; drive P; a small drive that regularises the direction of P
    where P = 0.
    """
    if model == "full":
        return 0.0, 0.0
    if model == "fixed_half":
        return direction[1], -direction[0]
    px, py = drive
    per_norm = inverse_root(px * px + py * py + least**2 + 1e-300)  # 1e-300: no 0/0 at rest
    return px * per_norm, py * per_norm


def film_resistance(model: FilmModel, x: Scalar, y: Scalar, direction: Vector, arc: Vector) -> Resistance:
    """Resistance matrix M of a film model.

    Over the whole circle it is isotropic I + radial r r^T. Over the half circle that trails the line of centres (alpha
    from 0 to pi), as in (27), it is half of that minus skew (n r'^T + r' n^T) with r' = (-y, x).

    **Arguments:** film model; position (x, y) over clearance, and its direction n as a unit vector, regularised at the
    centre, where the fixed arc is undefined; the arc as from `arc_centre`.
    """
    if model == "positive_pressure":
        return half_circle_resistance(x, y, *arc)
    inverse = 1 / (1 - (x * x + y * y))
    isotropic = (jnp.pi if model == "full" else jnp.pi / 2) * inverse * jnp.sqrt(inverse)
    radial = 3 * isotropic * inverse
    xx, xy, yy = isotropic + radial * x * x, radial * x * y, isotropic + radial * y * y
    if model == "full":
        return Resistance(xx, xy, yy)
    (nx, ny), skew = direction, 2 * inverse * inverse
    return Resistance(xx + 2 * skew * nx * y, xy - skew * (nx * x - ny * y), yy - 2 * skew * nx * y)


class RibFilm(AbstractLaw):
    """Oil film of the guiding lands: their number and width, supply pressure and film model."""

    law_name = "film"

    land_width: Scalar = parameter("m", 1e-4, 0.05, "width of one guiding land", kind="drawing")
    smoothing: Scalar = parameter(
        "m", 1e-12, 1e-5, "length that keeps the film differentiable at the centre", default=1e-9
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
    """R L p_0 of all lands [N]. The thrust of a uniform gauge pressure on the half circle centred on u is -2 R L p_0 u,
    the paper's last term of (27): +2 R L p_0 along +phi, since the fixed half is centred on -phi."""
    drag: Scalar
    """2 pi mu R^3 L/c of all lands [N m s]: the torque per relative speed of a centred cage."""
    model: FilmModel = eqx.field(static=True)

    def force(self, motion: Motion) -> Force:
        place, direction = motion.place, (motion.place.nx, motion.place.ny)
        omega = motion.cage_speed + motion.land_speed
        px, py = film_drive(place.x, place.y, place.vx, place.vy, omega)
        ux, uy = arc_centre(self.model, direction, (px, py), motion.land.centre_width * omega)
        kept = 1 - place.excess * place.per_eps
        m = film_resistance(self.model, kept * place.x, kept * place.y, direction, (ux, uy))
        half, thrust = -self.scale / 2, -2 * self.supply_scale
        eps = place.eps - place.excess
        torque = self.drag * inverse_root(1 - eps * eps) * (motion.cage_speed - motion.land_speed)
        return (
            half * (m.xx * px + m.xy * py) + thrust * ux,
            half * (m.xy * px + m.yy * py) + thrust * uy,
            -torque,
        )
