"""Many lanes of the whole bearing over blocks of revolutions, each lane by steps of its own.

Lanes go on at their own pace from sample to sample and wait for each other at the end of a block only. A lane that
fails stays where it was, and its neighbours go on.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._types import Scalar
from ..models.whole import BearingAtSpeed, BearingState
from ._bearing_step import INTEGRATED, Moving, Point, first_point, kept, law_of, step
from ._lanes import FAR, LEAST, MOST, NOT_FINITE, ORDER, OUTSIDE, SAFETY, TOO_MANY
from ._march import compiled
from ._results import INACCURATE


TURN = 2 * np.pi
SAMPLES = 32
"""Of a revolution of the cage."""
LONGEST_BLOCK = 16
"""Revolutions in one go: a tangent vector may grow by a factor of 1e12 in each, and its length still is a number."""
FIRST, LONGEST, SHORTEST = TURN / 20_000, TURN / 200, TURN / 4e6
"""First, longest and shortest step [rad] of the cage's angle."""
MOST_ATTEMPTS = 20_000
"""In a revolution, in the mean over a block: a lane that needs more has failed."""
STALLED = 0.05
"""Speed of the cage over that of pure rolling below which its angle is no measure of progress."""


class BearingLanes(NamedTuple):
    """Where lanes are between two blocks."""

    point: Point
    angle: Float[Array, " lanes"]
    """Of the cage [rad]."""
    step: Float[Array, " lanes"]
    """To try next [rad]."""
    outcome: Int[Array, " lanes"]


class BearingBlock(NamedTuple):
    """What was gathered over a block."""

    growth: Float[Array, " lanes"]
    """Logarithm of the growth of the tangent vector."""
    integrals: Float[Array, "1+integrals lanes"]
    """Time, and what `INTEGRATED` names."""
    peaks: Float[Array, "followed lanes"]
    """As in `FOLLOWED`."""
    steps: Int[Array, " lanes"]
    place: Float[Array, "samples 2 lanes"]
    """Of the cage's centre from the land's at the samples, in clearances; NaN where there was none."""


class _Going(NamedTuple):
    """Lanes within a block."""

    point: Point
    base: Array
    """Angle of the last sample."""
    within: Array
    """Angle since then."""
    reached: Array
    """Samples since the block began."""
    step: Array
    outcome: Array
    integrals: tuple[Array, ...]
    peaks: tuple[Array, ...]
    steps: Array
    place: Array
    attempts: Array


def _moving(state: BearingState) -> Moving:
    """Of a state with lanes last."""
    return Moving(tuple(row.reshape(-1) for row in state.rollers), tuple(state.bodies))


def _inverse(scale: BearingState) -> Moving:
    return jax.tree.map(lambda x: 1 / x, _moving(scale))


@compiled
def begin_lanes(
    at: BearingAtSpeed, scale: BearingState, state: BearingState, direction: BearingState | None
) -> BearingLanes:
    """Lanes at their beginning, with lanes last in everything.

    **Arguments:** laws, each number a scalar or of lanes; magnitudes of the state, of one roller each; states;
    direction of the tangent vectors in units of the scale, None for none.
    """
    lanes = state.bodies.shape[-1]
    units = _inverse(scale)
    y = _moving(state)
    tangent = Moving((), ())
    if direction is not None:
        law = law_of(at, units, lanes)
        row = lambda parts, unit: tuple(x / u for x, u in zip(parts, unit, strict=True))
        along = _moving(direction)
        tangent = Moving(row(along.rollers, law.units.rollers), row(along.bodies, units.bodies))
    point = first_point(law_of(at, units, lanes), state.clock[0], y, tangent)
    full = lambda x: jnp.full((lanes,), x)
    return BearingLanes(point, state.clock[0], full(FIRST), full(0).astype(jnp.int32))


def _length(units: Moving, tangent: Moving, rollers: int) -> Array:
    """Of tangent vectors, in units of the state; 1 where there are none."""
    if not tangent.bodies:
        return jnp.ones_like(units.bodies[0])
    parts = [jnp.square(x * u) for x, u in zip(tangent.bodies, units.bodies, strict=True)]
    squares = [jnp.square(x.reshape(rollers, -1) * u) for x, u in zip(tangent.rollers, units.rollers, strict=True)]
    length = jnp.sqrt(sum(parts) + sum(jnp.sum(x, axis=0) for x in squares))
    return jnp.where((length > 0) & jnp.isfinite(length), length, 1.0)


