"""Design spaces: a design, the parameters that may change, and their bounds."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError, InputError, parameters_like
from .._parameters import parameter_paths, parameters, replace
from .._pytrees import compiled
from ..models import AbstractForcedSystem


Models = Sequence[AbstractForcedSystem]
Bounds = Mapping[str, tuple[float, float]]
"""Smallest and largest value [SI] by parameter name."""
Places = Float[np.ndarray, "designs n"]
"""Parameters of designs, scaled to 0 at their lower and 1 at their upper bounds."""


class Value(NamedTuple):
    """Property of a design, its gradient in the design space, and the cage speed [rpm] at which it occurs."""

    value: float
    slope: Float[np.ndarray, " n"]
    rpm: float = float("nan")


class DesignSpace(eqx.Module):
    """Design with bounds of some parameters: a differentiable function from a place, 0 to 1 in each, to a design."""

    system: AbstractForcedSystem
    lower: Float[np.ndarray, " n"]
    """Lower bounds [SI]."""
    span: Float[np.ndarray, " n"]
    """Upper minus lower bounds [SI]."""
    names: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, system: AbstractForcedSystem, vary: Bounds) -> "DesignSpace":
        """Design space within bounds.

        **Raises:** `ValueError` for a parameter that the system does not have, bounds that do not ascend, or none.
        """
        if not vary:
            raise ArgumentError("vary", said="must hold at least one parameter, but it is empty.")
        known = parameter_paths(system)
        for name, (low, high) in vary.items():
            if name not in known:
                raise InputError(f"`{name}` must be {parameters_like(name, [*known])}.")
            if not (np.isfinite([low, high]).all() and low < high):
                raise InputError(f"Bounds of `{name}` must ascend, but {low} and {high} were given.")
        low, high = np.array(list(vary.values()), dtype=float).T
        return cls(system, low, high - low, tuple(vary))

    @property
    def place(self) -> Float[np.ndarray, " n"]:
        """Place of the given design."""
        known = parameters(self.system)
        return (np.array([float(known[name]) for name in self.names]) - self.lower) / self.span

    def values(self, place: Float[np.ndarray, " n"]) -> dict[str, float]:
        """Parameters [SI] at a place."""
        return dict(zip(self.names, (self.lower + place * self.span).tolist(), strict=True))

    def model(self, place: Float[np.ndarray, " n"]) -> AbstractForcedSystem:
        """Design at a place."""
        return replace(self.system, **self.values(place))

    def models(self, places: Places) -> list[AbstractForcedSystem]:
        return [self.model(place) for place in places]

    def slope_of(self, derivative: Mapping[str, float]) -> Float[np.ndarray, " n"]:
        """Gradient in the design space, from derivatives by the parameters [SI]."""
        return np.array([derivative[name] for name in self.names]) * self.span

    def __call__(self, place: Float[Array, " n"]) -> AbstractForcedSystem:
        values = self.lower + place * self.span
        return replace(self.system, **{name: values[i] for i, name in enumerate(self.names)})


@compiled
def function_value(function: Callable[[Any], Any], designs: DesignSpace, place: Array) -> tuple[Array, Array]:
    """Value and gradient of a function of the design, at a place."""
    f = lambda x: jnp.asarray(function(designs(x)), dtype=float)
    slope, value = jax.jacfwd(lambda x: (f(x),) * 2, has_aux=True)(place)
    return value, slope
