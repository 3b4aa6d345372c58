"""Tables of the chances of chaos of a design with unknown parameters, and of ranges narrowed by measurements."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..design import Ensemble, Index, Narrowed
from ..files import Measurement, Range
from .tables import Beside, Column, Table, chosen, speed_columns, table


MOST = 3
"""Largest number of values advised for measurement."""
WORDS = {
    "not decided": "not decided by what is known",
    "calm as computed": "calm where computed",
    "chaotic as computed": "chaotic where computed",
}
"""Text of verdicts that are shown in other words."""


def chances_document(found: Ensemble) -> dict[str, Any]:
    """Chances of chaos by speed for a JSON document."""
    names = ("chance_lower", "chance_upper", "chaotic_draws", "finished_draws")
    counts = dict(zip(names, (*found.interval, *found.counts), strict=True))
    failed = {"draws": len(found.place), "failed": int(np.sum(found.failed)), "speeds_rpm": found.rpm}
    return failed | {"chance_of_chaos": found.chance, **counts, "verdict": found.verdict}


def chances_tables(name: str, found: Ensemble, beside: Beside = None) -> list[Table]:
    """Tables of speed ranges with one verdict, and of the unknown values, the most influential first."""
    (low, high), verdicts, lost = found.interval, found.verdict, len(found.place) - found.counts[1]
    span = lambda x, unit="": " to ".join(dict.fromkeys(f"{end:.0f}" for end in (np.min(x), np.max(x)))) + unit
    stretches = []
    for verdict, places in itertools.groupby(range(len(verdicts)), key=verdicts.__getitem__):
        part = list(places)
        known = found.chance[part][np.isfinite(found.chance[part])]
        row = {"from": float(found.rpm[part[0]]), "to": float(found.rpm[part[-1]]), "failed draws": span(lost[part])}
        row |= {"verdict": WORDS.get(verdict, verdict), "chance": span(100 * known, " %") if known.size else None}
        stretches.append(row | {"95 % bars": span(100 * np.concatenate([low[part], high[part]]), " %")})
    columns = [column for end in ("from", "to") for column in speed_columns(end, end, beside)]
    title = f"Chance of chaos of {name}, {len(found.place)} draws from {len(found.unknowns)} ranges [rpm]"
    chances = table(title, stretches, [*columns, "verdict", "chance", "95 % bars", "failed draws"])
    shares = {clue.label: clue.share for clue in found.clues()}
    each = zip(found.unknowns, found.units or len(found.unknowns) * ("",), found.sources, strict=True)
    rows = [
        {"value": u.label, "range": range_words(u.range, unit), "share": shares.get(u.label), "measure": source}
        for u, unit, source in sorted(each, key=lambda row: -shares.get(row[0].label, 0.0))
    ]
    share = Column("of the verdict", "share", shown="%", digits=0)
    return [chances, table("Unknown values", rows, ["value", "range", share], "unknowns")]


def range_words(found: Range, unit: str) -> str:
    """Text of a range with its unit."""
    low, high = (f"{end:.4g}".replace("e+0", "e").replace("e+", "e") for end in (found.lower, found.upper))
    return f"{low} to {high} {'' if unit == '1' else unit}".rstrip()


def chances_answer(found: Ensemble) -> str:
    """Sentence on what the known values decide, and what to do about the rest."""
    if count := int(np.sum(found.undecided)):
        said = f"Known values do not decide between calm and chaotic at {count} of {found.rpm.size} speeds."
        return f"{said} {measures_words(found.clues())}"
    if "too few draws" in found.verdict:
        return "Too few draws finished to call a speed calm or chaotic: take more --draws."
    partly = any(v.endswith("as computed") for v in found.verdict)
    return f"Known values decide at every speed{', as far as the draws could be computed' if partly else ''}."


def chances_notes(found: Ensemble) -> list[str]:
    """Notes on how the draws were run, how many failed, and how to measure each unknown value."""
    length = f"{found.discard} revolutions left out, {found.revolutions} observed"
    notes = [f"One initial state for each draw, {length}: chaos that dies out later counts too."]
    if np.any(found.failed):
        lost = f"{int(np.sum(found.failed))} of {found.failed.size} simulations failed and are in no chance"
        notes.append(f"{lost}; bars and the verdicts calm and chaotic hold whatever they would do.")
    if partly := sum(v.endswith("as computed") for v in found.verdict):
        notes.append(
            f"At {partly} of {found.rpm.size} speeds the verdict is that of the draws that could be computed. "
            "The rest are not like them, and more draws do not replace these: other steps may (--solver, --steps)."
        )
    return [*notes, *(f"{u.label}: {source}" for u, source in zip(found.unknowns, found.sources, strict=True))]


def measures_words(clues: Sequence[Index]) -> str:
    """Sentence on the values to be measured, the most influential first."""
    telling = [c for c in clues if c.share > 0][:MOST]
    if not telling:
        return "No single value decides: measure all, or draw more (--draws)."
    return f"Measure {'; '.join(f'{c.label} ({c.source}), {c.share:.0%} of the verdict' for c in telling)}."


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
