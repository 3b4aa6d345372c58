"""Array types of the public signatures (jaxtyping; checked at run time in the tests only)."""

from typing import TypeAlias

from jaxtyping import Array, Float


Scalar: TypeAlias = Float[Array, ""] | float | int
"""A real number: a zero-dimensional array (traced or not) or a Python number."""

State: TypeAlias = tuple[Float[Array, "..."] | float | int, ...]
"""Coordinates, velocities or a whole state as a tuple of scalars, so that lanes stay innermost under `vmap`; of a whole
bearing two arrays, the state and the quantities beside it."""
