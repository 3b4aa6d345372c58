"""Contacts in the whole bearing: raceways, pockets, guiding land and oil, with their parameters.

Each contact gives one set of numbers, which both bodies use. A raceway contact acts at the middle of the overlap: the
roller's arm is h = D/2 - delta/2, and that of the race ends there too; other arms would leave a couple of traction and
overlap. Line contacts have the damping of Hunt and Crossley, Q = K p^(10/9) (1 + (3/2) alpha delta') >= 0, where p is
the overlap delta cut off smoothly at zero, and alpha the slope of the coefficient of restitution over the approach
speed (K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440). Traction follows Gupta's law, made odd and
smooth: P. K. Gupta, *Advanced Dynamics of Rolling Elements* (Springer 1984), fits measured curves of the traction
coefficient over the sliding speed a >= 0 by kappa_G(a) = (A + B a) exp(-C a) + D. Drag and churning of oil and air are
quadratic: F = -(1/2) C_d rho D l |v| v and M = -(1/2) C_n rho (D/2)^4 l |s| s with the density rho of the mixture
(J. H. Rumbarger, E. G. Filetti and D. Gubernick, J. Lubr. Technol. 95 (1973) 401).
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._arguments import is_concrete
from .._errors import ArgumentError
from .._parameters import choice, parameter
from .._pytrees import Scalar
from ..bearing import LOAD_POWER, STARVATION
from ..forces import ContactForce, FilmForce, Land, Motion, contact_force, inverse_root, power_10_9, smooth_plus


class Raceways(eqx.Module):
    """The contacts of rollers and raceways beyond their stiffness, which the bearing knows."""

    raceway_damping: Scalar = parameter(
        "s/m", 0.0, 10.0, "alpha: loss of restitution over approach speed of the raceway contacts", default=0.1
    )
    raceway_smoothing: Scalar = parameter(
        "m", 1e-12, 1e-6, "half width over which a raceway contact sets in", default=1e-8
    )


def line_load(overlap: Scalar, rate: Scalar, stiffness: Scalar, damping: Scalar, width: Scalar) -> tuple[Array, Array]:
    """Load of a line contact, and its elastic part [N].

    **Arguments:** overlap (negative: apart) [m] and its rate [m/s]; stiffness [N/m^(10/9)], damping [s/m], and the
    length over which contact sets in [m].
    """
    pressed = smooth_plus(overlap, width)
    return contact_force(pressed, rate, stiffness, damping), stiffness * power_10_9(pressed)


class TractionCurve(eqx.Module):
    """Coefficients of kappa(u) = (u/a) [(A + B a) exp(-C a) + D] with a = sqrt(u^2 + u_s^2)."""

    a: Scalar
    b: Scalar
    c: Scalar
    d: Scalar
    smoothing: Scalar
    """u_s, the sliding speed below which the law is linear [m/s]."""

    def __call__(self, sliding: Scalar) -> Array:
        """Traction coefficient at a sliding speed [m/s], of its sign."""
        speed = jnp.sqrt(sliding * sliding + self.smoothing * self.smoothing)
        return sliding / speed * ((self.a + self.b * speed) * jnp.exp(-self.c * speed) + self.d)


class Traction(eqx.Module):
    """Traction curve of the oil, by its values at rest, at the peak and far beyond it."""

    rest: Scalar = parameter("1", 0.0, 0.5, "traction coefficient of Gupta's law at zero sliding", default=0.0)
    peak: Scalar = parameter("1", 1e-4, 0.5, "largest traction coefficient", default=0.05)
    limit: Scalar = parameter("1", 0.0, 0.5, "traction coefficient at large sliding speeds", default=0.036)
    peak_speed: Scalar = parameter("m/s", 1e-3, 100.0, "sliding speed of the largest coefficient", default=1.0)
    traction_smoothing: Scalar = parameter(
        "m/s", 1e-6, 1.0, "sliding speed below which traction is linear in it", default=0.01
    )
    viscosity_exponent: Scalar = parameter(
        "1", 0.0, 2.0, "exponent of the oil's viscosity in the slope of the traction curve", default=0.0
    )

    def __check_init__(self) -> None:
        known = (self.rest, self.peak, self.limit)
        if is_concrete(*known) and np.any(
            np.asarray(self.peak) <= np.maximum(*map(np.asarray, (self.rest, self.limit)))
        ):
            rest, peak, limit = map(float, known)
            raise ArgumentError(
                "peak", said=f"must be above `rest` and `limit`, but is {peak:g} beside {rest:g} and {limit:g}."
            )

    def at(self, thickness: Scalar = 1.0) -> TractionCurve:
        """The law in oil whose viscosity is `thickness` times that for which the curve holds, its `viscosity_1`: there
        its maximum before smoothing is `peak`, exactly at `peak_speed`. Smoothing takes (u_s/u_m)^2/2 of it, 5e-5 by
        default.

        With w = A + B u_m the slope vanishes at u_m if C = B/w, and the value there is the peak if
        w exp(A/w) = e (peak - limit), whose solution is Lambert's function.

        While the oil in the contact is Newtonian, the slope is eta_p/(p h) with the viscosity eta_p at the mean
        pressure p and the film thickness h (C. R. Evans and K. L. Johnson, Proc. IMechE C 200 (1986) 313). With
        Roelands' law, eta_p grows as the viscosity to the power (1 + p/196 MPa)^0.6, and h as its power 0.78 (D. Dowson
        and G. R. Higginson, with Roelands' pressure coefficient). The exponent of the slope is the difference: 0.6 at
        0.15 GPa, 1.4 at 0.5 GPa. Peak and limit are left as they are: above a few MPa of shear they depend on the
        logarithm of the viscosity only.
        """
        a = self.rest - self.limit
        above = jnp.exp(1.0) * (self.peak - self.limit)
        w = above * jnp.exp(lambert_w(-a / above))
        b = (w - a) / (self.peak_speed * thickness**-self.viscosity_exponent)
        return TractionCurve(a, b, b / w, self.limit, self.traction_smoothing)


def lambert_w(x: Scalar) -> Array:
    """The upper branch of w exp(w) = x for x > -1/e. Differentiable three times.

    Newton's method descends to the root from log(1 + x), which is at or above it, and from 0 if x is negative.
    """
    x = jnp.asarray(x, dtype=float)

    def better(_: Any, w: Array) -> Array:
        e = jnp.exp(w)
        return w - (w * e - x) / (e * (w + 1))

    root = jax.lax.fori_loop(0, 63, better, jnp.log1p(jnp.maximum(x, 0.0)))
    return better(None, better(None, jax.lax.stop_gradient(root)))  # two steps carry first to third derivatives


class Pockets(eqx.Module):
    """The contact of rollers and cage bars; their clearance is the bearing's."""

    pocket_stiffness: Scalar = parameter("N/m", 0.0, 1e12, "stiffness K_p of a bar under a roller")
    pocket_damping: Scalar = parameter(
        "s/m", 0.0, 100.0, "alpha: loss of restitution over approach speed of the pocket contacts", default=0.1
    )
    pocket_friction: Scalar = parameter("1", 0.0, 1.0, "friction coefficient of rollers on bars", default=0.05)
    saturation_speed: Scalar = parameter(
        "m/s", 1e-6, 10.0, "sliding speed at which dry friction has 0.7 of its limit", default=0.02
    )
    pocket_smoothing: Scalar = parameter(
        "m", 1e-12, 1e-5, "half width over which a pocket contact sets in", default=1e-7
    )
    pocket_exponent: Scalar = parameter("1", 1.0, 2.0, "exponent of the overlap with `power`", default=10 / 9)
    pocket_reference: Scalar = parameter(
        "m", 1e-9, 1e-3, "overlap at which `power` is as stiff as `linear`", default=1e-6
    )
    pocket_law: str = choice(
        "linear", "power", text="force of a bar: linear in the overlap or a power", default="linear"
    )

    def elastic(self, overlap: Scalar) -> Array:
        """Elastic force [N] at an overlap (negative: apart) [m]."""
        pressed = smooth_plus(overlap, self.pocket_smoothing)
        if self.pocket_law == "linear":
            return self.pocket_stiffness * pressed
        touching = pressed > 0
        ratio = jnp.where(touching, pressed, self.pocket_reference) / self.pocket_reference
        return self.pocket_stiffness * pressed * ratio ** (self.pocket_exponent - 1)


