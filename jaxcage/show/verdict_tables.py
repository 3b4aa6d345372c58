"""Verdict on an operating range: its sentence, what would decide it, and what to change first."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from .._parameters import parameter_info
from ..analysis import ONE_ROLLER, outcomes
from ..bearing import listed_like, static_load_rating
from ..design import Chance, Checked, Index, Margins
from .tables import OWN, UNIT, Beside, Column, Table, speed_columns, table


MOST = 6
"""Largest number of parameters, or unknown values, listed."""
FAR = 0.3
"""Relative change of a parameter beyond which a first derivative is not extrapolated."""


def range_sentence(over: str, found: Chance | Checked) -> str:
    """Sentence of the verdict, from draws of the unknowns or from simulations of a known design."""
    if isinstance(found, Chance):
        low, high = found.interval
        share = f"{100 * found.share:.0f} %" if found.known else "unknown"
        words = {"calm": "Calm", "rattles": "The cage rattles", "not decided": "Not decided"}[found.state]
        bars = f"95 % interval {100 * low:.0f} to {100 * high:.0f} %"
        return f"{words}: over {over} the cage is calm with probability {share} ({bars})."
    if found.calm:
        return f"Calm: over {over} all {found.initial_states} initial states end on the calm motion at every speed."
    share, lost = (100 * found.shares.get(label, 0.0) for label in ("periodic-1", "failed"))
    failures = f", and {lost:.1f} % failed" if lost else ""
    if found.state == "not decided":
        return f"Not decided: over {over} {share:.1f} % of the simulations end calm{failures}."
    everywhere = found.chaotic_rpm.size == found.speeds_rpm.size
    if share == 0 and everywhere:
        return f"The cage rattles: over {over} no simulation ends on a calm motion{failures}."
    where = "at every speed" if everywhere else "at some speeds"
    where = f"and chaos is seen {where}" if found.chaotic_rpm.size else "the others on other motions"
    return f"Not calm from every initial state: over {over} {share:.1f} % end calm, {where}{failures}."


def margin_sentence(found: Margins | str, whose: str, ratio: float) -> str:
    """Margin of a design, and the change that adds most to it; speeds are those of `whose`, `ratio` times as large as
    the model's."""
    if isinstance(found, str):
        return f"No margin: {found}"
    end, least = found.least
    if end in found.open:
        far = f"{found.lower.value:.0f} % below and {found.upper.value:.0f} % above it"
        return f"The synchronous orbit is stable over the whole range, and to {far}."
    said = f"The {end} end of the range is {least.value:.2g} % of its speed away from a loss of stability"
    if least.value < 0:
        from_, to = (f"{ratio * margin.rpm:.0f}" for margin in (found.lower, found.upper))
        only = f"from {from_} rpm on" if "upper" in found.open else f"up to {to} rpm" if "lower" in found.open else ""
        said = f"The synchronous orbit in the middle of the range is stable only {only or f'from {from_} to {to} rpm'}"
        said += f" of the {whose}, and the cage goes over to another motion there"
    if not (changes := found.changes):
        return f"{said}."
    first = changes[0]
    what = f"{first.amount} {'more' if first.up else 'less'} {first.name.replace('_', ' ')}"
    return f"{said}; {what} adds {first.gain:.2g} % of speed at its {end} end."


def margins_table(found: Margins, beside: Beside = None) -> Table:
    """Table of the edges of the stable range beside the operating range."""
    rows: list[dict[str, Any]] = []
    for end in ("lower", "upper"):
        margin = getattr(found, end)
        shown = f"above {margin.value:.0f}" if end in found.open else f"{margin.value:.2f}"
        rows.append({"end of the range": end, "margin [%]": shown, "margin": margin.value, "rpm": margin.rpm})
    decay = "does not die out" if math.isinf(found.decay) else f"falls to 1/e in {found.decay:.2g} revolutions"
    columns = ["end of the range", "margin [%]", *speed_columns("edge [rpm]", "rpm", beside)]
    return table(f"Margins; a disturbance {decay} at the worst speed", rows, columns, "margins")


