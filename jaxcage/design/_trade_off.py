"""What several objectives cost each other: designs all over the bounds, and those that no other beats in everything."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from .._arguments import require_at_least
from .._errors import ArgumentError
from .._sobol import sobol
from ..models import AbstractForcedSystem
from ._objective import AbstractObjective, DesignSpace


@dataclasses.dataclass(frozen=True)
class TradeOff:
    """Designs and what they are worth by every objective."""

    names: tuple[str, ...]
    """Of the objectives."""
    space: DesignSpace
    places: Float[np.ndarray, "designs n"]
    values: Float[np.ndarray, "designs objectives"]
    """NaN where an objective could not be had."""

    @property
    def efficient(self) -> Bool[np.ndarray, " designs"]:
        """Designs that no other beats: none is as good in every objective and better in one. One with a NaN is not."""
        return unbeaten(self.values)

    def parameters(self, i: int) -> dict[str, float]:
        """Of the i-th design [SI]."""
        return self.space.values(self.places[i])

    def __str__(self) -> str:
        chosen = np.flatnonzero(self.efficient)
        cells = lambda i: [*self.parameters(i).values(), *self.values[i]]
        head = "  ".join([*self.space.names, *self.names])
        rows = ["  ".join(f"{x:.4g}" for x in cells(i)) for i in chosen[np.argsort(self.values[chosen, 0])].tolist()]
        return "\n".join([f"{chosen.size} of {len(self.places)} designs that no other beats", head, *rows])


def unbeaten(values: Float[np.ndarray, "designs objectives"]) -> Bool[np.ndarray, " designs"]:
    """Rows that no other beats, being as good in every column and better in one. One with a NaN is not."""
    known = np.all(np.isfinite(values), axis=1)
    kept = np.where(known[:, None], values, np.inf)
    no_worse = np.all(kept[:, None] <= kept[None], axis=2)
    better = np.any(kept[:, None] < kept[None], axis=2)
    return known & ~np.any(no_worse & better, axis=0)


def trade_off(
    system: AbstractForcedSystem,
    vary: Mapping[str, tuple[float, float]],
    objectives: Mapping[str, AbstractObjective],
    *,
    designs: int = 64,
    seed: int = 0,
    beside: Float[np.ndarray, "more n"] | None = None,
) -> TradeOff:
    """What designs all over the bounds are worth by each of several objectives, no prices needed.

    **Arguments:** the system; bounds [SI] by parameter; objectives by name, each to be small; number of designs
    (scrambled Sobol points) and their seed; places of more designs, such as an optimum.

    **Raises:** `ValueError` for bounds that are none, and without objectives or designs.
    """
    require_at_least(0, seed=seed)
    if not objectives:
        raise ArgumentError("objectives", said="must hold at least one, but it is empty.")
    require_at_least(1, designs=designs)
    space = DesignSpace.of(system, vary)
    points = sobol(len(space.names), designs, seed)
    places = points if beside is None else np.vstack([points, beside])
    values = np.column_stack([objective.values(space, places) for objective in objectives.values()])
    return TradeOff(tuple(objectives), space, places, values)
