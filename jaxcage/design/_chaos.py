"""How much of a speed range is chaotic, as a smooth statistic of lanes: every speed counts with a smooth step of its
largest exponent. It has no slope: the derivative of a chaotic trajectory grows like e^(lambda n), whatever the
statistics do.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.special import expit

from .._errors import ArgumentError
from ..analysis import CHAOS_THRESHOLD
from ..solve import AbstractMethod
from ..sweeps import rpm, sweep_designs
from ._objective import AbstractObjective, DesignSpace


TOGETHER = 96
"""Designs swept in one batch."""


@dataclasses.dataclass(frozen=True)
class Ran:
    """Designs after their revolutions."""

    exponent: Float[np.ndarray, "k speeds starts"]
    last: Float[np.ndarray, "k speeds starts dim"]
    loads: dict[int, dict[str, np.ndarray]] = dataclasses.field(default_factory=dict)
    """What their land feels over so many revolutions more, as far as it was asked for."""


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
    method: AbstractMethod | None = None
    _last: list[Any] = dataclasses.field(default_factory=list, init=False, repr=False)

    def __post_init__(self):
        if not self.softness > 0:
            raise ArgumentError("softness", said=f"must be positive, but {self.softness} was given.")

    def run(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Ran:
        """The designs run over the speeds; what was run last is known, for other terms of a sum that ask for it."""
        key = np.asarray(places).tobytes()
        if self._last and self._last[0] is space and self._last[1] == key:
            return self._last[2]
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
        self._last[:] = [space, key, ran]
        return ran

    def chaos(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k speeds"]:
        """How chaotic each design is at each speed. A lane that failed counts as chaotic: nothing says it is calm."""
        level = expit((self.run(space, places).exponent - CHAOS_THRESHOLD) / self.softness)
        return np.max(np.where(np.isfinite(level), level, 1.0), axis=2)

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return self.chaos(space, np.asarray(places)) @ self.weights


def chaotic_width(first_rpm: float, last_rpm: float, count: int = 48, **options: Any) -> ChaosMeasure:
    """Chaotic speeds between two [rpm], on a grid of `count` speeds: a smoothed width of the zones in that range.

    **Arguments:** range and speeds; the fields of `ChaosMeasure`.

    **Returns:** an objective in rpm, at the resolution of the grid.
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
