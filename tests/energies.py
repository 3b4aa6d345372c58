"""Energy that the bearing has at a moment, and the angular momentum of its cage."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from jaxcage.forces import cos_sin
from jaxcage.models import BearingAtSpeed, BearingState, Bodies, Rollers


def kinetic_energy(at: BearingAtSpeed, state: BearingState) -> Array:
    """Kinetic energy of rollers, cage (about its mass centre) and the inner ring's centre [J]."""
    rollers, cage = Rollers(*state.rollers), Bodies(*state.bodies)
    square = rollers.radial**2 + (rollers.radius * rollers.orbit) ** 2
    of_rollers = jnp.sum(at.roller_mass * square + at.roller_inertia * rollers.spin**2) / 2
    vx, vy = mass_centre(at, state)[2:]
    of_cage = (at.model.cage_mass * (vx * vx + vy * vy) + at.model.cage_inertia * cage.cage_speed**2) / 2
    return of_rollers + of_cage + at.model.ring.ring_mass * (cage.ring_vx**2 + cage.ring_vy**2) / 2


def potential_energy(at: BearingAtSpeed, state: BearingState) -> Array:
    """Potential energy of weight, load and all contacts [J]."""
    rollers, cage = Rollers(*state.rollers), Bodies(*state.bodies)
    geometry = at.forces(state).geometry
    weight = at.model.cage_mass * mass_centre(at, state)[1] + at.model.ring.ring_mass * cage.ring_y
    weight = weight + at.roller_mass * jnp.sum(rollers.radius * geometry.sin)
    return weight * at.model.gravity + at.model.load * cage.ring_y + contact_energies(at, state)


def contact_energies(at: BearingAtSpeed, state: BearingState) -> Array:
    """Elastic energy of raceways, pockets and land [J]."""
    rollers, cage = Rollers(*state.rollers), Bodies(*state.bodies)
    g, half, law = at.forces(state).geometry, at.outer_race.half, at.model.pockets
    stiffness, width = at.outer_race.stiffness, at.outer_race.smoothing
    energy = jax.vmap(contact_energy, in_axes=(0, None, None))
    outer = energy(rollers.radius + half - at.outer_race.radius, width, 10 / 9)
    inner = energy(at.inner_race.radius + half - g.distance, width, 10 / 9)
    along = rollers.radius * g.lag_sin - (cage.y * g.pocket_cos - cage.x * g.pocket_sin)
    exponent = 1.0 if law.pocket_law == "linear" else law.pocket_exponent
    bar = energy(jnp.abs(along) - at.model.bearing.pocket_clearance / 2, law.pocket_smoothing, exponent)
    bar = law.pocket_stiffness * law.pocket_reference ** (1 - exponent) * bar
    dx, dy = (cage.x - cage.ring_x, cage.y - cage.ring_y) if at.model.guidance == "inner" else (cage.x, cage.y)
    land, c = at.guide.land, at.guide.land.clearance
    depth = c * land.place(dx, dy, 0.0, 0.0).gap
    touch = at.guide.contact.stiffness * contact_energy(depth, c * land.onset_width)
    return jnp.sum(stiffness * (outer + inner) + bar) + touch


def mass_centre(at: BearingAtSpeed, state: BearingState) -> tuple[Array, Array, Array, Array]:
    """Place [m] and velocity [m/s] of the cage's mass centre."""
    cage, e = Bodies(*state.bodies), at.model.eccentricity
    cos, sin = cos_sin(state.clock[0])
    turn = e * cage.cage_speed
    x, y = jnp.asarray(cage.x + e * cos), jnp.asarray(cage.y + e * sin)
    return x, y, jnp.asarray(cage.vx - turn * sin), jnp.asarray(cage.vy + turn * cos)


def cage_angular_momentum(at: BearingAtSpeed, state: BearingState) -> Array:
    """About the outer ring's centre [N m s]."""
    x, y, vx, vy = mass_centre(at, state)
    return jnp.asarray(
        at.model.cage_mass * (x * vy - y * vx) + at.model.cage_inertia * Bodies(*state.bodies).cage_speed
    )


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


def contact_energy(overlap: float, width: float, exponent: float = 10 / 9) -> Array:
    """Integral of p^exponent over the overlap, p being the overlap cut off smoothly: the energy stored over stiffness.

    Closed form beyond `width`, a quadrature before it.
    """
    within = jnp.clip((overlap + width) / (2 * width), 0.0, 1.0)  # the part of [-width, width] that is covered
    nodes, weights = 0.5 * (1 + _NODES), 0.5 * _WEIGHTS
    onset = jnp.zeros_like(within)
    for node, weight in zip(nodes, weights, strict=True):
        # Nodes gather where contact begins: t = within u^2, as the integrand goes like t^(4 exponent).
        t = within * node * node
        onset = onset + weight * 2 * node * within * (t**4 * (t * (t - 3) + 2.5)) ** exponent
    more = jnp.maximum(overlap, width) ** (exponent + 1) - width ** (exponent + 1)
    return (2 * width) ** (exponent + 1) * onset + more / (exponent + 1)
