"""Objectives: numbers that a design is measured by. They add up, and exact ones have a slope.

An objective is asked for its values at many places of a design space at once, so that expensive ones run in one batch.
Slopes are with respect to places: 0 is a parameter's lower bound, 1 its upper bound.
"""

import abc
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, Self, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError, InputError
from .._parameters import parameter_paths, parameters, replace
from .._pytrees import Scalar, compiled
from ..lanes import sobol
from ..models import AbstractForcedSystem


Design = TypeVar("Design", bound=AbstractForcedSystem)
"""Model that is designed; its changed designs are of the same kind."""
Models = Sequence[AbstractForcedSystem]
Scatter = Callable[[Float[np.ndarray, " draws"]], Float[np.ndarray, " draws"]]
"""Made value over nominal value, from evenly drawn numbers between 0 and 1."""


@dataclasses.dataclass(frozen=True, eq=False)
class DesignSpace(Generic[Design]):
    """A design, the parameters that may change, and their bounds."""

    system: Design
    bounds: Mapping[str, tuple[float, float]]
    """Smallest and largest value [SI] by parameter name."""

    @classmethod
    def of(cls, system: Design, vary: Mapping[str, tuple[float, float]]) -> "DesignSpace[Design]":
        """The space within bounds [SI] by parameter name.

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
        """Place of the design itself."""
        return self.place_of(parameters(self.system))

    def place_of(self, values: Mapping[str, Any]) -> Float[np.ndarray, " n"]:
        """Place of parameters [SI]."""
        return (np.array([float(values[name]) for name in self.names]) - self.lower) / self.span

    def values(self, place: Float[np.ndarray, " n"]) -> dict[str, float]:
        """Parameters [SI] at a place."""
        return dict(zip(self.names, (self.lower + np.asarray(place) * self.span).tolist(), strict=True))

    def model(self, place: Float[np.ndarray, " n"]) -> Design:
        """The design at a place."""
        return replace(self.system, **self.values(place))

    def models(self, places: Float[np.ndarray, "k n"]) -> list[Design]:
        """The designs at some places."""
        return [self.model(place) for place in places]

    def slope_of(self, derivative: Mapping[str, float]) -> Float[np.ndarray, " n"]:
        """Derivatives by the place, from derivatives by the parameters [SI]."""
        return np.array([derivative[name] for name in self.names]) * self.span


@dataclasses.dataclass(frozen=True)
class Measured:
    """An exact objective at one place; NaN where it has no value, and `status` says why."""

    value: float
    slope: Float[np.ndarray, " n"]
    """d value / d place."""
    status: str = "ok"


class AbstractObjective(abc.ABC):
    """A number to be made small. Objectives are added and multiplied by numbers: `width + 200 * cost`."""

    @abc.abstractmethod
    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        """Value at each place; NaN where there is none."""

    def by_block(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k blocks"]:
        """Values from each block of the runs, the mean of which is the value; one block of what is exact."""
        return np.asarray(self.values(space, places))[:, None]

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        """Value and slope at each place.

        **Raises:** `ValueError` for an objective that has no slope, such as the width of chaos.
        """
        said = f"must have a slope, but {type(self).__name__} has none: `jaxcage.design.surrogate_search` takes none."
        raise ArgumentError("objective", said=said)

    def samples(self, models: Models) -> Float[np.ndarray, "k starts blocks"]:
        """Value of each design from each initial state and block of the runs; their mean is the value.

        **Raises:** `ValueError` for an objective that follows orbits through a design space.
        """
        said = f"must be a statistic or a function of the design, but {type(self).__name__} is neither."
        raise ArgumentError("objective", said=said)

    def estimate(self, models: Models) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
        """Value of each design, and its standard error from the scatter of initial states; NaN where there is one."""
        each = self.samples(models)
        by_start = each.mean(axis=2)
        count = by_start.shape[1]
        error = by_start.std(axis=1, ddof=1) / np.sqrt(count) if count > 1 else np.full(len(each), np.nan)
        return by_start.mean(axis=1), error

    def negligible(self, model: AbstractForcedSystem) -> float:
        """Value below which this is next to nothing for a model."""
        return 0.0

    def unit(self, model: AbstractForcedSystem) -> str:
        """Unit of the value."""
        return "1"

    def on(self, runs: Any) -> Self:
        """The same read off other runs."""
        return self

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
    """An objective that is computed for one design after the other, its value and slope together."""

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

    def _total(self, of: Callable[[AbstractObjective], Any]) -> Any:
        return sum(weight * of(part) for weight, part in self.parts)

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return self._total(lambda part: part.values(space, places))

    def by_block(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k blocks"]:
        return self._total(lambda part: part.by_block(space, places))

    def samples(self, models: Models) -> Float[np.ndarray, "k starts blocks"]:
        return self._total(lambda part: part.samples(models))

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        weights = np.array([w for w, _ in self.parts])
        rows = zip(*(part.measure(space, places) for _, part in self.parts), strict=True)
        return [_weighted(weights, row) for row in rows]

    def negligible(self, model: AbstractForcedSystem) -> float:
        return max(weight * part.negligible(model) for weight, part in self.parts)

    def unit(self, model: AbstractForcedSystem) -> str:
        return self.parts[0][1].unit(model)

    def on(self, runs: Any) -> "_Sum":
        return _Sum(tuple((weight, part.on(runs)) for weight, part in self.parts))


def _weighted(weights: np.ndarray, row: Sequence[Measured]) -> Measured:
    value, slope = weights @ [m.value for m in row], weights @ np.array([m.slope for m in row])
    return Measured(float(value), slope, next((m.status for m in row if m.status != "ok"), "ok"))


@dataclasses.dataclass(frozen=True)
class Smooth(AbstractObjective):
    """A differentiable JAX function of the design, such as its cost; the derivative is exact."""

    function: Callable[..., Scalar]
    """Function of the system that returns a number."""

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        value, slope = _value_and_slope(self.function, space.system, tuple(space.bounds.items()), jnp.asarray(places))
        known = np.isfinite(value) & np.all(np.isfinite(slope), axis=1)
        return [
            Measured(float(v), np.asarray(s), "ok" if fine else "not finite here")
            for v, s, fine in zip(np.asarray(value), np.asarray(slope), known, strict=True)
        ]

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.asarray(_values(self.function, space.system, tuple(space.bounds.items()), jnp.asarray(places)))

    def samples(self, models: Models) -> Float[np.ndarray, "k starts blocks"]:
        return np.array([float(self.function(model)) for model in models])[:, None, None]


def _of_place(function: Callable, system: Any, bounds: Sequence[Any]) -> Callable[[Array], Array]:
    """The function of a place."""

    def at(place: Array) -> Array:
        chosen = {name: low + place[i] * (high - low) for i, (name, (low, high)) in enumerate(bounds)}
        return jnp.asarray(function(replace(system, **chosen)), dtype=float)

    return at


@compiled
def _value_and_slope(function: Callable, system: Any, bounds: Any, places: Array) -> tuple[Array, Array]:
    f = _of_place(function, system, bounds)  # forward mode, since few parameters vary
    slope, value = jax.vmap(jax.jacfwd(lambda p: (f(p),) * 2, has_aux=True))(places)
    return value, slope


@compiled
def _values(function: Callable, system: Any, bounds: Any, places: Array) -> Array:
    return jax.vmap(_of_place(function, system, bounds))(places)


@dataclasses.dataclass(frozen=True)
class Price:
    """Cost of accuracy in one parameter: `amount` at `at`, in proportion to (value/at)^exponent."""

    amount: float
    at: float
    """[SI]."""
    exponent: float = -1.0
    """Negative where small values are dear."""


COSTS: Mapping[str, Price] = {
    "guidance_gap": Price(1.0, 0.45e-3),
    "eccentricity": Price(1.0, 23e-6),
}
"""The cage of the paper's case 1a costs 2: one part for turning cage and rib to their gap, one for balancing. Both
fall with the reciprocal of the value, a common form of tolerance costs. A default to be replaced by a shop's own."""