def saturated(sliding: Scalar, speed: Scalar) -> Array:
    """Odd and smooth stand-in for the sign of a sliding speed [m/s]: its slope at rest is 1/`speed`."""
    return sliding * inverse_root(sliding * sliding + speed * speed)


class RollerDrag(eqx.Module):
    """Drag, churning and rolling resistance of rollers, none by default; `bearing.oil_drag` has the laws."""

    drag_coefficient: Scalar = parameter(
        "1", 0.0, 10.0, "drag coefficient C_d of a roller's centre; with `cylinder` times a cylinder's", default=0.0
    )
    churning_coefficient: Scalar = parameter("1", 0.0, 10.0, "churning coefficient C_n of its spin", default=0.0)
    oil_share: Scalar = parameter("1", 0.0, 1.0, "share of oil in the volume between the rings", default=0.02)
    rolling_coefficient: Scalar = parameter(
        "1", 0.0, 1e-4, "R_1 of SKF's rolling resistance, in mm, N, rpm, mm^2/s", default=1.2e-6
    )
    drag_law: str = choice(
        "constant", "cylinder", text="drag coefficient: constant, or by Reynolds number", default="constant"
    )
    rolling_law: str = choice(
        "none", *STARVATION, text="supply of oil for the rolling resistance; or none of it", default="none"
    )


