"""The published edges beside those found, kind by kind.

Kinds never stand in for each other: chaos that lasts, chaos seen at first, the loss of the synchronous orbit, and what
an observer reads off a diagram (`_observer`).
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..analysis import Zone
from ..bearing import PublishedCase


ZONE_RANGE_RPM = (4000.0, 27500.0)
"""Speeds between which a case should have exactly two zones."""
LASTING, AT_FIRST, LOSS = "lasting", "at first", "synchronous-loss"
"""Chaos that lasts beyond the horizon; chaos while observed, lasting or not; loss of the synchronous orbit."""
WIDE_RPM = 500.0
"""Zones at least so wide are those that a diagram over 25000 rpm shows."""


@dataclasses.dataclass(frozen=True)
class ComparedEdge:
    """A published edge and ours of one kind; None where there is none."""

    case: str
    edge: str
    """`zone 1 onset`, `zone 1 exit` or `zone 2 onset`."""
    published_rpm: float
    kind: str
    """`lasting`, `at first`, `synchronous-loss`, or the name of an observer."""
    ours_rpm: float | None
    uncertainty_rpm: float | None
    mechanism: str | None

    @property
    def error_percent(self) -> float | None:
        """Ours less published, relative to published [%]."""
        return None if self.ours_rpm is None else 100 * (self.ours_rpm / self.published_rpm - 1)


def zones_in_range(zones: Sequence[Zone]) -> list[Zone]:
    """Zones that reach into the range in which two were published."""
    low, high = ZONE_RANGE_RPM
    ends = [(z.onset.speed_rpm if z.onset else 0.0, z.exit.speed_rpm if z.exit else float("inf")) for z in zones]
    return [z for z, (a, b) in zip(zones, ends, strict=True) if b > low and a < high]


def wide_zones(zones: Sequence[Zone]) -> list[Zone]:
    """Of those the ones that are wide, or run past the swept range."""
    return [z for z in zones_in_range(zones) if z.width_rpm is None or z.width_rpm >= WIDE_RPM]


def compare_edges(published: PublishedCase, zones: Sequence[Zone], kind: str) -> list[ComparedEdge]:
    """The three published edges of a case beside those of the zones found in the range in which they were published."""
    low, high, next_low = published.zone_1_onset_rpm, published.zone_1_exit_rpm, published.zone_2_onset_rpm
    first, second = _matched([(low, high), (next_low, ZONE_RANGE_RPM[1])], zones_in_range(zones))
    rows = (
        ("zone 1 onset", low, first.onset if first else None),
        ("zone 1 exit", high, first.exit if first else None),
        ("zone 2 onset", next_low, second.onset if second else None),
    )
    return [
        ComparedEdge(
            published.name,
            name,
            rpm,
            kind,
            edge.speed_rpm if edge else None,
            edge.uncertainty_rpm if edge else None,
            edge.mechanism if edge else None,
        )
        for name, rpm, edge in rows
    ]


def _matched(published: Sequence[tuple[float, float]], found: Sequence[Zone]) -> list[Zone | None]:
    """For each published zone, in their order, the found one that shares most speeds with it, if any does. A found zone
    answers for one published zone only, the first."""

    def shared(zone: Zone, low: float, high: float) -> float:
        onset = zone.onset.speed_rpm if zone.onset else 0.0
        leaves = zone.exit.speed_rpm if zone.exit else np.inf
        return min(leaves, high) - max(onset, low)

    taken: list[Zone | None] = []
    for ends in published:
        best = max(found, key=lambda zone: shared(zone, *ends), default=None)
        lost = best is None or shared(best, *ends) <= 0 or any(best is zone for zone in taken)
        taken.append(None if lost else best)
    return taken


def summary(edges: Sequence[ComparedEdge], kind: str) -> dict[str, Any]:
    """How many of the published edges were found, how many within 10 %, and the median error."""
    own = [row for row in edges if row.kind == kind]
    errors = np.array([abs(row.error_percent) for row in own if row.error_percent is not None])
    return {
        "published": len(own),
        "found": int(errors.size),
        "within_10_percent": int(np.sum(errors <= 10)),
        "median_error_percent": float(np.median(errors)) if errors.size else None,
    }
