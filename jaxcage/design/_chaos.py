"""How much of a speed range is chaotic, as a smooth statistic of an ensemble with a slope and error bars.

A chaotic edge has no equation where the attractor ends or a torus breaks down, and the derivative of a chaotic
trajectory grows like e^(lambda n), whatever the statistics do. What has a slope is an average. Every speed counts with
a smooth step of its largest exponent, every design is surrounded by a cloud of others, and the slope is that of a
least-squares plane through the cloud. The same random numbers are used at every design, so that two designs differ by
what they are and not by luck.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import expit, ndtri

from .._errors import ArgumentError
from .._sobol import sobol
from ..analysis import CHAOS_THRESHOLD
from ..integrate import AbstractMethod
from ..sweeps import rpm, sweep_designs
from ._objective import AbstractObjective, DesignSpace, Measured


TOGETHER = 96
"""Designs swept in one batch."""
RESAMPLED = 400
"""Bootstrap samples behind a standard error."""


class Ran(NamedTuple):
    """Designs after their revolutions."""

    exponent: Float[np.ndarray, "k speeds starts"]
    last: Float[np.ndarray, "k speeds starts dim"]


@dataclasses.dataclass(frozen=True, eq=False)
class ChaosMeasure(AbstractObjective):
    """Sum over speeds of a weight times how chaotic the design is there (0 to 1, the worst of its starts)."""

    speeds: Float[np.ndarray, " speeds"]
    """Ascending [rad/s]."""
    weights: Float[np.ndarray, " speeds"]
    starts: int = 1
    """How many of the system's own starts."""
    discard: int = 150
    revolutions: int = 100
    softness: float = 0.02
    """Half width of the step, in exponents per revolution."""
    cloud: int = 12
    """Designs around each, a multiple of 2: they come in opposite pairs."""
    spread: float = 0.03
    """Standard deviation of the cloud, as a part of the distance between the bounds."""
    seed: int = 0
    method: AbstractMethod | None = None
    _last: list[Any] = dataclasses.field(default_factory=list, init=False, repr=False)
    _read: dict[Any, Any] = dataclasses.field(default_factory=dict, init=False, repr=False)

    def __post_init__(self):
        if self.cloud < 4 or self.cloud % 2:
            raise ArgumentError("cloud", said=f"must be an even number from 4 up, but {self.cloud} was given.")
        if not self.spread > 0 or not self.softness > 0:
            given = f"{self.spread} and {self.softness}"
            raise ArgumentError("spread", "softness", said=f"must be positive, but {given} were given.")

    @property
    def resolution_rpm(self) -> float:
        """Largest distance between two speeds."""
        return float(np.max(np.diff(self.speeds))) * 30 / np.pi if self.speeds.size > 1 else float("inf")

    def run(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> "Ran":
        """The designs run over the speeds; what was run last is known, for other terms of a sum that ask for it."""
        key = space.system, space.unknowns, np.asarray(places).tobytes()
        if self._last and self._last[0][2] == key[2] and self._last[0][0] is key[0] and self._last[0][1] == key[1]:
            return self._last[0][3]
        rows = []
        for part in np.array_split(places, -(-len(places) // TOGETHER)):
            models = [space.model(place) for place in part]
            rows += sweep_designs(
                models,
                self.speeds,
                starts=self.starts,
                discard=self.discard,
                revolutions=self.revolutions,
                exponents=1,
                blocks=1,
                keep=1,
                method=self.method,
            )
        ran = Ran(np.array([s.exponents[..., 0] for s in rows]), np.array([s.last for s in rows]))
        self._last[:] = [(*key, ran)]
        return ran

    def read_off(
        self, space: DesignSpace, places: Float[np.ndarray, "k n"], what: Any, read: Callable[["Ran"], Any]
    ) -> Any:
        """What `read` makes of a run; what was read last is known, for other terms of a sum that ask for `what`."""
        ran = self.run(space, places)
        if what not in self._read or self._read[what][0] is not ran:
            self._read[what] = ran, read(ran)
        return self._read[what][1]

    def chaos(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k speeds"]:
        """How chaotic each design is at each speed. A lane that failed counts as chaotic: nothing says it is calm."""
        level = expit((self.run(space, places).exponent - CHAOS_THRESHOLD) / self.softness)
        return np.max(np.where(np.isfinite(level), level, 1.0), axis=2)

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return self.chaos(space, np.asarray(places)) @ self.weights

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        return self.through_cloud(space, places, self.values)

    def through_cloud(
        self,
        space: DesignSpace,
        places: Float[np.ndarray, "k n"],
        values: Callable[[DesignSpace, Float[np.ndarray, "k n"]], Float[np.ndarray, " k"]],
    ) -> list[Measured]:
        """Value and slope of `values` at each place, from the cloud of designs around it."""
        steps = self.spread * self._directions(len(space.unknowns))
        around = np.clip(
            np.asarray(places)[:, None, None] + steps[None, None] * np.array([[1.0], [-1.0]])[:, None], 0, 1
        )
        k, _, pairs, n = around.shape
        found = values(space, around.reshape(-1, n)).reshape(k, 2, pairs)
        rng = np.random.default_rng(self.seed)
        drawn = np.concatenate([np.arange(pairs)[None], rng.integers(0, pairs, (RESAMPLED, pairs))])
        return [self._plane(around[i], found[i], drawn) for i in range(k)]

    def _directions(self, n: int) -> Float[np.ndarray, "pairs n"]:
        """Evenly spread over a normal distribution, the same at every design."""
        return ndtri(np.clip(sobol(n, self.cloud // 2, self.seed), 1e-3, 1 - 1e-3))

    def _plane(self, around: np.ndarray, found: np.ndarray, drawn: np.ndarray) -> Measured:
        """Value and slope from pairs of opposite designs, with errors by the bootstrap over pairs."""
        apart, change, middle = around[0] - around[1], found[0] - found[1], found.mean(axis=0)
        if not np.all(np.isfinite(found)):
            nothing = np.full(around.shape[-1], np.nan)
            return Measured(math.nan, math.nan, nothing, nothing, "every start of a design near it failed")
        slopes = np.array([np.linalg.lstsq(apart[rows], change[rows], rcond=1e-6)[0] for rows in drawn])
        pairs, n = apart.shape
        small = np.sqrt(pairs / max(pairs - n, 1))  # the bootstrap of few pairs is too sure of itself
        return Measured(
            float(middle.mean()),
            float(middle.std(ddof=1) / np.sqrt(pairs)),
            slopes[0],
            small * slopes[1:].std(axis=0, ddof=1),
        )


def chaotic_width(first_rpm: float, last_rpm: float, count: int = 48, **options: Any) -> ChaosMeasure:
    """Chaotic speeds between two [rpm], on a grid of `count` speeds: a smoothed width of the zones in that range.

    **Arguments:** range and speeds; the fields of `ChaosMeasure`.

    **Returns:** an objective in rpm, at the resolution of the grid and of the cloud.
    """
    speeds = rpm(first_rpm, last_rpm, count)
    return ChaosMeasure(speeds, np.full(count, (last_rpm - first_rpm) / count), **options)


def chaotic_share(spectrum: Sequence[tuple[float, float, float]], count: int = 12, **options: Any) -> ChaosMeasure:
    """Share of its running time that a cage is chaotic.

    **Arguments:** operating spectrum as rows (first rpm, last rpm, hours), `count` speeds in each; ranges must not
    overlap; the fields of `ChaosMeasure`.

    **Raises:** `ValueError` for ranges that overlap or descend.
    """
    rows = sorted(spectrum)
    ends = [x for first, last, _ in rows for x in (first, last)]
    if not rows or any(b <= a for a, b in zip(ends[:-1], ends[1:], strict=True)):
        raise ArgumentError("spectrum", said=f"must hold ranges that ascend and do not overlap, but is {spectrum}.")
    speeds = np.concatenate([rpm(first, last, count) for first, last, _ in rows])
    hours = np.repeat([h for *_, h in rows], count)
    return ChaosMeasure(speeds, hours / hours.sum(), **options)