def cost(prices: Mapping[str, Price] = COSTS) -> Smooth:
    """Manufacturing cost: the sum of the prices of some parameters, in units of their amounts."""

    def total(system: AbstractForcedSystem) -> Array:
        value = parameters(system)
        return sum((p.amount * (value[n] / p.at) ** p.exponent for n, p in prices.items()), jnp.zeros(()))

    return Smooth(total)


def uniform(half_width: float) -> Scatter:
    """Scatter evenly within +-`half_width`, below 1, about the nominal value."""
    if not 0 <= half_width < 1:
        raise ArgumentError("half_width", said=f"must be at least 0 and below 1, but {half_width:g} was given.")
    return lambda q: 1 + half_width * (2 * q - 1)


def rayleigh() -> Scatter:
    """Scatter by Rayleigh's distribution with mean 1: the size of a vector with two normal components, such as an
    eccentricity left by balancing."""
    return lambda q: np.sqrt(-2 * np.log1p(-np.clip(q, 0, 1 - 1e-9))) / np.sqrt(np.pi / 2)


@dataclasses.dataclass(frozen=True, eq=False)
class Robust(AbstractObjective):
    """The mean of an objective over the designs that manufacture makes of a nominal one, or the mean of the worst.

    The scatter comes from the same quasi-random numbers in every design. A made design counts with its own slope, times
    the change of the made value with the nominal one.
    """

    objective: AbstractObjective
    scatter: Mapping[str, Scatter]
    """Made over nominal value by parameter name."""
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
        """Places of the made designs, beyond the bounds too."""
        return (self.factors(space) * list(space.values(place).values()) - space.lower) / space.span

    def _counted(self, values: np.ndarray) -> np.ndarray:
        """Numbers of the worst draws along the last axis."""
        order = np.argsort(-np.nan_to_num(values, nan=np.inf), axis=-1)
        return order[..., : max(1, round(self.worst * values.shape[-1]))]

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        made = [self.made(space, place) for place in places]
        rows, found = self.objective.measure(space, np.concatenate(made)), []
        for first in range(0, len(rows), self.draws):
            some = rows[first : first + self.draws]
            counted = self._counted(np.array([m.value for m in some]))
            slope = (np.array([m.slope for m in some]) * self.factors(space))[counted].mean(axis=0)
            value = float(np.mean([some[i].value for i in counted]))
            found.append(
                Measured(value, slope, next((some[i].status for i in counted if some[i].status != "ok"), "ok"))
            )
        return found

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        made = [self.made(space, place) for place in places]
        found = self.objective.values(space, np.concatenate(made)).reshape(len(made), -1)
        return np.take_along_axis(found, self._counted(found), axis=1).mean(axis=1)