@compiled
def run_block(
    at: BearingAtSpeed,
    scale: BearingState,
    lanes: BearingLanes,
    samples: Int[Array, ""],
    tolerance: Scalar,
) -> tuple[BearingLanes, BearingBlock]:
    """Lanes over a number of samples, at most those of `LONGEST_BLOCK` revolutions.

    **Arguments:** laws and magnitudes as in `begin_lanes`; lanes; how many samples; largest estimated error of a step.
    """
    units = _inverse(scale)
    count = lanes.angle.shape[0]
    law = law_of(at, units, count)
    before = _length(units, lanes.point.tangent, at.n_rollers)
    scaled = lambda m: Moving(
        tuple(x / law.layout.over(before) for x in m.rollers), tuple(x / before for x in m.bodies)
    )
    point = (
        lanes.point._replace(tangent=scaled(lanes.point.tangent), tangent_slope=scaled(lanes.point.tangent_slope))
        if lanes.point.tangent.bodies
        else lanes.point
    )
    spacing = TURN / SAMPLES
    slowest = STALLED * jnp.abs(jnp.asarray(at.rolling_cage_speed))
    most = MOST_ATTEMPTS * (1 + samples // SAMPLES)
    number = jnp.arange(count)
    per_clearance = jnp.asarray(at.guide.land.per_clearance)

    def place(point: Point) -> Array:
        x, y, *_ = point.y.bodies
        if at.inner_guided:
            x, y = x - point.y.bodies[5], y - point.y.bodies[6]
        return jnp.stack([x * per_clearance, y * per_clearance])

    def active(going: _Going) -> Array:
        alive = (going.outcome == 0) | (going.outcome == INACCURATE)
        return alive & (going.reached < samples)

    def attempt(going: _Going) -> _Going:
        goes = active(going)
        left = spacing - going.within
        h = jnp.where(left <= going.step, left, jnp.where(left < 2 * going.step, left / 2, going.step))
        new, error = step(law, going.base + law.sense * going.within, h, going.point)
        finite = jnp.isfinite(error)
        good, shortest = (error <= tolerance) & finite, going.step <= SHORTEST
        taken = goes & finite & (good | shortest)
        wish = SAFETY * (tolerance / jnp.maximum(error, 1e-30)) ** (1 / ORDER)
        tried = h * jnp.where(finite, jnp.clip(wish, LEAST, MOST), LEAST)
        # A step that was shortened to end at a sample says nothing against the one that was to be tried.
        tried = jnp.where(good & (h < going.step), jnp.maximum(going.step, tried), tried)
        tried = jnp.where(goes, jnp.clip(tried, SHORTEST, LONGEST), going.step)
        hit = taken & (h >= left)
        point = kept(law, taken, new, going.point)
        trapezoid = lambda total, a, b: total + jnp.where(taken, h / 2 * (a + b), 0.0)
        peaks = tuple(jnp.where(taken, jnp.maximum(p, w), p) for p, w in zip(going.peaks, new.watched, strict=True))
        code = jnp.where(goes & shortest & ~good, jnp.where(finite, INACCURATE, NOT_FINITE), 0)
        lost = (jnp.abs(point.y.bodies[4]) < slowest) | (point.watched[3] > FAR)
        code = jnp.where(goes & lost, OUTSIDE, code)
        code = jnp.where(goes & (going.attempts + 1 >= most) & ~hit, TOO_MANY, code)
        worse = (going.outcome == 0) | ((code != 0) & (code != INACCURATE))
        return _Going(
            point=point,
            base=jnp.where(hit, going.base + law.sense * spacing, going.base),
            within=jnp.where(hit, 0.0, jnp.where(taken, going.within + h, going.within)),
            reached=going.reached + hit.astype(jnp.int32),
            step=tried,
            outcome=jnp.where(worse, code, going.outcome).astype(jnp.int32),
            integrals=tuple(map(trapezoid, going.integrals, going.point.integrand, new.integrand)),
            peaks=peaks,
            steps=going.steps + taken.astype(jnp.int32),
            place=going.place.at[jnp.where(hit, going.reached, going.place.shape[0]), :, number].set(
                place(point).T, mode="drop"
            ),
            attempts=going.attempts + 1,
        )

    zero, none = jnp.zeros((count,)), jnp.zeros((count,), jnp.int32)
    begun = _Going(
        point=point,
        base=lanes.angle,
        within=zero,
        reached=none,
        step=lanes.step,
        outcome=lanes.outcome,
        integrals=(zero,) * (1 + len(INTEGRATED)),
        peaks=point.watched,
        steps=none,
        place=jnp.full((LONGEST_BLOCK * SAMPLES, 2, count), jnp.nan),
        attempts=jnp.zeros((), jnp.int32),
    )
    going = jax.lax.while_loop(lambda going: jnp.any(active(going)), attempt, begun)
    after = BearingLanes(going.point, going.base, going.step, going.outcome)
    growth = jnp.log(_length(units, going.point.tangent, at.n_rollers))
    return after, BearingBlock(growth, jnp.stack(going.integrals), jnp.stack(going.peaks), going.steps, going.place)


@compiled
def lanes_apart(scale: BearingState, a: Point, b: Point) -> Float[Array, " lanes"]:
    """How far two points are apart, in units of the state's scale: the largest of all its parts."""
    units = _inverse(scale)
    count = units.bodies[0].shape[0]
    rollers = [jnp.abs(x - y).reshape(-1, count) * u for x, y, u in zip(a.y.rollers, b.y.rollers, units.rollers)]
    bodies = [jnp.abs(x - y) * u for x, y, u in zip(a.y.bodies, b.y.bodies, units.bodies)]
    return jnp.max(jnp.stack([*(jnp.max(x, axis=0) for x in rollers), *bodies]), axis=0)


def bearing_states(lanes: BearingLanes) -> tuple[Any, Any]:
    """Rollers and bodies of each lane, lanes first."""
    count = lanes.angle.shape[0]
    rollers = np.stack([np.asarray(x).reshape(-1, count) for x in lanes.point.y.rollers])
    return np.moveaxis(rollers, -1, 0), np.stack([np.asarray(x) for x in lanes.point.y.bodies], axis=-1)
