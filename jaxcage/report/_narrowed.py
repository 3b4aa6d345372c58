"""What measurements leave of the ranges of a file, as documents and tables."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..io import Measurement
from ..studies import Narrowed
from ._chances import range_words
from ._table import Table, number


def narrowed_document(found: Narrowed, measured: Sequence[Measurement]) -> dict[str, Any]:
    """For programs."""
    ends = lambda r: [r.lower, r.upper]
    pairs = zip(found.unknowns, found.ranges, found.share, found.narrowed, strict=True)
    return {
        "draws": found.draws,
        "stages": found.stages,
        "accepted": found.accepted,
        "measurements": [
            {"what": str(m), "off_by_tolerances": float(off)} for m, off in zip(measured, found.nearest, strict=True)
        ],
        "ranges": {
            u.label: {"before": ends(u.range), "after": ends(r), "share": float(share), "narrowed": bool(worth)}
            for u, r, share, worth in pairs
        },
    }


def measured_table(found: Narrowed, measured: Sequence[Measurement]) -> Table:
    """How near the best draw comes to each measurement."""
    rows = [
        (m.quantity, number(m.cage_rpm), m.words or "-", f"{off:.2g}")
        for m, off in zip(measured, found.nearest, strict=True)
    ]
    columns = ("measured", "cage [rpm]", "value", "off")
    return Table("Measurements, and how far the nearest draw is off [tolerances]", columns, rows, ("cage [rpm]",))


def narrowed_table(found: Narrowed, units: Mapping[str, str]) -> Table:
    """Each range before and after, with the unit of each value by its label."""
    ends = lambda label, r: range_words(r, units[label])
    rows = [
        (u.label, ends(u.label, u.range), ends(u.label, r) if worth else "as it was", f"{share:.0%}")
        for u, r, share, worth in zip(found.unknowns, found.ranges, found.share, found.narrowed, strict=True)
    ]
    return Table("Ranges", ("value", "before", "after", "left of it"), rows)
