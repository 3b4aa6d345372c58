"""The whole bearing over a stretch of cage angle or of time, many lanes at once, by steps that are controlled.

The classical method of Runge and Kutta with the embedded estimate of `_explicit`: a step is refused whose estimated
error is above the tolerance in any part of the state. Lanes are the last axis of every array, and the stages a loop, so
that a step is compiled once however many rollers and lanes there are.
"""

from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from .._types import Scalar
from ..models.whole import LEDGER, MEANS, PEAKS, BearingAtSpeed, BearingState, Rates
from ._results import INACCURATE, OUTCOMES


By = Literal["angle", "time"]
"""What is integrated over: the cage's angle, with time as a quadrature, or time."""

ORDER = 4.0
SAFETY, LEAST, MOST = 0.9, 0.2, 3.0
"""Of the step that the estimate asks for, and how far a step may be from the one before it."""
SHORTEST = 1e-6
"""Shortest step, as a share of a revolution: one that is still too inaccurate there is taken, and said."""
STALLED = 0.05
"""Speed of the cage over that of pure rolling below which its angle is no measure of progress."""
NOT_FINITE, OUTSIDE, TOO_MANY = (OUTCOMES.index(name) for name in ("not_finite", "outside", "max_steps_reached"))


class Lanes(NamedTuple):
    """Where lanes are, and what has been gathered on the way; the last axis of everything is that of the lanes."""

    state: BearingState
    integrals: Array
    peaks: Array
    rates: Rates
    """Over time, at `state`."""
    step: Float[Array, " lanes"]
    """To try next, in revolutions' or time's unit."""
    error: Float[Array, " lanes"]
    """Sum of the estimated errors of all steps, each the largest of the state, in units of its scale."""
    steps: Int[Array, " lanes"]
    refused: Int[Array, " lanes"]
    outcome: Int[Array, " lanes"]


class Controls(NamedTuple):
    """How to integrate."""

    tolerance: Scalar
    """Largest estimated error of a step, in units of the state's scale."""
    longest: Scalar
    """Longest step, in units of the angle or time."""
    shortest: Scalar
    most_steps: int


def _over(f: Any, *arguments: Any) -> Any:
    """`f` of each lane."""
    return jax.vmap(f, in_axes=-1, out_axes=-1)(*arguments)


def begin(at: BearingAtSpeed, state: BearingState, step: Scalar) -> Lanes:
    """Lanes at their beginning."""
    lanes = state.bodies.shape[-1]
    rates = _over(lambda at, y: at(y), at, state)
    zero = lambda n: jnp.zeros((n, lanes))
    count = jnp.zeros((lanes,), jnp.int32)
    each = jnp.ones((lanes,)) * step
    return Lanes(state, zero(len(LEDGER) + len(MEANS)), rates.peaks, rates, each, 0 * each, count, count, count)


def _slope(rates: Rates, by: By) -> tuple[BearingState, Array]:
    """Rates of state and integrals over what is integrated over."""
    if by == "time":
        return rates.state, rates.integrals
    pace = 1 / rates.state.clock[0]
    return jax.tree.map(lambda r: r * pace, (rates.state, rates.integrals))


def _add(y: Any, h: Array, k: Any) -> Any:
    return jax.tree.map(lambda y, k: y + h * k, y, k)


def advance(
    at: BearingAtSpeed, scale: BearingState, lanes: Lanes, span: Float[Array, " lanes"], controls: Controls, by: By
) -> Lanes:
    """Every lane over its `span`, in as many steps as it needs."""
    slope = lambda rates: _over(lambda r: _slope(r, by), rates)

    def step(carry: tuple[Lanes, Array]) -> tuple[Lanes, Array]:
        lanes, done = carry
        left = span - done
        h = jnp.where(left <= lanes.step, left, jnp.where(left < 2 * lanes.step, left / 2, lanes.step))
        y, k1 = (lanes.state, lanes.integrals), slope(lanes.rates)

        def stage(i: Array, c: tuple) -> tuple:
            rates, k, _, total = c
            share, weight = jnp.asarray((0.5, 0.5, 1.0, 0.0))[i], jnp.asarray((2.0, 2.0, 1.0, 0.0))[i]
            last = (i == 3).astype(float)
            way = jax.tree.map(lambda k, t: share * k + last / 6 * t, k, total)
            state = _over(lambda y, h, k: _add(y, h, k), y[0], h, way[0])
            rates = _over(lambda at, y: at(y), at, state)
            new = slope(rates)
            return rates, new, k, jax.tree.map(lambda t, n: t + weight * n, total, new)

        rates, k5, k4, total = jax.lax.fori_loop(0, 4, stage, (lanes.rates, k1, k1, k1))
        after = _over(lambda y, h, k: _add(y, h / 6, k), y, h, total)
        error = _over(_largest, h, k4[0], k5[0], scale)
        error = jax.lax.stop_gradient(error)
        finite = jnp.isfinite(error)
        floor = lanes.step <= controls.shortest
        good = (error <= controls.tolerance) & finite
        taken = (good | floor) & (left > 0)
        wish = SAFETY * (controls.tolerance / jnp.maximum(error, 1e-30)) ** (1 / ORDER)
        factor = jnp.where(finite, jnp.clip(wish, LEAST, MOST), LEAST)
        # A step that was shortened to end the stretch says nothing against the one that was to be tried.
        tried = jnp.where(good & (h < lanes.step), jnp.maximum(lanes.step, h * factor), h * factor)
        tried = jnp.clip(tried, controls.shortest, controls.longest)
        code = jnp.where(taken & ~good, jnp.where(finite, INACCURATE, NOT_FINITE), 0)
        code = jnp.where(lanes.steps >= controls.most_steps, TOO_MANY, code)
        outcome = jnp.where(lanes.outcome == 0, code, lanes.outcome).astype(jnp.int32)
        keep = lambda new, old: jax.tree.map(lambda n, o: jnp.where(taken, n, o), new, old)
        active = left > 0
        new = Lanes(
            *keep(after, y),
            peaks=keep(jnp.maximum(lanes.peaks, rates.peaks), lanes.peaks),
            rates=keep(rates, lanes.rates),
            step=jax.lax.stop_gradient(jnp.where(active, tried, lanes.step)),
            error=lanes.error + jnp.where(taken, error, 0.0),
            steps=lanes.steps + taken.astype(jnp.int32),
            refused=lanes.refused + (active & ~taken).astype(jnp.int32),
            outcome=outcome,
        )
        fatal = (outcome == NOT_FINITE) | (outcome == TOO_MANY)
        done = jnp.where(taken, jnp.where(h >= left, span, done + h), done)
        return new, jnp.where(fatal, span, done)

    going = lambda carry: jnp.any(span - carry[1] > 0)
    lanes, _ = jax.lax.while_loop(going, step, (lanes, jnp.zeros_like(span)))
    return lanes


def _largest(h: Array, k4: BearingState, k5: BearingState, scale: BearingState) -> Array:
    """The embedded estimate h/6 (k_4 - k_5), the largest of all parts over its scale; the clock is left out."""
    of = lambda a, b, s: jnp.max(jnp.abs(h / 6 * (a - b)) / s)
    return jnp.maximum(of(k4.rollers, k5.rollers, scale.rollers), of(k4.bodies, k5.bodies, scale.bodies))