class RacewayForces(NamedTuple):
    """Forces of one raceway on a roller."""

    load: Scalar
    """Q [N], pressing roller and raceway apart."""
    traction: Scalar
    """T [N] on the roller, counter-clockwise about the ring's centre."""
    arm: Scalar
    """h from the roller's centre [m]."""
    race_arm: Scalar
    """Distance of the contact from the ring's centre [m]."""
    lost_in_sliding: Scalar
    """Power of the traction [W]."""
    lost_in_damping: Scalar
    """Power of Q beyond its elastic part [W]."""
    sliding: Scalar
    """Speed of the raceway beyond that of the roller's surface, where they meet or would meet [m/s]."""


class RacewayConstants(NamedTuple):
    """Constants of a raceway contact."""

    half: Scalar
    """D/2 [m]."""
    radius: Scalar
    """Radius of the raceway [m]."""
    speed: Scalar
    """Speed of its ring [rad/s]."""
    stiffness: Scalar
    damping: Scalar
    smoothing: Scalar
    curve: TractionCurve
    rolling: Scalar | None
    """Couple of rolling resistance at a load of 1 N [N m], if it is considered."""


LIGHT = 1.0
"""Load [N] below which the couple of rolling resistance falls to zero in proportion."""
SLOW = 1.0
"""Speed of rolling [rad/s] below which it does so too."""


def rolling_resistance(at: RacewayConstants, load: Scalar, spin: Scalar) -> Scalar:
    """Couple on a roller against its rotation relative to a ring [N m]: its constant times Q^0.31."""
    assert at.rolling is not None
    return -at.rolling * load * (load + LIGHT) ** (LOAD_POWER - 1) * saturated(spin - at.speed, SLOW)


def raceway_contact(
    at: RacewayConstants, outer: bool, distance: Scalar, away: Scalar, across: Scalar, spin: Scalar
) -> RacewayForces:
    """The outer or inner raceway on a roller; T and Q are along the tangent and the radius of the raceway.

    **Arguments:** constants; which raceway; distance of the roller's centre from the ring's [m]; velocity of the roller
    relative to the ring's centre, away from it and across (counter-clockwise) [m/s]; spin.
    """
    sense = 1.0 if outer else -1.0
    overlap = distance + at.half - at.radius if outer else at.radius + at.half - distance
    load, elastic = line_load(overlap, sense * away, at.stiffness, at.damping, at.smoothing)
    arm = at.half - overlap / 2
    race_arm = distance + sense * arm
    sliding = at.speed * race_arm - (across + sense * spin * arm)
    traction = at.curve(sliding) * load
    return RacewayForces(load, traction, arm, race_arm, traction * sliding, (load - elastic) * sense * away, sliding)


class PocketForces(NamedTuple):
    """Forces of the bars on a roller."""

    along: Scalar
    """Force on the roller along the pocket's tangent t_j [N]."""
    out: Scalar
    """Force on the roller along the pocket's radius n_j [N]."""
    roller_moment: Scalar
    """Moment on the roller [N m]."""
    cage_moment: Scalar
    """Moment on the cage about its centre [N m]."""
    normal: Scalar
    """N [N]."""
    lost_in_sliding: Scalar
    lost_in_damping: Scalar
    rubbing: Scalar
    """N times the sliding speed [W]."""


