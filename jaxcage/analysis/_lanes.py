"""Strobe maps of many lanes at once, with what is the same in every lane kept as scalars.

A compiled step reads some thirty numbers per lane. Those that do not depend on the speed are the same for all lanes;
left as scalars instead of arrays they halve the run time (they stay in registers, and what follows from them alone is
worked out once).
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.extend as jex
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from .._types import LaneState
from ..integrate import AbstractMethod, StrobeMap, strobe_map
from ..models import AbstractForcedSystem


def depends_on_input(f: Callable[[Array], PyTree[Array]], x: Array) -> PyTree[bool]:
    """For each array that f(x) returns, whether it depends on x."""
    traced, shape = jax.make_jaxpr(f, return_shape=True)(x)
    touched = set(traced.jaxpr.invars)
    reached = lambda v: not isinstance(v, jex.core.Literal) and v in touched
    for equation in traced.jaxpr.eqns:
        if any(map(reached, equation.invars)):
            touched.update(equation.outvars)
    return jax.tree.unflatten(jax.tree.structure(shape), list(map(reached, traced.jaxpr.outvars)))


class StrobeLanes(eqx.Module):
    """The strobe maps of lanes that share a system and differ in speed."""

    own: StrobeMap  # arrays that differ from lane to lane, the lane axis first; None elsewhere
    shared: StrobeMap  # the rest
    scale: LaneState

    @classmethod
    def of(cls, system: AbstractForcedSystem, method: AbstractMethod, speed: Float[Array, " lanes"]) -> "StrobeLanes":
        """One lane per speed [rad/s]."""
        make = lambda s: strobe_map(system, s, method)
        differs = depends_on_input(lambda s: eqx.filter(make(s), eqx.is_array), speed[0])
        stacked = eqx.filter(eqx.filter_vmap(make)(speed), eqx.is_array)
        alike, static = eqx.partition(make(speed[0]), eqx.is_array)
        own = jax.tree.map(lambda varies, x: x if varies else None, differs, stacked)
        shared = eqx.combine(jax.tree.map(lambda varies, x: None if varies else x, differs, alike), static)
        scale = tuple(jnp.broadcast_to(c, speed.shape) for c in stacked.scale)
        return cls(own, shared, scale)

    def map(self, f: Callable[[StrobeMap, Any], Any], y: LaneState) -> Any:
        """f(strobe map, state) in every lane."""
        return eqx.filter_vmap(lambda own, state: f(eqx.combine(own, self.shared), state))(self.own, y)
