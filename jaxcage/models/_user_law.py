"""A law that a user wrote: what goes wrong in it is said in a sentence and not by JAX's innards."""

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .._errors import InputError
from .._types import State


@contextlib.contextmanager
def told(what: str) -> Iterator[None]:
    """**Raises:** `ValueError` for functions of NumPy or `math`, and for an `if`, on numbers that JAX traces."""
    try:
        yield
    except (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError) as error:
        raise InputError(
            f"{what} must be made of functions of `jax.numpy`: JAX traces it, and NumPy's or `math`'s functions, "
            "`float(x)` and `if x > 0:` want known numbers; write `jnp.cos(x)` and `jnp.where(x > 0, a, b)`."
        ) from error


def components(what: str, law: Callable[..., State], *arguments: Any, number: int) -> State:
    """What `law` returns, a tuple of `number` scalars.

    **Raises:** `ValueError`, one sentence, for anything else.
    """
    with told(what):
        found = law(*arguments)
    shape = jnp.shape(arguments[1][0])
    wanted = f"{what} must return a tuple of {number} scalar{'s' if number > 1 else ''}, one for each component"
    if not isinstance(found, tuple | list) and not (isinstance(found, jax.Array | np.ndarray) and found.ndim):
        raise InputError(f"{wanted}, but returned {_named(found)}: a single one is written `(a,)`.")
    parts = tuple(found)
    if len(parts) != number:
        raise InputError(f"{wanted}, but returned {len(parts)}.")
    if any(jnp.issubdtype(jnp.result_type(part), jnp.complexfloating) for part in parts):
        raise InputError(f"{wanted}, but one of them is complex: take `jnp.real` or `jnp.abs` of it.")
    if wrong := [jnp.shape(part) for part in parts if jnp.shape(part) not in ((), shape)]:
        raise InputError(f"{wanted}, but one of them has shape {wrong[0]}.")
    whole = lambda part: not jnp.issubdtype(jnp.result_type(part), jnp.inexact)  # has no derivative as it is
    return tuple(jnp.asarray(part, dtype=float) if whole(part) else part for part in parts)


REPEATS = 1e-3
"""Share of its size by which a law may differ after one revolution: pi in a law may have few digits."""
PHASES, SPEEDS = (0.4, 1.9, 3.4, 5.3), (1.3717, 41.31)
"""Where that is looked at: no simple parts of a revolution, so that a law in time does not repeat by chance."""


def require_repeats(
    what: str, law: Callable[..., State], states: Sequence[tuple[State, ...]], number: int, harmonics: int
) -> None:
    """Compare the law at a few phases with itself one revolution later, in states as its arguments.

    **Raises:** `ValueError` where it is not the same. What cannot be compared passes: a law that raises something, has
    traced numbers in it, returns no `number` scalars, or gives something else every time.
    """

    def row(i: int, turn: float = 0.0) -> tuple[float, ...] | None:
        found = _plain(law, PHASES[i] + turn, *states[i % len(states)], np.float64(SPEEDS[i % 2]))
        return None if found is None or len(found) != number else found

    pairs = []
    for i in range(len(PHASES)):
        pair = row(i), row(i, 2 * np.pi)
        if None in pair:
            return
        pairs.append(pair)
    found = np.array(pairs, dtype=float)
    eps = float(jnp.finfo(jnp.result_type(float)).eps)
    allowed = REPEATS * max(1.0, 1e7 * eps * harmonics)  # single precision rounds the phase
    size = abs(found).max(axis=1)
    rounding = 100 * math.sqrt(eps) * np.max(size, axis=0, where=np.isfinite(size), initial=0.0)
    with np.errstate(invalid="ignore"):
        off = abs(found[:, 1] - found[:, 0]) > allowed * np.maximum(size, rounding)
    off = np.any(off & np.isfinite(size), axis=1)
    if np.any(off) and row(i := int(np.argmax(off))) == pairs[i][0]:
        raise InputError(
            f"{what} must repeat after one revolution (tau -> tau + 2 pi), but does not: take the slowest forcing as "
            "the revolution, so that all others are whole multiples of it, and `jnp.mod(tau, 2 * jnp.pi)` in pulses."
        )


def _plain(law: Callable[..., State], tau: float, *rest: Any) -> tuple[float, ...] | None:
    """What a law returns as plain numbers, None where it does not."""
    try:
        with np.errstate(all="ignore"):
            found = law(np.float64(tau), *rest)
        if any(jnp.shape(part) or isinstance(part, Tracer) or np.iscomplexobj(part) for part in found):
            return None
        return tuple(map(float, found))
    except Exception:  # of any kind: it is said where the law is used
        return None


def _named(found: Any) -> str:
    return "nothing (is there a `return`?)" if found is None else f"one {type(found).__name__}"
