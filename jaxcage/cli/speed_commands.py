"""Commands that run the model: at one speed, over speed, up and down, and over any parameters."""

import collections
import dataclasses
import json
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from .answer import Answer, drawn
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
    number,
)
from .progress import say


SHOWN = ("cage_slip", "pocket_force_mean_sum_N", "friction_power_W", "eccentricity_mean", "exponent")
"""Variables in the table over speed, of those that a data set has."""
COMPARED = (
    "exponent orbit_size peak_land_force wear_load cage_slip pocket_impulse_N_s land_impulse_N_s pocket_wear_mm3_per_h "
    "friction_power_W"
).split()
"""Variables that are compared, of those that a data set has."""
RAMPED = ("size", "eccentricity", "cage_slip", "friction_power_W")
"""Variables of a ramp that are shown, of those that a data set has."""
CHOSEN, ROWS = 5, 20
"""Speeds shown in tables of a comparison where none are named, and windows of a ramp."""
MOST_POINTS = 100_000_000
"""Points of a study: a week at a rate of 150 lanes a second."""
ADVICE = "what is stored stays, and the same command goes on from there"
AGAIN = "the same command without --check and --shard computes again what is damaged and leaves the rest"


def simulate(
    case: Case,
    *,
    speed: Speed,
    load: Load = None,
    run: RunOptions = RunOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Time history, orbit and forces at one speed, of 20 revolutions; slips and losses of a bearing with its rollers."""
    from .. import analysis
    from .._errors import NoResult
    from ..show import trajectory_columns
    from ..show import measures_table, simulation_figure
    from ..solve import simulate
    from .subject import read_case

    subject = read_case(case, load)
    model, at = subject.model, subject.speed(speed)
    steps = getattr(run.method, "steps", 128)  # of equal steps the samples must divide the number
    length = {"revolutions": run.revolutions or 20, "discard": run.discard or 0}
    samples = max(n for n in range(1, min(128, steps) + 1) if steps % n == 0)
    with show.computing(f"simulate {subject.name}"):
        found = simulate(model, at, **length, samples=samples, method=run.method)
    if found.outcome not in ("successful", "inaccurate"):
        how = f"failed ({found.outcome}): try more --steps, or another --solver."
        raise NoResult(f"The simulation at {subject.at(at)} {how}")
    title, measures = (
        f"{subject.name}, {subject.at(at)}, {length['revolutions']} revolutions",
        analysis.measures(model, found),
    )
    document = subject.both(at) | length | {"outcome": found.outcome, "error": found.error}
    document["measures"] = {name: value for name, (_, value, _) in measures.items()}
    document["measures_error"] = {name: error for name, (_, _, error) in measures.items()}
    notes = [f"Error of a revolution: at most {found.error:.0e} of the scale ({found.outcome})"]
    if subject.reports_means:
        more = _rollers(model, found, title)
    else:
        forces, clearance = analysis.cage_forces(model, found), float(model.clearance)
        figure = simulation_figure(found, forces, clearance, title)
        more = Answer("", files={"figure": (".png", figure), "data": (".csv", trajectory_columns(found, forces))})
    files = {key: (f"_{speed:g}rpm{ending}", content) for key, (ending, content) in more.files.items()}
    told = ("largest_eps", "whirl_ratio", "drag_power", "cage_slip", "pocket_force_max_N", "friction_power_W")
    each = (
        f"{q.text} {value:.4g} {q.unit if q.unit != '1' else ''}".rstrip()
        for q, value, _ in (measures[n] for n in told if n in measures)
    )
    said = f"At {subject.at(at)}: {', '.join(each)}."
    return Answer(
        said, [measures_table(title, measures), *more.tables], notes, document | more.document, subject, files
    )


def _rollers(model: Any, found: Any, title: str) -> Answer:
    """Rollers around the bearing, spectra, figure and columns of a history."""
    from ..analysis import rollers
    from ..show import bearing_figure, circumference_table, line_tables

    history, orders = rollers.roller_history(model, found), rollers.bearing_orders(model, found)
    around, spectra = rollers.around(history), {}
    if found.state.shape[0] > 2 * history.samples:
        spectra = rollers.bearing_spectra(history)
    columns = {"time [s]": history.time, "cage angle [rad]": history.angle}
    columns |= {f"cage place {axis} over clearance": history.place[:, i] for i, axis in enumerate("xy")}
    for name in ("pocket_on_cage", "land_on_cage"):
        columns |= {f"{name}_{axis} [N]": getattr(history, name)[:, i] for i, axis in enumerate("xy")}
    for name, unit in {"pocket_force": "N", "inner_load": "N", "roller_slip": "1"}.items():
        columns |= {f"{name}_{j + 1} [{unit}]": x for j, x in enumerate(getattr(history, name).T)}
    document = {
        "pocket_force_distribution_N": rollers.pocket_force_distribution(history),
        "around": around,
        "orders": orders,
    }
    files = {
        "figure": (".png", bearing_figure(model, found, history, around, spectra, orders, title)),
        "data": (".csv", columns),
    }
    return Answer("", [circumference_table(around), *line_tables(spectra, orders)], document=document, files=files)


def sweep(
    case: Case,
    *,
    first: First = 2500.0,
    last: Last = 27500.0,
    count: Count = None,
    load: Load = None,
    draws: FromZero = 64,
    seed: Seed = 0,
    run: SweepOptions = SweepOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Sweep over speed from several initial states: labels, exponents, chaotic zones; slips, forces, losses of a bearing.

    Of a file with ranges, chances of chaos.

    Args:
        draws: Draws from values that the file knows within ranges only; 0 takes the best guesses as if they were known.
    """
    from .subject import read_case

    subject = read_case(case, load)
    if subject.unknowns and draws:
        return chances(subject, subject.range(first, last, count or 40), draws, seed, run, show)
    return swept(subject, subject.range(first, last, count or subject.usual(251, 13)), run, show)[1]


def swept(subject: Any, speeds: Any, run: SweepOptions, show: ShowOptions) -> tuple[Any, Answer]:
    """The data set of a sweep, and the answer about it."""
    import numpy as np

    from .. import analysis, show as shown
    from ..lanes import sweep as run_sweep

    with show.computing(f"sweep of {subject.name}") as progress:
        found = run_sweep(subject.model, speeds, **run.settings, progress=partial(progress, ""))
    require_some(found)
    zones, length, counts = zones_of(found), analysis.length(found), counted(found)
    short, beyond = int(np.sum(analysis.too_short(found))), int(np.sum(found["peak"].values > 1))
    if short:
        say(f"Warning: {short} lanes have no certain label{analysis.cure(found) or ': choose more --revolutions'}.")
    if beyond and not subject.reports_means:
        say(f"Warning: {beyond} lanes went beyond eps = 1, where the surfaces would overlap.")
    title = f"Lanes: {speeds.size} speeds x {found.sizes['start']} initial states, {length}"
    tables = [*zone_tables(subject, found, zones), shown.shares_table(title, "label", counts)]
    if subject.reports_means:
        names = [n for n in SHOWN if n == "exponent" or n in found]
        tables.insert(1, shown.quantities_table(f"Means over initial states of {subject.name}, {length}", found, names))
    failed, confirmed = analysis.outcomes(found), json.loads(found.attrs["confirmed"])
    document = {"speeds": speeds.size, "starts": found.sizes["start"], "labels": counts, "failed": failed}
    document |= {n: found.attrs[n] for n in ("discard", "revolutions", "horizon")} | {"too_short": short}
    document |= {"beyond_clearance": beyond, "error": float(np.nanmax(found["error"].values))}
    document["confirmed"] = [dict(zip(("lanes", "changed", "moved"), each, strict=True)) for each in confirmed]
    title = f"{subject.name}, {length}\n{subject.design_words}"
    files: dict[str, Any] = {"figure": (".png", shown.sweep_figure(found, zones, subject.published, title))}
    widest = max(getattr(zones, "zones", ()), key=lambda z: z.width_rpm or 0.0, default=None)
    if widest is not None and widest.width_rpm:
        low, high = shown.zone_span(widest)
        limits = low - 0.2 * widest.width_rpm, high + 0.2 * widest.width_rpm
        draw = lambda ax: shown.orbit_diagram(found, ax=ax, limits_rpm=limits)
        files["zoom"] = ("_zoom.png", drawn(f"{subject.name}, widest zone", draw))
    notes = [
        f"Failed lanes: {', '.join(f'{n} {how}' for how, n in failed.items()) or 'none'}",
        f"Error of a revolution: at most {document['error']:.0e} of the scale",
        *(
            f"Confirmed by steps at most 1/{2 << i} as long: {n} of {of} labels changed"
            for i, (of, n, *_) in enumerate(confirmed)
        ),
    ]
    return found, Answer(said_of(found, zones), tables, notes, document, subject, files | {"data": (".zarr", found)})


def require_some(found: Any, where: str = "") -> None:
    """**Raises:** `NoResult` if every lane of a data set failed."""
    from .._errors import NoResult
    from ..analysis import failed, outcomes

    if failed(found).all():
        count, how = found["label"].size, ", ".join(outcomes(found))
        raise NoResult(f"All {count} simulations{where} failed ({how}): try more steps (--steps).")


def counted(found: Any) -> dict[str, int]:
    """Number of lanes by label."""
    return dict(sorted(collections.Counter(found["label"].values.ravel().tolist()).items()))


def zones_of(found: Any) -> Any:
    """Zones of chaos, or stretches of speed with the same labels where no lane is called chaotic."""
    from .. import analysis

    return analysis.zones(found) if "strobe" in found else analysis.stretches(found)


def zone_tables(subject: Any, found: Any, zones: Any) -> list[Any]:
    """Tables of zones of chaos, or of stretches of speed."""
    from .. import show

    if "strobe" not in found:
        return [show.stretches_table(subject.name, zones)]
    span = float(found["rpm"][0]), float(found["rpm"][-1])
    table = show.zones_table(subject.name, zones, subject.published, span, subject.beside)
    details = show.zone_details(f"Chaotic zones of {subject.name} in detail", zones.zones)
    return [table, *details, *show.transient_tables(subject.name, zones)]


def said_of(found: Any, zones: Any) -> str:
    """The zones in a sentence."""
    from ..show import zone_words

    rpm = found["rpm"].values
    between = f"between {rpm[0]:.0f} and {rpm[-1]:.0f} rpm" if rpm.size > 1 else f"at {rpm[0]:.0f} rpm"
    if "strobe" not in found:
        chaotic = sum(zone.speeds for zone in zones if zone.chaotic)
        each = (f"{' or '.join(z.labels)} {z.low_rpm:.0f} to {z.high_rpm:.0f} rpm" for z in zones)
        said = f"The largest exponent is positive beyond doubt at {chaotic} of {rpm.size} speeds {between}; motion: "
        return said + ", ".join(each) + "."
    lasts = f" that lasts beyond {zones.horizon} revolutions" if zones.horizon else ""
    dies = f", and {len(zones.transient)} of chaos that dies out" if zones.transient else ""
    if not zones.zones:
        return f"No zone of chaos{lasts} {between}{dies}."
    count = f"{len(zones.zones)} zone{'s' if len(zones.zones) > 1 else ''}"
    return f"{count} of chaos{lasts} {between}: {', '.join(map(zone_words, zones.zones))}{dies}."


def chances(subject: Any, speeds: Any, draws: int, seed: int, run: RunOptions, show: ShowOptions) -> Answer:
    """Chances of chaos by speed, and bands of the edges, of a file with ranges."""
    from .. import show as shown
    from .._errors import NoResult

    with show.computing(f"draws of {subject.name}") as progress:
        found = draw(subject, speeds, draws, seed, run, progress)
    if found.failed.all():
        raise NoResult(f"All {found.failed.size} simulations failed: try more steps (--steps), or narrower ranges.")
    bands = [(band.name, band.rpm) for band in found.bands]
    figure = drawn(
        f"{subject.name}: {draws} draws from {len(subject.unknowns)} ranges",
        lambda ax: shown.chance_of_chaos(found.rpm, found.chance, found.interval, bands, ax),
    )
    columns = {"cage speed [rpm]": found.rpm, "shaft speed [rpm]": found.rpm * subject.shaft}
    columns |= {"chance of chaos": found.chance, "lower bound": found.interval[0], "upper bound": found.interval[1]}
    tables, files = (
        shown.chances_tables(subject.name, found, subject.beside),
        {"figure": (".png", figure), "data": (".csv", columns)},
    )
    said, notes = shown.chances_answer(found), shown.chances_notes(found)
    return Answer(said, tables, notes, shown.chances_document(found), subject.certain, files)


def draw(subject: Any, speeds: Any, draws: int, seed: int, run: RunOptions, progress: Any) -> Any:
    """The motions of draws from the ranges of a file over speed; revolutions above those of a chance are left out."""
    from ..design import REVOLUTIONS, ensemble
    from .options import blocks_of

    length = {name: min(getattr(run, name) or REVOLUTIONS, REVOLUTIONS) for name in ("discard", "revolutions")}
    length |= {"blocks": blocks_of(length["revolutions"]), "draws": draws, "seed": seed}
    told = partial(progress, "draws")
    return ensemble(subject.model, subject.unknowns, speeds, **length, method=run.method, progress=told)


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
    from ..show import strobe_columns
    from ..lanes import sweep as run_sweep
    from ..show import Column, rows_table, strobe_section
    from .subject import read_case

    subject = read_case(case)
    subject.require_orbits("poincare")
    at, stem = subject.speed(speed), f"_{speed:g}rpm"
    where = f"{subject.name}, {subject.at(at)}"
    with show.computing(f"poincare {subject.name}") as progress:
        settings = run.settings | {"keep": run.revolutions, "progress": partial(progress, "")}
        found = run_sweep(subject.model, np.array([at]), **settings)
    require_some(found, f" at {subject.at(at)}")
    starts = []
    for i in range(found.sizes["start"]):
        lane = found.isel(speed=0, start=i)
        row = {
            "start": i + 1,
            "exponent": float(lane["exponents"][0]),
            "standard_error": float(lane["standard_error"][0]),
        }
        row |= {name: str(lane[name].values) for name in ("label", "outcome")}
        starts.append(row | {name: lane["strobe"].sel(component=name).values for name in ("y_C", "vy_C")})
    exponent = Column("largest exponent per revolution", (), key="exponent", errors="standard_error")
    table = rows_table(
        f"Strobe section of {where}, {length(found)}",
        starts,
        [Column("start", ()), Column("label", ()), exponent],
        "starts",
    )
    names = [f"start {row['start']}: {row['label']}" for row in starts]
    figure = drawn(where, lambda ax: strobe_section(found["strobe"].values[0], ax, names=names), 6.5, 5.4)
    files = {"figure": (f"{stem}.png", figure), "data": (f"{stem}.csv", strobe_columns(found))}
    said = f"At {subject.at(at)} the motion is {', '.join(dict.fromkeys(row['label'] for row in starts))}."
    return Answer(said, [table], [], subject.both(at), subject, files)


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

    from .. import show as shown
    from .._errors import InputError
    from ..analysis import failed
    from ..lanes import sweep as run_sweep
    from .subject import RPM, read_case

    one, two = read_case(case), read_case(other)
    if one.reports_means != two.reports_means:
        kind = one.usual("a cage", "a bearing with its rollers")
        raise InputError(f"Case '{other}' must be {kind}, as the first one is: two of a kind are compared.")
    pair = [one, dataclasses.replace(two, name=f"{two.name}_second") if two.name == one.name else two]
    names, times = [each.name for each in pair], 1.0 if one.shaft is None else one.shaft / two.shaft
    even, wanted = one.range(first, last, count or one.usual(126, 13)), [one.speed(x, "at") for x in _speeds(at)]
    if outside := [x for x in wanted if not even[0] <= x <= even[-1]]:
        raise InputError(
            f"Option --at must lie between --first and --last, {even[0] * RPM:g} to {even[-1] * RPM:g} rpm, but "
            f"{outside[0] * RPM:g} rpm was given."
        )
    two.speed(float(even[-1]) * times * RPM, "last")
    new = [x for x in wanted if np.min(np.abs(even - x)) > 1e-6 * x]
    speeds = np.sort(np.concatenate([even, new]))
    places = [int(np.argmin(np.abs(speeds - x))) for x in wanted]
    places = places or np.unique(np.linspace(0, speeds.size - 1, CHOSEN).round().astype(int)).tolist()
    found = []
    with show.computing(f"compare {names[0]}") as progress:
        for each, factor in zip(pair, (1.0, times), strict=True):
            settings = run.settings | {"progress": partial(progress, each.name)}
            found.append(_measured(each.model, run_sweep(each.model, speeds * factor, **settings)))
    quantities = [n for n in COMPARED if n == "exponent" or n in found[0]]
    designs, rows, said, tables = {}, [{"measure": n.replace("_", " ")} for n in quantities], [], []
    for each, data in zip(pair, found, strict=True):
        require_some(data, f" of {each.name}")
        zones, means = zones_of(data), [shown.mean_over_starts(data, n) for n in quantities]
        designs[each.name] = {
            "labels": data["label"].values,
            "failed": int(failed(data).sum()),
            **each.both(data["rpm"].values / RPM),
        }
        for name, row, (mean, error) in zip(quantities, rows, means, strict=True):
            designs[each.name] |= {name: mean, f"{name}_error": error}
            row[each.name] = float(np.nanmean(mean))
        said.append(f"{each.name}: {said_of(data, zones)}")
        tables += [dataclasses.replace(table, key="") for table in zone_tables(each, data, zones)]
    overall = shown.rows_table(
        "Means over speed, in SI units", rows, [shown.Column(n, ()) for n in ("measure", *names)], "means"
    )
    chosen = [data.isel(speed=places) for data in found]
    tables = [overall, shown.differences_table(names, [each.model for each in pair]), *tables]
    tables += [shown.quantity_beside(n, names, chosen) for n in quantities]
    files = {
        "figure": (f"_{names[1]}.png", shown.sweeps_beside(names, found, [zones_of(each) for each in found])),
        "measures": (f"_{names[1]}_measures.png", shown.quantities_beside(names, found, quantities[1:])),
    }
    note = "Means over initial states, with standard errors; * where both differ by more than two of them."
    return Answer(" ".join(said), tables, [note], {"cases": names, "designs": designs}, one, files)


def _speeds(text: str) -> list[float]:
    """Speeds [rpm] with commas between them, each of which may say whose it is."""
    from .._errors import ArgumentError
    from .options import read_quantity

    try:
        return [read_quantity(part.strip(), "rpm") for part in text.split(",") if part.strip()]
    except ValueError as error:
        raise ArgumentError("at", said=str(error)) from error


def _measured(model: Any, found: Any) -> Any:
    """The data set with the size of the orbit and the loads of the land, where the model does not report quantities."""
    if model.quantities:
        return found
    from ..design import land_loads, motions

    loads, size = land_loads(model, found), motions(model, found).size
    about = {
        "orbit_size": (("speed", "start"), size, "m"),
        "peak_land_force": (("speed",), loads["peak land force"], "N"),
    }
    about["wear_load"] = ("speed",), loads["wear load"], "N m/s"
    words = lambda name, unit: {"units": unit, "long_name": name.replace("_", " ")}
    return found.assign({name: (dims, x, words(name, unit)) for name, (dims, x, unit) in about.items()})


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
        rate: Speed gained per second [rpm/s], in the mean over the ramp, of the speed that bare numbers are.
        windows: Parts into which each ramp is cut, in each of which the motion is read.
        discard: Revolutions at the first speed before the ramp begins.
    """
    from ..lanes import apart, ramp_up_down, stretches_apart
    from ..show import Column, Table, head_of, ramp_figure
    from .subject import RPM, read_case

    subject = read_case(case, load)
    low, high = subject.range(first, last, 2)
    given = {
        "windows": windows or subject.usual(100, 24),
        "settle": subject.usual(100, 10) if discard is None else discard,
    }
    with show.computing(f"runup {subject.name}"):
        found = ramp_up_down(subject.model, low, high, subject.rate(rate), **given, method=steps.method)
    names, differs, spans = [n for n in RAMPED if n in found], apart(found), stretches_apart(found)
    up, down = found.sel(way="up"), found.sel(way="down")
    rows = slice(0, found.sizes["window"], -(-found.sizes["window"] // ROWS))
    columns = [Column("speed [rpm]", up["rpm"].values[rows].tolist(), digits=0)]
    for name in names:
        unit = up[name].attrs["units"]
        columns += [
            Column(f"{head_of(name, unit)} {way}", found[name].sel(way=way).values[rows].tolist(), unit)
            for way in ("up", "down")
        ]
    columns.append(Column("hysteresis", ["differs" if x else "" for x in differs[rows]]))
    said = "Up and down are alike within their scatter: no hysteresis is seen at this rate."
    if spans:
        each = ", ".join(f"{a:.0f} to {b:.0f} rpm" for a, b in spans)
        said = f"Up and down differ: {each}. A slower ramp tells whether the cage only lags behind."
    length = f"{found.attrs['revolutions']} revolutions each way in {found.attrs['seconds']:.3g} s"
    title = f"Run-up and run-down of {subject.name}, {rate:g} rpm/s, {length}"
    document = {
        "rate_rpm_per_s": rate,
        "hysteresis_rpm": spans,
        "ramp_seconds": found.attrs["seconds"],
        "revolutions": found.attrs["revolutions"],
    }
    data = {
        f"{key.removesuffix('_rpm').replace('_', ' ')} [rpm]": x
        for key, x in subject.both(up["rpm"].values / RPM).items()
    }
    for way, part in (("up", up), ("down", down)):
        document[way] = {"speed_rpm": part["rpm"].values, **{str(n): x.values for n, x in part.data_vars.items()}}
        data |= {f"{n} {way} [{x.attrs['units']}]": x.values for n, x in part.data_vars.items()}
    files = {
        "figure": (".png", ramp_figure(up, down, names, spans, title)),
        "data": (".csv", data | {"differs": differs}),
    }
    return Answer(said, [Table(title, columns)], [], document, subject, files)


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
    given, done = read_vary(vary, subject), []
    sizes = [float(x.size) for x in given.values() if isinstance(x, np.ndarray)]
    if np.prod([max(sample, 1.0), *sizes]) > MOST_POINTS:
        raise InputError(f"Options --vary and --sample must make at most {MOST_POINTS} points to run lanes at.")
    about = {"samples": sample, "seed": seed, "starts": starts, "strobe": strobe, "lanes": chunk, "shard": shard}
    about |= {"executor": executor, "scheduler": scheduler, "workers": workers}
    settings = {n: x for n, x in (run.settings | {"exponents": exponents}).items() if x is not None}
    with show.computing(f"study {subject.name}", ADVICE) as bar:

        def progress(so_far: int, total: int) -> None:
            done.append(so_far)  # the first number is of those that were stored before
            bar("lanes", so_far, total)

        try:
            stored = lanes.study(subject.model, given, store=path, **about, progress=progress, **settings)
        except ImportError as error:  # of an extra
            raise InputError(str(error)) from error
        try:
            with stored:
                names = [str(name) for name, x in stored.data_vars.items() if x.dims == stored["label"].dims]
                found = stored[names].load()
        except ValueError as error:  # a chunk that another shard has written
            raise NoResult(f"The store '{path}' is damaged: {AGAIN}.") from error
    dims, counts = found["label"].dims, counted(found)
    left = counts.pop("pending", 0)
    if left:
        say(f"Warning: {left} lanes are left for the other shards.")
    known = found.stack(lane=dims)
    require_some(known.isel(lane=np.flatnonzero(known["label"].values != "pending")))
    spread = lambda x: [float(v) for v in np.nanpercentile(x, (0, 50, 100))] if np.isfinite(x).any() else [None] * 3
    document = {
        "axes": dict(zip(dims, found["label"].shape, strict=True)),
        "lanes": found["label"].size,
        "labels": counts,
    }
    document |= {"stored": found["label"].size - left, "stored_before": found["label"].size - left - done[-1] + done[0]}
    document["least_median_most"] = {
        q.name: spread(found[q.name].values) for q in subject.model.quantities if q.name in found
    }
    shape = " x ".join(f"{n} {axis}" for axis, n in document["axes"].items())
    said = f"{document['stored']} of {document['lanes']} lanes are stored; {max(counts, key=counts.__getitem__)} is most common."
    table, notes = shares_table(f"Lanes: {shape}", "label", counts), [f"Open it: jaxcage.open_study({str(path)!r})"]
    return Answer(said, [table], notes, document, subject, stored={"store": str(path)})


def _checked(subject: Any, path: Path) -> Answer:
    """The chunks of a store compared with their checksums."""
    from .._errors import InputError
    from ..lanes import check_study

    try:
        state = check_study(path)
    except FileNotFoundError as error:
        raise InputError(str(error)) from error
    damaged = {str(chunk): what for chunk, what in state.damaged.items()}
    document = {"store": str(path), "chunks": state.chunks, "finished": state.finished, "damaged": damaged}
    said, *notes = str(state).splitlines()
    failure = f"The store '{path}' is damaged: {AGAIN}." if damaged else ""
    return Answer(said, [], notes, document, subject, failure=failure)
