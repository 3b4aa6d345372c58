"""What a design is measured by: numbers that add up, those that are exact with a slope.

An objective is asked for its value at many places of a design space at once, so that what is expensive runs in one
batch. Slopes are with respect to places: 0 is a parameter's lower bound, 1 the upper one.
"""

import abc
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError, InputError
from .._form import compiled
from .._parameters import parameter_paths, parameters, replace
from .._sobol import sobol
from .._types import Scalar
from ..models import AbstractForcedSystem, BearingModel


Design = TypeVar("Design", bound=AbstractForcedSystem | BearingModel)
"""What is designed, whose kind its changed designs have too: a forced system such as a cage, or a whole bearing."""
Scatter = Callable[[Float[np.ndarray, " draws"]], Float[np.ndarray, " draws"]]
"""Made value over nominal one, from evenly drawn numbers between 0 and 1."""


@dataclasses.dataclass(frozen=True, eq=False)
class DesignSpace(Generic[Design]):
    """A design, the parameters that may change, and their bounds."""

    system: Design
    """A forced system, or a whole bearing."""
    bounds: Mapping[str, tuple[float, float]]
    """Smallest and largest value [SI] by parameter name."""

    @classmethod
    def of(cls, system: Design, vary: Mapping[str, tuple[float, float]]) -> "DesignSpace[Design]":
        """From bounds [SI] by parameter name.

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
        return cls(system, {name: (float(low), float(high)) for name, (low, high) in vary.items()})

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(self.bounds)

    @property
    def lower(self) -> Float[np.ndarray, " n"]:
        """Smallest values [SI]."""
        return np.array([low for low, _ in self.bounds.values()])

    @property
    def span(self) -> Float[np.ndarray, " n"]:
        """Distances of the bounds [SI]."""
        return np.array([high - low for low, high in self.bounds.values()])

    @property
    def place(self) -> Float[np.ndarray, " n"]:
        """Where the design itself lies."""
        return self.place_of(parameters(self.system))

    def place_of(self, values: Mapping[str, Any]) -> Float[np.ndarray, " n"]:
        """Where parameters [SI] lie."""
        return (np.array([float(values[name]) for name in self.names]) - self.lower) / self.span

    def values(self, place: Float[np.ndarray, " n"]) -> dict[str, float]:
        """Parameters [SI] at a place."""
        return dict(zip(self.names, (self.lower + np.asarray(place) * self.span).tolist(), strict=True))

    def model(self, place: Float[np.ndarray, " n"]) -> Design:
        """The design at a place."""
        return replace(self.system, **self.values(place))

    def slope_of(self, derivative: Mapping[str, float]) -> Float[np.ndarray, " n"]:
        """d / d place of what has these derivatives with respect to parameters [SI]."""
        return np.array([derivative[name] for name in self.names]) * self.span


@dataclasses.dataclass(frozen=True)
class Measured:
    """An exact objective at one place. NaN where it could not be had, and `status` says why."""

    value: float
    slope: Float[np.ndarray, " n"]
    """d value / d place."""
    status: str = "ok"


class AbstractObjective(abc.ABC):
    """A number to be made small. Objectives are added and multiplied by numbers: `width + 200 * cost`."""

    @abc.abstractmethod
    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        """Value at each place; NaN where it could not be had."""

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        """Value and slope at each place.

        **Raises:** `ValueError` for an objective that has no slope, such as the width of chaos.
        """
        said = f"must have a slope, but {type(self).__name__} has none: `jaxcage.design.surrogate_search` takes none."
        raise ArgumentError("objective", said=said)

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
    """Weighted objectives."""

    parts: tuple[tuple[float, AbstractObjective], ...]

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        weights = np.array([w for w, _ in self.parts])
        rows = zip(*(part.measure(space, places) for _, part in self.parts), strict=True)
        return [_weighted(weights, row) for row in rows]

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.sum([w * part.values(space, places) for w, part in self.parts], axis=0)


def _weighted(weights: np.ndarray, row: Sequence[Measured]) -> Measured:
    value, slope = weights @ [m.value for m in row], weights @ np.array([m.slope for m in row])
    return Measured(float(value), slope, next((m.status for m in row if m.status != "ok"), "ok"))


@dataclasses.dataclass(frozen=True)
class Smooth(AbstractObjective):
    """Any differentiable JAX function of the design, such as a cost or a measure of a periodic orbit; its derivative is
    exact. All places are worked out under one `vmap`.
    """

    function: Callable[..., Scalar]
    """From the system to a number."""

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        value, slope = _value_and_slope(self.function, space.system, tuple(space.bounds.items()), jnp.asarray(places))
        known = np.isfinite(value) & np.all(np.isfinite(slope), axis=1)
        return [
            Measured(float(v), np.asarray(s), "ok" if fine else "not finite here")
            for v, s, fine in zip(np.asarray(value), np.asarray(slope), known, strict=True)
        ]

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.asarray(_values(self.function, space.system, tuple(space.bounds.items()), jnp.asarray(places)))


def _of_place(function: Callable, system: Any, bounds: Sequence[Any]) -> Callable[[Array], Array]:
    """The function of a place."""

    def at(place: Array) -> Array:
        chosen = {name: low + place[i] * (high - low) for i, (name, (low, high)) in enumerate(bounds)}
        return jnp.asarray(function(replace(system, **chosen)), dtype=float)

    return at


@compiled
def _value_and_slope(function: Callable, system: Any, bounds: Any, places: Array) -> tuple[Array, Array]:
    f = _of_place(function, system, bounds)  # forward mode: few parameters vary, and orbits are simulated
    slope, value = jax.vmap(jax.jacfwd(lambda p: (f(p),) * 2, has_aux=True))(places)
    return value, slope


@compiled
def _values(function: Callable, system: Any, bounds: Any, places: Array) -> Array:
    return jax.vmap(_of_place(function, system, bounds))(places)


def uniform(half_width: float) -> Scatter:
    """Made value over nominal one, evenly within +-`half_width`, below 1, from evenly drawn numbers between 0 and 1."""
    if not 0 <= half_width < 1:
        raise ArgumentError("half_width", said=f"must be at least 0 and below 1, but {half_width:g} was given.")
    return lambda q: 1 + half_width * (2 * q - 1)


def rayleigh() -> Scatter:
    """Made value over nominal one, Rayleigh-distributed with mean 1: the size of a vector with two normal components,
    such as an eccentricity left by balancing."""
    return lambda q: np.sqrt(-2 * np.log1p(-np.clip(q, 0, 1 - 1e-9))) / np.sqrt(np.pi / 2)


@dataclasses.dataclass(frozen=True, eq=False)
class Robust(AbstractObjective):
    """The mean of an objective over what manufacture makes of a design, or the mean of the worst of it.

    The scatter is made of the same quasi-random numbers in every design. A made design counts with its own slope, times
    what the nominal value moves the made one by.
    """

    objective: AbstractObjective
    scatter: Mapping[str, Scatter]
    """By parameter name, made over nominal value."""
    draws: int = 16
    """A power of 2."""
    worst: float = 1.0
    """Share of the draws that counts, the worst ones: 1 is the mean, 0.05 the mean of the worst twentieth."""
    seed: int = 0

    def __post_init__(self):
        if self.draws < 2 or not 0 < self.worst <= 1:
            given = f"{self.draws} and {self.worst}"
            raise ArgumentError("draws", "worst", said=f"must be at least 2 and within (0, 1], but {given} were given.")

    def factors(self, space: DesignSpace) -> Float[np.ndarray, "draws n"]:
        """Made over nominal value of each parameter that varies."""
        if missing := [name for name in self.scatter if name not in space.names]:
            raise InputError(f"Scatter of `{missing[0]}` must be of one of {', '.join(space.names)}.")
        sample = sobol(len(space.names), self.draws, self.seed)
        drawn = [self.scatter[n](q) if n in self.scatter else np.ones_like(q) for n, q in zip(space.names, sample.T)]
        return np.array(drawn).T

    def made(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Float[np.ndarray, "draws n"]:
        """Places of the made designs; beyond the bounds too."""
        return (self.factors(space) * list(space.values(place).values()) - space.lower) / space.span

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        rows = self.objective.measure(space, np.concatenate([self.made(space, place) for place in places]))
        n = len(rows) // len(places)
        return [self._over(space, rows[i * n : (i + 1) * n]) for i in range(len(places))]

    def _over(self, space: DesignSpace, rows: Sequence[Measured]) -> Measured:
        value = np.array([m.value for m in rows])
        counted = np.argsort(-np.nan_to_num(value, nan=np.inf))[: max(1, round(self.worst * len(rows)))]
        slope = np.array([m.slope for m in rows]) * self.factors(space)
        bad = next((rows[i].status for i in counted if rows[i].status != "ok"), "ok")
        return Measured(float(value[counted].mean()), slope[counted].mean(axis=0), bad)

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        made = [self.made(space, place) for place in places]
        found = self.objective.values(space, np.concatenate(made)).reshape(len(made), -1)
        count = max(1, round(self.worst * found.shape[1]))
        return -np.sort(-found, axis=1)[:, :count].mean(axis=1)
