"""Equations of motion of the whole bearing at one shaft speed.

The independent variable is the cage's angle. Rollers are an axis of arrays. Each contact is computed once, and
both bodies get the same numbers of it: forces and moments inside the bearing cancel to rounding. Rates of the
rollers contain the cage's speed, but not its acceleration: rollers are coupled only through cage and inner ring.

Cage, with mass centre G at distance e from C along n = (cos theta, sin theta), t across, all outer forces F_C (weight
too) and the moment tau_C of the contacts about C:
    M C'' = F_C + M e (omega^2 n - omega' t),   J_G omega' = tau_C - e M g cos theta - e t.F_C.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._pytrees import Scalar, State
from ..forces import cos_sin
from .bearing_states import LOST, BearingState, Bodies, Rates, Rollers, bodies_of, rollers_of
from .contacts import (
    Guide,
    LandForces,
    PocketForces,
    RacewayConstants,
    RacewayForces,
    land_forces,
    pocket_contact,
    raceway_contact,
    rolling_resistance,
)
from .field import AbstractField


Many = Float[Array, "*rollers"] | float | int
"""A number of all rollers, or of one."""

STALLED = 0.05
"""Speed of the cage over that of pure rolling below which its angle is no measure of progress."""

NO_SPIN = 1e-9
"""Spin of a rolling roller over the cage's speed that is rounding: surfaces of both rings move at one speed."""


class Geometry(NamedTuple):
    """Directions of pockets, and of rollers from both ring centres."""

    pocket_cos: Many
    pocket_sin: Many
    lag_cos: Many
    lag_sin: Many
    cos: Many
    """Cosine of the roller's angle about the outer ring's centre."""
    sin: Many
    distance: Many
    """Distance of the roller from the inner ring's centre [m]."""
    inner_out: Many
    """Direction from the inner ring's centre to the roller, along the roller's radius and across."""
    inner_across: Many


class Forces(NamedTuple):
    """All contacts of the bearing at one moment; of one roller, `land` is left out."""

    geometry: Geometry
    outer: RacewayForces
    inner: RacewayForces
    pocket: PocketForces
    drag_out: Many
    drag_across: Many
    churning: Many
    drag_power: Many
    rolling: tuple[Many, Many] | None = None
    """Couples of rolling resistance of outer and inner ring on the roller, where they are considered [N m]."""
    land: LandForces | None = None


class Passed(NamedTuple):
    """Forces, moments and powers that a roller passes on to cage, rings and ledger, or their sums over all rollers."""

    x: Many
    """Force of the cage on the roller [N]."""
    y: Many
    cage_moment: Many
    """Moment on the cage about its centre [N m]."""
    inner_x: Many
    """Force of the inner ring on the roller [N]."""
    inner_y: Many
    inner_moment: Many
    """Moment of traction and rolling resistance on the roller about the ring's centre [N m]."""
    outer_moment: Many
    traction: Many
    """Powers that are lost [W], to `drag`."""
    raceway_damping: Many
    pocket_friction: Many
    pocket_damping: Many
    drag: Many
    normal: Many
    """Pocket force [N]."""
    spin: Many
    """Over the number of rollers [rad/s]."""
    rubbing: Many
    """Pocket force times sliding speed [W]."""


MOVING = 7
"""Number of entries of `Passed`, the first ones, that move cage and rings."""


