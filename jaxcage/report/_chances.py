"""Chances of chaos, and ranges that measurements narrowed, as documents, tables and sentences."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..design import SobolIndices
from ..io import Measurement, Range
from ..studies import Band, Clue, Ensemble, Narrowed, verdict_of
from ._operating import Operating
from ._table import Table, speed


MOST = 3
"""Things that one is told to measure."""


def chances_document(found: Ensemble) -> dict[str, Any]:
    """An ensemble for programs."""
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
        "verdict": found.verdict,
        "bands": [{"edge": b.name, "share": b.share, "rpm_5_50_95": b.rpm} for b in found.bands],
        "unknowns": {u.label: [u.range.lower, u.range.upper] for u in found.unknowns},
        "measure": [{"what": c.label, "share": c.share, "how": c.source} for c in found.clues()],
    }


def chances_table(name: str, found: Ensemble) -> Table:
    """Stretches of speeds with one verdict, and the chances within them."""
    low, high = found.interval
    verdicts, rows = found.verdict, []
    lost = len(found.place) - found.counts[1]
    for verdict, places in itertools.groupby(range(len(verdicts)), key=verdicts.__getitem__):
        part = list(places)
        p = found.chance[part]
        chance = _span(p[np.isfinite(p)])
        bar = f"{100 * low[part].min():.0f} to {100 * high[part].max():.0f} %"
        ends = (speed(float(found.rpm[i])) for i in (part[0], part[-1]))
        rows.append((*ends, verdict_words(verdict), chance, bar, _counts(lost[part])))
    title = f"Chance of chaos of {name}, {found.place.shape[0]} draws from {len(found.unknowns)} ranges [rpm]"
    return Table(title, ("from", "to", "verdict", "chance", "95 % bars", "draws that failed"), rows, ("from", "to"))


_WORDS = {
    "not decided": "not decided by what is known",
    "calm as computed": "calm where computed",
    "chaotic as computed": "chaotic where computed",
}


def verdict_words(verdict: str) -> str:
    """A verdict for people."""
    return _WORDS.get(verdict, verdict)


def _counts(lost: np.ndarray) -> str:
    low, high = int(lost.min()), int(lost.max())
    return f"{low}" if low == high else f"{low} to {high}"


def _span(p: np.ndarray) -> str:
    if p.size == 0:
        return "-"
    low, high = 100 * float(np.min(p)), 100 * float(np.max(p))
    return f"{low:.0f} %" if round(low) == round(high) else f"{low:.0f} to {high:.0f} %"


def bands_table(name: str, bands: Sequence[Band]) -> Table:
    """Where each edge may be."""
    rows = [(b.name, *(speed(rpm) for rpm in b.rpm), f"{b.share:.0%}") for b in bands]
    columns = ("edge", "5 %", "middle", "95 %", "draws that have it")
    return Table(
        f"Bands of the chaotic edges of {name} [rpm]",
        columns,
        rows or [("none", *4 * ("-",))],
        ("5 %", "middle", "95 %"),
    )


def unknowns_table(found: Ensemble) -> Table:
    """What is unknown, how much of the verdict hangs on it, and what to measure; the most telling first."""
    shares = {c.label: c.share for c in found.clues()}
    each = list(zip(found.unknowns, found.units or len(found.unknowns) * ("",), found.sources, strict=True))
    rows = [
        (u.label, range_words(u.range, unit), f"{shares[u.label]:.0%}" if u.label in shares else "-", source)
        for u, unit, source in sorted(each, key=lambda row: -shares.get(row[0].label, 0.0))
    ]
    return Table("What is not known", ("value", "range", "of the verdict", "measure"), rows)


def range_words(found: Range, unit: str) -> str:
    """The ends of a range with their unit."""
    low, high = (f"{end:.4g}".replace("e+0", "e").replace("e+", "e") for end in (found.lower, found.upper))
    return f"{low} to {high} {'' if unit == '1' else unit}".rstrip()


def chances_tables(name: str, found: Ensemble) -> list[Table]:
    """All that is said of an ensemble."""
    return [
        chances_table(name, found),
        bands_table(name, found.bands),
        unknowns_table(found),
    ]


def chances_notes(found: Ensemble) -> list[str]:
    """What to do about it."""
    notes = [
        f"One start for each draw, {found.discard} revolutions left out, {found.revolutions} observed: chaos that dies "
        "out later counts too."
    ]
    if np.any(found.failed):
        lost = f"{int(np.sum(found.failed))} of {found.failed.size}"
        notes.append(
            f"{lost} simulations failed: they are in no chance; bars and the verdicts calm and chaotic hold whatever "
            "they would do."
        )
    partly = [v for v in found.verdict if v.endswith("as computed")]
    if partly:
        notes.append(
            f"At {len(partly)} of {found.rpm.size} speeds the verdict is that of the draws that could be computed. "
            "The rest are not like them, and more draws do not replace these: other steps may (--solver, --steps)."
        )
    clues = found.clues()
    open_ = found.rpm[found.undecided]
    if open_.size:
        notes.insert(0, f"Not decided by what is known at {open_.size} of {found.rpm.size} speeds. {measures(clues)}")
    elif "too few draws" in found.verdict:
        notes.insert(0, "Too few draws finished to call a speed calm or chaotic: take more --draws.")
    elif partly:
        notes.insert(0, "What is known decides at every speed, as far as the draws could be computed.")
    else:
        notes.insert(0, "What is known decides at every speed.")
    return notes


def measures(clues: Sequence[Clue]) -> str:
    """What to measure, the most telling first."""
    telling = [c for c in clues if c.share > 0][:MOST]
    if not telling:
        return "No single value decides: measure all, or draw more (--draws)."
    each = "; ".join(f"{c.label} ({c.source}), {c.share:.0%} of the verdict" for c in telling)
    return f"Measure {each}."


def operating_chances(found: Ensemble, operating: Sequence[Operating], ratio: float) -> Table:
    """Verdicts at operating speeds; of a range, the chance that some speed in it is chaotic."""
    rows = []
    for at in operating:
        which = found.between(at.low_rpm, at.high_rpm)
        done = ~np.any(found.failed[:, which], axis=1) | np.any(found.chaotic[:, which], axis=1)
        hits, of = int(np.sum(np.any(found.chaotic[done][:, which], axis=1))), int(np.sum(done))
        chance = hits / of if of else float("nan")
        verdict = verdict_of(hits, of, len(done))
        said = verdict_words(verdict)
        measure = measures(found.clues(which)) if verdict == "not decided" else "-"
        rows.append((str(at), str(at.of_shaft(ratio)), f"{100 * chance:.0f} %", said, measure))
    return Table(
        "Operating speeds, by what is known",
        ("cage speed", "shaft speed", "chance of chaos", "verdict", "measure"),
        rows,
    )


def verdict_table(name: str, shares: SobolIndices, sources: Mapping[str, str]) -> Table:
    """What each unknown does to the chaotic share, alone and with the others, and how to measure it."""
    span = lambda pair: "not known" if np.isnan(pair).any() else f"{pair[0]:+.2f} to {pair[1]:+.2f}"
    cell = lambda value, pair: f"{value:+.2f} ({span(pair)})"
    columns = {
        "value": str,
        "alone": lambda n: cell(shares.first[n], shares.first_interval[n]),
        "with the others": lambda n: cell(shares.total[n], shares.total_interval[n]),
        "measure": lambda n: sources[n],
    }
    title = f"Sobol indices of the chaotic share of {name}, {shares.evaluations} draws"
    return Table.of(title, columns, sorted(shares.total, key=lambda n: -shares.total[n]))


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
        (m.quantity, speed(m.cage_rpm), m.words or "-", f"{off:.2g}")
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
