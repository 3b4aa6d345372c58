"""The verdict for an operating range."""

from functools import partial
from typing import Annotated, Any

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError
from . import options as o
from .answer import Answer
from .progress import say
from .speed_commands import draw
from .subject import RPM, Subject, read_case


SPEEDS = 9
"""Speeds at which a bearing with its rollers is simulated."""
LENGTH: dict[str, Any] = {"starts": 2, "discard": 30, "revolutions": 20, "blocks": 4}
Operating = Annotated[str, o.text(), tyro.conf.arg(help='Range of speed of the machine, e.g. "4000-14000 rpm shaft".')]


def check(
    case: o.Case,
    *,
    operating: Operating,
    draws: o.Draws = 64,
    seed: o.Seed = 0,
    steps: o.StepOptions = o.StepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Does the cage stay calm over an operating range, with what probability and margin, and what to change first."""
    subject, d = read_case(case), jc.design
    model = subject.model
    found = jc.show.read_operating(operating, model, subject.speeds)
    if len(found) != 1 or found[0].low_rpm == found[0].high_rpm:
        raise InputError(f"Option --operating must be one range of speed, but '{operating}' was given.")
    ends, over = (found[0].low_rpm / RPM, found[0].high_rpm / RPM), f"{found[0]} of the {subject.own}"
    if subject.with_rollers:
        return _with_rollers(subject, over, ends, show)
    if subject.shaft is not None:
        over = f"{found[0].of_shaft(1 / subject.shaft)} of the shaft"
    tables, notes, document = list[Any](), list[str](), {"operating_rpm": [end * RPM for end in ends]}
    with show.computing(f"check {subject.name}") as tell:
        margins = d.margins(model, ends)
        margin = jc.show.margin_sentence(margins)
        say(f"Preliminary: {margin}")
        if subject.unknowns and draws:
            run = o.RunOptions(steps.solver, steps.steps, steps.tolerance)
            drawn = draw(subject, np.linspace(*ends, d.RANGE_SPEEDS), draws, seed, run, tell)
            chance, chaotic = d.range_chance(drawn, found[0].low_rpm, found[0].high_rpm)
            rows = d.indices(drawn, chaotic)
            said = jc.show.range_sentence(over, chance, None)
            document |= {"verdict": chance.state, "calm_share": chance.share, "calm_interval": chance.interval}
            document |= {"draws": draws, "chaotic_draws": chance.chaotic, "known_draws": chance.known}
            notes.append(jc.show.indices_note(rows))
            decide = [jc.show.indices_table(rows)] if rows and rows[0].telling else []
        else:
            checked = d.check_design(model, ends, progress=tell)
            said, decide = jc.show.range_sentence(over, None, checked), []
            document |= {"verdict": "calm" if checked.calm else "not calm", "checked": checked}
            notes.append(f"Checked: {checked}")
    if not isinstance(margins, str):
        tables.append(jc.show.margins_table(margins, subject.beside))
        if margins.changes:
            tables.append(jc.show.changes_table(model, margins))
    return Answer(f"{said} {margin}", tables + decide, notes, document, subject)


def _with_rollers(subject: Subject, over: str, ends: tuple[float, float], show: o.ShowOptions) -> Answer:
    """The verdict for a bearing with its rollers: the motion of its cage, its slip, and the makers' minimum load."""
    speeds, motions = np.linspace(*ends, SPEEDS), jc.show.MOTIONS
    with show.computing(f"check {subject.name}") as tell:
        found = jc.sweep(subject.model, speeds, **LENGTH, exponents=0, progress=partial(tell, "simulations"))
    jc.show.require_some(found)
    table = jc.show.motion_table(f"Motion of the cage of {subject.name}", found)
    load, bearing = float(subject.model.load), subject.model.bearing
    notes = jc.show.minimum_load_notes(bearing, load, ends[1] * RPM)
    notes += [f"{motions[name]}: {words}" for name, words in jc.show.MOTION_WORDS.items()]
    notes.append(f"{SPEEDS} speeds, {found.sizes['start']} initial states, {jc.analysis.length(found)}")
    document = {"operating_rpm": [end * RPM for end in ends], "verdict": jc.show.motion_verdict(found)}
    return Answer(jc.show.motion_sentence(over, found), [table], notes, document, subject)
