"""The oil film of the guiding lands as a force on the cage.

Beyond the onset of land contact the film keeps the coefficients that it has there: the clearance circle is where they
would be infinite.
"""

import equinox as eqx
import jax.numpy as jnp

from .._parameters import choice, count, parameter
from .._types import Scalar
from ._film import FilmModel, film_drive, film_resistance, film_scale, fixed_arc, supply_force
from ._motion import AbstractForce, Force, GuidedCage, Motion, Rows
from ._smooth import inverse_root


class RibFilm(eqx.Module):
    """The oil film of the guiding lands: how many, how wide, and which film model."""

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

    def slopes(self, motion: Motion) -> tuple[Rows, Rows] | None:
        """Closed form for a fixed arc.

        A displacement u turns the line of centres n by dn = (u - n n.u)/eps and t = (-n_y, n_x), across it, by as much.
        """
        if self.model == "positive_pressure":
            return None
        place, per_c, omega = motion.place, motion.land.per_clearance, motion.cage_speed + motion.land_speed
        nx, ny, per_eps = place.nx, place.ny, place.per_eps
        px, py = film_drive(place.x, place.y, place.vx, place.vy, omega)
        p_n, p_t = nx * px + ny * py, nx * py - ny * px
        # The film is at w n, shorter than the cage's place by the excess, and than w by the length that rounds n off.
        w, open_, length = place.eps - place.excess, 1 - place.touch, nx * nx + ny * ny
        inverse, isotropic, radial, skew = fixed_arc(self.model, w * w * length)
        steep = w * (w * (1 - length) * per_eps + length * open_)  # half of the square's derivative along n
        # M P = isotropic P + b n p_n - g (n p_t + t p_n)
        b, g = radial * w * w, skew * w
        d_b, d_g = radial * w * (5 * inverse * steep * w + 2 * open_), skew * (4 * inverse * steep * w + open_)
        of_pn = ((px - p_n * nx) * per_eps - omega * ny, (py - p_n * ny) * per_eps + omega * nx)
        of_pt = ((py - p_t * nx) * per_eps - omega * nx, (-px - p_t * ny) * per_eps - omega * ny)
        along_n, along_t = d_b * p_n - d_g * p_t, d_g * p_n
        of_n = [along_n * n + b * x - g * y for n, x, y in zip((nx, ny), of_pn, of_pt, strict=True)]
        of_t = [along_t * n + g * x for n, x in zip((nx, ny), of_pn, strict=True)]
        half = -self.scale / 2 * per_c
        thrust = 2 * self.supply_scale * per_c if self.model == "fixed_half" else 0.0
        swelling, turning = radial * steep, (b * p_n - g * p_t) * per_eps
        across = (thrust - half * g * p_n) * per_eps
        shear = isotropic * omega
        of_q = (
            (
                half * (swelling * px * nx + turning * (1 - nx * nx) + nx * of_n[0] + ny * of_t[0]) + across * nx * ny,
                half * (swelling * px * ny + shear - turning * nx * ny + nx * of_n[1] + ny * of_t[1])
                - across * (1 - ny * ny),
            ),
            (
                half * (swelling * py * nx - shear - turning * nx * ny + ny * of_n[0] - nx * of_t[0])
                + across * (1 - nx * nx),
                half * (swelling * py * ny + turning * (1 - ny * ny) + ny * of_n[1] - nx * of_t[1]) - across * nx * ny,
            ),
        )
        drag, skewed = 2 * half, 2 * g * nx * ny
        xy = drag * (b * nx * ny - g * (nx * nx - ny * ny))
        of_v = (
            (drag * (isotropic + b * nx * nx + skewed), xy),
            (xy, drag * (isotropic + b * ny * ny - skewed)),
        )
        return of_q, of_v
