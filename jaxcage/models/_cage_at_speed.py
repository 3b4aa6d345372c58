"""The cage's forces at one speed, with everything that does not change during a revolution worked out once."""

from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._types import Scalar, State
from ..bearing import load_distribution
from ..forces import (
    Cross,
    ElasticRib,
    FilmModel,
    PulseTrain,
    RollerPassImpact,
    contact_force,
    contact_slopes,
    cross_force,
    cubic_stiffness,
    effective_eccentricity,
    film_drive,
    film_resistance,
    film_scale,
    finite_film_force,
    polar_resistance,
    pulse_train,
    pulse_train_force,
    restitution_damping,
    rib_force,
    smooth_norm,
    smooth_plus,
    smooth_plus_slope,
    spring_force,
    supply_force,
    support_slopes,
    synchronous_amplitude,
    synchronous_force,
    unbalance_force,
    weight,
)


if TYPE_CHECKING:
    from ._cage import CageModel


Vector = tuple[Scalar, Scalar]
Rows = tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]


class CageForces(NamedTuple):
    """Each force on the cage as (F_x, F_y) [N]."""

    film: Vector
    contact: Vector
    support: Vector
    impact: Vector
    unbalance: Vector
    weight: Vector


class CageAtSpeed(eqx.Module):
    """Numbers that stay constant during a revolution, in SI units, and the force laws on them."""

    omega: Scalar
    mass: Scalar
    clearance: Scalar
    eccentricity: Scalar
    film_scale: Scalar
    supply_scale: Scalar
    slenderness: Scalar
    damping_number: Scalar
    stiffness_x: Scalar
    stiffness_y: Scalar
    support_damping: Scalar
    cubic_stiffness: Scalar
    cross_stiffness: Scalar
    cross_cubic: Scalar
    contact_stiffness: Scalar
    contact_onset: Scalar
    contact_approach_speed: Scalar
    contact_smoothing: Scalar
    film_smoothing: Scalar
    gravity: Scalar
    impact: Array | PulseTrain
    n_rollers: int = eqx.field(static=True)
    film_model: FilmModel = eqx.field(static=True)
    cross: Cross = eqx.field(static=True)

    @classmethod
    def of(cls, model: "CageModel", omega: Scalar) -> "CageAtSpeed":
        """Work out the constants of `model` at cage speed `omega` [rad/s]."""
        film, contact, support = model.film, model.contact, model.support
        c, radius = model.clearance, model.land_radius
        stiffness = (support.stiffness_x + support.stiffness_y) / 2
        return cls(
            omega=omega,
            mass=model.cage_mass,
            clearance=c,
            eccentricity=effective_eccentricity(
                model.unbalance, model.eccentricity, model.guidance_gap, model.printed_unit
            ),
            film_scale=film.n_lands * film_scale(model.lubricant.dynamic_viscosity, radius, film.land_width, c),
            supply_scale=film.n_lands * radius * film.land_width * film.supply_pressure,
            slenderness=film.land_width / (2 * radius),
            damping_number=restitution_damping(contact.restitution),
            stiffness_x=support.stiffness_x,
            stiffness_y=support.stiffness_y,
            support_damping=support.damping,
            cubic_stiffness=cubic_stiffness(support.cubic, support.cubic_stiffness, support.cubic_ratio, stiffness, c),
            cross_stiffness=support.cross_stiffness,
            cross_cubic=support.cross_cubic,
            contact_stiffness=contact.stiffness,
            contact_onset=contact.onset,
            contact_approach_speed=contact.approach_speed,
            contact_smoothing=contact.smoothing / c,
            film_smoothing=film.smoothing / c,
            gravity=model.gravity,
            impact=_impact(model, omega),
            n_rollers=model.bearing.n_rollers,
            film_model=film.model,
            cross=support.cross,
        )

    def land_forces(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> tuple[Vector, Vector]:
        """Film and contact force for the cage centre at (x, y) [m] from the rib centre, moving at (vx, vy) [m/s]."""
        # Divisions and roots are what a step costs: constants are inverted once, the eccentricity once.
        c, per_c = self.clearance, 1 / self.clearance
        x, y, vx, vy = x * per_c, y * per_c, vx * per_c, vy * per_c
        eps = smooth_norm(x, y, self.film_smoothing)
        per_eps = 1 / eps
        n = (x * per_eps, y * per_eps)
        excess = smooth_plus(eps - self.contact_onset, self.contact_smoothing)
        px, py = film_drive(x, y, vx, vy, self.omega)
        kept = 1 - excess * per_eps  # the film's coefficients stay at their value at the onset of contact
        film = self._film(kept * x, kept * y, n, px, py)
        arc = "positive_pressure" if self.film_model == "finite_length" else self.film_model
        thrust = supply_force(arc, n, px, py, self.omega, self.film_smoothing)
        film = film[0] + self.supply_scale * thrust[0], film[1] + self.supply_scale * thrust[1]
        rate = n[0] * vx + n[1] * vy
        normal = contact_force(
            c * excess, c * rate, self.contact_stiffness, self.damping_number, self.contact_approach_speed
        )
        return film, (-normal * n[0], -normal * n[1])

    def _film(self, x: Scalar, y: Scalar, n: Vector, px: Scalar, py: Scalar) -> Vector:
        """The film's force [N] at (x, y) over clearance, for the drive P."""
        if self.film_model == "finite_length":
            fx, fy = finite_film_force(x, y, px, py, self.omega, self.slenderness, self.film_smoothing)
            return jnp.asarray(self.film_scale * fx), jnp.asarray(self.film_scale * fy)
        m = film_resistance(self.film_model, x, y, n, px, py, self.omega, self.film_smoothing)
        half = -self.film_scale / 2
        return jnp.asarray(half * (m.xx * px + m.xy * py)), jnp.asarray(half * (m.xy * px + m.yy * py))

    def slopes(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> tuple[Rows, Rows]:
        """Derivatives of land and support forces with respect to position [N/m] and velocity [N s/m], as rows.

        In closed form, in the frame (n, t) of the line of centres: dn = t (t.u)/eps and dt = -n (t.u)/eps for a
        displacement u. For the film models with a fixed arc; exact outside the film's smoothing length of the centre.
        """
        c, per_c = self.clearance, 1 / self.clearance
        ex, ey, ux, uy = x * per_c, y * per_c, vx * per_c, vy * per_c
        eps = smooth_norm(ex, ey, self.film_smoothing)
        per_eps = 1 / eps
        nx, ny = ex * per_eps, ey * per_eps
        gap = eps - self.contact_onset
        excess, touch = smooth_plus(gap, self.contact_smoothing), smooth_plus_slope(gap, self.contact_smoothing)
        px, py = film_drive(ex, ey, ux, uy, self.omega)
        p_n, p_t = nx * px + ny * py, nx * py - ny * px
        assert self.film_model == "fixed_half" or self.film_model == "full"
        m = polar_resistance(self.film_model, eps - excess)
        open_ = 1 - touch  # how much of a change of eps the film's coefficients see
        half = -self.film_scale / 2 * per_c
        at_centre, turning = p_n * per_eps, p_t * per_eps
        film = (
            (
                open_ * ((m.d_a + m.d_b) * p_n - m.d_g * p_t) + m.g * self.omega,
                (m.a + m.b) * self.omega + m.b * turning + 2 * m.g * at_centre,
            ),
            (
                open_ * (m.d_a * p_t - m.d_g * p_n) - m.a * self.omega,
                m.b * at_centre - m.g * (2 * turning + self.omega),
            ),
        )
        thrust = self.supply_scale * per_c * per_eps * (2 if self.film_model == "fixed_half" else 0)
        law = (self.contact_stiffness, self.damping_number, self.contact_approach_speed)
        rate = c * (nx * ux + ny * uy)
        normal = contact_force(c * excess, rate, *law)
        stiff, damp = contact_slopes(c * excess, rate, *law)
        slip = (nx * uy - ny * ux) * per_eps
        polar = (
            (half * film[0][0] - stiff * touch, half * film[0][1] - damp * slip - thrust),
            (half * film[1][0], half * film[1][1] - normal * per_c * per_eps),
        )
        drag = 2 * half
        moving = ((drag * (m.a + m.b) - damp, -drag * m.g), (-drag * m.g, drag * m.a))
        held = support_slopes(
            self.cross,
            x,
            y,
            self.stiffness_x,
            self.stiffness_y,
            self.cubic_stiffness,
            self.cross_stiffness,
            self.cross_cubic,
        )
        of_q, of_v = _turned(polar, nx, ny), _turned(moving, nx, ny)
        b = self.support_damping
        return (
            ((of_q[0][0] + held[0][0], of_q[0][1] + held[0][1]), (of_q[1][0] + held[1][0], of_q[1][1] + held[1][1])),
            ((of_v[0][0] - b, of_v[0][1]), (of_v[1][0], of_v[1][1] - b)),
        )

    def solved_slopes(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> tuple[Rows, Rows]:
        """The same of a film whose pressure is solved for: one solve, differentiated along all four at once."""

        def held(state: Array) -> Array:
            film, contact = self.land_forces(*state)
            support = self.support_force(*state)
            return jnp.stack([film[i] + contact[i] + support[i] for i in (0, 1)])

        (a, b), (c, d) = jax.jacfwd(held)(jnp.stack([jnp.asarray(s) for s in (x, y, vx, vy)])).reshape(2, 2, 2)
        return ((a[0], a[1]), (c[0], c[1])), ((b[0], b[1]), (d[0], d[1]))

    def support_force(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> Vector:
        """Force of the elastic support for the same relative motion."""
        spring = spring_force(x, y, self.stiffness_x, self.stiffness_y, self.cubic_stiffness)
        cross = cross_force(self.cross, x, y, self.cross_stiffness, self.cross_cubic)
        return (
            spring[0] + cross[0] - self.support_damping * vx,
            spring[1] + cross[1] - self.support_damping * vy,
        )

    def impact_force(self, tau: Scalar) -> Vector:
        """Force of the rollers on the cage at phase tau."""
        if isinstance(self.impact, PulseTrain):
            return pulse_train_force(tau, self.impact, self.n_rollers)
        return synchronous_force(tau, self.impact)

    def forces(self, tau: Scalar, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> CageForces:
        """Every force on the cage, for the cage centre at (x, y) from the rib centre."""
        film, contact = self.land_forces(x, y, vx, vy)
        return CageForces(
            film=film,
            contact=contact,
            support=self.support_force(x, y, vx, vy),
            impact=self.impact_force(tau),
            unbalance=unbalance_force(tau, self.mass, self.eccentricity, self.omega),
            weight=weight(self.mass, self.gravity),
        )


def _times(factor: Scalar, k: Rows) -> Rows:
    (xx, xy), (yx, yy) = k
    return (factor * xx, factor * xy), (factor * yx, factor * yy)


def _turned(k: Rows, nx: Scalar, ny: Scalar) -> Rows:
    """A matrix in the frame (n, t), with t = (-ny, nx), in Cartesian coordinates."""
    (nn, nt), (tn, tt) = k
    xx, xy, yy = nx * nx, nx * ny, ny * ny
    both = nt + tn
    return (
        (nn * xx - both * xy + tt * yy, (nn - tt) * xy + nt * xx - tn * yy),
        ((nn - tt) * xy + tn * xx - nt * yy, nn * yy + both * xy + tt * xx),
    )


def _impact(model: "CageModel", omega: Scalar) -> Array | PulseTrain:
    if not isinstance(model.impact, RollerPassImpact):
        law = model.impact
        return synchronous_amplitude(omega, law.amplitude, law.reference_speed, law.exponent)
    bearing = model.bearing
    zone = load_distribution(bearing, model.load)
    return pulse_train(
        model.impact, omega, zone.half_angle, bearing.n_rollers, bearing.roller_mass, bearing.pocket_clearance
    )


class RigidRibLaw(eqx.Module):
    """Acceleration of a cage in a rib that does not move."""

    cage: CageAtSpeed

    def __call__(self, tau: Scalar, q: State, v: State) -> State:
        f = self.cage.forces(tau, *q, *v)
        per_mass = 1 / self.cage.mass
        return per_mass * sum(p[0] for p in f), per_mass * sum(p[1] for p in f)

    def slopes(self, q: State, v: State) -> tuple[Rows, Rows] | None:
        """Derivatives with respect to q and v, as rows, where the film's arc is fixed or its pressure is solved for."""
        if self.cage.film_model == "positive_pressure":
            return None
        per_mass = 1 / self.cage.mass
        solved = self.cage.film_model == "finite_length"
        of_q, of_v = (self.cage.solved_slopes if solved else self.cage.slopes)(*q, *v)
        return _times(per_mass, of_q), _times(per_mass, of_v)


class ElasticRibLaw(eqx.Module):
    """Acceleration of cage and rib: film, contact and support act on their difference and react on the rib."""

    cage: CageAtSpeed
    rib: ElasticRib
    gravity: Scalar

    def __call__(self, tau: Scalar, q: State, v: State) -> State:
        (xc, yc, xo, yo), (uc, wc, uo, wo) = q, v
        f = self.cage.forces(tau, xc - xo, yc - yo, uc - uo, wc - wo)
        rib = self.rib
        held = rib_force(xo, yo, uo, wo, rib.stiffness, rib.damping, rib.cubic_stiffness)
        down = weight(rib.mass, self.gravity)
        on_cage = [sum(p[i] for p in f) for i in (0, 1)]
        on_rib = [held[i] + down[i] - (f.film[i] + f.contact[i] + f.support[i]) for i in (0, 1)]
        return (*(c / self.cage.mass for c in on_cage), *(c / rib.mass for c in on_rib))
