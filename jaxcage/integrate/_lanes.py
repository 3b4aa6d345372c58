"""The whole bearing over a stretch of cage angle or of time, many lanes at once, by steps that are controlled.

The classical method of Runge and Kutta with the embedded estimate of `_explicit`, or an implicit one: a step is refused
whose estimated error is above the tolerance in any part of the state. Lanes are the last axis of every array, and the
stages a loop, so that a step is compiled once however many rollers and lanes there are.
"""

import functools
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from .._types import Scalar
from ..models.whole import LEDGER, MEANS, BearingAtSpeed, BearingState
from ._implicit import implicit_step
from ._results import INACCURATE, OUTCOMES


By = Literal["angle", "time"]
"""What is integrated over: the cage's angle, with time as a quadrature, or time."""

ORDER = 4.0
"""Of the estimates of both methods."""
SAFETY, LEAST, MOST = 0.9, 0.2, 3.0
"""Of the step that the estimate asks for, and how far a step may be from the one before it."""
MOST_STEPS = 200_000
"""In a stretch."""
FAR = 2.0
"""Eccentricity ratio beyond which a cage is no longer in its land."""
NOT_FINITE, OUTSIDE, TOO_MANY = (OUTCOMES.index(name) for name in ("not_finite", "outside", "max_steps_reached"))


class Lanes(NamedTuple):
    """Where lanes are, and what has been gathered on the way; the last axis of everything is that of the lanes."""

    packed: Float[Array, "numbers lanes"]
    """State and integrals in one array, so that what a step does to all of them is done at once: see `unpacked`."""
    rates: Float[Array, "numbers lanes"]
    """Over time, at `packed`."""
    peaks: Float[Array, "peaks lanes"]
    """The largest since they were last set back."""
    step: Float[Array, " lanes"]
    """To try next, in units of angle or time."""
    error: Float[Array, " lanes"]
    """Sum of the estimated errors of all steps, each the largest of the state, in units of its scale."""
    steps: Int[Array, " lanes"]
    outcome: Int[Array, " lanes"]

    @property
    def state(self) -> BearingState:
        """The state of each lane."""
        return unpacked(self.packed)[0]


INTEGRALS = len(LEDGER) + len(MEANS)


def packed(state: BearingState, integrals: Array) -> Array:
    """One array of a state and its integrals; the rollers come first."""
    rollers = state.rollers.reshape(-1, *state.rollers.shape[2:])
    return jnp.concatenate([rollers, state.bodies, state.clock, integrals])


