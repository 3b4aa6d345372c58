"""Objectives made of synchronous-loss edges: exact, with exact slopes, as long as the edges are there."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..orbits import Point
from ._objective import AbstractObjective, DesignSpace, Measured
from ._tracked import TrackedEdges


CASE = "the design"


class FollowedEdges:
    """Edges of one design by name, followed from the nearest design at which they are known."""

    def __init__(self, points: Mapping[str, Point], method: AbstractMethod | None = None):
        """**Arguments:** bifurcations by name (`LossZones.edges`), as found in the design a search begins with."""
        if not points:
            raise ArgumentError("points", said="must hold at least one edge, but it is empty.")
        self.points, self.method = dict(points), method
        self._tracked: TrackedEdges | None = None
        self._space: DesignSpace | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the edges."""
        return tuple(self.points)

    @property
    def solves(self) -> int:
        """Edge solves so far."""
        return 0 if self._tracked is None else self._tracked.solves

    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> tuple[np.ndarray, np.ndarray]:
        """Speeds [rpm] and their slopes; NaN where an edge is lost."""
        if self._tracked is None or space is not self._space:
            systems: dict[str, AbstractForcedSystem] = {CASE: space.system}
            cases = [CASE] * len(self.points)
            points = list(self.points.values())
            self._tracked = TrackedEdges(systems, space.unknowns, cases, points, space.place, self.method)
            self._space = space
        found = self._tracked(np.asarray(place))
        return found.rpm, found.slope


@dataclasses.dataclass(frozen=True, eq=False)
class EdgeSum(AbstractObjective):
    """A weighted sum of edges [rpm], such as the width between two."""

    edges: FollowedEdges
    weights: Mapping[str, float]
    constant: float = 0.0
    """Added to the sum [rpm]."""

    def __post_init__(self):
        if missing := [name for name in self.weights if name not in self.edges.names]:
            raise ValueError(f"Edge `{missing[0]}` must be one of {', '.join(self.edges.names)}.")

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        weights = np.array([self.weights.get(name, 0.0) for name in self.edges.names])
        measured = []
        for place in places:
            speeds, slopes = self.edges.at(space, place)
            lost = [name for name, s, w in zip(self.edges.names, speeds, weights, strict=True) if w and np.isnan(s)]
            here = weights != 0
            measured.append(
                Measured(
                    self.constant + float(weights[here] @ speeds[here]),
                    0.0,
                    weights[here] @ slopes[here],
                    np.zeros(len(space.unknowns)),
                    f"lost: {', '.join(lost)}" if lost else "ok",
                )
            )
        return measured

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.array([m.value for m in self.measure(space, places)])


def zone_width(edges: FollowedEdges, zone: int = 1, range_rpm: tuple[float, float] | None = None) -> EdgeSum:
    """Width of a synchronous-loss zone, exit less onset [rpm].

    A zone that is open, its onset or exit beyond the speeds that were looked at, counts to the end of that range, and
    has the slope of its other edge alone.

    **Arguments:** edges by name; number of the zone; first and last speed that were looked at, for an open zone.

    **Raises:** `ValueError` for a zone of which no edge is known, or an open one without a range.
    """
    names = {end: f"zone {zone} {end}" for end in ("onset", "exit")}
    known = [end for end, name in names.items() if name in edges.names]
    if not known:
        raise ArgumentError("zone", said=f"must be one with an edge among {', '.join(edges.names)}, but is {zone}.")
    if len(known) == 1 and range_rpm is None:
        raise ArgumentError(
            "range_rpm", said=f"must be given for zone {zone}, which is open: its {known[0]} alone is known."
        )
    first, last = range_rpm or (0.0, 0.0)
    ends = {"onset": (-1.0, -first), "exit": (1.0, last)}
    weights = {names[end]: ends[end][0] for end in known}
    return EdgeSum(edges, weights, sum((ends[end][1] for end in names if end not in known), start=0.0))


@dataclasses.dataclass(frozen=True, eq=False)
class EdgeClearance(AbstractObjective):
    """Distance of operating speeds from the nearest edge [rpm], with its sign turned: small is far away.

    The nearest is taken by a soft minimum over edges and speeds, of `softness` [rpm].
    """

    edges: FollowedEdges
    operating_rpm: Sequence[float]
    """Speeds, or the two ends of a range."""
    softness: float = 100.0

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        measured = []
        for place in places:
            speeds, slopes = self.edges.at(space, place)
            lost = [name for name, s in zip(self.edges.names, speeds, strict=True) if np.isnan(s)]
            apart = speeds[None] - np.asarray(self.operating_rpm, dtype=float)[:, None]
            nearness = np.exp(-(np.abs(apart) - np.nanmin(np.abs(apart))) / self.softness)
            total = nearness.sum()
            value = self.softness * np.log(total) - np.nanmin(np.abs(apart))
            slope = np.einsum("se,en->n", -nearness / total * np.sign(apart), slopes)
            status = f"lost: {', '.join(lost)}" if lost else "ok"
            measured.append(Measured(float(value), 0.0, slope, np.zeros(len(space.unknowns)), status))
        return measured

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return np.array([m.value for m in self.measure(space, places)])
