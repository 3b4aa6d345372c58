"""Zones found in a sweep or by a search, beside the published ones."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from ..analysis import Stretch, Zone, Zones, lives_in_words
from ..bearing import PublishedCase
from .tables import Beside, Column, Table, rows_table, speed_columns


ENDS = ("onset", "exit")
Span = tuple[float, float | None]


def published_zones(published: PublishedCase | None) -> list[Span]:
    """Onset and exit [rpm] of the published zones; the second has no published exit."""
    if published is None:
        return []
    return [(published.zone_1_onset_rpm, published.zone_1_exit_rpm), (published.zone_2_onset_rpm, None)]


def zone_record(zone: Zone) -> dict[str, Any]:
    """A zone for tables and documents; an end is None where it runs past the range."""
    found: dict[str, Any] = {"kind": zone.kind, "width_rpm": zone.width_rpm, "share": zone.share}
    for end, edge in zip(ENDS, (zone.onset, zone.exit), strict=True):
        values = (None,) * 4 if edge is None else (edge.speed_rpm, edge.uncertainty_rpm, edge.mechanism, edge.basis)
        found |= {
            f"{end}_{n}": x for n, x in zip(("rpm", "uncertainty_rpm", "mechanism", "basis"), values, strict=True)
        }
    for name in ("revolutions", "seconds", "bound"):
        found[f"mean_life_{name}"] = None if zone.life is None else [getattr(life, name) for life in zone.life]
    return found


def zone_words(zone: Zone) -> str:
    """The speeds of a zone in words."""
    low, high = zone_span(zone)
    if math.isinf(low):
        return "the whole range" if math.isinf(high) else f"up to {high:.0f} rpm"
    return f"from {low:.0f} rpm on" if math.isinf(high) else f"{low:.0f} to {high:.0f} rpm"


def zones_table(
    name: str, zones: Zones, published: PublishedCase | None, swept: tuple[float, float], beside: Beside = None
) -> Table:
    """Chaotic zones, each published zone beside the one that shares most speeds with it."""
    lasting = f", chaos that lasts beyond {zones.horizon} revolutions" if zones.horizon else ""
    title = f"Chaotic zones of {name} [rpm], resolution {zones.resolution_rpm:.0f} rpm{lasting}"
    return beside_published(title, "zones", zones.zones, published, swept, beside)


def beside_published(
    title: str,
    key: str,
    zones: Sequence[Zone],
    published: PublishedCase | None,
    range_rpm: tuple[float, float],
    beside: Beside,
) -> Table:
    """A row for each zone, with the published zones that share most speeds with it.

    The title names published zones that share none, and those outside of the range that was looked at [rpm].
    """
    partners: dict[int | None, list[Span]] = {}
    for span in published_zones(published):
        outside = span[0] > range_rpm[1] or (span[1] is not None and span[1] < range_rpm[0])
        partners.setdefault(-1 if outside else _partner(span, zones), []).append(span)
    rows = [
        {"zone": i + 1, **zone_record(zone), "published": _words(partners.get(i, []))} for i, zone in enumerate(zones)
    ]
    columns = [Column("zone", ())]
    for end in ENDS:
        columns += speed_columns(end, f"{end}_rpm", beside, f"{end}_uncertainty_rpm", nothing="past range")
    columns += speed_columns("width", "width_rpm", None, nothing="open")
    columns += [] if published is None else [Column("published", ())]
    missing = {None: "Published, but not found", -1: "Published beyond this range"}
    notes = [f"{words}: {_words(partners[which])}" for which, words in missing.items() if which in partners]
    return rows_table("\n".join([title, *notes]), rows, columns, key)


def zone_details(title: str, zones: Sequence[Zone], key: str = "") -> list[Table]:
    """Mechanisms of the edges, share of chaotic initial states and mean life of chaos of each zone, if any."""
    rows = [
        zone_record(zone) | {"zone": f"{i}: {zone_words(zone)}", "life": _life(zone)}
        for i, zone in enumerate(zones, start=1)
    ]
    columns = [Column("zone", ()), *(Column(f"{end} by", (), key=f"{end}_mechanism") for end in ENDS)]
    columns.append(Column("share", (), "1", "%", digits=0))
    columns += [Column("mean life [revolutions]", (), key="life")] if any(zone.life for zone in zones) else []
    return [rows_table(title, rows, columns, key)] if rows else []


def transient_tables(name: str, zones: Zones, beside: Beside = None) -> list[Table]:
    """Zones of chaos that dies out before the horizon, if there are any."""
    title = f"Transient chaos of {name}, mean life below {zones.horizon} revolutions"
    return zone_details(title, zones.transient, "transient")


def stretches_table(name: str, found: Iterable[Stretch]) -> Table:
    """Stretches of speed in which the lanes have the same labels."""
    rows = [vars(each) | {"motion": " or ".join(each.labels)} for each in found]
    columns = [Column(head, (), key=key, digits=0) for head, key in (("from", "low_rpm"), ("to", "high_rpm"))]
    columns += [Column("motion", ()), Column("exponent", (), errors="exponent_error"), Column("chaotic", ())]
    title = f"Zones of {name} [rpm], each edge half way between two speeds of the sweep"
    return rows_table(title, rows, [*columns, Column("speeds", ())], "zones")


def _life(zone: Zone) -> str:
    """Mean lives in revolutions and, each at its own speed, in seconds."""
    if zone.life is None:
        return ""
    each = (lives_in_words(zone.life, f) for f in (lambda x: f"{x.revolutions:.0f}", lambda x: f"{x.seconds:.1f}"))
    return "{} ({} s)".format(*each)


def _words(spans: Sequence[Span]) -> str:
    return ", ".join(f"{a:.0f}{' and up' if b is None else f' to {b:.0f}'}" for a, b in spans)


def zone_span(zone: Zone, lowest: float = -math.inf, highest: float = math.inf) -> tuple[float, float]:
    """Onset and exit of a zone [rpm], or the limits in place of an end that it does not have."""
    low, high = zone.onset, zone.exit
    return lowest if low is None else low.speed_rpm, highest if high is None else high.speed_rpm


def _partner(span: Span, zones: Sequence[Zone]) -> int | None:
    """The zone that shares most speeds with a published one; None if none does."""
    top = math.inf if span[1] is None else span[1]
    shared = [min(high, top) - max(low, span[0]) for low, high in map(zone_span, zones)]
    best = max(range(len(shared)), key=shared.__getitem__, default=None)
    return best if best is not None and shared[best] > 0 else None