def changes_table(model: Any, found: Margins) -> Table:
    """Table of the effects of 10 % of each parameter on both margins, and of the values at which the margin is lost."""
    info, (end, _), rows = parameter_info(model), found.least, []
    other = "upper" if end == "lower" else "lower"
    for change in found.changes[:MOST]:
        row = dict(change._asdict()) | {"parameter": change.name.replace("_", " "), "unit": info[change.name].unit}
        limit = change.limit if abs(change.limit / change.value - 1) <= FAR else None
        rows.append(row | {"change": f"{'+' if change.up else '-'}{change.amount}", "limit": limit})
    columns = ["parameter", UNIT, Column("now", "value", OWN), "change"]
    columns.append(Column(f"adds to {end} margin [%]", "gain", digits=2))
    columns += [Column(f"to {other} margin [%]", "other", digits=2), Column("may reach", "limit", OWN)]
    return table("What to change first, at first order", rows, columns, "changes")


def forces_table(found: Mapping[str, Mapping[str, float]]) -> Table:
    """Table of the largest size of each force on the cage [N] at some speeds, from these by speed in words."""
    names = dict.fromkeys(name for forces in found.values() for name in forces)
    rows = [{"force on the cage": name} | {at: forces[name] for at, forces in found.items()} for name in names]
    columns = ["force on the cage", *(Column(f"at {at}", at, "N") for at in found)]
    return table("Largest forces on the cage at the best guess", rows, columns, "forces")


def forces_note(found: Mapping[str, Mapping[str, float]], unknown: Sequence[str]) -> str:
    """Note on the largest lasting force at the last speed, with the names of the unknown values that decide it."""
    at, forces = list(found.items())[-1]
    if any(map(math.isnan, forces.values())):
        return f"The largest force on the cage at {at} is not known: the simulation there failed"
    lasting = [name for name in forces if name != ONE_ROLLER]
    first, second, *_ = sorted(lasting, key=lambda name: forces[name], reverse=True)
    said = f"Largest force on the cage at {at}: {first}, {forces[first] / forces[second]:.2g} times the next, {second}"
    by = [label for label in unknown if label.startswith(f"{first}.")]
    return f"{said}; unknown about it: {', '.join(by)}" if by else said


def indices_table(rows: Sequence[Index]) -> Table:
    """Table of the values whose measurement would decide most."""
    shown = [row._asdict() for row in rows if row.telling]
    columns = [Column("value", "label"), Column("of the verdict", "share", shown="%", error="error", digits=0)]
    title = "What would decide it: first-order indices of the unknown values"
    return table(title, shown[:MOST], columns, "indices")


def indices_note(rows: Sequence[Index]) -> str:
    """Note on the value to measure first, if the draws show it."""
    if not rows:
        return "No unknown value stands out: all finished draws end alike, or are too few to compare."
    if not rows[0].telling:
        return "The draws do not tell which unknown value to measure first (no index exceeds twice its error)."
    return f"Measure {rows[0].label} first: {rows[0].source}"


MOTIONS = {"locally_periodic": "calm", "circular": "circling", "disordered": "rattling", "undecided": "undecided"}
"""Plain words for the motions of a cage among its rollers, by the names of `jaxcage.analysis.motion_label`."""
BY_CAGE_MODEL = 'The cage model prescribes the impacts of the rollers; slip and forces: a file with model = "bearing"'
MOTION_WORDS = {
    "locally_periodic": "a revolution later the centre of the cage is within a tenth of the clearance of where it was",
    "circular": "the centre whirls around the guide at an almost constant distance from the middle",
    "disordered": "neither: the cage wanders or bounces in its guide",
    "undecided": "within two standard errors of a limit between these",
}
"""Meaning of each motion."""


def motion_words(labels: Sequence[str]) -> str:
    """Plain words for motions."""
    return " or ".join(MOTIONS.get(label, label) for label in labels)


def cage_verdict(found: xr.Dataset) -> str:
    """Verdict over all speeds and initial states: `calm`, `circling`, `rattles` or `rattles in part`; `not decided` if
    simulations failed or are undecided and none of the others rattles."""
    some = set(found["label"].values.ravel().tolist())
    if "disordered" in some:
        return "rattles" if some <= {"disordered", "failed"} else "rattles in part"
    if some & {"failed", "undecided"}:
        return "not decided"
    return "circling" if "circular" in some else "calm"


