"""Why a chaotic zone ends where it does: statistical edges matched with bifurcations and cascade limits."""

import dataclasses

import numpy as np

from ..analysis import Edge, Zone, Zones
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ._cascade import Cascade, cascade
from ._point import Point
from ._search import SynchronousOrbits


CASCADE_REACH_RPM = 500.0
"""Period doublings this far on the calm side of a chaotic edge are tried for a cascade that ends there."""
CASCADE_LEVELS = 4


@dataclasses.dataclass(frozen=True)
class Explained:
    """Chaotic zones with the mechanisms of their edges, and what these were taken from."""

    zones: Zones
    sources: dict[str, Point | Cascade]
    """By edge, e.g. `zone 1 exit`: what the edge coincides with. Other edges stay statistical."""


def explain(
    zones: Zones, found: SynchronousOrbits, system: AbstractForcedSystem, method: AbstractMethod | None = None
) -> Explained:
    """Give each chaotic edge the mechanism it coincides with, within its uncertainty and the resolution of the sweep.

    A bar that is wider than that, for mean lives near the horizon or failed lanes, coincides with anything.

    An onset can be where a stable orbit ends, coming from below; an exit, where one begins. Bifurcations themselves are
    tried first, then the limits of the cascades that begin at period doublings on the calm side.

    **Returns:** `Explained`; edges that coincide with nothing that was located are left as they were.
    """
    sources: dict[str, Point | Cascade] = {}
    changed: list[Zone] = []
    for number, zone in enumerate(zones.zones, start=1):
        ends = {}
        for end, edge, calm in (("onset", zone.onset, -1), ("exit", zone.exit, 1)):
            near = 0.0 if edge is None else min(edge.uncertainty_rpm, zones.resolution_rpm)
            source = None if edge is None else _source(edge.speed_rpm, near, calm, found, system, method)
            if edge is not None and source is not None:
                sources[f"zone {number} {end}"] = source
                edge = _taken(edge, source)
            ends[end] = edge
        changed.append(dataclasses.replace(zone, **ends))
    return Explained(dataclasses.replace(zones, zones=tuple(changed)), sources)


def _source(
    rpm: float,
    near: float,
    calm: int,
    found: SynchronousOrbits,
    system: AbstractForcedSystem,
    method: AbstractMethod | None,
) -> Point | Cascade | None:
    """What lies within `near` of an edge at `rpm`, whose calm side is above or below it."""
    ends = [s.upper if calm < 0 else s.lower for s in found.stretches]
    points = [p for p in ends if p is not None]
    away = lambda p: abs(p.speed_rpm - rpm)
    here = [p for p in points if away(p) <= near + np.nan_to_num(p.error_rpm)]
    if here:
        return min(here, key=away)
    beyond = lambda p: 0 < calm * (p.speed_rpm - rpm) <= CASCADE_REACH_RPM
    doublings = [p for p in points if p.kind == "period-doubling" and beyond(p)]
    reach = 2 * CASCADE_REACH_RPM * np.pi / 30
    for point in sorted(doublings, key=away):
        speed = float(point.speed)
        tried = cascade(system, point, lower=speed - reach, upper=speed + reach, levels=CASCADE_LEVELS, method=method)
        if np.isfinite(tried.error) and abs(tried.limit * 30 / np.pi - rpm) <= near:
            return tried
    return None


def _taken(edge: Edge, source: Point | Cascade) -> Edge:
    """The chaotic edge at the place of what it coincides with."""
    if isinstance(source, Cascade):
        per_rpm = 30 / np.pi
        limit, error = source.limit * per_rpm, source.error * per_rpm
        return Edge(limit, error, edge.kind, "period-doubling", "cascade")
    return source.as_edge(edge.kind)