def pocket_contact(
    model: Any, out: Scalar, along: Scalar, v_out: Scalar, v_along: Scalar, spin: Scalar, cage_speed: Scalar
) -> PocketForces:
    """The bars on a roller.

    **Arguments:** the `BearingModel`; place of the roller's centre from the cage's, along n_j and t_j of its pocket
    [m]; velocity of the roller's centre relative to the cage's, not to the turning pocket [m/s]; spin and cage speed
    [rad/s].
    """
    law, half = model.pockets, model.bearing.roller_diameter / 2
    side = jnp.where(along >= 0, 1.0, -1.0)
    rate = side * (v_along - cage_speed * out)
    overlap = side * along - model.bearing.pocket_clearance / 2
    elastic = law.elastic(overlap)
    normal = elastic * smooth_plus(1 + 1.5 * law.pocket_damping * rate, 1e-4)
    sliding = v_out + cage_speed * along - side * half * (spin - cage_speed)
    friction = -law.pocket_friction * normal * saturated(sliding, law.saturation_speed)
    return PocketForces(
        along=-side * normal,
        out=friction,
        roller_moment=-side * half * friction,
        cage_moment=out * side * normal + (along + side * half) * friction,
        normal=normal,
        lost_in_sliding=-friction * sliding,
        lost_in_damping=(normal - elastic) * rate,
        rubbing=normal * jnp.abs(sliding),
    )


class LandForces(NamedTuple):
    """Forces of the land on the cage; the land gets the opposite force at its centre, and its own moment."""

    x: Scalar
    y: Scalar
    moment: Scalar
    """Moment on the cage about its centre [N m]."""
    land_moment: Scalar
    """Moment on the land about its centre [N m]."""
    lost_in_film: Scalar
    lost_in_contact: Scalar
    rubbing: Scalar
    """Normal force of the contact times its sliding speed [W]."""
    size: Scalar
    """Whole force [N]."""
    eps: Scalar
    """Eccentricity ratio."""
    whirl: Scalar
    """Angular speed of the line of centres [rad/s]."""


class Guide(eqx.Module):
    """The land's laws with their constants."""

    film: FilmForce
    contact: ContactForce
    land: Land
    friction: Scalar
    saturation_speed: Scalar
    arm: Scalar
    """Distance from the cage's centre to the contact along the line of centres; negative for a land inside it [m]."""


def land_forces(
    guide: Guide, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar, cage_speed: Scalar, land_speed: Scalar
) -> LandForces:
    """Forces and moments between land and cage.

    **Arguments:** place [m] and velocity [m/s] of the cage's centre relative to the land's; both speeds [rad/s].
    """
    sense = jnp.where(cage_speed + land_speed >= 0, 1.0, -1.0)
    motion = Motion(0.0, sense * x, y, sense * vx, vy, sense * cage_speed, sense * land_speed, 0.0, guide.land)
    film_x, film_y, drag = guide.film.force(motion)
    push_x, push_y, _ = guide.contact.force(motion)
    film_x, drag, push_x = sense * film_x, sense * drag, sense * push_x
    couple = (x * film_y - y * film_x) / 2  # both sides bear half of the moment that the film's force leaves
    on_cage, on_land = drag - couple, -drag - couple
    film_loss = -(film_x * vx + film_y * vy + on_cage * cage_speed + on_land * land_speed)

    place, c = motion.place, guide.land.clearance
    nx, ny = sense * place.nx, place.ny
    outward = nx * vx + ny * vy
    pressed = c * place.excess
    normal = contact_force(pressed, outward, guide.contact.stiffness, guide.contact.damping)
    land_arm = guide.arm + c * place.eps
    sliding = nx * vy - ny * vx + cage_speed * guide.arm - land_speed * land_arm
    rub = -guide.friction * normal * saturated(sliding, guide.saturation_speed)
    damped = (normal - guide.contact.stiffness * power_10_9(pressed)) * outward
    force_x, force_y = film_x + push_x - rub * ny, film_y + push_y + rub * nx
    return LandForces(
        x=force_x,
        y=force_y,
        moment=on_cage + guide.arm * rub,
        land_moment=on_land - land_arm * rub,
        lost_in_film=film_loss,
        lost_in_contact=damped - rub * sliding,
        rubbing=normal * jnp.abs(sliding),
        size=jnp.sqrt(force_x * force_x + force_y * force_y + 1e-12),
        eps=place.eps,
        whirl=(x * vy - y * vx) / (c * place.eps) ** 2,
    )
