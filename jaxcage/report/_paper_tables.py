"""The paper's results beside ours as tables."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..reproduction import ComparedEdge, ReadingResult
from ._table import Table, number


def compared_table(edges: Sequence[ComparedEdge], resolution: float) -> Table:
    """The published edges beside ours, from sweeps at a resolution [rpm]."""
    plus = lambda e: "" if e.uncertainty_rpm is None else f" ± {e.uncertainty_rpm:.3g}"
    columns = {
        "case": "{.case}",
        "edge": "{.edge}",
        "published": lambda e: number(e.published_rpm),
        "kind": "{.kind}",
        "ours": lambda e: number(e.ours_rpm, nothing="none") + plus(e),
        "error": lambda e: "-" if e.error_percent is None else f"{e.error_percent:+.1f} %",
        "mechanism": lambda e: e.mechanism or "-",
    }
    return Table.of(f"Published edges and ours [rpm], sweeps at {resolution:.0f} rpm", columns, edges)


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