class BearingAtSpeed(AbstractField):
    """The laws of the bearing at one shaft speed, with all constants computed."""

    model: Any
    """The `BearingModel`."""
    speed: Scalar
    """Speed of the inner ring [rad/s]."""
    outer_race: RacewayConstants
    inner_race: RacewayConstants
    guide: Guide
    roller_mass: Scalar
    roller_inertia: Scalar
    drag: Scalar
    churning: Scalar
    rolling_cage_speed: Scalar
    rolling_spin: Scalar

    @property
    def n_rollers(self) -> int:
        """Number of rollers."""
        return self.model.bearing.n_rollers

    def __call__(self, tau: Scalar, y: State) -> State:
        """Rates of a row of the state at the cage's angle `tau`."""
        clock = jnp.stack([jnp.asarray(tau, dtype=float), jnp.zeros(())])
        row = jnp.stack([jnp.asarray(c, dtype=float) for c in y])
        rates = self.rates(BearingState(rollers_of(row), bodies_of(row), clock)).state
        return tuple(self.pace(rates.clock[0]) * rates.row)

    def pace(self, cage_speed: Scalar) -> Scalar:
        """Factor from rates over time to rates over the cage's angle, counted in its sense."""
        return 1 / jnp.abs(cage_speed)

    @property
    def places(self) -> np.ndarray:
        """Angles of the pockets in the cage [rad]."""
        return 2 * np.pi / self.n_rollers * np.arange(self.n_rollers)

    def forces(self, state: BearingState) -> Forces:
        """Every contact at a state."""
        return self.on_rollers(state)._replace(land=self.on_land(Bodies(*state.bodies)))

    def on_rollers(self, state: BearingState) -> Forces:
        """Every contact of the rollers."""
        each = jax.vmap(self.on_roller, in_axes=(0, None, 0, 0))
        return each(Rollers(*state.rollers), Bodies(*state.bodies), *self.pockets(state.clock[0]))

    def pockets(self, angle: Scalar) -> tuple[Array, Array]:
        """Cosine and sine of the pockets' angles at an angle of the cage."""
        cos, sin = cos_sin(angle)
        table_cos, table_sin = jnp.asarray(np.cos(self.places)), jnp.asarray(np.sin(self.places))
        return cos * table_cos - sin * table_sin, sin * table_cos + cos * table_sin

    def on_roller(self, rollers: Rollers, cage: Bodies, pocket_cos: Scalar, pocket_sin: Scalar) -> Forces:
        """Every contact of one roller, that of `rollers`, by elementary operations."""
        g = self.geometry(rollers, cage, pocket_cos, pocket_sin)
        across = rollers.radius * rollers.orbit
        ring_out = cage.ring_vx * g.cos + cage.ring_vy * g.sin
        ring_across = cage.ring_vy * g.cos - cage.ring_vx * g.sin
        dv_out, dv_across = rollers.radial - ring_out, across - ring_across
        inner = raceway_contact(
            self.inner_race,
            False,
            g.distance,
            g.inner_out * dv_out + g.inner_across * dv_across,
            g.inner_out * dv_across - g.inner_across * dv_out,
            rollers.spin,
        )
        outer = raceway_contact(self.outer_race, True, rollers.radius, rollers.radial, across, rollers.spin)
        pocket = pocket_contact(
            self.model,
            rollers.radius * g.lag_cos - (cage.x * g.pocket_cos + cage.y * g.pocket_sin),
            rollers.radius * g.lag_sin - (cage.y * g.pocket_cos - cage.x * g.pocket_sin),
            rollers.radial * g.lag_cos - across * g.lag_sin - (cage.vx * g.pocket_cos + cage.vy * g.pocket_sin),
            rollers.radial * g.lag_sin + across * g.lag_cos - (cage.vy * g.pocket_cos - cage.vx * g.pocket_sin),
            rollers.spin,
            cage.cage_speed,
        )
        drag = -self.drag * jnp.sqrt(rollers.radial * rollers.radial + across * across + 1e-24)  # smooth at rest
        drag_out, drag_across = drag * rollers.radial, drag * across
        churning = -self.churning * jnp.abs(rollers.spin) * rollers.spin
        power = -(drag_out * rollers.radial + drag_across * across + churning * rollers.spin)
        found = Forces(g, outer, inner, pocket, drag_out, drag_across, churning, power)
        if self.inner_race.rolling is None:
            return found
        by_outer = rolling_resistance(self.outer_race, outer.load, rollers.spin)
        by_inner = rolling_resistance(self.inner_race, inner.load, rollers.spin)
        power = power - by_outer * (rollers.spin - self.outer_race.speed) - by_inner * (rollers.spin - self.speed)
        return found._replace(drag_power=power, rolling=(by_outer, by_inner))

    def on_land(self, cage: Bodies) -> LandForces:
        """The guiding land."""
        if self.model.guidance == "inner":
            from_land = cage.x - cage.ring_x, cage.y - cage.ring_y, cage.vx - cage.ring_vx, cage.vy - cage.ring_vy
            return land_forces(self.guide, *from_land, cage.cage_speed, self.speed)
        return land_forces(self.guide, cage.x, cage.y, cage.vx, cage.vy, cage.cage_speed, self.model.outer_speed)

    def geometry(self, rollers: Rollers, cage: Bodies, pocket_cos: Scalar, pocket_sin: Scalar) -> Geometry:
        """Place of a roller."""
        lag_cos, lag_sin = cos_sin(rollers.lag)
        c, s = pocket_cos * lag_cos - pocket_sin * lag_sin, pocket_sin * lag_cos + pocket_cos * lag_sin
        out = rollers.radius - (cage.ring_x * c + cage.ring_y * s)
        across = cage.ring_x * s - cage.ring_y * c
        distance = jnp.sqrt(out * out + across * across)
        return Geometry(pocket_cos, pocket_sin, lag_cos, lag_sin, c, s, distance, out / distance, across / distance)

    def rates(self, state: BearingState) -> Rates:
        """Rates over time."""
        rollers, cage = Rollers(*state.rollers), Bodies(*state.bodies)
        each = jax.vmap(self.roller_rates, in_axes=(0, None, 0))
        roller_rates, passed = each(rollers, cage, self.on_rollers(state))
        sums = Passed(*jnp.sum(jnp.stack(passed), axis=1))
        largest = jnp.max(passed.normal), jnp.max(self.slip(rollers.spin))
        body_rates, beside, watched = self.body_rates(cage, cos_sin(state.clock[0]), sums, largest)
        moved = BearingState(jnp.stack(roller_rates), jnp.stack(body_rates), jnp.stack(beside[:2]))
        return Rates(moved, jnp.stack(beside[2:]), jnp.stack(watched))

    def slip(self, spin: Many) -> Array:
        """Slip of a roller's spin against pure rolling, 0 where rollers that roll do not turn but for rounding."""
        turns = jnp.abs(self.rolling_spin) > NO_SPIN * jnp.abs(self.rolling_cage_speed)
        return jnp.where(turns, 1 - spin / jnp.where(turns, self.rolling_spin, 1.0), 0.0)

    def roller_rates(self, rollers: Rollers, cage: Bodies, f: Forces) -> tuple[tuple[Array, ...], Passed]:
        """Rates of one roller under its forces, and what it passes on."""
        g, inner, outer, pocket = f.geometry, f.inner, f.outer, f.pocket
        inner_out = inner.load * g.inner_out - inner.traction * g.inner_across
        inner_across = inner.load * g.inner_across + inner.traction * g.inner_out
        out = inner_out - outer.load + pocket.out * g.lag_cos + pocket.along * g.lag_sin + f.drag_out
        across = inner_across + outer.traction + pocket.along * g.lag_cos - pocket.out * g.lag_sin + f.drag_across
        out = out - self.roller_mass * self.model.gravity * g.sin
        across = across - self.roller_mass * self.model.gravity * g.cos
        on_rings = inner.traction * inner.race_arm, outer.traction * outer.race_arm
        moment = outer.arm * outer.traction - inner.arm * inner.traction + pocket.roller_moment + f.churning
        if f.rolling is not None:
            by_outer, by_inner = f.rolling
            moment, on_rings = moment + by_outer + by_inner, (on_rings[0] + by_inner, on_rings[1] + by_outer)
        per_mass = 1 / self.roller_mass
        rates = (
            rollers.orbit - cage.cage_speed,
            moment / self.roller_inertia,
            rollers.radial,
            out * per_mass + rollers.radius * rollers.orbit * rollers.orbit,
            (across * per_mass - 2 * rollers.radial * rollers.orbit) / rollers.radius,
        )
        passed = Passed(
            x=pocket.out * g.pocket_cos - pocket.along * g.pocket_sin,
            y=pocket.out * g.pocket_sin + pocket.along * g.pocket_cos,
            cage_moment=pocket.cage_moment,
            inner_x=inner_out * g.cos - inner_across * g.sin,
            inner_y=inner_out * g.sin + inner_across * g.cos,
            inner_moment=on_rings[0],
            outer_moment=on_rings[1],
            traction=inner.lost_in_sliding + outer.lost_in_sliding,
            raceway_damping=inner.lost_in_damping + outer.lost_in_damping,
            pocket_friction=pocket.lost_in_sliding,
            pocket_damping=pocket.lost_in_damping,
            drag=f.drag_power,
            normal=pocket.normal,
            spin=rollers.spin / self.n_rollers,
            rubbing=pocket.rubbing,
        )
        return tuple(map(jnp.asarray, rates)), passed

    def body_rates(
        self, cage: Bodies, phase: tuple[Scalar, Scalar], sums: Passed, largest: tuple[Scalar, Scalar]
    ) -> tuple[tuple[Array, ...], tuple[Array, ...], tuple[Array, ...]]:
        """Rates of cage and inner ring under the sums over all rollers; rates of the quantities beside the state, as in
        `BESIDE`; the quantities of `WATCHED`, where the eccentricity ratio is `LOST` if the cage turns too slowly for
        its angle to measure progress.

        **Arguments:** cosine and sine of the cage's angle; largest pocket force and slip; else as they are called.
        """
        land, (normal, slip) = self.on_land(cage), largest
        model, inner_guided = self.model, self.model.guidance == "inner"
        mass, e, g, damping = model.cage_mass, model.eccentricity, model.gravity, model.ring.mounting_damping
        cos, sin = phase
        contact_x, contact_y = land.x - sums.x, land.y - sums.y
        moment = sums.cage_moment + land.moment
        down = contact_y - mass * g
        drive = moment - e * mass * g * cos - e * (cos * down - sin * contact_x)
        if model.cage_rotation == "held":
            turning, hold = jnp.zeros_like(drive), -drive
        else:
            turning, hold = drive / model.cage_inertia, jnp.zeros_like(drive)
        swing = e * cage.cage_speed * cage.cage_speed
        cage_x = contact_x / mass + swing * cos + e * turning * sin
        cage_y = down / mass + swing * sin - e * turning * cos

        ring_x = -sums.inner_x - damping * cage.ring_vx - (land.x if inner_guided else 0.0)
        ring_y = -sums.inner_y - damping * cage.ring_vy - (land.y if inner_guided else 0.0)
        ring_y = ring_y - model.load - model.ring.ring_mass * g
        ring_rates = cage.ring_vx, cage.ring_vy, ring_x / model.ring.ring_mass, ring_y / model.ring.ring_mass
        on_inner = -sums.inner_moment + (land.land_moment if inner_guided else 0.0)
        on_outer = -sums.outer_moment + (0.0 if inner_guided else land.land_moment)
        mounting = damping * (cage.ring_vx * cage.ring_vx + cage.ring_vy * cage.ring_vy)
        paid = -on_inner * self.speed - on_outer * model.outer_speed + hold * cage.cage_speed
        about_origin = moment + cage.x * contact_y - cage.y * contact_x - mass * g * (cage.x + e * cos) + hold
        beside = (
            cage.cage_speed,
            1.0,
            paid,
            sums.traction,
            sums.raceway_damping,
            sums.pocket_friction,
            sums.pocket_damping,
            land.lost_in_film,
            land.lost_in_contact,
            sums.drag,
            mounting,
            about_origin,
            sums.normal,
            land.eps,
            land.whirl,
            cage.cage_speed,
            sums.spin,
            hold,
            sums.rubbing,
            land.rubbing,
            land.size,
            -sums.x * cos,
            -sums.x * sin,
            -sums.y * cos,
            -sums.y * sin,
            land.eps * land.eps,
        )
        stalled = jnp.abs(cage.cage_speed) < STALLED * jnp.abs(self.rolling_cage_speed)
        watched = jnp.where(stalled, LOST, land.eps), normal, land.size, slip, land.eps
        rates = cage.vx, cage.vy, cage_x, cage_y, turning, *ring_rates
        arrays = lambda numbers: tuple(jnp.asarray(x, dtype=float) for x in numbers)
        return arrays(rates), arrays(beside), arrays(watched)
