"""What a design is measured by: numbers with a slope, each exact or with a standard error, that add up.

An objective is asked for its value and slope at many places of a design space at once, so that what is expensive runs
in one batch. Slopes are with respect to places: 0 is a parameter's lower bound, 1 the upper one.
"""

import abc
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameters import parameters, replace
from .._recent import jitted
from .._types import Scalar
from ._unknowns import Design, Unknown, check_unknowns, slope_in_place, values_at, with_values


@dataclasses.dataclass(frozen=True)
class DesignSpace(Generic[Design]):
    """A design, the parameters that may change, and their bounds."""

    system: Design
    """A forced system, or a whole bearing."""
    unknowns: tuple[Unknown, ...]

    @classmethod
    def of(cls, system: Design, vary: Mapping[str, tuple[float, float]]) -> "DesignSpace[Design]":
        """From bounds [SI] by parameter name.

        **Raises:** `ValueError` for a parameter that the system does not have, bounds that do not ascend, or none.
        """
        unknowns = tuple(Unknown(name, float(low), float(high), "linear") for name, (low, high) in vary.items())
        check_unknowns({"the design": system}, unknowns)
        return cls(system, unknowns)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(u.name for u in self.unknowns)

    @property
    def place(self) -> Float[np.ndarray, " n"]:
        """Where the design itself lies."""
        now = parameters(self.system)
        return np.array([u.place(float(now[u.targets[0]])) for u in self.unknowns])

    def values(self, place: Float[np.ndarray, " n"]) -> dict[str, float]:
        """Parameters [SI] at a place."""
        return values_at(self.unknowns, place)

    def model(self, place: Float[np.ndarray, " n"]) -> Design:
        """The design at a place."""
        return with_values(self.system, self.unknowns, place)

    def slope_of(self, derivative: Mapping[str, float], place: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """d / d place of what has these derivatives with respect to parameters [SI]."""
        return slope_in_place(self.unknowns, derivative, place)


@dataclasses.dataclass(frozen=True)
class Measured:
    """An objective at one place. NaN where it could not be had, and `status` says why."""

    value: float
    error: float
    """Standard error; 0 for a value that is exact for the equations as integrated."""
    slope: Float[np.ndarray, " n"]
    """d value / d place."""
    slope_error: Float[np.ndarray, " n"]
    status: str = "ok"


class AbstractObjective(abc.ABC):
    """A number to be made small. Objectives are added and multiplied by numbers: `width + 200 * cost`."""

    @abc.abstractmethod
    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        """Value and slope at each place."""

    @abc.abstractmethod
    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        """Value alone at each place, for searches that take no slopes; NaN where it could not be had."""

    def __add__(self, other: "AbstractObjective") -> "AbstractObjective":
        return _Sum(((1.0, self), (1.0, other)))

    def __sub__(self, other: "AbstractObjective") -> "AbstractObjective":
        return _Sum(((1.0, self), (-1.0, other)))

    def __mul__(self, weight: float) -> "AbstractObjective":
        return _Sum(((float(weight), self),))

    __rmul__ = __mul__

    def __neg__(self) -> "AbstractObjective":
        return _Sum(((-1.0, self),))


class AbstractExact(AbstractObjective):
    """An objective that is had from one design after the other, its value and slope together."""

    @abc.abstractmethod
    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Measured:
        """Value and slope at a place."""

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        return [self.at(space, place) for place in places]

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.array([self.at(space, place).value for place in places])


@dataclasses.dataclass(frozen=True)
class _Sum(AbstractObjective):
    """Weighted objectives; their errors are taken as independent."""

    parts: tuple[tuple[float, AbstractObjective], ...]

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        weights = np.array([w for w, _ in self.parts])
        rows = zip(*(part.measure(space, places) for _, part in self.parts), strict=True)
        return [_weighted(weights, row) for row in rows]

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.sum([w * part.values(space, places) for w, part in self.parts], axis=0)


def _weighted(weights: np.ndarray, row: Sequence[Measured]) -> Measured:
    total = lambda name: np.tensordot(weights, np.array([getattr(m, name) for m in row]), 1)
    spread = lambda name: np.sqrt(np.tensordot(weights**2, np.array([getattr(m, name) for m in row]) ** 2, 1))
    status = next((m.status for m in row if m.status != "ok"), "ok")
    return Measured(float(total("value")), float(spread("error")), total("slope"), spread("slope_error"), status)


@dataclasses.dataclass(frozen=True)
class Smooth(AbstractObjective):
    """Any differentiable JAX function of the design, such as a cost or a measure of a periodic orbit; its derivative is
    exact. All places are worked out under one `vmap`.
    """

    function: Callable[..., Scalar]
    """From the system to a number."""

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        value, slope = _value_and_slope(self.function, space.system, space.unknowns, jnp.asarray(places))
        nothing = np.zeros(len(space.unknowns))
        known = np.isfinite(value) & np.all(np.isfinite(slope), axis=1)
        return [
            Measured(float(v), 0.0, np.asarray(s), nothing, "ok" if fine else "not finite here")
            for v, s, fine in zip(np.asarray(value), np.asarray(slope), known, strict=True)
        ]

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.asarray(_values(self.function, space.system, space.unknowns, jnp.asarray(places)))


def _of_place(function: Callable, system: Any, unknowns: Sequence[Unknown]) -> Callable[[Array], Array]:
    """The function of a place."""

    def at(place: Array) -> Array:
        value = lambda u, p: u.lower * jnp.exp(p * u.span) if u.scale == "log" else u.lower + p * u.span
        chosen = {t: value(u, place[i]) for i, u in enumerate(unknowns) for t in u.targets}
        return jnp.asarray(function(replace(system, **chosen)), dtype=float)

    return at


@jitted
def _value_and_slope(function: Callable, system: Any, unknowns: Any, places: Array) -> tuple[Array, Array]:
    f = _of_place(function, system, unknowns)  # forward mode: few parameters vary, and orbits are simulated
    slope, value = jax.vmap(jax.jacfwd(lambda p: (f(p),) * 2, has_aux=True))(places)
    return value, slope


@jitted
def _values(function: Callable, system: Any, unknowns: Any, places: Array) -> Array:
    return jax.vmap(_of_place(function, system, unknowns))(places)
