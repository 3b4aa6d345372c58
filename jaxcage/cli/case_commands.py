"""Commands about the case itself: its file, the verdict for an operating range, its statics, a report."""

import dataclasses
import shlex
import time
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError, visible
from . import options as o
from .answer import Answer
from .orbit_commands import bars, explained, gradient, mapped, of_orbits
from .progress import interrupted, report as tell, report_lanes, say
from .speed_commands import chances, simulate, swept
from .subject import RPM, Subject


SPEEDS = 9
"""Speeds at which a bearing with its rollers is simulated."""
LENGTH: dict[str, Any] = {"initial_states": 2, "discard": 30, "revolutions": 80, "blocks": 4, "exponents": 0}
FOLLOWED = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
"""Edges that are followed across the map, which takes about a minute each."""


def init(
    path: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE")],
    *,
    model: Literal["cage", "bearing"] = "cage",
    full: bool = False,
    json: bool = False,
) -> Answer:
    """A commented TOML file that describes a bearing, to be changed and given to the other commands.

    Args:
        path: Where to write it, e.g. my_bearing.toml; an existing file is left alone.
        model: Describe the cage under prescribed forces, or the bearing with its rollers.
        full: Write every option with its explanation; otherwise what must be known, in at most 40 lines.
        json: Print one JSON document on standard output.
    """
    from ..files import write_template  # the library as a whole takes seconds to load

    written = write_template(path, model, short=not full)
    what = "an NU2310 with its rollers" if model == "bearing" else "the cage of an NU2310"
    said = f"Written: {written}. It describes {what}: change the values and go on, e.g. with"
    operating, over = '--operating "4000-14000 rpm shaft"', "--first 4000 --last 14000"
    options = {"check": operating, "statics": "--speed 14000", "sweep": over, "zones": over, "report": operating}
    commands = [f"  jaxcage {command} {path} {given}" for command, given in options.items()]
    return Answer(said, notes=commands, document={"file": str(written)})


