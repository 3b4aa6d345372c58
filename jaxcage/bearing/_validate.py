"""Positive numbers at the entry points: `ValueError` where the value is known, else `error_if`."""

import contextlib
import contextvars
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array

from .._errors import ArgumentError
from .._types import Scalar


_checked = contextvars.ContextVar("checked", default=False)


@contextlib.contextmanager
def checked_before() -> Iterator[None]:
    """While numbers are traced that have been looked at before: a program with such checks cannot be kept on disk."""
    token = _checked.set(True)
    try:
        yield
    finally:
        _checked.reset(token)


def is_concrete(*values: object) -> bool:
    """Whether none of `values` is traced, so that Python may compare them."""
    return not any(isinstance(value, Tracer) for value in values)


def _known(array: Array) -> Any:
    """A known value as NumPy's, which compares without a compiled program."""
    return np.asarray(array) if is_concrete(array) else array


def _require(name: str, array: Array, holds: Any, said: str) -> Array:
    """`array`, if what is `said` of it `holds`."""
    if isinstance(holds, Tracer):
        if _checked.get():
            return array
        return eqx.error_if(array, ~holds, f"Argument `{name}` {said}.")
    if not np.all(np.asarray(holds)):
        # Under `grad` without `jit` the comparison is concrete while the value is still traced.
        given = "" if isinstance(array, Tracer) else f", but {float(array):g} was given"
        raise ArgumentError(name, said=f"{said}{given}.")
    return array


def require_at_most(name: str, array: Array, largest: float, unit: str) -> Array:
    """`array`, checked not to be beyond all sense. **Raises:** as `require_positive`."""
    return _require(name, array, _known(array) <= largest, f"must be at most {largest:g} {unit}")


def require_positive(name: str, value: Scalar) -> Array:
    """`value` as an array, checked to be above zero (NaN is not).

    **Raises:** `ValueError` that names the argument; when traced, an error as the computation runs.
    """
    array = jnp.asarray(value, dtype=float)
    return _require(name, array, _known(array) > 0, "must be positive")


def require_not_negative(name: str, value: Scalar) -> Array:
    """`value` as an array, checked to be zero or above (NaN is not). **Raises:** as above."""
    array = jnp.asarray(value, dtype=float)
    return _require(name, array, _known(array) >= 0, "must not be negative")
