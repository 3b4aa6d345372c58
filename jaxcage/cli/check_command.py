"""The verdict for an operating range."""

from functools import partial
from typing import Annotated, Any

import numpy as np
import tyro

import jaxcage as jc

from . import options as o
from .answer import Answer
from .progress import report_lanes, say
from .subject import RPM, Subject


SPEEDS = 9
"""Speeds at which a bearing with its rollers is simulated."""
LENGTH: dict[str, Any] = {"initial_states": 2, "discard": 30, "revolutions": 20, "blocks": 4, "exponents": 0}
Operating = Annotated[str, o.text(), tyro.conf.arg(help='Range of speed of the machine, e.g. "4000-14000 rpm shaft".')]


def check(
    subject: o.Case,
    *,
    operating: Operating,
    draws: o.Draws = 64,
    seed: o.Seed = 0,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Does the cage stay calm over an operating range, with what probability and margin, and what to change first."""
    ends, d = subject.operating(operating), jc.design
    if subject.with_rollers:
        return _with_rollers(subject, ends)
    ratio, whose = (1.0, subject.own) if subject.shaft is None else (subject.shaft, "shaft")
    over = lambda rpm: f"{ratio * rpm[0]:.0f} to {ratio * rpm[-1]:.0f} rpm of the {whose}"
    margins = d.margins(subject.model, ends)
    margin = jc.show.margin_sentence(margins, whose, ratio)
    say(f"Preliminary: {margin}")
    document: dict[str, Any] = {"operating_rpm": [end * RPM for end in ends]}
    if subject.unknowns and draws:
        speeds, told = np.linspace(*ends, d.RANGE_SPEEDS), partial(report_lanes, "draws")
        drawn = d.ensemble(subject.model, subject.unknowns, speeds, draws=draws, seed=seed, progress=told)
        chance, *outcomes = d.range_chance(drawn, ends[0] * RPM, ends[1] * RPM)
        rows = d.indices(drawn, *outcomes)
        said, note = jc.show.range_sentence(over(drawn.rpm), chance, None), jc.show.indices_note(rows)
        document |= {"verdict": chance.state, "calm_share": chance.share, "calm_interval": chance.interval}
        document |= {"draws": chance.draws, "chaotic_draws": chance.chaotic, "known_draws": chance.known}
        decide = [jc.show.indices_table(rows)] if rows and rows[0].telling else []
    else:
        checked = d.check_design(subject.model, ends, progress=report_lanes)
        said, note, decide = jc.show.range_sentence(over(checked.speeds_rpm), None, checked), f"Checked: {checked}", []
        document |= {"verdict": "calm" if checked.calm else "not calm", "checked": checked}
    table, largest = forces(subject, ends)
    tables = [] if isinstance(margins, str) else [jc.show.margins_table(margins, subject.beside)]
    if not isinstance(margins, str) and margins.changes:
        tables.append(jc.show.changes_table(subject.model, margins))
    model = 'The cage model prescribes the impacts of the rollers; slip and forces: a file with model = "bearing"'
    notes, by_ranges = [largest, note, model], "draws" in document
    return Answer(f"{said} {margin}", [*tables, *decide, table], notes, document, by_ranges=by_ranges)


def forces(subject: Subject, ends: tuple[float, float]) -> tuple[Any, str]:
    """Table of the forces on the cage at both ends of a range of its speed [rad/s], and a note on the largest."""
    ratio, whose = (1.0, subject.own) if subject.shaft is None else (subject.shaft, "shaft")
    found = {f"{ratio * end * RPM:.0f} rpm {whose}": jc.analysis.largest_forces(subject.model, end) for end in ends}
    return jc.show.forces_table(found), jc.show.forces_note(found, [u.label for u in subject.unknowns])


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
    rpm = found["rpm"].values
    over = f"{rpm[0]:.0f} to {rpm[-1]:.0f} rpm of the {subject.own}"
    table = jc.show.motion_table(f"Motion of the cage of {subject.name}", found)
    return Answer(jc.show.motion_sentence(over, found), [table], notes, document)
