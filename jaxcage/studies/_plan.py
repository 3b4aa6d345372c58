"""What a study varies, and how its lanes are cut into chunks.

A lane is one sample, one value on each axis of the grid, and one start. Its numbers follow from the plan and its place
alone, so that any process can compute any chunk, today or next week, and gets the same bits.
"""

import dataclasses
import functools
import hashlib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from .._arguments import require_at_least
from .._errors import ArgumentError
from .._sobol import sobol
from ._vary import Spread


SAMPLE, START = "sample", "start"
LANES = 2048
"""Lanes of a chunk, at most: some seconds of work, which is what a kill costs."""

Values = dict[str, Float[np.ndarray, " lanes"]]
"""Parameter by name -> its value in each lane [SI]."""


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """The lanes of a study: samples x grid x starts, in chunks that are blocks of this grid."""

    grid: Mapping[str, Float[np.ndarray, " values"]]
    """Parameter -> its values [SI], one axis each."""
    sampled: Mapping[str, Spread]
    """Parameter -> how it is sampled; all of them together are one axis."""
    samples: int
    seed: int
    """Of the scrambled Sobol sequence."""
    starts: int
    lanes: int = LANES
    """Lanes of a chunk, at most."""

    def __post_init__(self):
        for name, values in self.grid.items():
            distinct = np.unique(values).size == np.size(values) > 0
            if np.ndim(values) != 1 or not distinct or not np.all(np.isfinite(values)):
                raise ArgumentError("vary", said=f"must hold distinct numbers for {name}, but {values} was given.")
        if both := set(self.grid) & set(self.sampled):
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
        require_at_least(1, starts=self.starts, lanes=self.lanes)

    @property
    def names(self) -> tuple[str, ...]:
        """Everything that is varied."""
        return (*self.sampled, *self.grid)

    @property
    def axes(self) -> dict[str, int]:
        """Length of each axis by name, the slowest first."""
        sample = {SAMPLE: self.samples} if self.sampled else {}
        return {**sample, **{name: len(values) for name, values in self.grid.items()}, START: self.starts}

    @property
    def shape(self) -> tuple[int, ...]:
        """Lanes along each axis."""
        return tuple(self.axes.values())

    @property
    def size(self) -> int:
        """Lanes in all."""
        return math.prod(self.shape)

    @functools.cached_property
    def cloud(self) -> dict[str, Float[np.ndarray, " samples"]]:
        """The samples [SI]: scrambled Sobol points, taken through the distribution of each parameter."""
        if not self.sampled:
            return {}
        places = sobol(len(self.sampled), self.samples, self.seed)
        return {name: spread.at(places[:, i]) for i, (name, spread) in enumerate(self.sampled.items())}

    @functools.cached_property
    def block(self) -> tuple[int, ...]:
        """Extent of a chunk along each axis: the fastest axes whole, the next in equal parts that there is room for."""
        room, extents = self.lanes, []
        for length in reversed(self.shape):
            parts = -(-length // max(room, 1))
            extents.append(-(-length // parts))
            room //= length
        return tuple(reversed(extents))

    @property
    def blocks(self) -> tuple[int, ...]:
        """Number of chunks along each axis."""
        return tuple(-(-length // extent) for length, extent in zip(self.shape, self.block, strict=True))

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return math.prod(self.blocks)

    def region(self, chunk: int) -> tuple[slice, ...]:
        """Where a chunk lies in the grid."""
        place = np.unravel_index(chunk, self.blocks)
        corners = zip(place, self.block, self.shape, strict=True)
        return tuple(slice(int(i) * extent, min((int(i) + 1) * extent, length)) for i, extent, length in corners)

    def lanes_of(self, chunk: int) -> Int[np.ndarray, " lanes"]:
        """Numbers of the lanes of a chunk, counted through the grid."""
        within = np.ix_(*(np.arange(part.start, part.stop) for part in self.region(chunk)))
        return np.ravel_multi_index(within, self.shape).ravel()

    def at(self, lane: Int[np.ndarray, " lanes"]) -> tuple[Values, Int[np.ndarray, " lanes"]]:
        """What each lane has: the value of every varied parameter, and the number of its start."""
        place = dict(zip(self.axes, np.unravel_index(lane, self.shape), strict=True))
        sampled = {name: values[place[SAMPLE]] for name, values in self.cloud.items()}
        return {**sampled, **{name: values[place[name]] for name, values in self.grid.items()}}, place[START]

    def describe(self) -> dict[str, Any]:
        """Everything that the lanes follow from, for a store to be recognised by."""
        return {
            "grid": {name: _summary(values) for name, values in self.grid.items()},
            "sampled": {name: repr(spread) for name, spread in self.sampled.items()},
            "cloud": {name: _summary(values) for name, values in self.cloud.items()},
            "samples": self.samples,
            "seed": self.seed if self.sampled else None,
            "starts": self.starts,
            "lanes": self.lanes,
        }


def _summary(values: np.ndarray) -> list[Any]:
    """Count, ends and a digest of every bit."""
    exact = np.ascontiguousarray(values, dtype="<f8")
    return [exact.size, float(exact[0]), float(exact[-1]), hashlib.sha256(exact.tobytes()).hexdigest()[:16]]
