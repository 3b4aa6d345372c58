"""Zones found in a sweep or by a search beside the published ones; bifurcations, stable stretches of orbits."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from .. import analysis
from ..analysis import Zone, Zones, lives_in_words
from ..bearing import PublishedCase
from ..orbits import LossZones, Point, StableRange, SynchronousOrbits
from .tables import Beside, Column, Table, chosen, number, rows_table, speed_columns


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


def stretches_table(name: str, found: Iterable[analysis.Stretch]) -> Table:
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


AT_LIMIT_RPM = 1e-6
SAME = 0.03
"""Relative distance in places, and in speeds, within which two orbits are the same."""


def point_record(point: Point, found: SynchronousOrbits, name: str | None = None) -> dict[str, Any]:
    """A bifurcation for tables and documents; `name` is that of the edge that it makes."""
    mu, exact = complex(point.critical), {"period-doubling": 180.0, "fold": 0.0, "branch-point": 0.0}
    return {
        **{n: float(getattr(point, n)) for n in ("speed_rpm", "error_rpm")},
        **chosen(point, "kind steps edge state"),
        "multiplier": [mu.real, mu.imag],
        "angle_deg": exact.get(point.kind, abs(math.degrees(np.angle(mu)))),
        "branch": next((i for i, b in enumerate(found.branches) if any(p is point for p in b.special)), None),
        "name": name,
    }


def _stretch_record(stretch: StableRange, found: SynchronousOrbits) -> dict[str, Any]:
    """A stable stretch, which begins and ends by a kind of bifurcation, by `range` where it runs past the range, or by
    `unknown` where the branch was not followed further."""
    record = chosen(stretch, "lower_rpm upper_rpm width_rpm branch confirmed family met met_first")
    for end in ("lower", "upper"):
        point, at_limit = getattr(stretch, end), abs(record[f"{end}_rpm"] - getattr(found, f"{end}_rpm")) < AT_LIMIT_RPM
        record[f"{end}_kind"] = ("range" if at_limit else "unknown") if point is None else point.kind
    return record


def orbits_document(found: SynchronousOrbits, loss: LossZones) -> dict[str, Any]:
    """All bifurcations that a search found, and the orbits there are at the speed of each named edge."""
    pairs = lambda multipliers: [[float(mu.real), float(mu.imag)] for mu in multipliers]
    return {
        "range_rpm": [found.lower_rpm, found.upper_rpm],
        "close_below_rpm": loss.close_below_rpm,
        "points": [point_record(p, found) for p in found.points],
        "unexplained": [point_record(p, found) for p in found.unexplained],
        "coexisting": {
            name: [{"branch": i, "stable": stable, "state": y, "multipliers": pairs(mu)} for i, stable, y, mu in orbits]
            for name, orbits in loss.coexisting.items()
        },
        **chosen(found, "missed unsettled"),
    }


def stretch_table(name: str, found: SynchronousOrbits, beside: Beside = None) -> Table:
    """Stretches of speed in which a synchronous orbit is stable, and the bifurcations at their ends [rpm]."""
    rows, columns = [_stretch_record(s, found) for s in found.stretches], []
    for head, end in (("from", "lower"), ("to", "upper")):
        columns += [*speed_columns(head, f"{end}_rpm", beside, digits=2), Column("by", (), key=f"{end}_kind")]
    columns += [Column("width", (), key="width_rpm", digits=2), Column("settled", (), key="met"), Column("branch", ())]
    return rows_table(f"Stable synchronous orbits of {name} [rpm]", rows, columns, "stretches")


def loss_table(
    name: str, found: SynchronousOrbits, loss: LossZones, published: PublishedCase | None, beside: Beside = None
) -> Table:
    """Zones without a stable synchronous orbit, each published (chaotic) zone beside the one it shares most with."""
    title = f"Synchronous-loss zones of {name} [rpm], closed below {loss.close_below_rpm:.0f} rpm"
    between = found.lower_rpm, found.upper_rpm
    return beside_published(title, "synchronous_loss", loss.zones, published, between, beside)


def edge_table(found: SynchronousOrbits, loss: LossZones, beside: Beside = None, named: bool = False) -> Table:
    """Bifurcations at which a stable synchronous orbit begins or ends; with `named` those that bound a zone."""
    names = {id(point): name for name, point in loss.edges.items()}
    rows = [point_record(p, found, names.get(id(p))) for p in found.edges if not named or id(p) in names]
    for row in rows:
        both = f" ± {row['multiplier'][1]:.4f}i" if row["kind"] == "Neimark-Sacker" else ""
        row["critical"] = f"{row['multiplier'][0]:.4f}{both}"
    columns = [
        *speed_columns("speed", "speed_rpm", beside, "error_rpm"),
        Column("kind", ()),
        Column("multiplier", (), key="critical"),
        Column("angle", (), "deg", key="angle_deg", digits=2),
        Column("branch", ()),
        Column("edge of", (), key="name"),
    ]
    return rows_table("Ends of the stable synchronous orbits [rpm]", rows, columns, "edges")


def unsettled_notes(found: SynchronousOrbits) -> list[str]:
    """Bifurcations that were left out, stretches that are not certain, and bifurcations that must have been missed."""
    count = found.unsettled
    notes = [f"Left out: {count} bifurcations that half the steps put elsewhere (not converged)"] if count else []
    for s in found.stretches:
        if not s.confirmed:
            notes.append(f"Not confirmed: the stretch from {s.lower_rpm:.2f} rpm is narrower than its error")
    for p in found.unexplained:
        place = f"{number(float(p.speed_rpm), float(p.error_rpm))} rpm on branch {point_record(p, found)['branch']}"
        notes.append(f"Unexplained: the stability changes at {place}, and no bifurcation was found there")
    return notes


def coexisting_notes(loss: LossZones) -> list[str]:
    """One line for each named edge at whose speed another synchronous orbit is stable."""
    notes = []
    for name, orbits in loss.coexisting.items():
        others: list[np.ndarray] = []
        for state in (state for _, stable, state, _ in orbits if stable):
            if not any(_same(state, known) for known in (np.asarray(loss.edges[name].state), *others)):
                others.append(state)
        if others:
            orbit = "another synchronous orbit is" if len(others) == 1 else f"{len(others)} other ones are"
            at = f"{name} ({float(loss.edges[name].speed_rpm):.2f} rpm)"
            notes.append(f"At {at} {orbit} stable: not every initial state leads to this edge.")
    return notes


def _same(state: np.ndarray, other: np.ndarray) -> bool:
    parts = zip(np.split(state, 2), np.split(other, 2), strict=True)
    return all(np.linalg.norm(a - b) < SAME * np.linalg.norm(b) for a, b in parts)
