"""The paper's results beside ours as tables."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..reproduction import ComparedEdge, ReadingResult
from ._table import Table, number


def two_zones_table(zones: Mapping[str, Mapping[str, int]]) -> Table:
    """How many wide zones each case has, by case and kind, where two were published."""
    kinds = tuple(next(iter(zones.values())))
    rows = [(case, "2", *(str(found[kind]) for kind in kinds)) for case, found in zones.items()]
    return Table("Zones of 500 rpm and more, 4000 to 27500 rpm", ("case", "published", *kinds), rows)


def compared_table(edges: Sequence[ComparedEdge], resolution: float) -> Table:
    """The published edges beside ours of every kind, from sweeps at a resolution [rpm]."""
    kinds = tuple(dict.fromkeys(e.kind for e in edges))
    rows: dict[tuple[str, str, str], dict[str, str]] = {}
    for e in edges:
        found = "none" if e.ours_rpm is None else f"{e.ours_rpm:.0f} ({e.error_percent:+.1f} %)"
        rows.setdefault((e.case, e.edge, number(e.published_rpm)), {})[e.kind] = found
    body = [(*key, *(found.get(kind, "-") for kind in kinds)) for key, found in rows.items()]
    title = f"Published edges and ours [rpm], sweeps at {resolution:.0f} rpm"
    return Table(title, ("case", "edge", "published", *kinds), body)


def ranges_table(ranges: Sequence[Mapping[str, Any]]) -> Table:
    """Ranges of the strobe points beside the printed axes."""
    columns = {
        "figure": "{[figure]}",
        "quantity": "{0[quantity]} [{0[unit]}]",
        "ours": "{0[lower]:.3g} to {0[upper]:.3g}",
        "printed axis": "{0[axis_lower]:g} to {0[axis_upper]:g}",
        "inside": lambda r: "yes" if r["inside"] else "no",
    }
    return Table.of("Ranges of the strobe points", columns, ranges)


def readings_table(read: Sequence[ReadingResult]) -> Table:
    """What each reading of the paper does to the zones."""
    edges = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
    rows = [
        (r.reading.case, f"{r.reading.question}: {r.reading.answer}", f"{100 * r.chaotic_share:.0f} %", str(r.zones))
        + (*(number(e.ours_rpm) for e in r.edges), str(r.failed))
        for r in read
    ]
    return Table("Readings of the paper [rpm]", ("case", "reading", "chaotic", "zones", *edges, "failed"), rows)
