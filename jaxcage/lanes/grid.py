"""Grids and samples of parameters, whose lanes are divided into chunks.

A lane is one sample, one value on each axis of the grid, and one initial state. Its numbers depend only on the grid and
its index, so that any process can compute any chunk at any time with identical bits.
"""

import dataclasses
import functools
import hashlib
import itertools
import math
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._arguments import require_at_least
from .._errors import ArgumentError
from .._parameters import parameter_info, pick, require_range
from ..bearing import vg
from ..files import Range
from ..models import AbstractForcedSystem, require_speeds
from ..solve import Lanes
from .plan import SPEED, START, Coordinate, Plan, own_states


SAMPLE = "sample"
OIL = "oil"
"""Name of the ISO VG grade of a mineral oil, besides the names of the model's parameters."""
LANES = 2048
"""Maximum number of lanes per chunk: a few seconds of work, which are lost if a process is killed."""

Values = dict[str, Float[np.ndarray, " lanes"]]
"""Mapping of parameter names to the value in each lane [SI]."""


def sobol(unknowns: int, draws: int, seed: int | np.random.Generator) -> Float[np.ndarray, "draws unknowns"]:
    """Scrambled Sobol points between 0 and 1."""
    from scipy.stats import qmc  # takes half a second to load

    return qmc.Sobol(unknowns, rng=seed).random_base2(math.ceil(math.log2(draws)))[:draws]


