"""Commands about the case itself: its file, its statics, a report."""

import shlex
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError
from . import options as o
from .answer import Answer
from .progress import visible
from .speed_commands import draw, zone_tables
from .subject import RPM, read_case


def init(
    path: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE")],
    *,
    model: Literal["cage", "bearing"] = "cage",
    json: bool = False,
) -> Answer:
    """A commented TOML file that describes a bearing, to be changed and given to the other commands.

    Args:
        path: Where to write it, e.g. my_bearing.toml; an existing file is left alone.
        model: Describe the cage under prescribed forces, or the bearing with its rollers.
        json: Print one JSON document on standard output.
    """
    written = jc.files.write_template(path, model)
    what, first = (
        ("an NU2310 with its rollers", "zones") if model == "bearing" else ("the NU2310 of case 1a", "statics")
    )
    said = f"Written: {written}. It describes {what}: change the values and go on, e.g. with"
    commands = [f"  jaxcage {command} {path}" for command in dict.fromkeys((first, "sweep", "zones", "report"))]
    return Answer(said, notes=commands, document={"file": str(written)})


def statics(
    case: o.Case,
    *,
    load: Annotated[float | None, o.number("be above 0 N", lambda x: x > 0, "N")] = None,
    shaft_speed: Annotated[float, o.number("be at least 0 rpm", lambda x: x >= 0, "rpm")] = 0.0,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Load of every roller, loaded zone, static displacement of the cage, kinematics.

    Args:
        load: Shaft load [N], or with a unit, e.g. "4.45 kN"; the case's own if left out.
        shaft_speed: Speed of the shaft [rpm], or with a unit or of the cage, e.g. "10000 rpm cage".
    """
    subject = read_case(case)
    model, bearing, force = subject.model, subject.model.bearing, float(subject.model.load) if load is None else load
    if force <= 0:
        raise InputError(f"The load of {subject.name} must be above 0 N, but it is {force:g}: give one with --load.")
    ratio = float(bearing.cage_speed_ratio) if getattr(shaft_speed, "whose", "shaft") == "cage" else 1.0
    shaft = float(shaft_speed) / ratio / RPM
    with show.computing(f"statics {subject.name}"):
        found = jc.bearing.load_distribution(bearing, force, bearing.roller_centrifugal_force(shaft))
    title, loads = f"{subject.name} at {force:g} N, shaft at {shaft * RPM:g} rpm", np.asarray(found.inner_loads)
    columns = {
        "angle": (found.roller_angles, "rad"),
        "inner load": (loads, "N"),
        "outer load": (found.outer_loads, "N"),
    }
    rollers = [
        jc.show.Column(name, np.asarray(x).tolist(), unit, key=name.replace(" ", "_"), digits=1)
        for name, (x, unit) in columns.items()
    ]
    tables = [
        jc.show.statics_table(f"Statics of {title}", model, found, shaft),
        jc.show.Table("Rollers", rollers, "rollers"),
    ]
    document = {n: float(getattr(found, n)) for n in ("max_load", "shaft_shift", "elastic_approach", "half_angle")}
    document |= {
        "load": force,
        "shaft_speed_rpm": shaft * RPM,
        "cage_displacement": jc.show.displacements(model, found),
    }
    document["kinematics"] = {
        "cage_speed_ratio": float(bearing.cage_speed_ratio),
        "cage_speed": float(bearing.cage_speed(shaft)),
        "roller_centrifugal_force": float(bearing.roller_centrifugal_force(shaft)),
    }
    said = f"{np.sum(loads > 0)} of {loads.size} rollers carry {force:g} N, the most loaded one {np.max(loads):.0f} N."
    figure = jc.show.drawn(lambda ax: jc.show.load_bars(found, ax), 7.0, 3.8, title)
    data = {f"{name} [{unit}]": np.asarray(x) for name, (x, unit) in columns.items()}
    return Answer(said, tables, [], document, subject, {"figure": (".png", figure), "data": (".csv", data)})


def report(
    case: o.Case,
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
    subject = read_case(case)
    at = jc.show.read_operating(operating, subject.model, subject.speeds)
    if operating and not at:
        raise InputError(f"Option --operating must hold a speed, but '{operating}' was given.")
    speeds, chances = subject.range(over, subject.usual(126 if quick else 251, 5 if quick else 13)), None
    given = {"speeds": speeds, "operating": at, "quick": quick, "orbit_method": run.method, **run.settings}
    with show.computing(f"report {subject.name}") as say:
        found = jc.show.examine(subject.name, subject.model, subject.published, **given, progress=say)
        if subject.unknowns and draws:
            chances = draw(subject, subject.range(o.Range(over.first, over.last), 40), draws, seed, run, say)
    words = ["jaxcage", "report", Path(case).name, *(["--operating", operating] if operating else [])]
    command = visible(shlex.join([*words, *(["--quick"] if quick else [])]))
    table, left = (None, ()) if subject.file is None else (subject.file.table, subject.file.left)
    html = jc.show.page(found, table=table, command=command, chances=chances, left=left)
    assessed = jc.show.assess(found)
    tables = [jc.show.verdict_table(found)] if assessed else []
    tables += [] if chances is None else jc.show.chances_tables(subject.name, chances, subject.beside)
    each = [f"{where}: {v.state} ({kind})" for where, verdicts in assessed for kind, v in verdicts.items()]
    document = {"quick": quick, "stages": found.seconds, "bytes": len(html.encode())}
    document["operating"] = [{"low_rpm": x.low_rpm, "high_rpm": x.high_rpm, **verdicts} for x, verdicts in assessed]
    notes = [f"Stages: {', '.join(f'{stage} {seconds:.0f} s' for stage, seconds in found.seconds.items())}"]
    tables += zone_tables(subject, found.sweep, found.zones)
    if (orbits := found.orbits) is not None:
        tables.append(jc.show.loss_table(subject.name, orbits.found, orbits.loss, subject.published, subject.beside))
    files = {"report": (".html", html)}
    return Answer(f"{'; '.join(each) or 'The report is written'}.", tables, notes, document, subject, files)
