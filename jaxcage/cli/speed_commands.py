"""Commands that run the model: at one speed, over speed, up and down, and over any parameters."""

import collections
import dataclasses
import json
import zlib
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError, NoResult
from . import options as o
from .answer import Answer
from .progress import interrupted, report, report_lanes, say
from .subject import RPM, Subject
from .values import read_vary


TOLD = ("largest_eps", "whirl_ratio", "drag_power", "cage_slip", "pocket_force_max_N", "friction_power_W")
"""Quantities in the answer about one run, of those that the model reports."""
SHOWN = ("cage_slip", "pocket_force_mean_sum_N", "friction_power_W", "eccentricity_mean")
"""Variables in the table over speed, of those that a data set has."""
COMPARED = (
    "exponent orbit_size peak_land_force wear_load cage_slip pocket_impulse_N_s land_impulse_N_s pocket_wear_mm3_per_h "
    "friction_power_W"
).split()
"""Variables that are compared, of those that a data set has."""
RAMPED = ("size", "eccentricity", "cage_slip", "friction_power_W")
"""Variables of a ramp in its figure, of those that a data set has."""


def simulate(
    subject: o.Case,
    *,
    speed: o.Speed,
    load: o.Load = None,
    run: o.RunOptions = o.RunOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Time history and forces at one speed; slips of a bearing with its rollers.

    Of 20 revolutions if --revolutions is left out. The start-up before them is left out: 50 revolutions of a cage, 20
    of a bearing with its rollers, or as many as --discard says.
    """
    model, at, method = subject.model, subject.speed(speed), run.method
    most = subject.usual(512, 128)
    steps = getattr(method, "steps", most)  # of equal steps the samples must divide the number
    started = subject.usual(50, 20) if run.discard is None else run.discard
    length: dict[str, Any] = {"revolutions": run.revolutions or 20, "discard": started}
    samples = max(n for n in range(1, min(most, steps) + 1) if steps % n == 0)
    found = jc.simulate(model, at, **length, samples=samples, method=method)
    where = subject.at(at)
    if found.outcome not in ("successful", "inaccurate"):
        raise NoResult(f"The simulation at {where} failed ({found.outcome}): try more --steps, or another --solver.")
    title, measures = f"{subject.name}, {where}", jc.measures(model, found)
    document = subject.both(at) | length | {"outcome": found.outcome, "error": found.error}
    document["measures"] = {name: each.value for name, each in measures.items()}
    notes = [f"Error of a revolution: at most {found.error:.0e} of the scale ({found.outcome})"]
    if (rollers := jc.show.rollers_of(model, found)) is None:
        columns = jc.show.trajectory_columns(found, jc.analysis.cage_forces(model, found))
    else:
        shares = jc.analysis.pocket_force_distribution(rollers.history)
        around = {name: x.values for name, x in rollers.around.variables.items()}
        document |= {"around": around, "orders": rollers.orders, "force_shares": shares}
        columns = jc.show.roller_columns(rollers.history)
        shaft, slip = float(document["shaft_speed_rpm"]), measures.value("cage_slip")
        notes += [*jc.show.minimum_load_notes(model.bearing, float(model.load), shaft, slip), *_wear_notes(subject)]
    told = [jc.show.quantity_words(measures[name]) for name in TOLD if name in measures]
    files = {"figure": jc.show.run_figure(model, found, rollers, title), "data": columns}
    tables = jc.show.run_tables(title, measures, rollers)
    return Answer(f"At {where}: {', '.join(told)}.", tables, notes, document, files, part=f"_{speed:g}rpm")


def _wear_notes(subject: Subject) -> list[str]:
    """A note on the law of wear of a bearing with its rollers."""
    if not subject.with_rollers:
        return []
    k, hardness = float(subject.model.wear.wear_coefficient), float(subject.model.wear.hardness) / 1e9
    said = "wear is proportional to K, which is known to a decade or two at best"
    return [f"Wear by Archard's law with K = {k:g} and a hardness of {hardness:g} GPa: {said}"]


def sweep(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    load: o.Load = None,
    draws: o.Draws = 64,
    run: o.SweepOptions = o.SweepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Sweep over speed from several initial states: labels, exponents, chaotic zones; slips and losses of a bearing.

    A file with ranges gives chances of chaos. After Ctrl-C the answer is that of the finished speeds; a bearing with
    its rollers keeps them in --out, and the same command goes on from there.
    """
    if subject.unknowns and draws:
        return chances(subject, subject.range(over, 40), draws, run)
    return swept(subject, subject.range(over, subject.usual(251, 13)), run, show.out)[1]


def chances(subject: Subject, speeds: Any, draws: int, run: o.RunOptions = o.RunOptions()) -> Answer:
    """Answer on the probability that a cage with unknown values is calm at all speeds [rad/s], and on what would decide
    it; the first of its tables is the one by speed."""
    d, told = jc.design, {"draws": draws, "progress": partial(report_lanes, "simulations")}
    found = d.ensemble(subject.model, subject.unknowns, speeds, **told, **run.settings)
    if found.failed.all():
        raise NoResult(f"All {found.failed.size} simulations failed: try more steps (--steps), or narrower ranges.")
    chance, *outcomes = d.range_chance(found, found.rpm[0], found.rpm[-1])
    draws = len(found.place)
    rows, over = d.indices(found, *outcomes), subject.over(*found.speed[[0, -1]])
    columns = subject.speed_columns(found.speed)
    columns |= dict(zip(("chance of chaos", "lower", "upper"), found.chance_of_chaos.T, strict=True))
    title = f"{subject.name}: chaotic share of {draws} draws, at each speed alone"
    figure = jc.show.drawn(partial(jc.show.chance_of_chaos, found), title=title)
    tables = [jc.show.chances_table(subject.name, found, subject.beside)]
    tables += [jc.show.indices_table(rows)] if rows and rows[0].telling else []
    by_speed = [{"rpm": rpm, **_record(each)} for rpm, each in zip(found.rpm, found.chances, strict=True)]
    document = _record(chance) | {"by_speed": by_speed}
    notes, files = [jc.show.indices_note(rows), *jc.show.chances_notes(found)], {"figure": figure, "data": columns}
    said, details = jc.show.range_sentence(over, chance), jc.show.unknowns_notes(found)
    return Answer(said, tables, notes, document, files, details, by_ranges=True)


def _record(chance: Any) -> dict[str, Any]:
    """A chance for a document."""
    numbers = {"calm_share": chance.share, "calm_interval": chance.interval}
    return {"verdict": chance.state, **numbers, "chaotic_draws": chance.chaotic, "known_draws": chance.known}


def swept(subject: Subject, speeds: Any, run: o.RunOptions, out: str | None = None) -> tuple[Any, Answer]:
    """The data set of a sweep over speeds [rad/s], and the answer about it. With a folder `out` for finished lanes of a
    bearing with its rollers the sweep can be stopped."""
    kept, settings = None, jc.lanes.Run.of(subject.model, **run.settings)
    if subject.with_rollers and out is not None:
        given = jc.files.configuration(subject.model), speeds.tolist(), run.settings, jc.__version__
        kept = Path(out) / f"sweep_{subject.name}_unfinished_{zlib.crc32(repr(given).encode()):08x}.zarr"
    stage = f"lanes of {settings.discard + settings.revolutions} revolutions"
    told = partial(report if out is None else report_lanes, stage)
    found = jc.sweep(subject.model, speeds, **run.settings, progress=told, store=kept)
    jc.show.require_some(found)
    zones, title = zones_of(found), f"{subject.name}, {jc.analysis.length(found)}"
    if short := int(np.sum(jc.analysis.too_short(found))):
        cure = jc.analysis.cure(found) or ": choose more --revolutions"
        say(f"Warning: {jc.show.counted(short, 'lane')} without a certain label{cure}.")
    if beyond := int(np.sum(found["peak"].values > 1)) * (not subject.with_rollers):
        say(f"Warning: {jc.show.counted(beyond, 'lane')} went beyond eps = 1, where the surfaces would overlap.")
    tables = jc.show.motion_tables(subject.name, zones, subject.beside)
    if names := [n for n in SHOWN if n in found]:
        tables.append(jc.show.quantities_table(f"Means over initial states, {title}", found, [*names, "exponent"]))
    document = {name: found.attrs[name] for name in ("discard", "revolutions", "horizon")}
    document |= {"speeds": found.sizes["speed"], "initial_states": found.sizes["initial_state"]}
    document |= {"labels": counted(found), "failed": jc.analysis.outcomes(found)}
    document |= {"confirmed": json.loads(found.attrs["confirmed"]), "too_short": short}
    document |= {"error": float(np.nanmax(found["error"].values))}
    files = {"figure": jc.show.sweep_figure(found, zones, subject.published, title), "data": found}
    said, notes = said_of(subject, found, zones), zone_notes(subject, zones)
    return found, Answer(said, tables, notes, document, files, details=[jc.summary(found)], kept=kept)


def counted(found: Any) -> dict[str, int]:
    """Number of lanes by label."""
    return dict(sorted(collections.Counter(found["label"].values.ravel().tolist()).items()))


def zones_of(found: Any) -> Any:
    """Zones of chaos, or stretches of speed with the same labels where no lane is called chaotic."""
    return jc.zones(found) if "strobe" in found else jc.stretches(found)


def said_of(subject: Subject, found: Any, zones: Any) -> str:
    """The zones in a sentence."""
    whose, ratio = subject.beside or (subject.own, 1.0)
    rpm = ratio * found["rpm"].values
    between = f"between {rpm[0]:.0f} and {rpm[-1]:.0f} rpm" if rpm.size > 1 else f"at {rpm[0]:.0f} rpm"
    between = f"{between} of the {whose}"
    if "strobe" not in found:
        each = (f"{jc.show.motion_words(z.labels)} {z.low_rpm:.0f} to {z.high_rpm:.0f} rpm" for z in zones)
        count = f"at {rpm.size} speeds " if rpm.size > 1 else ""
        return f"Motion of the cage {count}{between}: {', '.join(each)}."
    each = ", ".join(jc.show.zone_words(zone, subject.beside) for zone in zones.zones)
    lasts = f", in which chaos lasts beyond {zones.horizon} revolutions" if zones.horizon else ""
    count = jc.show.counted(len(zones.zones), "chaotic zone") if zones.zones else "No chaotic zone"
    return f"{count} {between}{each and f': {each}'}{lasts if each else ''}."


def zone_notes(subject: Subject, zones: Any) -> list[str]:
    """The ranges of chaos that dies out, in a sentence; of a bearing with its rollers what its exponent means."""
    if subject.with_rollers:
        chaotic, speeds = (sum(zone.speeds for zone in some) for some in ([z for z in zones if z.chaotic], zones))
        said = f"The largest exponent of the whole bearing is positive beyond doubt at {chaotic} of {speeds} speeds"
        return [f"{said}: that is the rollers in their pockets, and no rattle of the cage"]
    each = ", ".join(jc.show.zone_words(zone, subject.beside) for zone in zones.transient)
    return [f"Transient chaos, with a mean life below {zones.horizon} revolutions: {each}"] if each else []


def poincare(
    subject: o.Case,
    *,
    speed: o.Speed,
    run: o.RunOptions = o.RunOptions(revolutions=1000),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Strobe section at one speed, from all initial states."""
    at = subject.speed(speed)
    settings: dict[str, Any] = run.settings | {"keep": run.revolutions, "progress": partial(report, "sweep")}
    found = jc.sweep(subject.model, np.array([at]), **settings)
    jc.show.require_some(found, f" at {subject.at(at)}")
    lanes, names = found.isel(speed=0, exponent=0), ("label", "outcome", "exponents", "standard_error")
    each = range(found.sizes["initial_state"])
    rows = [{"initial_state": i + 1} | {name: lanes[name].values[i].item() for name in names} for i in each]
    exponent = jc.show.Column("largest exponent per revolution", "exponents", error="standard_error")
    title = f"{subject.name}, {subject.at(at)}"
    labels = [f"initial state {row['initial_state']}: {row['label']}" for row in rows]
    draw = partial(jc.show.strobe_section, found["strobe"].values[0], names=labels)
    files = {"figure": jc.show.drawn(draw, 6.5, 5.4, title), "data": jc.show.strobe_columns(found)}
    title = f"Strobe section of {title}, {jc.analysis.length(found)}"
    tables = [jc.show.table(title, rows, ["initial_state", "label", exponent], "initial_states")]
    said = f"At {subject.at(at)} the motion is {' or '.join(counted(found))}."
    return Answer(said, tables, [], subject.both(at), files, part=f"_{speed:g}rpm")


def compare(
    subject: o.Case,
    other: o.Other,
    *,
    over: o.Range = o.Range(),
    run: o.SweepOptions = o.SweepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Two designs side by side at the same speeds of the shaft: differences, labels, zones, forces, wear."""
    second = dataclasses.replace(other, name=f"{other.name}_second") if other.name == subject.name else other
    pair, times = (subject, second), 1.0 if subject.shaft is None else subject.shaft / (second.shaft or 1.0)
    names, speeds = [each.name for each in pair], subject.range(over, subject.usual(126, 13))
    second.rpm(speeds[-1] * times * RPM, "last", second.own)
    found, said, tables, designs = [], [], [], {}
    for each, factor in zip(pair, (1.0, times), strict=True):
        data = jc.sweep(each.model, speeds * factor, **run.settings, progress=partial(report, each.name))
        jc.show.require_some(data, f" of {each.name}")
        found.append(data := _measured(each, data))
        own = {n: jc.show.mean_over_starts(data, n) for n in COMPARED if n == "exponent" or n in data}
        designs[each.name] = each.both(data["speed"].values) | {n: mean for n, (mean, _) in own.items()}
        designs[each.name] |= {f"{n}_error": error for n, (_, error) in own.items()}
        said.append(f"{each.name}: {said_of(each, data, zones_of(data))}")
        tables += jc.show.motion_tables(each.name, zones_of(data), each.beside)
    compared = [n for n in COMPARED if n in designs[names[0]]]
    tables = [
        jc.show.means_table(names, found, compared),
        jc.show.differences_table(names, [each.model for each in pair]),
        *(dataclasses.replace(table, key="") for table in tables),
    ]
    files = {"figure": jc.show.quantities_beside(names, found, compared, title=" and ".join(names))}
    first, others = ([*each.about(False)[1], *_wear_notes(each)] for each in pair)
    notes = [*_wear_notes(subject), *(f"{second.name}: {note}" for note in others if note not in first)]
    return Answer(" ".join(said), tables, notes, {"cases": names, "designs": designs}, files, part=f"_{names[1]}")


def _measured(subject: Subject, found: Any) -> Any:
    """The data set with the size of the orbit and the loads of the land, where the model does not report means."""
    if subject.with_rollers:
        return found
    loads, dims = jc.analysis.land_loads(subject.model, found), ("speed", "initial_state")
    about = {"orbit_size": (jc.analysis.motions(subject.model, found)[0], "m")}
    about |= {"peak_land_force": (loads["peak land force"], "N"), "wear_load": (loads["wear load"], "N m/s")}
    return found.assign({name: (dims[: x.ndim], x, {"units": unit}) for name, (x, unit) in about.items()})


def runup(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    rate: Annotated[float, o.number("be a rate above 0 rpm/s", lambda x: x > 0)] = 5000.0,
    discard: o.OptionalZero = None,
    load: o.Load = None,
    steps: o.StepOptions = o.StepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Run-up and run-down by equal steps of speed in every revolution: where the motion differs between both.

    Args:
        rate: Speed gained per second [rpm/s], in the mean over the ramp, of the speed that bare numbers are.
        discard: Revolutions at the first speed before the ramp begins.
    """
    settle = subject.usual(100, 10) if discard is None else discard
    given = {"windows": subject.usual(100, 24), "settle": settle, "method": steps.method}
    found = jc.lanes.ramp_up_down(subject.model, *subject.ends(over), subject.rate(rate), **given)
    spans, ways = jc.lanes.stretches_apart(found), {way: found.sel(way=way) for way in ("up", "down")}
    data = subject.speed_columns(ways["up"]["rpm"].values / RPM)
    for name, x in found.data_vars.items():
        data |= {f"{name} {way} [{x.attrs['units']}]": x.sel(way=way).values for way in ways}
    rows = [{"from": low, "to": high} for low, high in spans]
    columns = [jc.show.Column(f"{end} [rpm]", end, digits=0) for end in ("from", "to")]
    title = f"Run-up and run-down of {subject.name}, {rate:g} rpm/s, {found.attrs['revolutions']} revolutions each"
    each = ", ".join(f"{a:.0f} to {b:.0f} rpm" for a, b in spans)
    said = f"Up and down differ: {each}. A slower ramp tells whether the cage only lags behind."
    said = said if spans else "Up and down are alike within their scatter: no hysteresis is seen at this rate."
    document = {"rate_rpm_per_s": rate, "ramp_seconds": found.attrs["seconds"]}
    document |= {way: {n: x[n].values for n in ("rpm", *x.data_vars)} for way, x in ways.items()}
    names = [n for n in RAMPED if n in found]
    figure = jc.show.quantities_beside(("run-up", "run-down"), [*ways.values()], names, spans, title)
    files = {"figure": figure, "data": data | {"differs": jc.lanes.apart(found)}}
    tables = [jc.show.table(f"{title}: where they differ", rows, columns, "hysteresis")]
    return Answer(said, tables, [], document, files)


def study(
    subject: o.Case,
    *,
    vary: Annotated[o.Texts, tyro.conf.arg(metavar="NAME=VALUES")] = (),
    sample: o.FromZero = 0,
    seed: o.Seed = 0,
    initial_states: o.OptionalCount = None,
    shard: o.Shard = None,
    run: o.RunOptions = o.RunOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """A sweep over any grid or sample of parameters, stored as it goes; the same command goes on where one stopped.

    Args:
        vary: Once for each parameter, `speed` among them. A grid: speed=4000rpm:27500rpm:100, or single values:
            oil=32,56,78 (ISO VG grades). Sampled: guidance_gap=0.3mm:0.6mm, or in a tolerance: eccentricity=20um±3um.
        sample: Number of samples, best a power of 2.
        initial_states: Initial states at each point; all of the model's own if left out.
        shard: Part of the work, e.g. 2/4: every fourth chunk from the second on. All parts write to the same store.
    """
    path = Path(show.out) / f"study_{subject.name}.zarr"
    given, done = read_vary(vary, subject), []
    settings: dict[str, Any] = {"samples": sample, "seed": seed, "initial_states": initial_states}
    settings |= {"shard": shard or (1, 1)} | run.settings

    def stored_so_far(lanes: int, total: int) -> None:
        done.append(lanes)
        report_lanes("lanes", lanes, total)

    try:
        with jc.study(subject.model, given, store=path, progress=stored_so_far, **settings) as stored:
            names = [str(name) for name, x in stored.data_vars.items() if x.dims == stored["label"].dims]
            found = stored[names].load()
    except ValueError as error:  # a chunk that another shard has written
        if isinstance(error, InputError):
            raise
        again = "the same command without --shard computes again what is damaged and leaves the rest"
        raise NoResult(f"The store '{path}' is damaged: {again}.") from error
    dims, counts, size = found["label"].dims, counted(found), found["label"].size
    if left := counts.pop("pending", 0):
        if not counts and interrupted():
            raise KeyboardInterrupt
        if not counts:
            part = "/".join(map(str, settings["shard"]))
            raise InputError(f"Option --shard must be a part with lanes, but {part} has none: name fewer parts.")
        say(f"Warning: {jc.show.counted(left, 'lane')} left{'' if interrupted() else ' for the other shards'}.")
    lanes = found.stack(lane=dims)
    jc.show.require_some(lanes.isel(lane=np.flatnonzero(lanes["label"].values != "pending")))
    document = {"axes": dict(zip(dims, found["label"].shape, strict=True)), "lanes": size, "labels": counts}
    document |= {"stored": size - left, "stored_before": size - left - done[-1] + done[0]}
    shape = " x ".join(f"{n} {axis}" for axis, n in document["axes"].items())
    said = f"{size - left} of {size} lanes are stored; {max(counts, key=counts.__getitem__)} is most common."
    tables, opened = [jc.show.shares_table(f"Lanes: {shape}", "label", counts)], f"jaxcage.open_study({str(path)!r})"
    return Answer(said, tables, [f"Open it: {opened}"], document, {"store": path})