def check(
    subject: o.Case,
    *,
    operating: o.Operating,
    draws: o.Draws = 64,
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
        found = chances(subject, np.linspace(*ends, d.RANGE_SPEEDS), draws)
        by_speed, *decide = found.tables
        tables += [*decide, dataclasses.replace(by_speed, detail=True)]
    else:
        checked = d.check_design(subject.model, ends, progress=report_lanes)
        over = subject.over(*checked.speeds_rpm[[0, -1]] / RPM)
        document = {"verdict": checked.state, "checked": checked}
        found = Answer(jc.show.range_sentence(over, checked), notes=[f"Checked: {checked}"], document=document)
    document = {"operating_rpm": [end * RPM for end in ends], **found.document}
    table, largest = _forces(subject, ends)
    limit = jc.show.limiting_speed_notes(subject.model.bearing, ends[1] * RPM * (subject.shaft or 1.0))
    said, notes = f"{found.sentence} {margin}", [*limit, largest, *found.notes, jc.show.BY_CAGE_MODEL]
    return dataclasses.replace(found, sentence=said, tables=[*tables, table], notes=notes, document=document)


def _forces(subject: Subject, ends: tuple[float, float]) -> tuple[Any, str]:
    """Table of the forces on the cage at both ends of a range of its speed [rad/s], and a note on the largest."""
    whose, ratio = subject.beside or (subject.own, 1.0)
    found = {f"{ratio * end * RPM:.0f} rpm {whose}": jc.analysis.largest_forces(subject.model, end) for end in ends}
    return jc.show.forces_table(found), jc.show.forces_note(found, [u.label for u in subject.unknowns])


def at_best_guess(said: str) -> str:
    """Sentence about the best guess of values that are known within ranges only."""
    return f"At the best guess {said[:1].lower()}{said[1:]}"


def _with_rollers(subject: Subject, ends: tuple[float, float]) -> Answer:
    """The verdict for a bearing with its rollers: the motion of its cage, its slip, and the makers' minimum load."""
    found = jc.sweep(subject.model, np.linspace(*ends, SPEEDS), **LENGTH, progress=partial(report_lanes, "simulations"))
    jc.show.require_some(found)
    bearing, shaft, slip = subject.model.bearing, ends[1] * RPM, float(found["cage_slip"][-1].mean())
    notes = jc.show.limiting_speed_notes(bearing, shaft)
    notes += jc.show.minimum_load_notes(bearing, float(subject.model.load), shaft, slip if np.isfinite(slip) else None)
    notes += [f"{jc.show.MOTIONS[name]}: {words}" for name, words in jc.show.MOTION_WORDS.items()]
    notes.append("The motion is that of the cage: rollers that rattle in their pockets do not count")
    notes.append(
        f"{found.sizes['speed']} speeds, {found.sizes['initial_state']} initial states, {jc.analysis.length(found)}"
    )
    document = {"operating_rpm": [end * RPM for end in ends], "verdict": jc.show.cage_verdict(found)}
    over = subject.over(*found["speed"].values[[0, -1]])
    table = jc.show.motion_table(f"Motion of the cage of {subject.name}", found)
    return Answer(jc.show.motion_sentence(over, found), [table], notes, document)


def statics(
    subject: o.Case,
    *,
    load: Annotated[float | None, o.number("be above 0 N", lambda x: x > 0, "N")] = None,
    speed: o.SpeedOrRest = None,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Load of every roller, loaded zone, static displacement of the cage, kinematics.

    Args:
        load: Shaft load [N], or with a unit, e.g. "4.45 kN"; the case's own if left out.
    """
    model, bearing, force = subject.model, subject.model.bearing, float(subject.model.load) if load is None else load
    if force <= 0:
        raise InputError(f"The load of {subject.name} must be above 0 N, but it is {force:g}: give one with --load.")
    speeds = {} if speed is None else subject.both(subject.speed(speed))
    shaft, cage = (float(speeds.get(f"{whose}_speed_rpm", 0.0)) / RPM for whose in ("shaft", "cage"))
    centrifugal = bearing.roller_centrifugal_force(bearing.shaft_speed(cage))
    found = jc.bearing.load_distribution(bearing, force, centrifugal)
    title = f"{subject.name} at {force:g} N, {f'shaft at {shaft * RPM:.0f} rpm' if shaft else 'at rest'}"
    loads = np.asarray(found.inner_loads)
    said = f"{np.sum(loads > 0)} of {loads.size} rollers carry {force:g} N, the most loaded one {np.max(loads):.0f} N."
    document: dict[str, Any] = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
    document |= {
        "load": force,
        "shaft_speed_rpm": shaft * RPM,
        "cage_displacement": jc.show.displacements(model, found),
    }
    document["kinematic_viscosity"] = model.lubricant.kinematic_viscosity
    ratio = cage / shaft if shaft else bearing.cage_speed_ratio
    document["kinematics"] = {"cage_speed_ratio": ratio, "cage_speed": cage}
    arrays = {"angle [rad]": found.roller_angles, "inner load [N]": loads, "outer load [N]": found.outer_loads}
    columns = {head: np.asarray(x) for head, x in arrays.items()}
    files = {"figure": jc.show.drawn(partial(jc.show.load_bars, found), 7.0, 3.8, title), "data": columns}
    turning = (shaft, cage, centrifugal) if shaft else None
    table = jc.show.statics_table(f"Statics of {title}", model, found, ratio, turning)
    return Answer(said, [table], jc.show.minimum_load_notes(bearing, force, shaft * RPM), document, files)


def report(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    operating: o.Operating = None,
    draws: o.Draws = 64,
    quick: o.Quick = False,
    run: o.RunOptions = o.RunOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """One HTML page about a design: the answer of `check`, zones, orbits, map, gradients, and sources of all values."""
    began, (low, high), name = time.perf_counter(), subject.ends(over), subject.name
    parts, words, at = [], ["jaxcage", "report", Path(subject.path).name or name], None
    if operating is not None:
        parts.append(("Verdict", check(subject, operating=operating, draws=draws)))
        subject, at = subject.operating(operating)
        if over == o.Range(count=over.count):  # neither end was given
            low, high = (reach * end for reach, end in zip(jc.design.REACH, at, strict=True))
        low, high = min(low, at[0]), max(high, at[1])
        words += ["--operating", f"{operating[0]:g}-{operating[1]:g} rpm {subject.speeds}"]
    elif subject.unknowns and draws:
        parts.append(("Chances", chances(subject, subject.range(over, 40), draws, run)))
    if interrupted():
        return parts[0][1]
    count = over.count or subject.usual(126 if quick else 251, 5 if quick else 13)
    found, answer = swept(subject, np.linspace(low, high, count), run)
    if subject.with_rollers:
        parts += [("Over speed", answer), *(_at_one_speed(subject, at, quick, run) if at else [])]
    else:
        orbits = jc.orbits.synchronous_orbits(subject.model, low, high, settled=found, method=run.method, progress=tell)
        answer, slopes = explained(subject, found, orbits, answer, quick, run.method)
        parts += [("Zones", answer), *_of_orbits(subject, (low, high), orbits, slopes, quick, run.method)]
    if subject.unknowns:  # all but the first part
        guess = lambda each: dataclasses.replace(each, sentence=at_best_guess(each.sentence))
        parts = [*parts[:1], *((f"{title} at the best guess", guess(each)) for title, each in parts[1:])]
    if float(getattr(subject.model, "load", 0.0)) > 0:
        fastest = None if at is None else jc.files.SpeedOf(at[1] * RPM, subject.own)
        loads = statics(subject, speed=fastest)  # the verdict with rollers compares the minimum load already
        parts.append(("Statics", dataclasses.replace(loads, notes=()) if subject.with_rollers and at else loads))
    design = jc.show.sources_table(subject.model, subject.file if subject.path else None)
    made = jc.show.settings_table(found, time.perf_counter() - began)
    sections = [_section(*part) for part in parts]
    sections.append(jc.show.Section("The design", tables=[design], notes=subject.about(False)[1][:1]))
    sections.append(jc.show.Section("How it was computed", tables=[made], notes=[jc.show.PAPER]))
    command = visible(shlex.join([*words, *(["--quick"] if quick else [])]))
    subtitle = f"Cylindrical roller bearing, {subject.over(low, high)}"
    title = f"{'Case ' * (subject.published is not None)}{name}"
    html = jc.show.page(title, subtitle, sections, sweep=found, operating=at, command=command)
    first = parts[0][1]
    document = {**first.document, "quick": quick, "bytes": len(html.encode())}
    return dataclasses.replace(first, document=document, files={"report": html})


def _section(title: str, answer: Answer) -> Any:
    """An answer as a section of the page; titles of figures become captions."""
    from matplotlib.figure import Figure

    figures = {name: (x, x.get_suptitle()) for name, x in answer.files.items() if isinstance(x, Figure)}
    for figure, _ in figures.values():
        figure.suptitle("")
    tables = [each for each in answer.tables if not each.detail]
    return jc.show.Section(title, [answer.sentence], figures, tables, answer.notes)


def _at_one_speed(
    subject: Subject, at: tuple[float, float], quick: bool, run: o.RunOptions
) -> list[tuple[str, Answer]]:
    """A run of a bearing with its rollers in the middle of its operating range, and slopes of means there."""
    speed = jc.files.SpeedOf(sum(at) / 2 * RPM, subject.own)
    run = dataclasses.replace(run, discard=20, revolutions=20)
    found, means = simulate(subject, speed=speed, run=run), o.MeanOptions(speed, discard=20, revolutions=20)
    slopes = [] if quick else [("What moves the means", gradient(subject, means=means))]
    return [(f"At {speed:.0f} rpm of the {subject.own}", found), *slopes]


def _of_orbits(
    subject: Subject, ends: tuple[float, float], orbits: Any, slopes: dict[str, Any], quick: bool, method: Any
) -> list[tuple[str, Answer]]:
    """Synchronous orbits, a map over speed and guidance gap, and elasticities of edges."""
    found, loss, axis = [], jc.unstable_ranges(orbits), jc.show.parameter_axis(subject.model, "guidance_gap")
    if orbits.branches:
        answer = of_orbits(subject, orbits, loss)
        figure = {"figure": answer.files["figure"]}
        found.append(("The synchronous orbit", dataclasses.replace(answer, tables=answer.tables[1:], files=figure)))
    edges = {} if quick else {name: edge for name, edge in loss.edges.items() if name in FOLLOWED}
    count, discard, revolutions = ((40, 7), 100, 60) if quick else ((80, 12), 250, 100)
    length = {"discard": discard, "revolutions": revolutions, "blocks": 10, "method": method}
    found.append(("Stability map", mapped(subject, ends, axis, count, edges, length)))
    if trusted := [s for name, s in slopes.items() if s.trusted and name in loss.edges]:
        said = "Relative change of the edges, which are solved for, by that of a parameter that a designer can choose."
        found.append(("What moves the edges", Answer(said, files={"figure": bars(subject, trusted)})))
    return found
