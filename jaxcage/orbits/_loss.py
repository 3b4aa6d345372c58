"""Synchronous-loss zones: the speeds between the stable stretches of the synchronous orbit, with exact edges.

Several synchronous orbits coexist at many speeds, so what a zone is needs a rule. The **principal** stretch is the one
on which most simulations from the conventional start (a cage: at rest on the rib) settled; stretches of its own branch
that overlap it or follow within a window that is closed belong to it. Other stretches count where they do not overlap
it; those that do are coexisting orbits, which a cage meets only from other starts. Zones are what is left between.

As for chaotic zones, stretches narrower than a stated width do not count and windows narrower than it are closed, but
only between stretches wider than the window. Else a row of slivers, some a tenth of a revolution per minute wide, would
carry an edge far from the stretch it belongs to, to a bifurcation that every solver has elsewhere.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from .._notebook import notebook_html
from ..analysis import Edge, Zone, closing_width
from ._point import Point
from ._search import Stretch, SynchronousOrbits


@dataclasses.dataclass(frozen=True)
class LossZones:
    """Synchronous-loss zones of a speed range."""

    zones: tuple[Zone, ...]
    """Ascending; an edge is None where the zone runs past the range."""
    edges: dict[str, Point]
    """Edges by name: `zone 1 onset`, `zone 1 exit`, `zone 2 onset`, ..."""
    coexisting: dict[str, list[tuple[int, bool, np.ndarray, np.ndarray]]]
    """Orbits at each edge: branch, whether stable, state [SI], multipliers."""
    principal: Stretch | None
    """The stretch on which most simulations from the conventional start settled."""
    close_below_rpm: float

    def __str__(self) -> str:
        rows = [f"Synchronous-loss zones, closed below {self.close_below_rpm:.0f} rpm"]
        for i, zone in enumerate(self.zones, start=1):
            width = "open" if zone.width_rpm is None else f"{zone.width_rpm:.2f} rpm wide"
            rows.append(f"  zone {i}: {zone.onset or 'below the range'} to {zone.exit or 'above the range'}, {width}")
        return "\n".join(rows if self.zones else [*rows, "  none"])

    _repr_html_ = notebook_html


@dataclasses.dataclass(frozen=True)
class _Group:
    """Stretches taken as one."""

    stretches: tuple[Stretch, ...]

    @property
    def low(self) -> Stretch:
        return min(self.stretches, key=lambda s: s.lower_rpm)

    @property
    def high(self) -> Stretch:
        return max(self.stretches, key=lambda s: s.upper_rpm)

    def apart(self, other: "_Group") -> float:
        """Width of the gap between two groups [rpm], negative where they overlap."""
        return max(
            other.low.lower_rpm - self.high.upper_rpm,
            self.low.lower_rpm - other.high.upper_rpm,
        )

    @property
    def width(self) -> float:
        return self.high.upper_rpm - self.low.lower_rpm


def _joined(groups: Sequence[_Group], close: float) -> list[_Group]:
    """Groups joined where they overlap or where the window between them is closed, narrowest window first."""
    groups = list(groups)
    while True:
        pairs = [(a.apart(b), a, b) for i, a in enumerate(groups) for b in groups[:i]]
        closed = [pair for pair in pairs if pair[0] < max(0.0, min(close, pair[1].width, pair[2].width))]
        if not closed:
            return groups
        _, a, b = min(closed, key=lambda pair: pair[0])
        groups = [g for g in groups if g is not a and g is not b] + [_Group((*a.stretches, *b.stretches))]


def loss_zones(found: SynchronousOrbits, close_below_rpm: float | None = None) -> LossZones:
    """Zones in which the synchronous orbit is lost, from the stable stretches that were found.

    **Arguments:** result of `synchronous_orbits`; width below which windows and stretches are closed [rpm], by default
    500 rpm and at most 5 % of the highest speed.

    **Returns:** `LossZones`. Without any stretch there is no zone: nothing is known of the orbit.
    """
    close_below_rpm = closing_width(found.sweep.rpm) if close_below_rpm is None else close_below_rpm
    if not found.stretches:
        return LossZones((), {}, {}, None, close_below_rpm)
    principal = max(found.stretches, key=lambda s: (s.met_first, s.met, s.width_rpm))
    own = _joined([_Group((s,)) for s in found.stretches if s.family == principal.family], close_below_rpm)
    first = next(g for g in own if principal in g.stretches)
    others = [_Group((s,)) for s in found.stretches if first.apart(_Group((s,))) >= 0]
    groups = _joined([first, *others], close_below_rpm)
    groups = [g for g in groups if principal in g.stretches or g.width >= close_below_rpm]
    groups.sort(key=lambda g: g.low.lower_rpm)
    return _between(found, groups, principal, close_below_rpm)


def _between(found: SynchronousOrbits, groups: list[_Group], principal: Stretch, close: float) -> LossZones:
    tops = [None, *(g.high for g in groups)]
    bottoms = [*(g.low for g in groups), None]
    zones: list[Zone] = []
    edges: dict[str, Point] = {}
    for before, after in zip(tops, bottoms, strict=True):
        onset = None if before is None else before.upper
        leaves = None if after is None else after.lower
        open_below = before is None and after is not None and after.lower_rpm - found.lower_rpm < close
        open_above = after is None and before is not None and found.upper_rpm - before.upper_rpm < close
        if open_below or open_above or (before is not None and onset is None):
            continue
        zones.append(Zone("synchronous-loss", _edge(onset), _edge(leaves), _share(found, onset, leaves)))
        for name, point in (("onset", onset), ("exit", leaves)):
            if point is not None:
                edges[f"zone {len(zones)} {name}"] = point
    coexisting = {name: found.coexisting(float(p.speed)) for name, p in edges.items()}
    return LossZones(tuple(zones), edges, coexisting, principal, close)


def _share(found: SynchronousOrbits, onset: Point | None, leaves: Point | None) -> float:
    """Share of the simulations inside a zone that did not settle on a synchronous orbit; NaN if there are none."""
    rpm = found.sweep.rpm
    inside = (rpm > (onset.speed_rpm if onset else 0.0)) & (rpm < (leaves.speed_rpm if leaves else np.inf))
    return float(np.mean(found.sweep.label[inside] != "periodic-1")) if np.any(inside) else float("nan")


def _edge(point: Point | None) -> Edge | None:
    return None if point is None else point.as_edge("synchronous-loss")
