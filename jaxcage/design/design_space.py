"""A design with the parameters that may change and their bounds: places between them, and the designs there."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError, InputError
from .._parameters import parameter_paths, parameters, replace
from .._pytrees import compiled
from ..models import AbstractForcedSystem


Models = Sequence[AbstractForcedSystem]
Bounds = Mapping[str, tuple[float, float]]
"""Smallest and largest value [SI] by parameter name."""
Places = Float[np.ndarray, "designs n"]
"""Parameters of designs as parts of the way from their lower bounds to their upper ones."""


class Value(NamedTuple):
    """A number that a design is judged by, its derivatives by the place in the design space, and the cage speed [rpm]
    to which it belongs."""

    value: float
    slope: Float[np.ndarray, " n"]
    rpm: float = float("nan")


class DesignSpace(eqx.Module):
    """A design and bounds of some parameters: a function from a place, 0 to 1 in each parameter, to the design there,
    which JAX differentiates."""

    system: AbstractForcedSystem
    lower: Float[np.ndarray, " n"]
    """Smallest values [SI]."""
    span: Float[np.ndarray, " n"]
    """Distances of the bounds [SI]."""
    names: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, system: AbstractForcedSystem, vary: Bounds) -> "DesignSpace":
        """The space within bounds.

        **Raises:** `ValueError` for a parameter that the system does not have, bounds that do not ascend, or none.
        """
        if not vary:
            raise ArgumentError("vary", said="must hold at least one parameter, but it is empty.")
        known = parameter_paths(system)
        for name, (low, high) in vary.items():
            if name not in known:
                raise InputError(f"`{name}` must be a parameter of the design: {', '.join(known)}.")
            if not (np.isfinite([low, high]).all() and low < high):
                raise InputError(f"Bounds of `{name}` must ascend, but {low} and {high} were given.")
        low, high = np.array(list(vary.values()), dtype=float).T
        return cls(system, low, high - low, tuple(vary))

    @property
    def place(self) -> Float[np.ndarray, " n"]:
        """Place of the design itself."""
        known = parameters(self.system)
        return (np.array([float(known[name]) for name in self.names]) - self.lower) / self.span

    def values(self, place: Float[np.ndarray, " n"]) -> dict[str, float]:
        """Parameters [SI] at a place."""
        return dict(zip(self.names, (self.lower + place * self.span).tolist(), strict=True))

    def model(self, place: Float[np.ndarray, " n"]) -> AbstractForcedSystem:
        """The design at a place."""
        return replace(self.system, **self.values(place))

    def models(self, places: Places) -> list[AbstractForcedSystem]:
        """The designs at some places."""
        return [self.model(place) for place in places]

    def slope_of(self, derivative: Mapping[str, float]) -> Float[np.ndarray, " n"]:
        """Derivatives by the place, from derivatives by the parameters [SI]."""
        return np.array([derivative[name] for name in self.names]) * self.span

    def __call__(self, place: Float[Array, " n"]) -> AbstractForcedSystem:
        values = self.lower + place * self.span
        return replace(self.system, **{name: values[i] for i, name in enumerate(self.names)})


@compiled
def function_value(function: Callable[[Any], Any], designs: DesignSpace, place: Array) -> tuple[Array, Array]:
    """Return a function of the design and its derivatives by the place."""
    f = lambda x: jnp.asarray(function(designs(x)), dtype=float)
    slope, value = jax.jacfwd(lambda x: (f(x),) * 2, has_aux=True)(place)
    return value, slope
