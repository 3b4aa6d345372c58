"""Array types of public signatures (jaxtyping, checked in the tests only); pytrees split into arrays and the rest."""

import functools
import gc
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float


Scalar: TypeAlias = Float[Array, ""] | float | int
"""A real number: a zero-dimensional array (traced or not) or a Python number."""

State: TypeAlias = tuple[Float[Array, "..."] | float | int, ...]
"""Coordinates, velocities or a whole state as a tuple of scalars, so that lanes stay innermost under `vmap`; for a
whole bearing two arrays, the state and the quantities beside it."""

ARRAYS = (jax.Array, np.ndarray, np.generic)


class Form(NamedTuple):
    """Structure of a pytree without its arrays."""

    tree: Any
    rest: tuple[Any, ...]
    """None for each array; other leaves with their types, since 1 equals True."""

    def filled(self, arrays: Sequence[Any]) -> Any:
        each = iter(arrays)
        return jax.tree.unflatten(self.tree, [next(each) if x is None else x[1] for x in self.rest])


def split(tree: Any, taken: Callable[[Any], bool] = lambda x: isinstance(x, ARRAYS)) -> tuple[Form, list[Any]]:
    """Split a pytree into its form and its arrays, or those of its leaves that are `taken`."""
    leaves, shape = jax.tree.flatten(tree)
    rest = tuple(None if taken(x) else (type(x), x) for x in leaves)
    return Form(shape, rest), [x for x in leaves if taken(x)]


def compiled(f: Callable[..., Any]) -> Callable[..., Any]:
    """`equinox.filter_jit` without garbage collection during calls, which takes nearly half of the tracing time."""
    jitted = eqx.filter_jit(f)

    @functools.wraps(f)
    def run(*args: Any, **kwargs: Any) -> Any:
        collects = gc.isenabled()
        gc.disable()
        try:
            return jitted(*args, **kwargs)
        finally:
            if collects:
                gc.enable()

    return run
