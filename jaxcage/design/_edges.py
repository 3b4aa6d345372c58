"""Widths of zones, and objectives made of synchronous-loss edges: exact, as long as the edges are there."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import overload

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..orbits import Point
from ._objective import AbstractExact, DesignSpace, Measured
from ._tracked import TrackedEdges
from ._width import SolvedEdge, ZoneWidth


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
class EdgeSum(AbstractExact):
    """A weighted sum of edges [rpm], such as the width between two."""

    edges: FollowedEdges
    weights: Mapping[str, float]
    constant: float = 0.0
    """Added to the sum [rpm]."""

    def __post_init__(self):
        if missing := [name for name in self.weights if name not in self.edges.names]:
            raise ValueError(f"Edge `{missing[0]}` must be one of {', '.join(self.edges.names)}.")

    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Measured:
        weights = np.array([self.weights.get(name, 0.0) for name in self.edges.names])
        speeds, slopes = self.edges.at(space, place)
        lost = [name for name, s, w in zip(self.edges.names, speeds, weights, strict=True) if w and np.isnan(s)]
        here = weights != 0
        return Measured(
            self.constant + float(weights[here] @ speeds[here]),
            0.0,
            weights[here] @ slopes[here],
            np.zeros(len(space.unknowns)),
            f"lost: {', '.join(lost)}" if lost else "ok",
        )


@overload
def zone_width(edges: FollowedEdges, zone: int = 1, range_rpm: tuple[float, float] | None = None) -> EdgeSum: ...
@overload
def zone_width(edges: Mapping[str, SolvedEdge], zone: int = 1) -> ZoneWidth: ...
def zone_width(
    edges: FollowedEdges | Mapping[str, SolvedEdge], zone: int = 1, range_rpm: tuple[float, float] | None = None
) -> EdgeSum | ZoneWidth:
    """Width of a zone, exit less onset [rpm], and how it answers to the design.

    **Arguments:** edges by name, `zone 1 onset` and the like, or `onset` and `exit`; number of the zone; first and last
    speed that were looked at, for an open zone of followed edges.

    **Returns:** of edges that are solved for, `ZoneWidth`: the width and its change by any parameters, with standard
    errors. They may be `lasting_edges`, or `jaxcage.sensitivities` of synchronous-loss edges, and one of a kind with
    one of another. Of `FollowedEdges`, an objective for searches.

    A zone that is open, its onset or exit beyond the speeds that were looked at, has the slope of its other edge alone.
    As an objective it counts to the end of that range; a `ZoneWidth` has no width then and says that it is open.

    **Raises:** `ValueError` for a zone of which no edge is known, or an open one of followed edges without a range.
    """
    names = {end: f"zone {zone} {end}" for end in ("onset", "exit")}
    if not isinstance(edges, FollowedEdges):
        solved = {end: edges.get(name, edges.get(end)) for end, name in names.items()}
        if not any(solved.values()):
            raise _no_edge(edges, zone)
        return ZoneWidth(solved["onset"], solved["exit"])
    known = [end for end, name in names.items() if name in edges.names]
    if not known:
        raise _no_edge(edges.names, zone)
    if len(known) == 1 and range_rpm is None:
        raise ArgumentError(
            "range_rpm", said=f"must be given for zone {zone}, which is open: its {known[0]} alone is known."
        )
    first, last = range_rpm or (0.0, 0.0)
    ends = {"onset": (-1.0, -first), "exit": (1.0, last)}
    weights = {names[end]: ends[end][0] for end in known}
    return EdgeSum(edges, weights, sum((ends[end][1] for end in names if end not in known), start=0.0))


def _no_edge(known: Iterable[str], zone: int) -> ArgumentError:
    return ArgumentError("zone", said=f"must be one with an edge among {', '.join(known)}, but is {zone}.")


@dataclasses.dataclass(frozen=True, eq=False)
class EdgeClearance(AbstractExact):
    """Distance of operating speeds from the nearest edge [rpm], with its sign turned: small is far away.

    The nearest is taken by a soft minimum over edges and speeds, of `softness` [rpm].
    """

    edges: FollowedEdges
    operating_rpm: Sequence[float]
    """Speeds, or the two ends of a range."""
    softness: float = 100.0

    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Measured:
        speeds, slopes = self.edges.at(space, place)
        lost = [name for name, s in zip(self.edges.names, speeds, strict=True) if np.isnan(s)]
        apart = speeds[None] - np.asarray(self.operating_rpm, dtype=float)[:, None]
        nearness = np.exp(-(np.abs(apart) - np.nanmin(np.abs(apart))) / self.softness)
        total = nearness.sum()
        value = self.softness * np.log(total) - np.nanmin(np.abs(apart))
        slope = np.einsum("se,en->n", -nearness / total * np.sign(apart), slopes)
        status = f"lost: {', '.join(lost)}" if lost else "ok"
        return Measured(float(value), 0.0, slope, np.zeros(len(space.unknowns)), status)
