"""Commands about the case itself: its file, its statics, a report."""

import dataclasses
import shlex
import time
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError
from . import options as o
from .answer import Answer
from .check_command import at_best_guess, chances, check
from .orbit_commands import bars, explained, gradient, mapped, of_orbits
from .progress import interrupted, report as tell, visible
from .speed_commands import simulate, swept
from .subject import RPM, Subject


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
    shaft = 0.0 if speed is None else float(subject.both(subject.speed(speed))["shaft_speed_rpm"]) / RPM
    found = jc.bearing.load_distribution(bearing, force, bearing.roller_centrifugal_force(shaft))
    title = f"{subject.name} at {force:g} N, {f'shaft at {shaft * RPM:g} rpm' if shaft else 'at rest'}"
    loads = np.asarray(found.inner_loads)
    said = f"{np.sum(loads > 0)} of {loads.size} rollers carry {force:g} N, the most loaded one {np.max(loads):.0f} N."
    document: dict[str, Any] = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
    document |= {
        "load": force,
        "shaft_speed_rpm": shaft * RPM,
        "cage_displacement": jc.show.displacements(model, found),
    }
    document["kinematic_viscosity"] = model.lubricant.kinematic_viscosity
    document["kinematics"] = {"cage_speed_ratio": bearing.cage_speed_ratio, "cage_speed": bearing.cage_speed(shaft)}
    arrays = {"angle [rad]": found.roller_angles, "inner load [N]": loads, "outer load [N]": found.outer_loads}
    columns = {head: np.asarray(x) for head, x in arrays.items()}
    files = {"figure": jc.show.drawn(partial(jc.show.load_bars, found), 7.0, 3.8, title), "data": columns}
    table = jc.show.statics_table(f"Statics of {title}", model, found, shaft or None)
    return Answer(said, [table], jc.show.minimum_load_notes(bearing, force, shaft * RPM), document, files)


def report(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    operating: o.Operating = None,
    draws: o.Draws = 64,
    seed: o.Seed = 0,
    quick: o.Quick = False,
    run: o.RunOptions = o.RunOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """One HTML page about a design: the answer of `check`, zones, orbits, map, gradients, and sources of all values."""
    began, (low, high), name = time.perf_counter(), subject.ends(over), subject.name
    parts, words, at = [], ["jaxcage", "report", Path(subject.path).name or name], None
    if operating is not None:
        parts.append(("Verdict", check(subject, operating=operating, draws=draws, seed=seed)))
        subject, at = subject.operating(operating)
        low, high = min(low, at[0]), max(high, at[1])
        words += ["--operating", f"{operating[0]:g}-{operating[1]:g} rpm {subject.speeds}"]
    elif subject.unknowns and draws:
        parts.append(("Chances", chances(subject, subject.range(over, 40), draws, seed, run)))
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
        parts.append(("Statics", dataclasses.replace(statics(subject, speed=fastest), notes=())))
    design = jc.show.sources_table(subject.model, subject.file)
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
