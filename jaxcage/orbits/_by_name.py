"""Parameters by name: reading and setting one number of any system."""

from collections.abc import Callable
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._errors import ArgumentError
from .._parameters import get, parameter_paths
from ..models import AbstractForcedSystem


Parameter: TypeAlias = str | Callable[[Any], Any]
"""`"speed"`, the name of a parameter, or a function that picks it from the system, as `equinox.tree_at` takes."""

SPEED = "speed"


def _by_field_name(system: AbstractForcedSystem) -> dict[str, tuple[str, ...]]:
    """Numbers of a user's own module by the last word of their path, dotted where that alone is ambiguous."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(system)
    paths: list[tuple[str, ...]] = []
    for path, leaf in leaves:
        names = tuple(key.name for key in path if isinstance(key, jax.tree_util.GetAttrKey))
        public = len(names) == len(path) and not any(name.startswith("_") for name in names)
        if public and (isinstance(leaf, float) or eqx.is_inexact_array(leaf)) and jnp.ndim(leaf) == 0:
            paths.append(names)
    last = [path[-1] for path in paths]
    return {(path[-1] if last.count(path[-1]) == 1 else ".".join(path)): path for path in paths}


def pick(system: AbstractForcedSystem, parameter: Parameter) -> Callable[[Any], Any]:
    """The function that picks `parameter` from a system.

    **Raises:** `ValueError` for a name the system does not have, and for a function that picks no number of it.
    """
    if callable(parameter):
        picked = parameter(system)
        if not any(picked is leaf for leaf in jax.tree.leaves(system)) or jnp.ndim(picked):
            said = "must pick a number that the system holds as it is, such as `lambda s: s.acceleration.force`"
            raise ArgumentError("parameter", said=f"{said}, but picks something else.")
        return parameter
    paths = parameter_paths(system) or _by_field_name(system)
    if parameter not in paths:
        known = ", ".join([SPEED, *paths])
        raise ArgumentError("parameter", said=f"must be one of {known}, but '{parameter}' was given.")
    path = paths[parameter]
    return lambda s: get(s, path)


def value(system: AbstractForcedSystem, speed: Any, parameter: Parameter) -> Array:
    """What `parameter` is now."""
    return jnp.asarray(speed if parameter == SPEED else pick(system, parameter)(system), dtype=float)


def with_value(
    system: AbstractForcedSystem, speed: Any, parameter: Parameter, new: Any
) -> tuple[AbstractForcedSystem, Any]:
    """System and speed with `parameter` set to `new`."""
    if parameter == SPEED:
        return system, new
    return eqx.tree_at(pick(system, parameter), system, new), speed
