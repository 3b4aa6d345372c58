"""Contacts of a roller: outer raceway, inner raceway, pocket. Each gives one set of numbers, used for both bodies.

A raceway contact acts at the middle of the overlap: the roller's arm is h = D/2 - delta/2, and the race's ends there
too. Other arms would leave a couple of traction times overlap.
"""

from typing import NamedTuple

import jax.numpy as jnp

from ..._types import Scalar
from ...forces import smooth_plus
from ._pockets import Pockets, saturated
from ._raceway import hunt_crossley, line_load
from ._traction import TractionCurve


OfRoller = Scalar
"""Of one roller; over all of them under `jax.vmap`."""


class RacewayForces(NamedTuple):
    """Of one raceway on a roller."""

    load: OfRoller
    """Q [N], pressing roller and raceway apart."""
    traction: OfRoller
    """T [N] on the roller, counter-clockwise about the ring's centre."""
    arm: OfRoller
    """h from the roller's centre [m]."""
    race_arm: OfRoller
    """From the ring's centre [m]."""
    lost_in_sliding: OfRoller
    """Power of the traction [W]."""
    lost_in_damping: OfRoller
    """Power of Q beyond its elastic part [W]."""
    sliding: OfRoller
    """Speed of the raceway beyond that of the roller's surface, where they meet or would meet [m/s]."""


class RacewayConstants(NamedTuple):
    """What a raceway contact needs to know."""

    half: Scalar
    """D/2 [m]."""
    radius: Scalar
    """Of the raceway [m]."""
    speed: Scalar
    """Of its ring [rad/s]."""
    stiffness: Scalar
    damping: Scalar
    smoothing: Scalar
    curve: TractionCurve


def outer_contact(
    at: RacewayConstants, radius: OfRoller, radial: OfRoller, orbit: OfRoller, spin: OfRoller
) -> RacewayForces:
    """The outer raceway on a roller; T and Q are along the tangent and against the radius at the roller."""
    overlap = radius + at.half - at.radius
    load, elastic = line_load(overlap, radial, at.stiffness, at.damping, at.smoothing)
    arm = at.half - overlap / 2
    race_arm = radius + arm
    sliding = at.speed * race_arm - (radius * orbit + spin * arm)
    traction = at.curve(sliding) * load
    return RacewayForces(load, traction, arm, race_arm, traction * sliding, (load - elastic) * radial, sliding)


def inner_contact(
    at: RacewayConstants, distance: OfRoller, away: OfRoller, across: OfRoller, spin: OfRoller
) -> RacewayForces:
    """The inner raceway on a roller.

    **Arguments:** distance of the roller's centre from the ring's [m]; velocity of the roller relative to the ring's
    centre, away from it and across (counter-clockwise) [m/s]; spin.
    """
    overlap = at.radius + at.half - distance
    load, elastic = line_load(overlap, -away, at.stiffness, at.damping, at.smoothing)
    arm = at.half - overlap / 2
    race_arm = distance - arm
    sliding = at.speed * race_arm - (across - spin * arm)
    traction = at.curve(sliding) * load
    return RacewayForces(load, traction, arm, race_arm, traction * sliding, (elastic - load) * away, sliding)


class PocketForces(NamedTuple):
    """Of the bars on a roller."""

    along: OfRoller
    """Force on the roller along the pocket's tangent t_j [N]."""
    out: OfRoller
    """Force on the roller along the pocket's radius n_j [N]."""
    roller_moment: OfRoller
    """Moment on the roller [N m]."""
    cage_moment: OfRoller
    """Moment on the cage about its centre [N m]."""
    normal: OfRoller
    """N [N]."""
    lost_in_sliding: OfRoller
    lost_in_damping: OfRoller
    rubbing: OfRoller
    """N times the sliding speed [W]."""


class PocketConstants(NamedTuple):
    """What a pocket contact needs to know."""

    half: Scalar
    """D/2 [m]."""
    clearance: Scalar
    """T, of both sides together [m]."""
    law: Pockets


def pocket_contact(
    at: PocketConstants,
    out: OfRoller,
    along: OfRoller,
    v_out: OfRoller,
    v_along: OfRoller,
    spin: OfRoller,
    cage_speed: Scalar,
) -> PocketForces:
    """The bars on a roller.

    **Arguments:** place of the roller's centre from the cage's, along n_j and t_j of its pocket [m]; velocity of the
    roller's centre relative to the cage's, not to the turning pocket [m/s]; spin and cage speed [rad/s].
    """
    law = at.law
    side = jnp.where(along >= 0, 1.0, -1.0)
    rate = side * (v_along - cage_speed * out)
    overlap = side * along - at.clearance / 2
    elastic = law.elastic(overlap)
    normal = elastic * smooth_plus(1 + hunt_crossley(law.pocket_damping) * rate, 1e-4)
    sliding = v_out + cage_speed * along - side * at.half * (spin - cage_speed)
    friction = -law.pocket_friction * normal * saturated(sliding, law.saturation_speed)
    return PocketForces(
        along=-side * normal,
        out=friction,
        roller_moment=-side * at.half * friction,
        cage_moment=out * side * normal + (along + side * at.half) * friction,
        normal=normal,
        lost_in_sliding=-friction * sliding,
        lost_in_damping=(normal - elastic) * rate,
        rubbing=normal * jnp.abs(sliding),
    )
