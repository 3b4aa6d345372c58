"""A law that a user wrote: what goes wrong in it is said in a sentence and not by JAX's innards."""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

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
    if wrong := [jnp.shape(part) for part in parts if jnp.shape(part) not in ((), shape)]:
        raise InputError(f"{wanted}, but one of them has shape {wrong[0]}.")
    return parts


def _named(found: Any) -> str:
    return "nothing (is there a `return`?)" if found is None else f"one {type(found).__name__}"