@dataclasses.dataclass(frozen=True, eq=False)
class Grid:
    """Grid of samples x values x initial states, divided into chunks that are blocks of the grid."""

    values: Mapping[str, Float[np.ndarray, " values"]]
    """Values [SI] by parameter, one axis each."""
    sampled: Mapping[str, Range]
    """Distributions by parameter; all of them together form one axis."""
    samples: int
    seed: int
    """Seed of the scrambled Sobol sequence."""
    initial_states: int
    lanes: int = LANES
    """Maximum number of lanes per chunk."""

    def __post_init__(self):
        if SPEED not in self.names:
            raise ArgumentError("vary", said="must hold the speed: a single value is enough.")
        for name, values in self.values.items():
            distinct = np.unique(values).size == np.size(values) > 0
            if np.ndim(values) != 1 or not distinct or not np.all(np.isfinite(values)):
                raise ArgumentError("vary", said=f"must hold distinct numbers for {name}, but {values} was given.")
        if both := set(self.values) & set(self.sampled):
            raise ArgumentError("vary", said=f"must name each parameter once, but names {', '.join(both)} twice.")
        if self.sampled and self.samples < 1:
            names = ", ".join(self.sampled)
            raise ArgumentError(
                "samples", said=f"must say how many samples to take of {names}, but {self.samples} was given."
            )
        if self.samples and not self.sampled:
            raise ArgumentError(
                "samples", said=f"needs an interval or a tolerance to sample, but {self.samples} was given."
            )
        require_at_least(0, seed=self.seed)
        require_at_least(1, initial_states=self.initial_states, lanes=self.lanes)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters that vary."""
        return (*self.sampled, *self.values)

    @property
    def axes(self) -> dict[str, int]:
        """Length of each axis by name, slowest first."""
        sample = {SAMPLE: self.samples} if self.sampled else {}
        return {**sample, **{name: len(values) for name, values in self.values.items()}, START: self.initial_states}

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of lanes along each axis."""
        return tuple(self.axes.values())

    @property
    def size(self) -> int:
        """Total number of lanes."""
        return math.prod(self.shape)

    @functools.cached_property
    def cloud(self) -> dict[str, Float[np.ndarray, " samples"]]:
        """Samples [SI]: scrambled Sobol points, transformed to the distribution of each parameter."""
        if not self.sampled:
            return {}
        places = sobol(len(self.sampled), self.samples, self.seed)
        return {name: spread.at(places[:, i]) for i, (name, spread) in enumerate(self.sampled.items())}

    @property
    def coordinates(self) -> dict[str, Coordinate]:
        """Values [SI] along the axes of the grid, by parameter."""
        along = {name: ((name,), np.asarray(x)) for name, x in self.values.items()}
        return along | {name: ((SAMPLE,), x) for name, x in self.cloud.items()}

    @functools.cached_property
    def block(self) -> tuple[int, ...]:
        """Extent of a chunk along each axis: the fastest axes whole, the next in equal parts within `lanes`."""
        room, extents = self.lanes, []
        for length in reversed(self.shape):
            parts = -(-length // max(room, 1))
            extents.append(-(-length // parts))
            room //= length
        return tuple(reversed(extents))

    @functools.cached_property
    def chunks(self) -> list[tuple[slice, ...]]:
        """Slices of the grid that each chunk covers."""
        cuts = lambda length, extent: [slice(i, min(i + extent, length)) for i in range(0, length, extent)]
        return list(itertools.product(*map(cuts, self.shape, self.block)))

    def lanes_of(self, chunk: int) -> Int[np.ndarray, " lanes"]:
        """Indices of the lanes of a chunk in the ravelled grid."""
        within = np.ix_(*(np.arange(part.start, part.stop) for part in self.chunks[chunk]))
        return np.ravel_multi_index(within, self.shape).ravel()

    def at(self, lane: Int[np.ndarray, " lanes"]) -> tuple[Values, Int[np.ndarray, " lanes"]]:
        """Values of every varied parameter, and the index of the initial state, for each lane."""
        place = dict(zip(self.axes, np.unravel_index(lane, self.shape), strict=True))
        sampled = {name: values[place[SAMPLE]] for name, values in self.cloud.items()}
        return {**sampled, **{name: values[place[name]] for name, values in self.values.items()}}, place[START]

    def require_known(self, model: AbstractForcedSystem) -> None:
        """Raise `ValueError` for a parameter that the model does not have, a value that it must not have, or more
        initial states than it has."""
        declared = parameter_info(model)
        for name, given in {**self.sampled, **self.values}.items():
            values = np.array([given.lower, given.upper]) if isinstance(given, Range) else given
            if name == SPEED:
                require_speeds(model, values)
            elif name != OIL:
                pick(model, name, "vary")
                if name in declared:
                    require_range(name, values, declared[name])
        if OIL in self.names and not hasattr(model, "lubricant"):
            raise ArgumentError("vary", said=f"must not hold {OIL} for a model without oil.")
        if self.initial_states > (own := len(model.initial_states(1.0))):
            raise ArgumentError("initial_states", said=f"must be at most {own}, but {self.initial_states} was given.")

    def plan(self, model: AbstractForcedSystem, lanes: Int[np.ndarray, " lanes"] | None = None) -> Plan:
        """Plan of some lanes of a model, on one axis `lane`, or of all, over the axes of the grid."""
        some = np.arange(self.size) if lanes is None else lanes
        values, start = self.at(some)
        speed = values.pop(SPEED)
        if values:
            given = {name: jnp.asarray(x) for name, x in values.items()}
            designs = eqx.filter_vmap(lambda own: with_values(model, own), axis_size=some.size)(given)
            chosen = Lanes(designs, max(some.size, 2), np.arange(some.size), speed)
        else:
            chosen = Lanes.of([model], speed)
        states = chosen.each(own_states, np.arange(some.size))[np.arange(some.size), start]
        if lanes is not None:
            return Plan(chosen, states, {"lane": some.size}, {SPEED: (("lane",), speed)})
        return Plan(chosen, states, self.axes, self.coordinates)

    def describe(self) -> dict[str, Any]:
        """Description that determines the lanes, by which a store recognises its study."""
        return {
            "grid": {name: _summary(values) for name, values in self.values.items()},
            "sampled": {name: repr(spread) for name, spread in self.sampled.items()},
            "cloud": {name: _summary(values) for name, values in self.cloud.items()},
            "samples": self.samples,
            "seed": self.seed if self.sampled else None,
            "initial_states": self.initial_states,
            "lanes": self.lanes,
        }


def _summary(values: np.ndarray) -> list[Any]:
    """Count, first and last value, and a hash of all."""
    exact = np.ascontiguousarray(values, dtype="<f8")
    return [exact.size, float(exact[0]), float(exact[-1]), hashlib.sha256(exact.tobytes()).hexdigest()[:16]]


def with_values(model: Any, values: Mapping[str, Any]) -> Any:
    """Model with parameters set by name; `oil` makes the lubricant a mineral oil of that ISO VG grade."""
    for name, value in values.items():
        if name == OIL:
            model = eqx.tree_at(lambda m: m.lubricant, model, vg(value, model.lubricant.temperature))
        else:
            model = eqx.tree_at(pick(model, name), model, value)
    return model
