"""Many lanes of the whole bearing over blocks of revolutions, each lane by steps of its own.

Lanes go on at their own pace from sample to sample and wait for each other at the end of a block only. A lane that
fails stays where it was, and its neighbours go on.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._form import compiled
from .._types import Scalar
from ..models.whole import BearingAtSpeed, BearingState
from ..solve import lanewise
from ._bearing_step import INTEGRATED, Moving, Point, first_point, kept, law_of, step
from ._lanes import FAR, LEAST, MOST, NOT_FINITE, OUTSIDE, SAFETY, TOO_MANY
from ._results import INACCURATE


TURN = 2 * np.pi
SAMPLES = 16
"""Of a revolution of the cage."""
LONGEST_BLOCK, WITH_TANGENT = 12, 4
"""Revolutions in one go; with a tangent vector fewer: it may grow by a factor of 1e75 in each, and its length still is
a number. At low speeds and light loads it grows by 1e16."""
SPACING = TURN / SAMPLES
FIRST, LONGEST, SHORTEST = TURN / 20_000, TURN / 200, TURN / 4e6
"""First, longest and shortest step [rad] of the cage's angle."""
PERIODS, COMPARED = 50, 10
"""Of a loaded roller's vibration on its raceway. A shaft is slow if more of them than the first go from sample to
sample, for NU2310 one below 4000 rpm: only so many as the second are then compared with the same by longer steps. What
rollers do to their bars depends little on the speed: neighbouring motions diverge over time, not over revolutions."""
SLOWEST = 1000.0
"""At most so many times as many periods count."""
MOST_ATTEMPTS = 20_000
"""In a revolution, in the mean over a block: a lane that needs more has failed. As many times more
as the shaft is slow."""
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
    steps: Float[Array, " lanes"]
    place: Float[Array, "samples 2 lanes"]
    """Of the cage's centre from the land's at the samples, in clearances; NaN where there was none."""


class _Course(NamedTuple):
    """How far lanes are within a block, in floating numbers: one kernel updates them all."""

    base: Array
    """Angle of the last sample."""
    within: Array
    """Angle since then."""
    reached: Array
    """Samples since the block began."""
    step: Array
    outcome: Array
    steps: Array
    integrals: tuple[Array, ...]
    peaks: tuple[Array, ...]


class _Going(NamedTuple):
    """Lanes within a block."""

    point: Point
    course: _Course
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
    law, tangent = law_of(at, units, lanes), Moving((), ())
    if direction is not None:
        row = lambda parts, unit: tuple(x / u for x, u in zip(parts, unit, strict=True))
        along = _moving(direction)
        tangent = Moving(row(along.rollers, law.units.rollers), row(along.bodies, units.bodies))
    point = first_point(law, state.clock[0], y, tangent)
    full = lambda x: jnp.full((lanes,), x)
    return BearingLanes(point, state.clock[0], full(FIRST), full(0).astype(jnp.int32))


def _length(units: Moving, tangent: Moving, rollers: int) -> Array:
    """Of tangent vectors, in units of the state; 1 where there are none."""
    if not tangent.bodies:
        return jnp.ones_like(units.bodies[0])
    parts = [(x * u)[None] for x, u in zip(tangent.bodies, units.bodies, strict=True)]
    parts += [x.reshape(rollers, -1) * u[None] for x, u in zip(tangent.rollers, units.rollers, strict=True)]
    every = jnp.concatenate(parts)
    largest = jnp.max(jnp.abs(every), axis=0)  # squares of numbers beyond 1e154 are none
    length = largest * jnp.sqrt(jnp.sum(jnp.square(every / jnp.where(largest > 0, largest, 1.0)[None]), axis=0))
    return jnp.where((length > 0) & jnp.isfinite(length), length, 1.0)


def slowness(at: BearingAtSpeed, scale: BearingState) -> Float[Array, "*lanes"]:
    """How many times as many periods of a roller go from sample to sample as in a shaft that is not slow: at least 1.

    **Arguments:** laws and magnitudes as in `begin_lanes`.
    """
    period = TURN * scale.rollers[2] / scale.rollers[3]
    turned = PERIODS * period * jnp.abs(jnp.asarray(at.rolling_cage_speed))
    return jnp.clip(SPACING / turned, 1.0, SLOWEST)


