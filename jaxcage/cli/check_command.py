"""The verdict for an operating range, and chances of chaos of a file with ranges."""

import dataclasses
from functools import partial
from typing import Any

import numpy as np

import jaxcage as jc

from .._errors import NoResult
from . import options as o
from .answer import Answer
from .progress import report_lanes, say
from .subject import RPM, Subject


SPEEDS = 9
"""Speeds at which a bearing with its rollers is simulated."""
LENGTH: dict[str, Any] = {"initial_states": 2, "discard": 30, "revolutions": 20, "blocks": 4, "exponents": 0}


def check(
    subject: o.Case,
    *,
    operating: o.Operating,
    draws: o.Draws = 64,
    seed: o.Seed = 0,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """The verdict for an operating range: calm or not, with its probability and margin, and what to change first."""
    subject, ends = subject.operating(operating)
    if subject.with_rollers:
        return _with_rollers(subject, ends)
    d = jc.design
    margins = d.margins(subject.model, ends)
    margin = jc.show.margin_sentence(margins, *(subject.beside or (subject.own, 1.0)))
    if subject.unknowns and not isinstance(margins, str):
        margin = at_best_guess(margin)
    say(f"Preliminary: {margin}")
    tables = [] if isinstance(margins, str) else [jc.show.margins_table(margins, subject.beside)]
    if not isinstance(margins, str) and margins.changes:
        tables.append(jc.show.changes_table(subject.model, margins))
    if subject.unknowns and draws:
        found = chances(subject, np.linspace(*ends, d.RANGE_SPEEDS), draws, seed)
        by_speed, *decide = found.tables
        tables += [*decide, dataclasses.replace(by_speed, detail=True)]
    else:
        checked = d.check_design(subject.model, ends, progress=report_lanes)
        over = subject.over(*checked.speeds_rpm[[0, -1]] / RPM)
        document = {"verdict": checked.state, "checked": checked}
        found = Answer(jc.show.range_sentence(over, checked), notes=[f"Checked: {checked}"], document=document)
    model = 'The cage model prescribes the impacts of the rollers; slip and forces: a file with model = "bearing"'
    document = {"operating_rpm": [end * RPM for end in ends], **found.document}
    table, largest = _forces(subject, ends)
    said, notes = f"{found.sentence} {margin}", [largest, *found.notes, model]
    return dataclasses.replace(found, sentence=said, tables=[*tables, table], notes=notes, document=document)


def _forces(subject: Subject, ends: tuple[float, float]) -> tuple[Any, str]:
    """Table of the forces on the cage at both ends of a range of its speed [rad/s], and a note on the largest."""
    whose, ratio = subject.beside or (subject.own, 1.0)
    found = {f"{ratio * end * RPM:.0f} rpm {whose}": jc.analysis.largest_forces(subject.model, end) for end in ends}
    return jc.show.forces_table(found), jc.show.forces_note(found, [u.label for u in subject.unknowns])


def at_best_guess(said: str) -> str:
    """Sentence about the best guess of values that are known within ranges only."""
    return f"At the best guess {said[:1].lower()}{said[1:]}"


def chances(subject: Subject, speeds: Any, draws: int, seed: int, run: o.RunOptions = o.RunOptions()) -> Answer:
    """Answer on the probability that a cage with unknown values is calm at all speeds [rad/s], and on what would decide
    it; the first of its tables is the one by speed."""
    d, told = jc.design, {"draws": draws, "seed": seed, "progress": partial(report_lanes, "draws")}
    found = d.ensemble(subject.model, subject.unknowns, speeds, **told, **run.settings)
    if found.failed.all():
        raise NoResult(f"All {found.failed.size} simulations failed: try more steps (--steps), or narrower ranges.")
    chance, *outcomes = d.range_chance(found, found.rpm[0], found.rpm[-1])
    draws = len(found.place)
    rows, over = d.indices(found, *outcomes), subject.over(*found.speed[[0, -1]])
    columns = subject.speed_columns(found.speed)
    columns |= dict(zip(("chance of chaos", "lower", "upper"), found.chance_of_chaos.T, strict=True))
    title = f"{subject.name}: chaotic share of {draws} draws, at each speed alone"
    figure = jc.show.drawn(partial(jc.show.chance_of_chaos, found), title=title)
    tables = [jc.show.chances_table(subject.name, found, subject.beside)]
    tables += [jc.show.indices_table(rows)] if rows and rows[0].telling else []
    by_speed = [{"rpm": rpm, **_record(each)} for rpm, each in zip(found.rpm, found.chances, strict=True)]
    document = _record(chance) | {"by_speed": by_speed}
    notes, files = [jc.show.indices_note(rows), *jc.show.chances_notes(found)], {"figure": figure, "data": columns}
    said, details = jc.show.range_sentence(over, chance), jc.show.unknowns_notes(found)
    return Answer(said, tables, notes, document, files, details, by_ranges=True)


def _record(chance: Any) -> dict[str, Any]:
    """A chance for a document."""
    numbers = {"calm_share": chance.share, "calm_interval": chance.interval}
    return {"verdict": chance.state, **numbers, "chaotic_draws": chance.chaotic, "known_draws": chance.known}


def _with_rollers(subject: Subject, ends: tuple[float, float]) -> Answer:
    """The verdict for a bearing with its rollers: the motion of its cage, its slip, and the makers' minimum load."""
    found = jc.sweep(subject.model, np.linspace(*ends, SPEEDS), **LENGTH, progress=partial(report_lanes, "simulations"))
    jc.show.require_some(found)
    notes = jc.show.minimum_load_notes(subject.model.bearing, float(subject.model.load), ends[1] * RPM)
    notes += [f"{jc.show.MOTIONS[name]}: {words}" for name, words in jc.show.MOTION_WORDS.items()]
    notes.append("The motion is that of the cage: rollers that rattle in their pockets do not count")
    notes.append(
        f"{found.sizes['speed']} speeds, {found.sizes['initial_state']} initial states, {jc.analysis.length(found)}"
    )
    document = {"operating_rpm": [end * RPM for end in ends], "verdict": jc.show.cage_verdict(found)}
    over = subject.over(*found["speed"].values[[0, -1]])
    table = jc.show.motion_table(f"Motion of the cage of {subject.name}", found)
    return Answer(jc.show.motion_sentence(over, found), [table], notes, document)
