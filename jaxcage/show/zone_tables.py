"""Zones found in a sweep or by a search, beside the published ones: records for documents, and tables."""

import math
from collections.abc import Sequence
from typing import Any

from ..analysis import Stretch, Zone, Zones, lives_in_words
from ..bearing import PublishedCase
from .tables import Beside, Column, Table, chosen, number, rows_table, speed_columns


ENDS = ("onset", "exit")
Span = tuple[float, float | None]


def published_zones(published: PublishedCase | None) -> list[Span]:
    """Onset and exit [rpm] of the published zones; the second has no published exit."""
    if published is None:
        return []
    return [(published.zone_1_onset_rpm, published.zone_1_exit_rpm), (published.zone_2_onset_rpm, None)]


def zone_record(zone: Zone) -> dict[str, Any]:
    """A zone for a document; None where it runs past the range."""
    found: dict[str, Any] = {"kind": zone.kind}
    for end, edge in zip(ENDS, (zone.onset, zone.exit), strict=True):
        found[f"{end}_rpm"] = edge and edge.speed_rpm
        found[f"{end}_uncertainty_rpm"] = edge and edge.uncertainty_rpm
        found[f"{end}_mechanism"] = edge and edge.mechanism
        found[f"{end}_basis"] = edge and edge.basis
    lives = {} if zone.life is None else {
        "mean_life_revolutions": [life.revolutions for life in zone.life],
        "mean_life_seconds": [life.seconds for life in zone.life],
        "mean_life_is_lower_bound": [life.bound for life in zone.life],
    }  # fmt: skip
    return found | {"width_rpm": zone.width_rpm, "share": zone.share} | lives


def zones_document(zones: Zones, published: PublishedCase | None) -> dict[str, Any]:
    """All zones of a sweep for a document."""
    return {
        **chosen(zones, "resolution_rpm close_below_rpm horizon"),
        **{kind: list(map(zone_record, getattr(zones, kind))) for kind in ("zones", "transient", "synchronous")},
        "published": [
            {"zone": i, "onset_rpm": a, "exit_rpm": b} for i, (a, b) in enumerate(published_zones(published), start=1)
        ],
    }


def zone_words(zone: Zone) -> str:
    """The speeds of a zone in words."""
    low, high = zone.onset, zone.exit
    if low is None and high is None:
        return "the whole range"
    if low is None or high is None:
        return f"up to {high.speed_rpm:.0f} rpm" if high is not None else f"from {low.speed_rpm:.0f} rpm on"  # pyright: ignore
    return f"{low.speed_rpm:.0f} to {high.speed_rpm:.0f} rpm"


def zones_table(
    name: str, zones: Zones, published: PublishedCase | None, swept: tuple[float, float], beside: Beside = None
) -> Table:
    """Chaotic zones, each published zone beside the one that shares most speeds with it."""
    lasting = f", chaos that lasts beyond {zones.horizon} revolutions" if zones.horizon else ""
    title = f"Chaotic zones of {name} [rpm], resolution {zones.resolution_rpm:.0f} rpm{lasting}"
    return beside_published(title, zones.zones, published, swept, beside)


def beside_published(
    title: str, zones: Sequence[Zone], published: PublishedCase | None, range_rpm: tuple[float, float], beside: Beside
) -> Table:
    """A row for each zone, with the published zones that share most speeds with it.

    Published zones that share none are in rows of their own, which say whether their speeds were looked at [rpm].
    """
    partners: dict[int | None, list[Span]] = {}
    for span in published_zones(published):
        partners.setdefault(_partner(span, zones), []).append(span)
    past = {f"{end}_rpm": "past range" for end in ENDS} | {"width_rpm": "open"}
    rows: list[dict[str, Any]] = []
    for i, zone in enumerate(zones):
        known = {key: value for key, value in zone_record(zone).items() if value is not None}
        rows.append({"zone": i + 1, **past, **known, "published": _spans(partners.get(i, []))})
    for onset, exit_ in partners.get(None, []):
        looked = onset <= range_rpm[1] and (exit_ is None or exit_ >= range_rpm[0])
        found = "not found" if looked else "out of range"
        rows.append({"zone": "-", "onset_rpm": found, "published": _spans([(onset, exit_)])})
    columns = [
        Column("zone", ()),
        *(c for end in ENDS for c in speed_columns(end, f"{end}_rpm", beside, f"{end}_uncertainty_rpm")),
        Column("width", (), key="width_rpm", digits=0),
        *([Column("published", ())] if published is not None else []),
    ]
    return rows_table(title, rows or [{"zone": "none"}], columns)


def zone_details(title: str, zones: Sequence[Zone]) -> list[Table]:
    """Mechanisms of the edges, share of chaotic initial states and mean life of chaos of each zone, if there are any."""
    rows = [
        zone_record(zone) | {"zone": f"{i}: {zone_words(zone)}", "life": _life(zone)}
        for i, zone in enumerate(zones, start=1)
    ]
    columns = [
        Column("zone [rpm]", (), key="zone"),
        *(Column(f"{end} by", (), key=f"{end}_mechanism") for end in ENDS),
        Column("share", (), "1", "%", digits=0),
        *([Column("mean life [revolutions]", (), key="life")] if any(zone.life for zone in zones) else []),
    ]
    return [rows_table(title, rows, columns)] if rows else []


def transient_tables(name: str, zones: Zones, beside: Beside = None) -> list[Table]:
    """Zones of chaos that dies out before the horizon, if there are any."""
    return zone_details(f"Transient chaos of {name}, mean life below {zones.horizon} revolutions", zones.transient)


def stretches_table(name: str, found: Sequence[Stretch]) -> Table:
    """Stretches of speed in which the lanes have the same labels."""
    rows = [
        vars(each)
        | {"from": each.low_rpm, "to": each.high_rpm, "label": " or ".join(each.labels)}
        | {"says": "chaotic" if each.chaotic else "not known to be chaotic"}
        for each in found
    ]
    columns = [
        Column("from", (), digits=0),
        Column("to", (), digits=0),
        Column("motion", (), key="label"),
        Column("exponent", (), errors="exponent_error"),
        Column("by the exponent", (), key="says"),
        Column("speeds", ()),
    ]
    return rows_table(f"Zones of {name} [rpm], each edge half way between two speeds of the sweep", rows, columns)


def _life(zone: Zone) -> str:
    """Mean lives in revolutions and, each at its own speed, in seconds."""
    if zone.life is None:
        return ""
    revolutions = lives_in_words(zone.life, lambda life: f"{life.revolutions:.0f}")
    return f"{revolutions} ({lives_in_words(zone.life, lambda life: number(life.seconds, digits=1))} s)"


def _spans(spans: Sequence[Span]) -> str:
    return ", ".join(f"{a:.0f}{' and up' if b is None else f' to {b:.0f}'}" for a, b in spans)


def zone_span(zone: Zone, lowest: float = -math.inf, highest: float = math.inf) -> tuple[float, float]:
    """Onset and exit of a zone [rpm], or the limits in place of an end that it does not have."""
    return (
        lowest if zone.onset is None else zone.onset.speed_rpm,
        highest if zone.exit is None else zone.exit.speed_rpm,
    )


def _partner(span: Span, zones: Sequence[Zone]) -> int | None:
    """The zone that shares most speeds with a published one; None if none does."""
    top = math.inf if span[1] is None else span[1]
    shared = [min(high, top) - max(low, span[0]) for low, high in map(zone_span, zones)]
    best = max(range(len(shared)), key=shared.__getitem__, default=None)
    return best if best is not None and shared[best] > 0 else None
