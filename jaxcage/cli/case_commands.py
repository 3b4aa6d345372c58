"""Commands about the case itself: its file, its statics, one impact, the paper's results, a report."""

import shlex
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from . import options as o
from .answer import Answer, drawn
from .progress import visible


QUICK: dict[str, Any] = {"speeds": 101, "discard": 150, "revolutions": 100, "section_revolutions": 504, "orbits": False}


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
    from ..files import write_template

    written = write_template(path, model)
    said = f"Written: {written}. It describes the NU2310 of case 1a: change the values and go on, e.g. with"
    commands = [f"  jaxcage {command} {path}" for command in ("statics", "sweep", "zones", "report")]
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
    import numpy as np

    from .. import show as shown
    from .._errors import InputError
    from ..bearing import load_distribution
    from ..lanes import rpm
    from .subject import read_case

    subject = read_case(case)
    model, bearing = subject.model, subject.model.bearing
    force = float(model.load) if load is None else load
    if force <= 0:
        raise InputError(
            f"The shaft load of {subject.name} must be above 0 N, but it is {force:g}: give one with --load."
        )
    ratio = float(bearing.cage_speed_ratio) if getattr(shaft_speed, "whose", "shaft") == "cage" else 1.0
    shaft = rpm(float(shaft_speed) / ratio)
    with show.computing(f"statics {subject.name}"):
        found = load_distribution(bearing, force, bearing.roller_centrifugal_force(shaft))
    columns = {"angle": found.roller_angles, "inner load": found.inner_loads, "outer load": found.outer_loads}
    columns = {name: np.asarray(x) for name, x in columns.items()}
    units = {"angle": "rad", "inner load": "N", "outer load": "N"}
    rollers = [shown.Column(n, x.tolist(), units[n], key=n.replace(" ", "_"), digits=1) for n, x in columns.items()]
    at = f"{subject.name} at {force:g} N, shaft at {shaft_speed / ratio:g} rpm"
    tables = [shown.statics_table(f"Statics of {at}", model, found, shaft), shown.Table("Rollers", rollers, "rollers")]
    names = ("max_load", "shaft_shift", "elastic_approach", "half_angle")
    document = {"load": force, "shaft_speed_rpm": shaft_speed / ratio, **{n: float(getattr(found, n)) for n in names}}
    document["cage_displacement"] = shown.displacements(model, found)
    document["kinematics"] = {
        "cage_speed_ratio": float(bearing.cage_speed_ratio),
        "cage_speed": float(bearing.cage_speed(shaft)),
        "roller_centrifugal_force": float(bearing.roller_centrifugal_force(shaft)),
    }
    loaded = int(np.sum(columns["inner load"] > 0))
    said = f"{loaded} of {loaded + int(np.sum(columns['inner load'] <= 0))} rollers carry {force:g} N, the most loaded one "
    said += f"{document['max_load']:.0f} N."
    figure = drawn(at, lambda ax: shown.load_bars(found, ax), 7.0, 3.8)
    data = {f"{name} [{units[name]}]": x for name, x in columns.items()}
    return Answer(said, tables, [], document, subject, {"figure": (".png", figure), "data": (".csv", data)})


