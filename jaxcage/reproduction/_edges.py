"""The published edges beside those found, kind by kind."""

import dataclasses
from collections.abc import Sequence

from ..analysis import Zone
from ..bearing import PublishedCase


ZONE_RANGE_RPM = (4000.0, 27500.0)
"""Speeds between which a case should have exactly two zones."""


@dataclasses.dataclass(frozen=True)
class ComparedEdge:
    """A published edge and ours of one kind; None where there is none."""

    case: str
    edge: str
    """`zone 1 onset`, `zone 1 exit` or `zone 2 onset`."""
    published_rpm: float
    kind: str
    """`chaotic` or `synchronous-loss`."""
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


def _shared(zone: Zone, low: float, high: float) -> float:
    """How much of [low, high] a zone covers [rpm]."""
    onset = zone.onset.speed_rpm if zone.onset else 0.0
    leaves = zone.exit.speed_rpm if zone.exit else float("inf")
    return min(leaves, high) - max(onset, low)


def compare_edges(published: PublishedCase, zones: Sequence[Zone], kind: str) -> list[ComparedEdge]:
    """The three published edges of a case beside the zones found.

    Zone 1 is the one that shares most speeds with the published zone 1; zone 2, of those above it, the one that shares
    most with the published zone 2. A single zone over both has the edges of zone 1 only.
    """
    near = zones_in_range(zones)
    spans = ((published.zone_1_onset_rpm, published.zone_1_exit_rpm), (published.zone_2_onset_rpm, ZONE_RANGE_RPM[1]))
    best = [max(near, key=lambda z: _shared(z, *span), default=None) for span in spans]
    first, second = (z if z is not None and _shared(z, *s) > 0 else None for z, s in zip(best, spans, strict=True))
    if second is first:
        second = None
    wanted = (
        ("zone 1 onset", published.zone_1_onset_rpm, first and first.onset),
        ("zone 1 exit", published.zone_1_exit_rpm, first and first.exit),
        ("zone 2 onset", published.zone_2_onset_rpm, second and second.onset),
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
        for name, rpm, edge in wanted
    ]
