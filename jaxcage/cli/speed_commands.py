"""Commands that run the model: at one speed, over speed, up and down, and over any parameters."""

import dataclasses
from functools import partial
from typing import Annotated, Any, Literal

import tyro

from .answer import Answer
from .options import (
    Case,
    Count,
    First,
    FromZero,
    Last,
    Load,
    OptionalCount,
    OptionalText,
    RunOptions,
    Seed,
    Shard,
    ShowOptions,
    Speed,
    StepOptions,
    Store,
    SweepOptions,
    Texts,
    count as count_option,
    number,
)
from .progress import say


CHOSEN = 5
"""Speeds shown in the table of a comparison, where none are named."""
ROWS = 20
"""Windows of a ramp shown in a table; files and JSON have all."""
ADVICE = "what is stored stays, and the same command goes on from there"
AGAIN = "the same command without --check and --shard computes again what is damaged and leaves the rest"
Draws = Annotated[int, count_option(0)]


def simulate(
    case: Case,
    *,
    speed: Speed,
    load: Load = None,
    run: RunOptions = RunOptions(revolutions=20, discard=0),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Time history, orbit and forces at one speed; slips, forces and losses of a bearing with its rollers."""
    from .._errors import NoResult
    from ..integrate import simulate
    from .subject import read_case

    subject = read_case(case, load)
    model, at = subject.model, subject.speed(speed)
    where, revolutions = subject.at(at), run.revolutions or 20
    with show.computing(f"simulate {subject.name}"):
        length = {"revolutions": revolutions, "discard": run.discard or 0, "samples": _samples(run.method)}
        found = simulate(model, at, **length, method=run.method)
    if found.outcome not in ("successful", "inaccurate"):
        raise NoResult(f"The simulation at {where} failed ({found.outcome}): try more --steps, or another --solver.")
    title = f"{subject.name}, {where}, {revolutions} revolutions"
    seen = _rollers(model, found, at, title) if subject.reports_means else _cage(model, found, title)
    document = subject.both(at) | {"revolutions": revolutions, "discard": length["discard"]}
    document |= {"outcome": found.outcome, "error": found.error} | seen.document
    stem = f"_{speed:g}rpm"
    files = {key: (f"{stem}{ending}", content) for key, (ending, content) in seen.files.items()}
    error = f"Error of a revolution: at most {found.error:.0e} of the scale ({found.outcome})"
    return dataclasses.replace(seen, document=document, files=files, notes=[error], subject=subject)


def _samples(method: Any) -> int:
    """Samples of a revolution: of equal steps they must divide the number of steps."""
    steps = getattr(method, "steps", None)
    return 128 if not steps else max(n for n in range(1, min(128, steps) + 1) if steps % n == 0)


def _cage(model: Any, found: Any, title: str) -> Answer:
    """Measures, figure and columns of the history of a cage."""
    from ..analysis import cage_forces, orbit_measures
    from ..io import trajectory_columns
    from ..show import measures_table, simulation_figure

    forces, measures = cage_forces(model, found), orbit_measures(model, found)
    said = (
        f"The cage comes to {measures.largest_eps:.3f} of its clearance and whirls at {measures.whirl_ratio:.3f} times "
        f"its own speed; its film takes {measures.drag_power:.3g} W."
    )
    files = {
        "figure": (".png", simulation_figure(found, forces, float(model.clearance), title)),
        "data": (".csv", trajectory_columns(found, forces)),
    }
    return Answer(said, [measures_table(title, measures)], document={"measures": measures}, files=files)


def _rollers(model: Any, found: Any, speed: float, title: str) -> Answer:
    """Measures, spectra, figure and columns of the history of a bearing."""
    import numpy as np

    from .. import analysis
    from ..show import bearing_figure, circumference_table, line_tables, measures_table

    history = analysis.bearing_history(model, found, speed)
    measures, orders = analysis.bearing_measures(model, found, speed), analysis.bearing_orders(model, found, speed)
    around = analysis.around(history)
    spectra = analysis.bearing_spectra(history) if np.ptp(history.angle) > 2.5 * np.pi else {}
    said = (
        f"The cage slips by {100 * measures.cage_slip:.2f} %, its pockets push with up to "
        f"{measures.pocket_force_max_N:.0f} N, and {measures.friction_power_W:.0f} W are lost; its motion is "
        f"{measures.state.replace('_', ' ')}."
    )
    columns = {"time [s]": history.time, "cage angle [rad]": history.angle}
    columns |= {f"cage place {axis} over clearance": history.place[:, i] for i, axis in enumerate("xy")}
    for name in ("pocket_on_cage", "land_on_cage"):
        columns |= {f"{name}_{axis} [N]": getattr(history, name)[:, i] for i, axis in enumerate("xy")}
    for name, unit in {"pocket_force": "N", "inner_load": "N", "roller_slip": "1"}.items():
        columns |= {f"{name}_{j + 1} [{unit}]": x for j, x in enumerate(getattr(history, name).T)}
    document = {
        **dataclasses.asdict(measures),
        "pocket_force_distribution_N": analysis.pocket_force_distribution(history),
        "around": around,
        "orders": orders,
        "spectra": {n: [vars(line) for line in analysis.named_lines(s, orders)] for n, s in spectra.items()},
    }
    figure = bearing_figure(model, found, history, around, spectra, orders, title)
    tables = [measures_table(title, measures), circumference_table(around), *line_tables(spectra, orders)]
    return Answer(said, tables, document=document, files={"figure": (".png", figure), "data": (".csv", columns)})


def sweep(
    case: Case,
    *,
    first: First = 2500.0,
    last: Last = 27500.0,
    count: Count = None,
    load: Load = None,
    nominal: bool = False,
    draws: Draws = 64,
    seed: Seed = 0,
    run: SweepOptions = SweepOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Sweep over speed from several initial states: labels, exponents, chaotic zones; slips, forces, losses of a bearing.

    Of a file with ranges, chances of chaos.

    Args:
        nominal: Take the best guesses of values known within ranges only, as if they were known.
        draws: Draws from values that the file knows within ranges only, each run once at every speed.
    """
    from .subject import read_case

    subject = read_case(case, load)
    if subject.unknowns and draws and not nominal:
        return chances(subject, subject.range(first, last, count or 40), draws, seed, run, show)
    return swept(subject, subject.range(first, last, count or subject.usual(251, 13)), run, show)[1]


def swept(subject: Any, speeds: Any, run: SweepOptions, show: ShowOptions) -> tuple[Any, Answer]:
    """The data set of a sweep, and the answer about it."""
    import numpy as np

    from .. import analysis
    from ..lanes import sweep as run_sweep
    from ..show import quantities_table, shares_table, sweep_figure

    with show.computing(f"sweep of {subject.name}") as progress:
        found = run_sweep(subject.model, speeds, **run.settings, progress=partial(progress, ""))
    require_some(found)
    followed, rpm = "strobe" in found, found["rpm"].values
    zones = analysis.zones(found) if followed else analysis.stretches(found)
    title = f"{subject.name}, {analysis.length(found)}"
    counts = counted(found)
    short, beyond = int(np.sum(analysis.too_short(found))), int(np.sum(found["peak"].values > 1))
    if short:
        say(f"Warning: {short} lanes have no certain label{analysis.cure(found) or ': choose more --revolutions'}.")
    if beyond and followed:
        say(f"Warning: {beyond} lanes went beyond eps = 1, where the surfaces would overlap.")
    lanes = shares_table(f"Lanes: {speeds.size} speeds x {found.sizes['start']} initial states, {analysis.length(found)}", "label", counts)
    document = {"speeds": speeds.size, "starts": found.sizes["start"], "labels": counts, "failed": analysis.outcomes(found)}
    document |= {name: found.attrs[name] for name in ("discard", "revolutions")}
    document |= {"beyond_clearance": beyond, "too_short": short, "error": float(np.nanmax(found["error"].values))}
    document |= {"confirmed": analysis_confirmed(found)} | _zones_document(subject, zones, followed)
    tables = [*zone_tables(subject, found, zones), lanes]
    if quantities := [q.name for q in subject.model.quantities]:
        shown = [n for n in ("cage_slip", "pocket_force_mean_sum_N", "friction_power_W", "exponent") if n in quantities or n == "exponent"]
        tables.insert(1, quantities_table(f"Means over initial states of {title}", found, shown))
        document |= {"label": found["label"].values, "outcome": found["outcome"].values, **subject_speeds(found)}
        document |= {name: found[name].values for name in quantities}
        document |= {"standard_errors": {n: analysis.scatter(found[f"{n}_blocks"].values) for n in quantities}}
    files: dict[str, Any] = {"figure": (".png", sweep_figure(found, zones, subject.published, _title(subject, title)))}
    widest = max(zones.zones, key=lambda z: z.width_rpm or 0.0, default=None) if followed else None
    if widest is not None and widest.width_rpm:
        files["zoom"] = ("_zoom.png", _zoom(found, widest, f"{title}, widest zone"))
    files["data"] = (".zarr", found)
    failed = ", ".join(f"{n} {how}" for how, n in document["failed"].items())
    notes = [f"Failed lanes: {failed or 'none'}", f"Error of a revolution: at most {document['error']:.0e} of the scale"]
    for i, each in enumerate(document["confirmed"]):
        notes.append(f"Confirmed by steps at most 1/{2 << i} as long: {each['changed']} of {each['lanes']} labels changed")
    return found, Answer(_said(zones, followed, rpm), tables, notes, document, subject, files)


def analysis_confirmed(found: Any) -> list[dict[str, int]]:
    """Rounds in which labels were confirmed by finer steps."""
    import json

    return [dict(zip(("lanes", "changed", "moved"), each)) for each in json.loads(found.attrs["confirmed"])]


def require_some(found: Any, where: str = "") -> None:
    """**Raises:** `NoResult` if every lane of a data set failed."""
    from .._errors import NoResult
    from ..analysis import failed, outcomes

    if failed(found).all():
        how = ", ".join(outcomes(found))
        raise NoResult(f"All {found['label'].size} simulations{where} failed ({how}): try more steps (--steps).")


def counted(found: Any) -> dict[str, int]:
    """Number of lanes by label."""
    import collections

    return dict(sorted(collections.Counter(found["label"].values.ravel().tolist()).items()))


def subject_speeds(found: Any) -> dict[str, Any]:
    """Speeds of cage and shaft in a data set [rpm], for a document."""
    pair = {"cage_speed_rpm": "cage_rpm", "shaft_speed_rpm": "shaft_rpm"}
    return {"speed_rpm": found["rpm"].values} | {
        key: found[name if name in found.coords else "rpm"].values for key, name in pair.items()
    }


def zone_tables(subject: Any, found: Any, zones: Any) -> list[Any]:
    """Tables of zones of chaos, or of stretches of speed with the same label."""
    from .. import show

    if "strobe" not in found:
        return [show.stretches_table(subject.name, zones)]
    span = float(found["rpm"][0]), float(found["rpm"][-1])
    table = show.zones_table(subject.name, zones, subject.published, span, subject.beside)
    details = show.zone_details(f"Chaotic zones of {subject.name} in detail", zones.zones)
    return [table, *details, *show.transient_tables(subject.name, zones)]


def _zones_document(subject: Any, zones: Any, followed: bool) -> dict[str, Any]:
    from ..show import zones_document

    return zones_document(zones, subject.published) if followed else {"zones": [vars(zone) for zone in zones]}


def _said(zones: Any, followed: bool, rpm: Any) -> str:
    """The zones in a sentence."""
    from ..show import zone_words

    between = f"between {rpm[0]:.0f} and {rpm[-1]:.0f} rpm" if rpm.size > 1 else f"at {rpm[0]:.0f} rpm"
    if not followed:
        chaotic = sum(zone.speeds for zone in zones if zone.chaotic)
        said = f"The largest exponent is positive beyond doubt at {chaotic} of {rpm.size} speeds {between}; motion: "
        return said + ", ".join(f"{' or '.join(z.labels)} {z.low_rpm:.0f} to {z.high_rpm:.0f} rpm" for z in zones) + "."
    lasts = f" that lasts beyond {zones.horizon} revolutions" if zones.horizon else ""
    if not zones.zones:
        also = f", but {len(zones.transient)} of chaos that dies out" if zones.transient else ""
        return f"No zone of chaos{lasts} {between}{also}."
    count = f"{len(zones.zones)} zone{'s' if len(zones.zones) > 1 else ''}"
    return f"{count} of chaos{lasts} {between}: {', '.join(map(zone_words, zones.zones))}."


def _title(subject: Any, title: str) -> str:
    model = subject.model
    return f"{title}\nguidance gap {1e3 * float(model.guidance_gap):.3g} mm, eccentricity {1e6 * float(model.eccentricity):.3g} µm"


def _zoom(found: Any, zone: Any, title: str) -> Any:
    """The orbit diagram of a zone, with a fifth of its width at either side."""
    from ..show import new_figure, orbit_diagram

    figure, beyond = new_figure(9.0, 5.0), 0.2 * zone.width_rpm
    limits = zone.onset.speed_rpm - beyond, zone.exit.speed_rpm + beyond
    orbit_diagram(found, ax=figure.subplots(), limits_rpm=limits)
    figure.suptitle(title, fontsize=11)
    return figure


def chances(subject: Any, speeds: Any, draws: int, seed: int, run: RunOptions, show: ShowOptions) -> Answer:
    """Chances of chaos by speed, and bands of the edges, of a file with ranges."""
    from .._errors import NoResult
    from ..design import REVOLUTIONS
    from ..show import chance_of_chaos, chances_answer, chances_document, chances_notes, chances_tables, new_figure

    found = drawn(subject, speeds, draws, seed, run, show)
    if found.failed.all():
        raise NoResult(f"All {found.failed.size} simulations failed: try more steps (--steps), or narrower ranges.")
    figure = new_figure(9.0, 5.0)
    bands = [(band.name, band.rpm) for band in found.bands]
    chance_of_chaos(found.rpm, found.chance, found.interval, bands, figure.subplots())
    figure.suptitle(f"{subject.name}: {draws} draws from {len(subject.unknowns)} ranges", fontsize=11)
    columns = {"cage speed [rpm]": found.rpm, "shaft speed [rpm]": found.rpm * (subject.shaft or 1.0)}
    columns |= {"chance of chaos": found.chance, "lower bound": found.interval[0], "upper bound": found.interval[1]}
    files = {"figure": (".png", figure), "data": (".csv", columns)}
    tables, notes = chances_tables(subject.name, found, subject.beside), chances_notes(found)
    del REVOLUTIONS
    return Answer(chances_answer(found), tables, notes, chances_document(found), subject.certain, files)


def drawn(subject: Any, speeds: Any, draws: int, seed: int, run: RunOptions, show: ShowOptions) -> Any:
    """The motions of draws from the ranges of a file over speed."""
    from ..design import REVOLUTIONS, ensemble

    length = {name: value for name, value in run.settings.items() if name in ("discard", "revolutions", "blocks") and value is not None}
    for name in ("discard", "revolutions"):
        length[name] = min(length.get(name, REVOLUTIONS), REVOLUTIONS)
    if length["revolutions"] == REVOLUTIONS:
        length["blocks"] = 20
    with show.computing(f"draws of {subject.name}") as progress:
        return ensemble(
            subject.model,
            subject.unknowns,
            speeds,
            draws=draws,
            seed=seed,
            **length,
            method=run.method,
            progress=partial(progress, "draws"),
        )


def poincare(
    case: Case,
    *,
    speed: Speed,
    run: RunOptions = RunOptions(revolutions=1000),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Strobe section at one speed, from all initial states."""
    import numpy as np

    from ..analysis import length
    from ..io import strobe_columns
    from ..lanes import sweep as run_sweep
    from ..show import Column, new_figure, rows_table, strobe_section
    from .subject import read_case

    subject = read_case(case)
    subject.require_orbits("poincare")
    at = subject.speed(speed)
    with show.computing(f"poincare {subject.name}") as progress:
        settings = run.settings | {"keep": run.revolutions}
        found = run_sweep(subject.model, np.array([at]), **settings, progress=partial(progress, "")).isel(speed=0)
    require_some(found, f" at {subject.at(at)}")
    components = found["component"].values.tolist()
    starts = [
        {
            "start": i + 1,
            "label": str(lane["label"].values),
            "outcome": str(lane["outcome"].values),
            "exponent": float(lane["exponents"][0]),
            "standard_error": float(lane["standard_error"][0]),
            **{name: lane["strobe"].values[:, components.index(name)] for name in ("y_C", "vy_C")},
        }
        for i, lane in ((i, found.isel(start=i)) for i in range(found.sizes["start"]))
    ]
    figure = new_figure(6.5, 5.4)
    names = [f"start {each['start']}: {each['label']}" for each in starts]
    strobe_section(found["strobe"].values, figure.subplots(), names=names)
    figure.suptitle(f"{subject.name}, {subject.at(at)}, {run.revolutions} revolutions", fontsize=11)
    exponent = Column("largest exponent per revolution", (), key="exponent", errors="standard_error")
    title = f"Strobe section of {subject.name} at {subject.at(at)}, {length(found)}"
    table = rows_table(title, starts, [Column("start", ()), Column("label", ()), exponent])
    labels = ", ".join(dict.fromkeys(each["label"] for each in starts))
    stem = f"_{speed:g}rpm"
    files = {"figure": (f"{stem}.png", figure), "data": (f"{stem}.csv", strobe_columns(found.expand_dims("speed")))}
    said = f"At {subject.at(at)} the {len(starts)} initial states lead to motion that is {labels}."
    return Answer(said, [table], [], subject.both(at) | {"starts": starts}, subject, files)


def compare(
    case: Case,
    other: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="OTHER")],
    *,
    first: First = 2500.0,
    last: Last = 27500.0,
    count: Count = None,
    at: str = "",
    run: SweepOptions = SweepOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Two designs side by side at the same speeds of the shaft: differences, labels, zones, forces, wear.

    Args:
        other: The design to compare it with, a case or a TOML file.
        at: Speeds to be shown in tables, e.g. "8500, 12000" [rpm] or "20000 rpm shaft"; five of the range if left out.
    """
    import numpy as np

    from .. import analysis
    from .. import show as shown
    from .._errors import InputError
    from ..lanes import sweep as run_sweep
    from .subject import RPM, read_case

    one, two = read_case(case), read_case(other)
    if type(one.model) is not type(two.model):
        raise InputError(f"Case '{other}' must be a {one.usual('cage', 'bearing with its rollers')}, as the first one is: two of a kind are compared.")
    pair = [one, two if two.name != one.name else dataclasses.replace(two, name=f"{two.name}_second")]
    names = [each.name for each in pair]
    wanted = [each.low_rpm for each in shown.read_operating(at, one.own_ratio, one.speeds)] if at else []
    speeds, places = _with(one.range(first, last, count or one.usual(126, 13)) * RPM, wanted)
    factor = 1.0 if one.shaft is None else one.shaft / two.shaft  # pyright: ignore[reportOptionalOperand]
    two.speed(float(speeds[-1]) * factor, "last")
    found = []
    with show.computing(f"compare {names[0]}") as progress:
        for each, times in zip(pair, (1.0, factor), strict=True):
            settings = run.settings | {"progress": partial(progress, each.name)}
            found.append(_measured(each.model, run_sweep(each.model, speeds * times / RPM, **settings)))
    for name, each in zip(names, found, strict=True):
        require_some(each, f" of {name}")
    quantities = [n for n in QUANTITIES if n == "exponent" or n in found[0]]
    means = [{n: shown.mean_over_starts(each, n) for n in quantities} for each in found]
    changed = shown.differences([each.model for each in pair])
    zones = [analysis.zones(each) if "strobe" in each else analysis.stretches(each) for each in found]
    document = {"cases": names, "differences": changed, "designs": {}}
    for name, subject, each, values, of_it in zip(names, pair, found, means, zones, strict=True):
        rows = {"labels": each["label"].values, "failed": int(analysis.failed(each).sum()), **subject_speeds(each)}
        rows |= {"chaotic_share": analysis.chaotic_share(each)} if "strobe" in each else {}
        rows |= {n: mean for n, (mean, _) in values.items()} | {f"{n}_error": error for n, (_, error) in values.items()}
        document["designs"][name] = rows | _zones_document(subject, of_it, "strobe" in each)
    overall = [
        {"measure": n.replace("_", " "), **{name: float(np.nanmean(of[n][0])) for name, of in zip(names, means, strict=True)}}
        for n in quantities
    ]
    chosen = [each.isel(speed=places) for each in found]
    tables = [
        shown.rows_table("Means over speed, in SI units", overall, [shown.Column("measure", ()), *(shown.Column(n, ()) for n in names)]),
        shown.differences_table(names, changed),
        *(table for each, data, of_it in zip(pair, found, zones, strict=True) for table in zone_tables(each, data, of_it)),
        *(shown.quantity_beside(n, names, chosen) for n in quantities),
    ]
    files = {
        "figure": (f"_{names[1]}.png", shown.sweeps_beside(names, found, zones)),
        "measures": (f"_{names[1]}_measures.png", shown.quantities_beside(names, found, [n for n in quantities if n != "exponent"])),
    }
    note = "Means over initial states, with standard errors; * where both differ by more than two of them."
    said = "; ".join(f"{name}: {_said(of_it, 'strobe' in each, each['rpm'].values)}" for name, each, of_it in zip(names, found, zones, strict=True))
    return Answer(said, tables, [note], document, one, files)


QUANTITIES = (
    "exponent orbit_size peak_land_force wear_load cage_slip pocket_impulse_N_s land_impulse_N_s pocket_wear_mm3_per_h "
    "friction_power_W"
).split()
"""Variables that are compared, of those that a data set has."""


def _measured(model: Any, found: Any) -> Any:
    """The data set with the size of the orbit and the loads of the land, where a sweep does not report quantities."""
    if "strobe" not in found:
        return found
    from ..design import land_loads, motions

    loads = land_loads(model, found)
    about = {"orbit_size": (motions(model, found).size, "m"), "peak_land_force": (loads["peak land force"], "N")}
    about["wear_load"] = loads["wear load"], "N m/s"
    dims = ("speed", "start")
    return found.assign(
        {n: (dims[: x.ndim], x, {"units": unit, "long_name": n.replace("_", " ")}) for n, (x, unit) in about.items()}
    )


def _with(even: Any, wanted: list[float]) -> tuple[Any, list[int]]:
    """Speeds [rpm] with the wanted ones among them, and the places of those to be shown in tables.

    **Raises:** `InputError` for speeds outside the range.
    """
    import numpy as np

    from .._errors import InputError

    if not wanted:
        return even, np.unique(np.linspace(0, even.size - 1, CHOSEN).round().astype(int)).tolist()
    if outside := [x for x in wanted if not even[0] <= x <= even[-1]]:
        raise InputError(
            f"Option --at must lie between --first and --last, {even[0]:g} to {even[-1]:g} rpm, but {outside[0]:g} rpm "
            "was given."
        )
    near = [float(even[np.argmin(np.abs(even - x))]) for x in wanted]
    new = [x for x, y in zip(wanted, near, strict=True) if abs(x - y) > 1e-6 * x]
    speeds = np.unique(np.concatenate([even, new]))
    return speeds, [int(np.argmin(np.abs(speeds - x))) for x in wanted]


def runup(
    case: Case,
    *,
    first: First = 2500.0,
    last: Last = 27500.0,
    rate: Annotated[float, number("be a rate above 0 rpm/s", lambda x: x > 0)] = 5000.0,
    windows: OptionalCount = None,
    discard: OptionalCount = None,
    load: Load = None,
    steps: StepOptions = StepOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Run-up and run-down at a constant rate: where the motion differs between both.

    Args:
        rate: Speed gained per second [rpm/s], in the mean over the ramp, of the same speed as bare numbers are.
        windows: Parts into which each ramp is cut, in each of which the motion is read.
        discard: Revolutions at the first speed before the ramp begins.
    """
    from ..lanes import ramp_up_down
    from ..show import Column, Table, head_of, ramp_figure
    from .subject import RPM, read_case

    subject = read_case(case, load)
    low, high = subject.range(first, last, 2)
    own = subject.speed(first + rate, "last") - subject.speed(first, "first")
    given = {"windows": windows, "settle": discard, "method": steps.method}
    with show.computing(f"runup {subject.name}"):
        found = ramp_up_down(subject.model, low, high, own, **{n: x for n, x in given.items() if x is not None})
    require_some_ramp(found)
    names, up, down = list(found.quantities), found.up, found.down
    at = up["rpm"].values
    rows = slice(0, at.size, -(-at.size // ROWS))
    columns = [Column("speed [rpm]", at[rows].tolist(), digits=0)]
    for name in names:
        unit = up[name].attrs["units"]
        columns += [Column(f"{head_of(name, unit)} {way}", data[name].values[rows].tolist(), unit) for way, data in (("up", up), ("down", down))]
    columns.append(Column("hysteresis", ["differs" if x else "" for x in found.apart[rows]]))
    spans = ", ".join(f"{a:.0f} to {b:.0f} rpm" for a, b in found.stretches)
    said = "Up and down are alike within their scatter: no hysteresis is seen at this rate."
    if spans:
        said = f"Up and down differ: {spans}. A slower ramp tells whether the cage only lags behind."
    title = f"Run-up and run-down of {subject.name}, {rate:g} rpm/s"
    document = {"rate_rpm_per_s": own * RPM, "hysteresis_rpm": found.stretches, **found.about}
    data: dict[str, Any] = {f"{key.removesuffix('_rpm').replace('_', ' ')} [rpm]": x for key, x in subject_speeds(up).items() if key != "speed_rpm"}
    for way, part in (("up", up), ("down", down)):
        document[way] = {"speeds_rpm": part["rpm"].values, **{n: part[n].values for n in part.data_vars}}
        data |= {f"{n} {way} [{part[n].attrs['units']}]": part[n].values for n in part.data_vars}
    figure = ramp_figure(up, down, names, found.stretches, title)
    files = {"figure": (".png", figure), "data": (".csv", data | {"differs": found.apart})}
    return Answer(said, [Table(title, columns)], [], document, subject, files)


def require_some_ramp(found: Any) -> None:
    """**Raises:** `NoResult` if every window of both ramps failed."""
    import numpy as np

    from .._errors import NoResult

    if not any(np.isfinite(each[name].values).any() for each in (found.up, found.down) for name in found.quantities):
        raise NoResult("All windows of the ramp failed: try more --steps, or a slower --rate.")


def study(
    case: Case,
    *,
    vary: Annotated[Texts, tyro.conf.arg(metavar="NAME=VALUES")] = (),
    sample: FromZero = 0,
    seed: Seed = 0,
    starts: OptionalCount = None,
    exponents: OptionalCount = None,
    strobe: FromZero = 0,
    store: Store = None,
    chunk: OptionalCount = None,
    shard: Shard = (1, 1),
    executor: Literal["local", "dask"] = "local",
    scheduler: OptionalText = None,
    workers: OptionalCount = None,
    check: bool = False,
    run: RunOptions = RunOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """A sweep over any grid or sample of parameters, stored as it goes; the same command goes on where one stopped.

    Args:
        vary: Once for each parameter, `speed` among them. A grid: speed=4000rpm:27500rpm:100, or single values:
            oil=32,56,78 (ISO VG grades). Sampled: guidance_gap=0.3mm:0.6mm, or in a tolerance: eccentricity=20um+-3um.
        sample: Number of samples, best a power of 2.
        starts: Initial states at each point; all of the model's own if left out.
        exponents: Number of Lyapunov exponents.
        strobe: Strobe states stored of each lane, the last ones.
        store: Name of the store within the output folder.
        chunk: Lanes computed and stored together.
        shard: Part of the work, e.g. 2/4: every fourth chunk from the second on. All parts write to the same store.
        executor: Where to run: on all cores of this machine, or on dask.distributed.
        scheduler: Address of a dask scheduler, e.g. tcp://host:8786; a cluster on this machine if left out.
        workers: Processes of the cluster on this machine; one a core if left out.
        check: Compute nothing: compare every chunk of the store with its checksum.
    """
    import time
    from pathlib import Path

    import numpy as np

    from .. import lanes
    from .._errors import InputError, NoResult
    from ..show import shares_table
    from .subject import read_case
    from .values import read_vary

    subject = read_case(case)
    path = Path(show.out) / (store or f"study_{subject.name}.zarr")
    if check:
        return _checked(subject, path)
    if executor == "local" and (scheduler is not None or workers is not None):
        raise InputError("Options --scheduler and --workers go with --executor dask.")
    given = read_vary(vary, subject)
    sizes = [x.size for x in given.values() if isinstance(x, np.ndarray)]
    if (size := int(np.prod([max(sample, 1), *sizes], dtype=float))) > MOST_POINTS:
        raise InputError(f"Options --vary and --sample must make at most {MOST_POINTS} points for the lanes, not {size}.")
    began, done = time.perf_counter(), [0]
    with show.computing(f"study {subject.name}", ADVICE) as bar:

        def progress(so_far: int, total: int) -> None:
            done.append(so_far)
            bar("lanes", so_far, total)

        settings = {name: value for name, value in run.settings.items() if value is not None}
        settings |= {} if exponents is None else {"exponents": exponents}
        try:
            stored = lanes.study(
                subject.model,
                given,
                store=path,
                samples=sample,
                seed=seed,
                starts=starts,
                strobe=strobe,
                lanes=chunk,
                shard=shard,
                executor=executor,
                scheduler=scheduler,
                workers=workers,
                progress=progress,
                **settings,
            )
        except ImportError as error:  # of an extra
            raise InputError(str(error)) from error
    computed, seconds = done[-1] - done[1], time.perf_counter() - began  # the first number is of those stored before
    try:
        with stored:
            found = lanes.decoded(stored[[*_plain(stored)]].load())
    except ValueError as error:  # a chunk that another shard has written
        raise NoResult(f"The store '{path}' is damaged: {AGAIN}.") from error
    known = found["label"].values != lanes.PENDING
    stored_lanes, all_lanes = int(np.sum(known)), found["label"].size
    if stored_lanes:
        require_some(found.stack(lane=found["label"].dims).isel(lane=np.flatnonzero(known)))
    if stored_lanes < all_lanes:
        say(f"Warning: {all_lanes - stored_lanes} lanes are left for the other shards.")
    counts = {label: n for label, n in counted(found).items() if label != lanes.PENDING}
    rate = computed / seconds if computed else None
    spread = lambda x: [float(v) for v in np.nanpercentile(x, (0, 50, 100))] if np.isfinite(x).any() else [None] * 3
    document = {
        "axes": dict(zip(found["label"].dims, found["label"].shape, strict=True)),
        "lanes": all_lanes,
        "stored": stored_lanes,
        "stored_before": stored_lanes - computed,
        "labels": counts,
        "lanes_per_second": rate,
        "least_median_most": {q.name: spread(found[q.name].values) for q in subject.model.quantities},
    }
    shape = " x ".join(f"{n} {axis}" for axis, n in document["axes"].items())
    notes = [f"Computed: {computed} lanes{f', {rate:.3g} a second' if rate else ''}", f"Open it: jaxcage.open_study({str(path)!r})"]
    said = f"{stored_lanes} of {all_lanes} lanes are stored; most common: {max(counts, key=counts.__getitem__, default='none')}."
    return Answer(said, [shares_table(f"Lanes: {shape}", "label", counts)], notes, document, subject, stored={"store": str(path)})


MOST_POINTS = 100_000_000
"""Points of a study: a week at a rate of 150 lanes a second."""


def _plain(stored: Any) -> list[str]:
    """Variables of a store that are one value a lane."""
    return [str(name) for name, x in stored.data_vars.items() if x.dims == stored["label"].dims]


def _checked(subject: Any, path: Any) -> Answer:
    """The chunks of a store compared with their checksums."""
    from .._errors import InputError
    from ..lanes import check_study

    try:
        state = check_study(path)
    except FileNotFoundError as error:
        raise InputError(str(error)) from error
    damaged = {str(chunk): what for chunk, what in state.damaged.items()}
    document = {"store": str(path), "chunks": state.chunks, "finished": state.finished, "damaged": damaged}
    failure = f"The store '{path}' is damaged: {AGAIN}." if damaged else ""
    said, *notes = str(state).splitlines()
    return Answer(said, [], notes, document, subject, failure=failure)