def impact(
    case: o.Case,
    *,
    speed: o.Speed,
    duration: Annotated[float, o.number("lie between 0 and 1000 ms", lambda x: 0 < x <= 1000, "ms")] = 0.6,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Impact of one roller on a cage bar: history of both forces.

    Args:
        duration: Length of the history [ms].
    """
    import jax.numpy as jnp
    import numpy as np

    from .. import show as shown
    from .._errors import InputError
    from .._parameters import parameters
    from ..forces import PocketImpact, approach_speed, impact_history
    from .subject import read_case

    subject = read_case(case)
    subject.require_orbits("impact")
    model, at = subject.model, subject.speed(speed)
    law = getattr(model.impact, "oscillator", PocketImpact())  # a synchronous impact has none
    if not float(model.bearing.pocket_clearance) > 0:
        raise InputError(f"The pocket clearance of {subject.name} must be above 0 for an impact, but it is 0.")
    with show.computing(f"impact {subject.name}"):
        v0 = approach_speed(law.approach_ratio, at, model.bearing.pocket_clearance)
        found = impact_history(law, model.bearing.roller_mass, v0, jnp.asarray(1e-3 * duration))
    where, stem = f"{subject.name}, {subject.at(at)}", f"_{speed:g}rpm"
    table, values = shown.impact_table(f"Impact in {where}", found, float(v0))
    units = {"time": "s", "contact_force": "N", "bar_force": "N", "roller_position": "m", "bar_position": "m"}
    columns = {f"{name} [{unit}]": np.asarray(getattr(found, name)) for name, unit in units.items()}
    bar = {name: float(getattr(law, name)) for name in parameters(law)}
    note = "Bar and contact (SI): " + ", ".join(f"{name} {value:g}" for name, value in bar.items())
    figure = drawn(where, lambda ax: shown.impact_forces(found, ax), 7.0, 4.0)
    said = f"The roller hits the bar at {float(v0):.3g} m/s with up to {values['peak_contact_force']:.4g} N."
    if values["ends_in_contact"]:
        said += " It is still in contact at the end: give a longer --duration."
    files = {"figure": (f"{stem}.png", figure), "data": (f"{stem}.csv", columns)}
    return Answer(said, [table], [note], subject.both(at) | values | {"bar": bar}, subject, files)


def reproduce(
    *,
    constants: Literal["identified", "preliminary"] = "identified",
    quick: o.Quick = False,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """The paper beside this model: edges, conclusions, and the orbit diagrams of figures 7 and 8.

    Args:
        constants: Set of constants that the paper does not print.
    """
    from ..bearing import PUBLISHED_CASES
    from ..models import case
    from ..show import paper_diagrams, reproduction, run_all

    models = {name: case(name, constants) for name in PUBLISHED_CASES}
    with show.computing("reproduce") as say:
        runs = run_all(models, report=say, **(QUICK if quick else {}))
        document, tables, notes = reproduction(runs)
    verdicts = [each["verdict"] for each in document["conclusions"]]
    said = f"{verdicts.count('holds')} of the paper's {len(verdicts)} conclusions hold, {verdicts.count('holds in part')} in part."
    files = {name: (f"_{name}.png", figure) for name, figure in paper_diagrams(runs)}
    return Answer(said, tables, notes, {"quick": quick, "constants": constants, **document}, files=files)


def report(
    case: o.Case,
    *,
    first: o.First = 2500.0,
    last: o.Last = 27500.0,
    count: o.Count = None,
    operating: str = "",
    draws: o.FromZero = 64,
    seed: o.Seed = 0,
    quick: o.Quick = False,
    run: o.RunOptions = o.RunOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """One HTML page about a design: zones, operating speeds, orbits, map, gradients, and how certain it all is.

    Args:
        operating: Speeds and ranges to assess, e.g. "8500, 12000-15000" [rpm], "900 rad/s" or "20000-24000 rpm shaft".
        draws: Draws from values that the file knows within ranges only; 0 takes the best guesses alone.
    """
    from .. import show as shown
    from .._errors import InputError
    from .speed_commands import draw, zone_tables
    from .subject import read_case

    subject = read_case(case)
    at = shown.read_operating(operating, subject.model, subject.speeds)
    if operating and not at:
        raise InputError(f"Option --operating must hold a speed, but '{operating}' was given.")
    count = count or subject.usual(126 if quick else 251, 5 if quick else 13)
    speeds, settings = subject.range(first, last, count), {n: x for n, x in run.settings.items() if n != "method"}
    with show.computing(f"report {subject.name}") as say:
        given = {"speeds": speeds, "operating": at, "quick": quick, "method": run.method, "progress": say}
        findings = shown.examine(subject.name, subject.model, subject.published, **given, **settings)
        chances = (
            draw(subject, speeds[:: -(-count // 40)], draws, seed, run, say) if subject.unknowns and draws else None
        )
    words = ["jaxcage", "report", Path(case).name, *(["--operating", operating] if operating else [])]
    command = visible(shlex.join([*words, *(["--quick"] if quick else [])]))
    table, left = (None, ()) if subject.file is None else (subject.file.table, subject.file.left)
    html = shown.page(findings, table=table, command=command, chances=chances, left=left)
    assessed = shown.assess(findings)
    tables = [*zone_tables(subject, findings.sweep, findings.zones)]
    if chances is not None:
        tables = [*shown.chances_tables(subject.name, chances, subject.beside), *tables]
    rows = [
        {"operating": str(each.at), "kind": kind, "verdict": verdict.state, "where": str(verdict)}
        for each in assessed
        for kind, verdict in each.verdicts.items()
    ]
    if rows:
        columns = [shown.Column(head, ()) for head in ("operating", "kind", "verdict", "where")]
        tables.insert(0, shown.rows_table("Operating speeds", rows, columns, "operating"))
    said = "; ".join(f"{row['operating']}: {row['verdict']} ({row['kind']})" for row in rows) or "The report is written"
    stages = ", ".join(f"{stage} {seconds:.0f} s" for stage, seconds in findings.seconds.items())
    document = {"quick": quick, "stages": findings.seconds, "bytes": len(html.encode())}
    return Answer(f"{said}.", tables, [f"Stages: {stages}"], document, subject, {"report": (".html", html)})
