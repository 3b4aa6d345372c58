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
from .check_command import forces
from .orbit_commands import bars, explained, gradient, mapped, of_orbits
from .progress import report as tell, visible
from .speed_commands import chances, simulate, swept, zones_of
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
    commands = [f"  jaxcage {command} {path}" for command in ("statics", "sweep", "zones", "report")]
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
    title, loads = f"{subject.name} at {force:g} N, shaft at {shaft * RPM:g} rpm", np.asarray(found.inner_loads)
    heads = {"angle": "rad", "inner load": "N", "outer load": "N"}
    data = dict(zip(heads, map(np.asarray, (found.roller_angles, loads, found.outer_loads)), strict=True))
    rollers = [
        {name.replace(" ", "_"): float(x) for name, x in zip(data, row, strict=True)}
        for row in zip(*data.values(), strict=True)
    ]
    columns = [jc.show.Column(name, name.replace(" ", "_"), unit, digits=1) for name, unit in heads.items()]
    tables = [
        jc.show.statics_table(f"Statics of {title}", model, found, shaft),
        jc.show.table("Rollers", rollers, columns, "rollers"),
    ]
    document: dict[str, Any] = {
        n: float(getattr(found, n)) for n in ("max_load", "shaft_shift", "elastic_approach", "half_angle")
    }
    viscosity = float(model.lubricant.kinematic_viscosity)
    document |= {"load": force, "shaft_speed_rpm": shaft * RPM, "kinematic_viscosity": viscosity}
    document["cage_displacement"] = jc.show.displacements(model, found)
    kinematics = {name: float(getattr(bearing, name)(shaft)) for name in ("cage_speed", "roller_centrifugal_force")}
    document["kinematics"] = {"cage_speed_ratio": float(bearing.cage_speed_ratio), **kinematics}
    said = f"{np.sum(loads > 0)} of {loads.size} rollers carry {force:g} N, the most loaded one {np.max(loads):.0f} N."
    figure = jc.show.drawn(partial(jc.show.load_bars, found), 7.0, 3.8, title)
    files = {"figure": figure, "data": {f"{name} [{heads[name]}]": x for name, x in data.items()}}
    return Answer(said, tables, jc.show.minimum_load_notes(bearing, force, shaft * RPM), document, files)


