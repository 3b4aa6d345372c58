"""Chances of chaos of a design that is known within ranges only, and ranges that measurements narrowed."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..design import Clue, Ensemble, Narrowed, verdict_of
from ..io import Measurement, Range
from .tables import Beside, Column, Table, chosen, rows_table, speed_columns


MOST = 3
"""Values that are advised to be measured."""
WORDS = {
    "not decided": "not decided by what is known",
    "calm as computed": "calm where computed",
    "chaotic as computed": "chaotic where computed",
}
"""Verdicts in words, where they differ."""


def chances_document(found: Ensemble) -> dict[str, Any]:
    """An ensemble for a document."""
    low, high = found.interval
    chaotic, of = found.counts
    return {
        "draws": int(found.place.shape[0]),
        "speeds_rpm": found.rpm,
        "chance_of_chaos": found.chance,
        "chance_lower": low,
        "chance_upper": high,
        "chaotic_draws": chaotic,
        "finished_draws": of,
        "failed": int(np.sum(found.failed)),
        "verdict": found.verdict,
        "bands": [{"edge": b.name, "share": b.share, "rpm_5_50_95": b.rpm} for b in found.bands],
        "unknowns": {u.label: [u.range.lower, u.range.upper] for u in found.unknowns},
        "measure": [{"what": c.label, "share": c.share, "how": c.source} for c in found.clues()],
    }


def chances_tables(name: str, found: Ensemble, beside: Beside = None) -> list[Table]:
    """Stretches of speed with one verdict, bands of the edges, and the unknown values, the most telling first."""
    (low, high), verdicts, lost = found.interval, found.verdict, len(found.place) - found.counts[1]
    span = lambda x, unit="": " to ".join(dict.fromkeys(f"{end:.0f}" for end in (np.min(x), np.max(x)))) + unit
    stretches = []
    for verdict, places in itertools.groupby(range(len(verdicts)), key=verdicts.__getitem__):
        part = list(places)
        known = found.chance[part][np.isfinite(found.chance[part])]
        stretches.append(
            {"from": float(found.rpm[part[0]]), "to": float(found.rpm[part[-1]]), "verdict": WORDS.get(verdict, verdict)}
            | {"chance": span(100 * known, " %") if known.size else None, "failed": span(lost[part])}
            | {"bars": span(100 * np.concatenate([low[part], high[part]]), " %")}
        )
    columns = [
        *speed_columns("from", "from", beside),
        *speed_columns("to", "to", beside),
        Column("verdict", ()),
        Column("chance", ()),
        Column("95 % bars", (), key="bars"),
        Column("failed draws", (), key="failed"),
    ]
    draws = f"{found.place.shape[0]} draws from {len(found.unknowns)} ranges"
    chances = rows_table(f"Chance of chaos of {name}, {draws} [rpm]", stretches, columns)
    bands = [{"edge": b.name, "share": b.share, **dict(zip(("5 %", "middle", "95 %"), b.rpm))} for b in found.bands]
    ends = [column for head in ("5 %", "middle", "95 %") for column in speed_columns(head, head, beside)]
    share = Column("draws that have it", (), "1", "%", key="share", digits=0)
    edges = rows_table(f"Bands of the chaotic edges of {name} [rpm]", bands, [Column("edge", ()), *ends, share])
    return [chances, *([edges] if bands else []), _unknowns_table(found)]


def _unknowns_table(found: Ensemble) -> Table:
    shares = {c.label: c.share for c in found.clues()}
    each = zip(found.unknowns, found.units or len(found.unknowns) * ("",), found.sources, strict=True)
    rows = [
        {"value": u.label, "range": range_words(u.range, unit), "share": shares.get(u.label), "measure": source}
        for u, unit, source in sorted(each, key=lambda row: -shares.get(row[0].label, 0.0))
    ]
    share = Column("of the verdict", (), "1", "%", key="share", digits=0)
    return rows_table("Unknown values", rows, [Column("value", ()), Column("range", ()), share, Column("measure", ())])


def range_words(found: Range, unit: str) -> str:
    """The ends of a range with their unit."""
    low, high = (f"{end:.4g}".replace("e+0", "e").replace("e+", "e") for end in (found.lower, found.upper))
    return f"{low} to {high} {'' if unit == '1' else unit}".rstrip()


def chances_answer(found: Ensemble) -> str:
    """What the ensemble decides, and what to do about the rest, in a sentence."""
    open_ = found.rpm[found.undecided]
    if open_.size:
        advice = measures(found.clues())
        return f"Known values do not decide between calm and chaotic at {open_.size} of {found.rpm.size} speeds. {advice}"
    if "too few draws" in found.verdict:
        return "Too few draws finished to call a speed calm or chaotic: take more --draws."
    if any(v.endswith("as computed") for v in found.verdict):
        return "Known values decide at every speed, as far as the draws could be computed."
    return "Known values decide at every speed."


def chances_notes(found: Ensemble) -> list[str]:
    """How the draws were run, and what became of those that failed."""
    notes = [
        f"One initial state for each draw, {found.discard} revolutions left out, {found.revolutions} observed: chaos "
        "that dies out later counts too."
    ]
    if np.any(found.failed):
        notes.append(
            f"{int(np.sum(found.failed))} of {found.failed.size} simulations failed: they are in no chance; bars and the "
            "verdicts calm and chaotic hold whatever they would do."
        )
    partly = [v for v in found.verdict if v.endswith("as computed")]
    if partly:
        notes.append(
            f"At {len(partly)} of {found.rpm.size} speeds the verdict is that of the draws that could be computed. "
            "The rest are not like them, and more draws do not replace these: other steps may (--solver, --steps)."
        )
    return notes


def measures(clues: Sequence[Clue]) -> str:
    """The values to be measured, the most telling first."""
    telling = [c for c in clues if c.share > 0][:MOST]
    if not telling:
        return "No single value decides: measure all, or draw more (--draws)."
    return f"Measure {'; '.join(f'{c.label} ({c.source}), {c.share:.0%} of the verdict' for c in telling)}."


def operating_chances(found: Ensemble, operating: Sequence[Any], ratio: float) -> Table:
    """Verdicts at operating speeds; of a range, the chance that some speed in it is chaotic."""
    rows = []
    for at in operating:
        which = found.between(at.low_rpm, at.high_rpm)
        done = ~np.any(found.failed[:, which], axis=1) | np.any(found.chaotic[:, which], axis=1)
        hits, of = int(np.sum(np.any(found.chaotic[done][:, which], axis=1))), int(np.sum(done))
        verdict = verdict_of(hits, of, len(done))
        rows.append(
            {"cage speed": str(at), "shaft speed": str(at.of_shaft(ratio)), "chance": hits / of if of else None}
            | {"verdict": WORDS.get(verdict, verdict)}
            | {"measure": measures(found.clues(which)) if verdict == "not decided" else None}
        )
    columns = [Column("cage speed", ()), Column("shaft speed", ()), Column("chance", (), "1", "%", digits=0)]
    return rows_table("Operating speeds, by known values", rows, [*columns, Column("verdict", ()), Column("measure", ())])


def narrowed_document(found: Narrowed, measured: Sequence[Measurement]) -> dict[str, Any]:
    """Narrowed ranges for a document."""
    ends = lambda r: [r.lower, r.upper]
    pairs = zip(found.unknowns, found.ranges, found.share, found.narrowed, strict=True)
    return {
        **chosen(found, "draws stages accepted"),
        "measurements": [
            {"what": str(m), "off_by_tolerances": float(off)} for m, off in zip(measured, found.nearest, strict=True)
        ],
        "ranges": {
            u.label: {"before": ends(u.range), "after": ends(r), "share": float(share), "narrowed": bool(worth)}
            for u, r, share, worth in pairs
        },
    }


def measured_table(found: Narrowed, measured: Sequence[Measurement], beside: Beside = None) -> Table:
    """The distance of the best draw from each measurement."""
    rows = [
        {"measured": m.quantity, "rpm": m.cage_rpm, "value": m.words, "off": float(off)}
        for m, off in zip(measured, found.nearest, strict=True)
    ]
    columns = [Column("measured", ()), *speed_columns("cage [rpm]", "rpm", beside), Column("value", ())]
    return rows_table("Measurements, and how far the nearest draw is off [tolerances]", rows, [*columns, Column("off", (), digits=2)])


def narrowed_table(found: Narrowed, units: Mapping[str, str]) -> Table:
    """Each range before and after, with the unit of each value by its label."""
    ends = lambda label, r: range_words(r, units[label])
    rows = [
        {"value": u.label, "before": ends(u.label, u.range), "after": ends(u.label, r) if worth else "as it was"}
        | {"left of it": share}
        for u, r, share, worth in zip(found.unknowns, found.ranges, found.share, found.narrowed, strict=True)
    ]
    columns = [Column("value", ()), Column("before", ()), Column("after", ()), Column("left of it", (), "1", "%", digits=0)]
    return rows_table("Ranges", rows, columns)
