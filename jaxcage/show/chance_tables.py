"""Tables of the chances of chaos of a design with unknown parameters, and of ranges narrowed by measurements."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from ..design import Ensemble, Narrowed
from ..files import Measurement, Range
from .tables import SHOWN, Beside, Column, Table, chosen, factor, speed_columns, table


def chances_table(name: str, found: Ensemble, beside: Beside = None) -> Table:
    """Table of the chances at each speed alone, with neighbouring speeds of one verdict in one row."""
    states, shares = [each.state for each in found.chances], 100 * found.chance_of_chaos
    lost = np.sum(found.failed, axis=0)
    span = lambda x, unit="": " to ".join(dict.fromkeys(f"{end:.0f}" for end in (np.min(x), np.max(x)))) + unit
    rows = []
    for state, places in itertools.groupby(range(len(states)), key=states.__getitem__):
        part = list(places)
        known = shares[part, 0][np.isfinite(shares[part, 0])]
        row = {"from": float(found.rpm[part[0]]), "to": float(found.rpm[part[-1]]), "failed draws": span(lost[part])}
        row |= {"verdict": state, "chance": span(known, " %") if known.size else None}
        rows.append(row | {"95 % bars": span(shares[part, 1:], " %")})
    columns = [column for end in ("from", "to") for column in speed_columns(end, end, beside)]
    columns += ["verdict", "chance", "95 % bars", *(["failed draws"] if np.any(lost) else [])]
    return table(f"Chance of chaos of {name} at each speed alone, {len(found.place)} draws [rpm]", rows, columns)


def range_words(found: Range, unit: str) -> str:
    """Text of a range with its unit."""
    shown, times = SHOWN.get(unit, unit), factor(unit, SHOWN.get(unit, unit)) if unit != "K" else 1.0
    low, high = (f"{times * end:.4g}".replace("e+0", "e").replace("e+", "e") for end in (found.lower, found.upper))
    return f"{low} to {high} {shown}".rstrip()


def chances_notes(found: Ensemble) -> list[str]:
    """Notes on how the draws were run, and how many failed."""
    length = f"{found.discard} revolutions left out, {found.revolutions} observed"
    notes = [f"{len(found.place)} draws from {len(found.unknowns)} ranges, one initial state each, {length}"]
    if np.any(found.failed):
        lost = f"{int(np.sum(found.failed))} of {found.failed.size} simulations failed and are in no chance"
        notes.append(f"{lost}; bars and the verdicts calm and rattles hold whatever they would do.")
    return notes


def unknowns_notes(found: Ensemble) -> list[str]:
    """Notes on the range of each unknown value, and how to measure it."""
    each = zip(found.unknowns, found.units or len(found.unknowns) * ("1",), found.sources, strict=True)
    return [f"{u.label}, {range_words(u.range, unit)}: {source}" for u, unit, source in each]


def measured_table(found: Narrowed, measured: Sequence[Measurement], beside: Beside = None) -> Table:
    """Table of the distance of the best draw from each measurement."""
    rows = [
        {"what": str(m), "measured": m.quantity, "rpm": m.cage_rpm, "value": m.words, "off_by_tolerances": float(off)}
        for m, off in zip(measured, found.nearest, strict=True)
    ]
    columns = ["measured", *speed_columns("speed [rpm]", "rpm", beside), "value"]
    title = "Measurements, and how far the nearest draw is off [tolerances]"
    return table(title, rows, [*columns, Column("off", "off_by_tolerances", digits=2)], "measurements")


def narrowed_table(found: Narrowed, units: Mapping[str, str]) -> Table:
    """Table of each range before and after, with units by the label of the value."""
    rows = []
    for u, r, share, worth in zip(found.unknowns, found.ranges, found.share, found.narrowed, strict=True):
        before, after = (range_words(each, units[u.label]) for each in (u.range, r))
        row = {"value": u.label, "before": before, "after": after if worth else "as it was", "share": float(share)}
        rows.append(row | chosen(r, "lower upper") | {"narrowed": bool(worth)})
    left = Column("left of it", "share", shown="%", digits=0)
    return table("Ranges", rows, ["value", "before", "after", left], "ranges")
