"""Commands about the case itself: its file, its statics, a report."""

import shlex
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError
from . import options as o
from .answer import Answer
from .progress import report as tell, visible
from .speed_commands import draw
from .subject import RPM


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
    what = "an NU2310 with its rollers" if model == "bearing" else "the NU2310 of case 1a"
    said = f"Written: {written}. It describes {what}: change the values and go on, e.g. with"
    commands = [f"  jaxcage {command} {path}" for command in ("statics", "sweep", "zones", "report")]
    return Answer(said, notes=commands, document={"file": str(written)})


def statics(
    subject: o.Case,
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
    model, bearing, force = subject.model, subject.model.bearing, float(subject.model.load) if load is None else load
    if force <= 0:
        raise InputError(f"The load of {subject.name} must be above 0 N, but it is {force:g}: give one with --load.")
    ratio = float(bearing.cage_speed_ratio) if getattr(shaft_speed, "whose", "shaft") == "cage" else 1.0
    shaft = float(shaft_speed) / ratio / RPM
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
    document = {n: float(getattr(found, n)) for n in ("max_load", "shaft_shift", "elastic_approach", "half_angle")}
    document |= {"load": force, "shaft_speed_rpm": shaft * RPM}
    document["cage_displacement"] = jc.show.displacements(model, found)
    document["kinematics"] = {
        "cage_speed_ratio": float(bearing.cage_speed_ratio),
        "cage_speed": float(bearing.cage_speed(shaft)),
        "roller_centrifugal_force": float(bearing.roller_centrifugal_force(shaft)),
    }
    said = f"{np.sum(loads > 0)} of {loads.size} rollers carry {force:g} N, the most loaded one {np.max(loads):.0f} N."
    figure = jc.show.drawn(partial(jc.show.load_bars, found), 7.0, 3.8, title)
    files = {"figure": figure, "data": {f"{name} [{heads[name]}]": x for name, x in data.items()}}
    return Answer(said, tables, [], document, files)


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
    speeds, chances = subject.range(over, subject.usual(126 if quick else 251, 5 if quick else 13)), None
    given = {"speeds": speeds, "operating": at, "quick": quick, "progress": tell, **run.settings}
    found = jc.show.examine(subject.name, subject.model, subject.published, **given)
    if subject.unknowns and draws:
        chances = draw(subject, o.Range(over.first, over.last), draws, seed, run)
    words = ["jaxcage", "report", Path(subject.path).name or subject.name]
    words += [*(["--operating", operating] if operating else []), *(["--quick"] if quick else [])]
    table, left = (None, ()) if subject.file is None else (subject.file.table, subject.file.left)
    html = jc.show.page(found, table=table, command=visible(shlex.join(words)), chances=chances, left=left)
    tables = [jc.show.verdict_table(found)] if at else []
    each = [f"{where}: {v.state} ({kind})" for where, verdicts in found.assessed for kind, v in verdicts.items()]
    document = {"quick": quick, "stages": found.seconds, "bytes": len(html.encode())}
    document["operating"] = [vars(where) | verdicts for where, verdicts in found.assessed]
    notes = [f"Stages: {', '.join(f'{stage} {seconds:.0f} s' for stage, seconds in found.seconds.items())}"]
    return Answer(f"{'; '.join(each) or 'The report is written'}.", tables, notes, document, {"report": html})