def report(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    operating: str = "",
    draws: o.Draws = 64,
    seed: o.Seed = 0,
    quick: o.Quick = False,
    run: o.RunOptions = o.RunOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """One HTML page about a design: zones, operating speeds, orbits, map, gradients, and how certain it all is.

    Args:
        operating: Speeds and ranges to assess, e.g. "8500, 12000-15000" [rpm], "900 rad/s" or "20000-24000 rpm shaft".
    """
    at = jc.show.read_operating(operating, subject.model, subject.speeds)
    if operating and not at:
        raise InputError(f"Option --operating must hold a speed, but '{operating}' was given.")
    began, said, orbits, loss = time.perf_counter(), [], None, ()
    speeds = subject.range(over, subject.usual(126 if quick else 251, 5 if quick else 13))
    found, answer = swept(subject, speeds, run)
    zones, limits = zones_of(found), (float(found["rpm"][0]), float(found["rpm"][-1]))
    if subject.with_rollers:
        parts = [("Over speed", answer), *(_at_one_speed(subject, at[0], quick, run) if at else [])]
    else:
        ends, told = (float(speeds[0]), float(speeds[-1])), {"method": run.method, "progress": tell}
        orbits = jc.orbits.synchronous_orbits(subject.model, *ends, settled=found, **told)
        answer, zones, slopes = explained(subject, found, orbits, answer, quick, run.method)
        loss = jc.unstable_ranges(orbits).zones
        parts = [("Zones", answer), *_of_orbits(subject, ends, orbits, slopes, quick, run.method)]
        if calm := jc.show.calmest((*zones.zones, *zones.transient, *loss), *limits):
            said.append(f"The widest range outside all zones goes from {calm[0]:.0f} to {calm[1]:.0f} rpm.")
    if subject.unknowns and draws:
        chance = chances(subject, o.Range(over.first, over.last), draws, seed, run)
        parts.insert(0, ("What is known, and what it decides", chance))
        said.append(f"All zones of this page are those of the best guesses. {chance.sentence}")
    if float(getattr(subject.model, "load", 0.0)) > 0:
        parts.append(("Statics", statics(subject)))
    assessed = jc.show.assess(at, found, zones, orbits, loss)
    verdicts = [jc.show.verdict_table(subject.name, assessed, subject.beside)] if at else []
    each = [f"{where}: {v.state} ({kind})" for where, by in assessed for kind, v in by.items()]
    table, left = (None, ()) if subject.file is None else (subject.file.table, subject.file.left)
    if at and not subject.with_rollers:
        table_of_forces, largest = forces(subject, (at[0].low_rpm / RPM, at[0].high_rpm / RPM))
        verdicts.append(table_of_forces)
        said.append(f"{largest}.")
    notes, made = subject.about(False)[1], jc.show.settings_table(found, time.perf_counter() - began)
    sections = [
        jc.show.Section("In short", [*each, answer.sentence, *said], tables=verdicts, notes=notes),
        *(_section(*part) for part in parts),
        jc.show.Section("The design", tables=[jc.show.sources_table(subject.model, table, left)]),
        jc.show.Section("How it was computed", tables=[made], notes=[jc.show.PAPER]),
    ]
    words = ["jaxcage", "report", Path(subject.path).name or subject.name]
    words += [*(["--operating", operating] if operating else []), *(["--quick"] if quick else [])]
    title = f"{'Case ' * (subject.published is not None)}{subject.name}"
    subtitle = f"Cylindrical roller bearing, {limits[0]:.0f} to {limits[1]:.0f} rpm of the {subject.own}"
    command = visible(shlex.join(words))
    html = jc.show.page(title, subtitle, sections, sweep=found, operating=at, command=command)
    document = {"quick": quick, "bytes": len(html.encode())}
    document["operating"] = [vars(where) | by for where, by in assessed]
    return Answer("; ".join(each) or answer.sentence, verdicts, said, document, {"report": html})


def _section(title: str, answer: Answer) -> Any:
    """An answer as a section of the page."""
    from matplotlib.figure import Figure

    figures = {name: (x, x.get_suptitle()) for name, x in answer.files.items() if isinstance(x, Figure)}
    return jc.show.Section(title, [answer.sentence], figures, answer.tables, answer.notes)


def _at_one_speed(subject: Subject, at: Any, quick: bool, run: o.RunOptions) -> list[tuple[str, Answer]]:
    """A run of a bearing with its rollers at an operating speed, and slopes of means there."""
    speed = jc.files.SpeedOf((at.low_rpm + at.high_rpm) / 2, subject.own)
    run = dataclasses.replace(run, discard=20, revolutions=20)
    found, means = simulate(subject, speed=speed, run=run), o.MeanOptions(speed, discard=20, revolutions=20)
    slopes = [] if quick else [("What moves the means", gradient(subject, means=means))]
    return [(f"At {at}", found), *slopes]


def _of_orbits(
    subject: Subject, ends: tuple[float, float], orbits: Any, slopes: dict[str, Any], quick: bool, method: Any
) -> list[tuple[str, Answer]]:
    """Synchronous orbits, a map over speed and guidance gap, and elasticities of edges."""
    found, loss, axis = [], jc.unstable_ranges(orbits), jc.show.parameter_axis(subject.model, "guidance_gap")
    if orbits.branches:
        found.append(("The synchronous orbit", of_orbits(subject, orbits, loss)))
    edges = {} if quick else {name: edge for name, edge in loss.edges.items() if name in FOLLOWED}
    count, discard, revolutions = ((40, 7), 100, 60) if quick else ((80, 12), 250, 100)
    length = {"discard": discard, "revolutions": revolutions, "blocks": 1, "keep": 1, "method": method}
    found.append(("Stability map", mapped(subject, ends, axis, count, edges, {}, length)))
    if trusted := [s for name, s in slopes.items() if s.trusted and name in loss.edges]:
        said = "Relative change of the edges, which are solved for, by that of a parameter that a designer can choose."
        found.append(("What moves the edges", Answer(said, files={"figure": bars(subject, trusted)})))
    return found
