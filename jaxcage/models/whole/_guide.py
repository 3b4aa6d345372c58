"""The guiding land on the cage and on the ring that carries it.

Film and normal contact are the laws of `jaxcage.forces`, in the inertial frame: the film is carried by the sum of both
surface speeds. Those laws are written for a film that is carried counter-clockwise; the other sense is its mirror
image.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from ..._types import Scalar
from ...forces import ContactForce, FilmForce, Land, Motion, contact_force, power_10_9
from ._pockets import saturated


class LandForces(NamedTuple):
    """Of the land on the cage; the land gets the opposite force at its centre, and its own moment."""

    x: Scalar
    y: Scalar
    moment: Scalar
    """On the cage about its centre [N m]."""
    land_moment: Scalar
    """On the land about its centre [N m]."""
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
    """From the cage's centre to where it touches, along the line of centres; negative for a land inside it [m]."""


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
