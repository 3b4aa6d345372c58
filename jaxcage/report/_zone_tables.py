"""Zones found in a sweep beside the published ones, as document and as table."""

import math
from collections.abc import Sequence
from typing import Any

from ..analysis import Edge, Zone, Zones, lives_in_words
from ..bearing import PublishedCase
from ._table import Speeds, Table, number, speed


LIFE = "mean life [revolutions]"
Span = tuple[float, float | None]


def published_zones(published: PublishedCase | None) -> list[Span]:
    """Onset and exit [rpm] of the published zones; the second has no published exit."""
    if published is None:
        return []
    return [
        (published.zone_1_onset_rpm, published.zone_1_exit_rpm),
        (published.zone_2_onset_rpm, None),
    ]


def published_document(published: PublishedCase | None) -> list[dict[str, Any]]:
    """The published zones for programs."""
    return [
        {"zone": i, "onset_rpm": onset, "exit_rpm": exit_}
        for i, (onset, exit_) in enumerate(published_zones(published), start=1)
    ]


def zone_document(zone: Zone) -> dict[str, Any]:
    """A zone for programs; null where it runs past the swept range."""
    onset, exit_ = zone.onset, zone.exit
    known = [edge.mechanism for edge in (onset, exit_) if edge is not None]
    return {
        "kind": zone.kind,
        "onset_rpm": onset and onset.speed_rpm,
        "exit_rpm": exit_ and exit_.speed_rpm,
        "onset_uncertainty_rpm": onset and onset.uncertainty_rpm,
        "exit_uncertainty_rpm": exit_ and exit_.uncertainty_rpm,
        "mechanism": known[0] if known else None,
        "onset_mechanism": onset and onset.mechanism,
        "exit_mechanism": exit_ and exit_.mechanism,
        "width_kind": zone.kind,
        "width_rpm": zone.width_rpm,
        "share": zone.share,
        "mean_life_revolutions": zone.life and [life.revolutions for life in zone.life],
        "mean_life_seconds": zone.life and [life.seconds for life in zone.life],
        "mean_life_is_lower_bound": zone.life and [life.bound for life in zone.life],
    }


def zones_document(name: str, zones: Zones, published: PublishedCase | None) -> dict[str, Any]:
    """All zones of a case for programs."""
    return {
        "case": name,
        "resolution_rpm": zones.resolution_rpm,
        "close_below_rpm": zones.close_below_rpm,
        "horizon": zones.horizon,
        "zones": [zone_document(zone) for zone in zones.zones],
        "transient": [zone_document(zone) for zone in zones.transient],
        "synchronous": [zone_document(stretch) for stretch in zones.synchronous],
        "published": published_document(published),
    }


def zones_table(name: str, zones: Zones, published: PublishedCase | None, swept: tuple[float, float]) -> Table:
    """Zones found, each published zone beside the one it shares most speeds with, or in a row of
    its own that says whether its speeds were swept at all [rpm].
    """
    lasting = f", chaos that lasts beyond {zones.horizon} revolutions" if zones.horizon else ""
    title = f"Chaotic zones of {name} [rpm], resolution {number(zones.resolution_rpm)} rpm{lasting}"
    life = [LIFE] if zones.horizon > 0 else []
    columns = ("zone", "onset", "exit", "width", "mechanism", "share", *life, "published")
    cells = [[*_zone_cells(zone), *(_life_cell(zone) for _ in life)] for zone in zones.zones]
    return zones_beside_published(title, columns, cells, zones.zones, published, swept, "not swept")


def zones_beside_published(
    title: str,
    columns: Sequence[str],
    cells: Sequence[Sequence[str]],
    zones: Sequence[Zone],
    published: PublishedCase | None,
    range_rpm: tuple[float, float],
    outside: str,
) -> Table:
    """A row for each zone: its number, its cells, and the published zones that share most speeds with it. Published
    zones that share none are in rows of their own, which say whether they are `outside` the range.
    """
    beside: dict[int | None, list[Span]] = {}
    for span in published_zones(published):
        beside.setdefault(_partner(span, zones), []).append(span)
    rows = [(str(i + 1), *found, _published_cell(beside.get(i, []))) for i, found in enumerate(cells)]
    for onset, exit_ in beside.get(None, []):
        met = onset <= range_rpm[1] and (exit_ is None or exit_ >= range_rpm[0])
        dashes = (len(columns) - 3) * ("-",)
        rows.append(("-", "not found" if met else outside, *dashes, _published_cell([(onset, exit_)])))
    nothing = ("none", *(len(columns) - 1) * ("-",))
    return Table(title, columns, rows or [nothing], ("onset", "exit", "width"))


def transient_tables(name: str, zones: Zones) -> list[Table]:
    """Zones of chaos that dies out before the horizon, if there are any."""
    if not zones.transient:
        return []
    rows = [(_edge_cell(z.onset), _edge_cell(z.exit), f"{z.share:.0%}", _life_cell(z)) for z in zones.transient]
    title = f"Transient chaos of {name} [rpm], mean life below {zones.horizon} revolutions"
    return [Table(title, ("from", "to", "share", LIFE), rows, ("from", "to"))]


def _zone_cells(zone: Zone) -> tuple[str, ...]:
    known = [edge.mechanism for edge in (zone.onset, zone.exit) if edge is not None]
    mechanism = " / ".join(dict.fromkeys(known)) or "-"
    width = speed(zone.width_rpm, nothing="open")
    return _edge_cell(zone.onset), _edge_cell(zone.exit), width, mechanism, f"{zone.share:.0%}"


def _life_cell(zone: Zone) -> str:
    """Mean lives in revolutions and, each at its own speed, in seconds."""
    if zone.life is None:
        return "-"
    revolutions = lives_in_words(zone.life, lambda life: f"{life.revolutions:.0f}")
    return f"{revolutions} ({lives_in_words(zone.life, lambda life: number(life.seconds, 1))} s)"


def _edge_cell(edge: Edge | None) -> str:
    if edge is None:
        return "past range"
    if edge.basis == "statistical":
        return Speeds("{:.0f} ± {:.0f}", edge.speed_rpm, edge.uncertainty_rpm)
    return speed(edge.speed_rpm, 1)


def _published_cell(spans: list[Span]) -> str:
    """Onset and exit of the published zones; the paper gives the second no exit."""
    texts = (number(a) + (" and up" if b is None else f" to {b:.0f}") for a, b in spans)
    return ", ".join(texts) or "-"


def zone_span(zone: Zone, lowest: float = -math.inf, highest: float = math.inf) -> tuple[float, float]:
    """Onset and exit of a zone [rpm], or what stands for an end that it does not have."""
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