def unpacked(numbers: Array) -> tuple[BearingState, Array]:
    """The same apart."""
    n = numbers.shape[0] - INTEGRALS
    rollers = numbers[: n - 11].reshape(5, (n - 11) // 5, *numbers.shape[1:])
    return BearingState(rollers, numbers[n - 11 : n - 2], numbers[n - 2 : n]), numbers[n:]


def _field(at: BearingAtSpeed, numbers: Array) -> tuple[Array, Array, Array]:
    """Packed numbers, settled; their rates over time, and what peaks are taken of."""
    state, integrals = unpacked(numbers)
    state = at.settled(state)
    rates = at(state)
    return packed(state, integrals), packed(rates.state, rates.integrals), rates.peaks


class Controls(NamedTuple):
    """How to integrate."""

    tolerance: Float[Array, " lanes"]
    """Largest estimated error of a step, in units of the state's scale."""
    longest: Scalar
    """Longest step, in units of the angle or time."""
    shortest: Scalar
    """Shortest step: one that is still too inaccurate is taken, and the lane is `inaccurate`."""
    slowest: Float[Array, " lanes"]
    """Speed of the cage below which its angle is no measure of progress [rad/s]; 0 where time is."""


def _over(f: Any, *arguments: Any) -> Any:
    """`f` of each lane."""
    return jax.vmap(f, in_axes=-1, out_axes=-1)(*arguments)


def begin(at: BearingAtSpeed, state: BearingState, step: Scalar) -> Lanes:
    """Lanes at their beginning."""
    lanes = state.bodies.shape[-1]
    y = packed(state, jnp.zeros((INTEGRALS, lanes)))
    y, rates, peaks = _over(functools.partial(_field, at), y)
    count = jnp.zeros((lanes,), jnp.int32)
    return Lanes(y, rates, peaks, jnp.ones((lanes,)) * step, jnp.zeros((lanes,)), count, count)


def advance(
    at: BearingAtSpeed,
    scale: BearingState,
    lanes: Lanes,
    span: Float[Array, " lanes"],
    controls: Controls,
    by: By,
    implicit: bool = False,
) -> Lanes:
    """Every lane over its `span`, in as many steps as it needs.

    **Arguments:** laws and scale, the same for all lanes; lanes; how far [rad or s]; controls; whether steps are
    implicit (not with a quasi-static inner ring).
    """
    n_state = lanes.packed.shape[0] - INTEGRALS
    units = 1 / packed(scale, jnp.ones(INTEGRALS))[: n_state - 2]
    step = _implicit_step if implicit else _explicit_step

    def attempt(carry: tuple[Lanes, Array]) -> tuple[Lanes, Array]:
        lanes, done = carry
        left = span - done
        h = jnp.where(left <= lanes.step, left, jnp.where(left < 2 * lanes.step, left / 2, lanes.step))
        found, estimate = step(at, lanes, h, by)
        error = _over(lambda e: jnp.max(jnp.abs(e) * units), estimate[: n_state - 2])
        error = jax.lax.stop_gradient(error)
        new, done = _accepted(lanes, found, h, left, error, done, span, controls)
        lost = (jnp.abs(new.rates[n_state - 2]) < controls.slowest) | (new.peaks[-1] > FAR)
        outcome = jnp.where((new.outcome == 0) & lost, OUTSIDE, new.outcome).astype(jnp.int32)
        return new._replace(outcome=outcome), jnp.where(outcome == OUTSIDE, span, done)

    going = lambda carry: jnp.any(span - carry[1] > 0)
    lanes, _ = jax.lax.while_loop(going, attempt, (lanes, jnp.zeros_like(span)))
    return lanes


Found = tuple[Array, Array, Array]
"""Packed numbers, their rates over time, and peaks."""


def _explicit_step(at: BearingAtSpeed, lanes: Lanes, h: Array, by: By) -> tuple[Found, Array]:
    """Where a step of each lane leads, and the estimated error of its numbers."""
    clock = lanes.packed.shape[0] - INTEGRALS - 2
    pace = lambda rates: rates / jnp.abs(rates[clock]) if by == "angle" else rates
    slope = lambda rates: _over(pace, rates)
    move = lambda y, h, k: _over(lambda y, h, k: y + h * k, y, h, k)
    y, k1 = lanes.packed, slope(lanes.rates)

    def stage(i: Array, c: tuple) -> tuple:
        _, _, k, total = c
        share, weight = jnp.asarray((0.5, 0.5, 1.0, 0.0))[i], jnp.asarray((2.0, 2.0, 1.0, 0.0))[i]
        way = jnp.where(i == 3, total / 6, share * k)  # the last stage is the first of the next step
        moved, rates, peaks = _over(functools.partial(_field, at), move(y, h, way))
        new = slope(rates)
        return (moved, rates, peaks), k, new, total + weight * new

    found, k4, k5, _ = jax.lax.fori_loop(0, 4, stage, ((y, lanes.rates, lanes.peaks), k1, k1, k1))
    return found, _over(lambda h, a, b: h / 6 * (a - b), h, k4, k5)


def _implicit_step(at: BearingAtSpeed, lanes: Lanes, h: Array, by: By) -> tuple[Found, Array]:
    """The same by an implicit method."""

    def lane(numbers: Array, rates: Array, h: Array) -> tuple[Found, Array]:
        end, after, error, peaks = implicit_step(at, unpacked(numbers), unpacked(rates), h, by == "angle")
        return (packed(*end), packed(*after), peaks), jnp.append(error.rollers.T.ravel(), error.bodies[:-1])

    return _over(lane, lanes.packed, lanes.rates, jnp.where(h > 0, h, 1.0))


def _accepted(
    lanes: Lanes,
    found: Found,
    h: Array,
    left: Array,
    error: Array,
    done: Array,
    span: Array,
    controls: Controls,
) -> tuple[Lanes, Array]:
    """Take a step or refuse it, and choose the next one."""
    after, rates, peaks = found
    finite, active = jnp.isfinite(error), left > 0
    good = (error <= controls.tolerance) & finite
    taken = (good | (lanes.step <= controls.shortest)) & active
    wish = SAFETY * (controls.tolerance / jnp.maximum(error, 1e-30)) ** (1 / ORDER)
    tried = h * jnp.where(finite, jnp.clip(wish, LEAST, MOST), LEAST)
    # A step that was shortened to end the stretch says nothing against the one that was to be tried.
    tried = jnp.where(good & (h < lanes.step), jnp.maximum(lanes.step, tried), tried)
    tried = jnp.clip(tried, controls.shortest, controls.longest)
    code = jnp.where(taken & ~good, jnp.where(finite, INACCURATE, NOT_FINITE), 0)
    code = jnp.where(active & (lanes.steps >= MOST_STEPS), TOO_MANY, code)
    outcome = jnp.where(lanes.outcome == 0, code, lanes.outcome).astype(jnp.int32)
    fatal = (outcome == NOT_FINITE) | (outcome == TOO_MANY)
    new = Lanes(
        packed=_over(jnp.where, taken, after, lanes.packed),
        rates=_over(jnp.where, taken, rates, lanes.rates),
        peaks=_over(jnp.where, taken, jnp.maximum(lanes.peaks, peaks), lanes.peaks),
        step=jax.lax.stop_gradient(jnp.where(active, tried, lanes.step)),
        error=lanes.error + jnp.where(taken, error, jnp.zeros_like(error)),
        steps=lanes.steps + taken.astype(jnp.int32),
        outcome=outcome,
    )
    done = jnp.where(taken, jnp.where(h >= left, span, done + h), done)
    return new, jnp.where(fatal, span, done)