def motion_sentence(over: str, found: xr.Dataset) -> str:
    """Sentence of the verdict on a bearing with its rollers."""
    label, rpm = found["label"].transpose("speed", ...).values, found["rpm"].values
    rough = np.any(label == "disordered", axis=1)
    counts = {words: int(np.sum(label == name)) for name, words in MOTIONS.items()}
    shares = ", ".join(f"{words} in {n}" for words, n in counts.items() if n)
    verdict = cage_verdict(found)
    words = {"calm": "Calm", "circling": "Calm or circling", "not decided": "Not decided"}
    said = words.get(verdict, f"The cage {verdict}")
    ends = dict.fromkeys(f"{end:.0f}" for end in rpm[rough][[0, -1]]) if rough.any() else {}
    where = f", {'from' if len(ends) > 1 else 'at'} {' to '.join(ends)} rpm" if ends and not rough.all() else ""
    failed = int(np.sum(label == "failed"))
    why = ", ".join(name.replace("_", " ") for name in outcomes(found) if name != "inaccurate")
    lost = f"; {failed} failed ({why})" if failed else ""
    return f"{said}{where}: over {over} the cage is {shares} of {label.size} simulations{lost}."


def motion_table(title: str, found: xr.Dataset) -> Table:
    """Table of the motion and slip of the cage, largest pocket force and friction by speed."""
    rows = []
    for i, rpm in enumerate(found["rpm"].values):
        at = found.isel(speed=i)
        names = [MOTIONS.get(str(name), str(name)) for name in at["label"].values.ravel()]
        row: dict[str, Any] = {"rpm": float(rpm), "motion": ", ".join(dict.fromkeys(names))}
        rows.append(row | {name: float(np.nanmean(at[name].values)) for name in READ if name in found})
    columns = [Column("shaft [rpm]", "rpm", digits=0), Column("motion of the cage", "motion")]
    columns += [Column("slip of the cage", READ[0], shown="%", digits=1)]
    columns += [Column("largest pocket force", READ[1], "N"), Column("friction", READ[2], "W")]
    return table(title, rows, columns, "speeds")


READ = "cage_slip", "pocket_force_max_N", "friction_power_W"
"""Variables of a data set that `motion_table` shows."""


BRASS_CAGE = 1.5
"""Limiting speed with a one-piece brass cage over that with the usual one (SKF, Rolling bearings, 2018, table 7)."""
SKIDS = 0.02
"""Slip of the cage from which a bearing is said to skid."""


def limiting_speed_notes(bearing: Any, shaft_rpm: float) -> list[str]:
    """A note if a speed of the shaft exceeds the limiting speed of the bearing in the catalogue."""
    like = listed_like(bearing)
    if like is None or not shaft_rpm > like.limiting_rpm:
        return []
    brass = f"{BRASS_CAGE * like.limiting_rpm:.0f} rpm with a one-piece brass cage"
    said = f"SKF limits {like.designation} to {like.limiting_rpm:.0f} rpm of the shaft, {brass}"
    return [f"{said}; the range reaches {shaft_rpm:.0f} rpm"]


def minimum_load_notes(bearing: Any, load: float, shaft_rpm: float, slip: float | None = None) -> list[str]:
    """Notes that compare the load of a bearing [N] with the makers' rules, and these with a computed slip."""
    like, rating = listed_like(bearing), static_load_rating(bearing)
    length = " and an effective length 1.5 mm below the roller's" if bearing.effective_length is None else ""
    rules = [(f"C0/60, with C0 by ISO 76{length}", rating / 60)]
    if like is not None:
        rules = [(f"C0/60 of {like.designation}", (like.static_rating or rating) / 60)]
        usual, brass = like.minimum_loads(shaft_rpm)
        rules += [("SKF's rule, usual cage", usual), ("SKF's rule, one-piece brass cage", brass)]
    rules = [(words, value) for words, value in rules if math.isfinite(value)]
    below = [words for words, value in rules if load < value]
    said = "; ".join(f"{value / 1e3:.2g} kN ({words})" for words, value in rules)
    them = "all of them" if len(rules) > 1 else "that"
    side = f"above {them}" if not below else f"below {them}" if len(below) == len(rules) else ""
    verdict = f"the load of {load / 1e3:.3g} kN is {side or 'below ' + ' and '.join(below)}"
    notes = [f"Minimum load against skidding at {shaft_rpm:.0f} rpm of the shaft: {said}; {verdict}"]
    if load > 60 * rules[0][1]:
        notes.append(f"The load is above C0 = {0.06 * rules[0][1]:.3g} kN: look at its unit")
    if slip is None:
        return notes
    given, skids = f"the computed slip of the cage is {slip:.2%}", slip >= SKIDS
    if skids and not below:
        notes.append(f"The model disagrees with the makers' rules: {given}, although the load is above {them}")
    if not skids and len(below) == len(rules):
        why = "they hold without preload" if bearing.radial_clearance < 0 else "more oil would make it slip more"
        said = f"although the load is below {them}; {why}"
        notes.append(f"The model disagrees with the makers' rules: {given}, {said}")
    return notes