def comparable(at: BearingAtSpeed, scale: BearingState) -> Float[Array, "*lanes"]:
    """How far each lane goes before it is compared with the same by longer steps [rad]: to the next sample, or less.

    **Arguments:** laws and magnitudes as in `begin_lanes`.
    """
    slow = slowness(at, scale)
    return jnp.where(slow > 1, COMPARED / PERIODS * SPACING / slow, SPACING)


@compiled
def run_block(
    at: BearingAtSpeed,
    scale: BearingState,
    lanes: BearingLanes,
    samples: Int[Array, ""],
    tolerance: Scalar,
    spacing: Float[Array, " lanes"] | None = None,
) -> tuple[BearingLanes, BearingBlock]:
    """Lanes over a number of samples, at most those of `LONGEST_BLOCK` revolutions.

    **Arguments:** laws and magnitudes as in `begin_lanes`; lanes; how many samples; largest estimated error of a step;
    angle from sample to sample, else that of `SAMPLES` a revolution. Where it is 0, a lane stays.
    """
    units = _inverse(scale)
    count = lanes.angle.shape[0]
    law = law_of(at, units, count)
    point = lanes.point
    before = _length(units, point.tangent, at.n_rollers)
    scaled = lambda m: Moving(
        tuple(x / law.layout.over(before) for x in m.rollers), tuple(x / before for x in m.bodies)
    )
    point = point._replace(tangent=scaled(point.tangent), tangent_slope=scaled(point.tangent_slope))
    slowest = jnp.broadcast_to(STALLED * jnp.abs(jnp.asarray(at.rolling_cage_speed)), (count,))
    sense = jnp.broadcast_to(law.sense, (count,))
    slow = jnp.ceil(jnp.max(slowness(at, scale))).astype(jnp.int32)
    most = MOST_ATTEMPTS * slow * (1 + samples // SAMPLES)
    each = jnp.full((count,), SPACING) if spacing is None else spacing
    per_clearance = jnp.asarray(at.guide.land.per_clearance)
    number = jnp.arange(LONGEST_BLOCK * SAMPLES, dtype=float)[:, None, None]

    def place(point: Point) -> Array:
        x, y, *_ = point.y.bodies
        if at.inner_guided:
            x, y = x - point.y.bodies[5], y - point.y.bodies[6]
        return jnp.stack([x * per_clearance, y * per_clearance])

    def attempt(going: _Going) -> _Going:
        course, old = going.course, going.point
        h, angle = lanewise(
            lambda _, lane: _to_try(*lane), 2, (), (course.base, course.within, course.step, sense, each)
        )
        new, error = step(law, angle, h, old)
        limits: tuple[Any, ...] = (tolerance, samples.astype(float), (going.attempts + 1 >= most).astype(float))
        leaves, tree = jax.tree.flatten(course)
        own = (error, h, new.y.bodies[4], slowest, sense, each, *old.integrand, *new.integrand, *new.watched)

        def accept(shared: tuple[Any, ...], lane: tuple[Any, ...]) -> list[Any]:
            course, own = jax.tree.unflatten(tree, lane[: len(leaves)]), lane[len(leaves) :]
            after, taken, hit = _accepted(shared, course, own)
            return [*jax.tree.leaves(after), taken, hit]

        *after, taken, hit = lanewise(accept, len(leaves) + 2, limits, (*leaves, *own))
        point = kept(law, taken, new, old)
        here = (number == course.reached[None, None]) & (hit > 0)[None, None]
        places = jnp.where(here, place(point)[None], going.place)
        return _Going(point, jax.tree.unflatten(tree, after), places, going.attempts + 1)

    zero = jnp.zeros((count,))
    course = _Course(
        base=lanes.angle,
        within=zero,
        reached=zero,
        step=lanes.step,
        outcome=lanes.outcome.astype(float),
        steps=zero,
        integrals=(zero,) * (1 + len(INTEGRATED)),
        peaks=point.watched,
    )
    nowhere = jnp.full((LONGEST_BLOCK * SAMPLES, 2, count), jnp.nan)
    begun = _Going(point, course, nowhere, jnp.zeros((), jnp.int32))
    going = jax.lax.while_loop(lambda going: jnp.any(_active(going.course, samples)), attempt, begun)
    done = going.course
    after = BearingLanes(going.point, done.base, done.step, done.outcome.astype(jnp.int32))
    growth = jnp.log(_length(units, going.point.tangent, at.n_rollers))
    return after, BearingBlock(growth, jnp.stack(done.integrals), jnp.stack(done.peaks), done.steps, going.place)


def _active(course: _Course, samples: Any) -> Any:
    """Lanes that still have to go on and can."""
    alive = (course.outcome == 0) | (course.outcome == INACCURATE)
    return alive & (course.reached < samples)


def _to_try(base: Any, within: Any, step: Any, sense: Any, spacing: Any) -> tuple[Any, Any]:
    """The step to try, which ends at the next sample or before it, and the angle where it begins."""
    left = spacing - within
    h = jnp.where(left <= step, left, jnp.where(left < 2 * step, left / 2, step))
    return h, base + sense * within


def _accepted(shared: tuple[Any, ...], course: _Course, own: tuple[Any, ...]) -> tuple[_Course, Any, Any]:
    """Take the step of a lane or refuse it, and choose the next one."""
    tolerance, samples, last_attempt = shared
    error, h, cage_speed, slowest, sense, spacing, *rest = own
    size = len(course.integrals)
    before, after, watched = rest[:size], rest[size : 2 * size], rest[2 * size :]
    goes, left = _active(course, samples), spacing - course.within
    finite, shortest = jnp.isfinite(error), course.step <= SHORTEST
    good = (error <= tolerance) & finite
    taken = goes & finite & (good | shortest)
    hit = taken & (h >= left)
    root = jnp.sqrt(jnp.sqrt(tolerance / jnp.maximum(error, 1e-30)))  # the estimate is of fourth order
    tried = h * jnp.where(finite, jnp.clip(SAFETY * root, LEAST, MOST), LEAST)
    # A step that was shortened to end at a sample says nothing against the one that was to be tried.
    tried = jnp.where(good & (h < course.step), jnp.maximum(course.step, tried), tried)
    tried = jnp.where(goes, jnp.clip(tried, SHORTEST, LONGEST), course.step)
    code = jnp.where(goes & shortest & ~good, jnp.where(finite, 1.0 * INACCURATE, 1.0 * NOT_FINITE), 0.0)
    lost = taken & ((jnp.abs(cage_speed) < slowest) | (watched[-1] > FAR))
    code = jnp.where(lost, 1.0 * OUTSIDE, code)
    code = jnp.where(goes & (last_attempt > 0) & ~hit, 1.0 * TOO_MANY, code)
    worse = (course.outcome == 0) | ((code != 0) & (code != INACCURATE))
    add = lambda total, a, b: total + jnp.where(taken, h / 2 * (a + b), 0.0)
    follow = lambda p, w: jnp.where(taken, jnp.maximum(p, w), p)
    new = _Course(
        base=jnp.where(hit, course.base + sense * spacing, course.base),
        within=jnp.where(hit, 0.0, jnp.where(taken, course.within + h, course.within)),
        reached=jnp.where(hit, course.reached + 1, course.reached),
        step=tried,
        outcome=jnp.where(worse, code, course.outcome),
        steps=jnp.where(taken & (h > 0), course.steps + 1, course.steps),
        integrals=tuple(map(add, course.integrals, before, after)),
        peaks=tuple(map(follow, course.peaks, watched)),
    )
    return new, jnp.where(taken, 1.0, 0.0), jnp.where(hit, 1.0, 0.0)


@compiled
def lanes_apart(scale: BearingState, a: Point, b: Point) -> Float[Array, " lanes"]:
    """How far two points are apart, in units of the state's scale: the largest of all its parts."""
    units = _inverse(scale)
    count = units.bodies[0].shape[0]
    rollers = [jnp.abs(x - y).reshape(-1, count) * u[None] for x, y, u in zip(a.y.rollers, b.y.rollers, units.rollers)]
    bodies = [jnp.abs(x - y) * u for x, y, u in zip(a.y.bodies, b.y.bodies, units.bodies)]
    return jnp.max(jnp.stack([*(jnp.max(x, axis=0) for x in rollers), *bodies]), axis=0)


def bearing_states(
    lanes: BearingLanes,
) -> tuple[Float[np.ndarray, "lanes 5 rollers"], Float[np.ndarray, "lanes 9"]]:
    """Rollers and bodies of each lane, lanes first."""
    count = lanes.angle.shape[0]
    rollers = np.stack([np.asarray(x).reshape(-1, count) for x in lanes.point.y.rollers])
    return np.moveaxis(rollers, -1, 0), np.stack([np.asarray(x) for x in lanes.point.y.bodies], axis=-1)
