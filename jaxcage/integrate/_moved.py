"""A lane after a revolution, with its tangent vectors."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from .._types import Scalar, State
from ._method import Stretch
from ._results import outcome_code


Tangents = tuple[State, ...]


class Moved(NamedTuple):
    """A lane after a revolution; or many, their axis last."""

    y: State
    tangents: Tangents
    peak: Scalar
    """Largest excursion on the way."""
    outcome: Int[Array, "*lanes"]
    level: Int[Array, "*lanes"]
    """Which of the method's step counts is worth trying next."""
    error: Float[Array, "*lanes"]
    """How far off the end would be with half as many steps, in units of the scale; NaN where that was not tried."""
    half: Tangents
    """The tangent vectors with half as many steps; none where that was not tried."""


def moved_by(advance: Callable[[State], Stretch], y: State, tangents: Tangents) -> Moved:
    """One lane moved by `advance`, its tangent vectors by the derivative of that."""

    def move(y: State) -> tuple[State, tuple[Any, ...]]:
        stretch = advance(y)
        return stretch.y, (jnp.asarray(stretch.peak), outcome_code(stretch.result), jnp.asarray(stretch.error))

    def moved(after: State, pushed: Tangents, seen: tuple[Any, ...]) -> Moved:
        peak, code, error = seen
        return Moved(after, pushed, peak, code, jnp.zeros((), jnp.int32), error, ())

    if not tangents:
        return moved(*_split(move(y)))
    along = lambda t: jax.jvp(move, (y,), (t,), has_aux=True)
    if len(tangents) == 1:  # without the extra axis the compiled loops are nearly twice as fast
        after, pushed, seen = along(tangents[0])
        return moved(after, (pushed,), seen)
    stacked = tuple(map(jnp.stack, zip(*tangents, strict=True)))
    after, pushed, seen = jax.vmap(along, out_axes=(None, 0, None))(stacked)
    return moved(after, tuple(zip(*pushed, strict=True)), seen)


def _split(moved: tuple[State, tuple[Any, ...]]) -> tuple[State, Tangents, tuple[Any, ...]]:
    return moved[0], (), moved[1]
