"""Unstable ranges of the synchronous orbit, between its stable stretches, with exact edges; sources of chaotic edges.

Several synchronous orbits coexist at many speeds, so the ranges need a definition. The **principal** stretch is the one
on which most simulations from the conventional initial state (a cage: at rest on the rib) settled. Stretches of its own
branch belong to it if they overlap it or are separated from it by a window that is closed. Stretches of other branches
count if they do not overlap it; otherwise they are coexisting orbits, which a cage reaches only from other initial
states. The unstable ranges are the complement.

As for chaotic zones, stretches narrower than a stated width do not count and windows narrower than it are closed, but
only between stretches wider than the window: a row of very narrow ones would move an edge far from the stretch it
belongs to, to a bifurcation whose position depends on the solver.

Edges of chaotic zones, which are statistical, are compared with bifurcations.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..analysis import Edge, Zone, Zones, closing_width
from ..quantities import notebook_html
from .point import Point
from .search import StableRange, SynchronousOrbits


@dataclasses.dataclass(frozen=True)
class UnstableRanges:
    """Unstable ranges of the synchronous orbit between two speeds, ascending.

    An edge is None if a range extends beyond the speeds searched; where the branch was not followed further, its
    mechanism is unknown. `edges` holds the bifurcations by name, `zone 1 onset`, `zone 1 exit`, `zone 2 onset`, ...,
    and `coexisting` the result of `SynchronousOrbits.coexisting` at each.
    `principal` is the stretch on which most simulations from the conventional initial state settled.
    """

    zones: tuple[Zone, ...]
    edges: dict[str, Point]
    coexisting: dict[str, list[tuple[int, bool, np.ndarray, np.ndarray]]]
    principal: StableRange | None
    close_below_rpm: float

    def __str__(self) -> str:
        rows = [f"Unstable ranges of the synchronous orbit, closed below {self.close_below_rpm:.0f} rpm"]
        for i, zone in enumerate(self.zones, start=1):
            width = "open" if zone.width_rpm is None else f"{zone.width_rpm:.2f} rpm wide"
            rows.append(f"  zone {i}: {zone.onset or 'below the range'} to {zone.exit or 'above the range'}, {width}")
        return "\n".join(rows if self.zones else [*rows, "  none"])

    _repr_html_ = notebook_html


class _Group(NamedTuple):
    """Stretches that count as one: the lowest, the highest, and all of them."""

    low: StableRange
    high: StableRange
    stretches: tuple[StableRange, ...]

    @property
    def width(self) -> float:
        return self.high.upper_rpm - self.low.lower_rpm

    def apart(self, other: "_Group") -> float:
        """Return the width of the gap between two groups [rpm], negative if they overlap."""
        return max(other.low.lower_rpm - self.high.upper_rpm, self.low.lower_rpm - other.high.upper_rpm)


def _group(*stretches: StableRange) -> _Group:
    low, high = min(stretches, key=lambda s: s.lower_rpm), max(stretches, key=lambda s: s.upper_rpm)
    return _Group(low, high, stretches)


def _joined(groups: Sequence[_Group], close: float) -> list[_Group]:
    """Join groups that overlap or whose window is closed, narrowest window first."""
    groups = list(groups)
    while True:
        pairs = [(a.apart(b), a, b) for i, a in enumerate(groups) for b in groups[:i]]
        closed = [pair for pair in pairs if pair[0] < max(0.0, min(close, pair[1].width, pair[2].width))]
        if not closed:
            return groups
        _, a, b = min(closed, key=lambda pair: pair[0])
        groups = [g for g in groups if g is not a and g is not b] + [_group(*a.stretches, *b.stretches)]


def unstable_ranges(found: SynchronousOrbits, close_below_rpm: float | None = None) -> UnstableRanges:
    """Return the unstable ranges of the synchronous orbit, between the stable stretches that were found.

    **Arguments:** result of `synchronous_orbits`; width below which windows are closed and stretches ignored [rpm], by
    default 500 rpm and at most 5 % of the highest speed.

    **Returns:** `UnstableRanges`, without any range if no stretch was found, since the orbit is then unknown.
    """
    close_below_rpm = closing_width(found.sweep["rpm"].values) if close_below_rpm is None else close_below_rpm
    if not found.stretches:
        return UnstableRanges((), {}, {}, None, close_below_rpm)
    principal = max(found.stretches, key=lambda s: (s.met_first, s.met, s.width_rpm))
    own = _joined([_group(s) for s in found.stretches if s.family == principal.family], close_below_rpm)
    first = next(g for g in own if principal in g.stretches)
    others = [_group(s) for s in found.stretches if first.apart(_group(s)) >= 0]
    groups = _joined([first, *others], close_below_rpm)
    groups = [g for g in groups if principal in g.stretches or g.width >= close_below_rpm]
    groups.sort(key=lambda g: g.low.lower_rpm)
    tops = [None, *(g.high for g in groups)]
    bottoms = [*(g.low for g in groups), None]
    zones: list[Zone] = []
    edges: dict[str, Point] = {}
    for before, after in zip(tops, bottoms, strict=True):
        open_below = before is None and after is not None and after.lower_rpm - found.lower_rpm < close_below_rpm
        open_above = after is None and before is not None and found.upper_rpm - before.upper_rpm < close_below_rpm
        if open_below or open_above:
            continue
        onset = None if before is None else _edge(before.upper, before.upper_rpm)
        leaves = None if after is None else _edge(after.lower, after.lower_rpm)
        zones.append(Zone("unstable", onset, leaves, _share(found, onset, leaves)))
        for name, point in (("onset", before and before.upper), ("exit", after and after.lower)):
            if point is not None:
                edges[f"zone {len(zones)} {name}"] = point
    coexisting = {name: found.coexisting(float(p.speed)) for name, p in edges.items()}
    return UnstableRanges(tuple(zones), edges, coexisting, principal, close_below_rpm)


def _edge(point: Point | None, rpm: float) -> Edge:
    """Return the end of a stable stretch, at `rpm` where no bifurcation was found, as an edge."""
    return Edge(rpm, float("nan"), "unstable", basis="followed") if point is None else point.as_edge("unstable")


def _share(found: SynchronousOrbits, onset: Edge | None, leaves: Edge | None) -> float:
    """Return the fraction of simulations in a range that did not settle on a synchronous orbit; NaN without any."""
    rpm = found.sweep.rpm
    inside = (rpm > (onset.speed_rpm if onset else 0.0)) & (rpm < (leaves.speed_rpm if leaves else np.inf))
    return float(np.mean(found.sweep.label[inside] != "periodic-1")) if np.any(inside) else float("nan")


class Explained(NamedTuple):
    """Chaotic zones with the mechanisms of their edges, and the bifurcations that coincide with an edge, by its name,
    e.g. `zone 1 exit`; other edges remain statistical."""

    zones: Zones
    sources: dict[str, Point]


def explain(zones: Zones, found: SynchronousOrbits) -> Explained:
    """Assign mechanisms to the chaotic edges that coincide with an end of a stable stretch: an onset with an upper end,
    an exit with a lower end.

    The tolerance is the smaller of the edge's uncertainty and the sweep's resolution: a wider error bar, from mean
    lives near the horizon or failed trajectories, would coincide with anything.
    """
    sources: dict[str, Point] = {}
    changed: list[Zone] = []
    for number, zone in enumerate(zones.zones, start=1):
        ends = {"onset": zone.onset, "exit": zone.exit}
        for end, edge in ends.items():
            if edge is None:
                continue
            near = min(edge.uncertainty_rpm, zones.resolution_rpm)
            away = lambda p, rpm=edge.speed_rpm: abs(p.speed_rpm - rpm)
            points = [p for s in found.stretches if (p := s.upper if end == "onset" else s.lower) is not None]
            here = [p for p in points if away(p) <= near + np.nan_to_num(p.error_rpm)]
            if here:
                sources[f"zone {number} {end}"] = source = min(here, key=away)
                ends[end] = source.as_edge(edge.kind)
        changed.append(dataclasses.replace(zone, **ends))
    return Explained(dataclasses.replace(zones, zones=tuple(changed)), sources)
