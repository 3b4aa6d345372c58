"""Commands on periodic orbits and their stability boundaries: zones, bifurcations, gradients, maps."""

import dataclasses
from functools import partial
from typing import Any

import numpy as np

import jaxcage as jc

from .._errors import ArgumentError, InputError, NoResult, parameters_like
from . import options as o
from .answer import Answer
from .progress import report
from .speed_commands import chances, counted, said_of, swept, zone_notes
from .subject import RPM, Subject


def zones(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    load: o.Load = None,
    draws: o.Draws = 64,
    quick: o.Quick = False,
    run: o.SweepOptions = o.SweepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Chaotic zones beside the unstable ranges of the synchronous orbit, with exact edges and their gradients.

    For a bearing with its rollers: ranges of speed with the same motion. For a file with ranges: chances of chaos.
    """
    if subject.unknowns and draws:
        return chances(subject, subject.range(over, 40), draws, run)
    found, answer = swept(subject, subject.range(over, subject.usual(251, 13)), run)
    if subject.with_rollers:
        return answer
    ends = float(found["speed"][0]), float(found["speed"][-1])
    orbits = jc.orbits.synchronous_orbits(subject.model, *ends, settled=found, method=run.method, progress=report)
    return explained(subject, found, orbits, answer, quick, run.method)[0]


def explained(
    subject: Subject, found: Any, orbits: Any, answer: Answer, quick: bool, method: Any
) -> tuple[Answer, dict[str, Any]]:
    """Answer on a sweep with the mechanisms of its zones and unstable ranges; sensitivities of exact edges."""
    name, beside, loss = subject.name, subject.beside, jc.unstable_ranges(orbits)
    known = jc.orbits.explain(jc.zones(found), orbits)
    slopes = {} if quick else jc.show.edge_slopes(subject.model, loss, known, method)
    tables = [
        *jc.show.motion_tables(name, known.zones, beside),
        jc.show.unstable_table(name, loss, beside),
        *([jc.show.elasticities_table(name, slopes, beside)] if slopes else []),
    ]
    notes = [*zone_notes(subject, known.zones), *jc.show.source_notes(known), *jc.show.unsettled_notes(orbits)]
    said = said_of(subject, found, known.zones)
    return dataclasses.replace(answer, sentence=said, tables=tables, notes=notes), slopes


def _searched(subject: Subject, over: o.Range, discard: int | None, method: Any, purpose: str = "") -> tuple[Any, Any]:
    """Synchronous orbits over speed, and their unstable ranges. **Raises:** `NoResult` if there are none, or no edges
    although the `purpose` needs some."""
    length: dict[str, Any] = {name: x for name, x in (("count", over.count), ("discard", discard)) if x is not None}
    told, ends = {"method": method, "progress": report}, subject.ends(over)
    found = jc.orbits.synchronous_orbits(subject.model, *ends, **length, **told)
    between, loss = f"within {subject.over(*ends)}", jc.unstable_ranges(found)
    if not found.branches:
        jc.show.require_some(found.sweep, f" {between}")
        what = f"No simulation {between} settled on a synchronous orbit"
        raise NoResult(f"{what}: try more --discard, or a larger --count.")
    if purpose and not loss.edges:
        what = f"No unstable range of the synchronous orbit begins or ends {between}"
        raise NoResult(f"{what}: there is no edge to {purpose}.")
    return found, loss


def bifurcations(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    discard: o.OptionalZero = None,
    steps: o.StepOptions = o.StepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Synchronous orbits over speed: their stable ranges, bifurcations and unstable ranges.

    Args:
        discard: Revolutions of the simulations that are discarded at the beginning.
    """
    return of_orbits(subject, *_searched(subject, over, discard, steps.method))


def of_orbits(subject: Subject, found: Any, loss: Any) -> Answer:
    """Answer on synchronous orbits over speed, at least one of which was found."""
    name, beside = subject.name, subject.beside
    main = found.branches[0 if loss.principal is None else loss.principal.branch]
    orbits = partial(jc.show.orbit_diagram_with_branches, found.sweep, found.branches)
    files = {
        "figure": jc.show.drawn(orbits, 10.0, 6.0, f"{name}: synchronous orbits"),
        "multipliers": jc.show.drawn(partial(jc.show.multiplier_circle, main), 7.0, 6.0, f"{name}: multipliers"),
        "data": jc.show.branch_columns(found.branches),
    }
    tables = [
        jc.show.unstable_table(name, loss, beside),
        jc.show.stretch_table(name, found, beside),
        jc.show.edge_table(found, loss, beside),
    ]
    notes = [*jc.show.coexisting_notes(loss), *jc.show.unsettled_notes(found)]
    if further := len(found.points) - len(found.edges):
        notes.append(f"Further bifurcations, on unstable parts: {further} (listed by --json)")
    if found.missed:
        notes.append(f"Settled orbits that are on no branch: {found.missed}")
    without, count = ", ".join(jc.show.zone_words(zone, beside) for zone in loss.zones), len(found.stretches)
    said = f"A synchronous orbit is stable at every speed{f' except {without}' if without else ''}"
    said += f" (ranges narrower than {loss.close_below_rpm:.0f} rpm do not count)."
    said = said if count else "No synchronous orbit that was found is stable."
    said += f" It is in {count} pieces; at the end of one the cage goes over to another motion." if count > 1 else ""
    document = {"points": [jc.show.point_record(p, found) for p in found.points], "missed": found.missed}
    return Answer(said, tables, notes, document, files)


def gradient(
    subject: o.Case,
    *,
    over: o.Range = o.Range(),
    lasting: bool = False,
    zone: o.FromZero = 0,
    by: tuple[str, ...] = (),
    designs: o.FromTwo = 64,
    means: o.MeanOptions = o.MeanOptions(),
    steps: o.StepOptions = o.StepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Derivatives by every parameter: of the edges and widths of unstable ranges of the synchronous orbit.

    With --lasting: of zones of lasting chaos. For a bearing with its rollers: of means at one --speed, such as slip,
    wear and power. Both have standard errors.

    Args:
        lasting: Differentiate zones of lasting chaos, by survival regression (minutes).
        zone: With --lasting: number of the zone, as `jaxcage sweep` counts them; 0 takes all.
        by: With --lasting or --speed: parameters; those joined by + change together.
        designs: With --lasting or --speed: number of designs around this one from which slopes are estimated.
    """
    model, method, name = subject.model, steps.method, subject.name
    given: dict[str, Any] = {"designs": designs}
    if subject.with_rollers:
        return _of_means(subject, means, steps.tolerance or 1e-4, by or jc.design.DIRECTIONS, given)
    if means.speed is not None:
        raise InputError(f"Option --speed goes with a bearing with its rollers, but {name} is a cage.")
    if lasting:
        return _of_lasting(subject, over, zone, by or jc.show.FIRST, given | {"method": method})
    if by or zone:
        raise InputError("Options --by and --zone go with --lasting.")
    _, loss = _searched(subject, over, means.discard, method, "differentiate")
    edges = jc.orbits.sensitivities(model, loss.edges, method=method)
    trusted = {edge: slope for edge, slope in edges.items() if slope.trusted}
    if not trusted:
        reasons = ", ".join(f"{edge}: {slope.status}" for edge, slope in edges.items())
        raise NoResult(f"No edge is a function of the design here ({reasons}): try more --steps.")
    ends: list[Any] = [trusted.get(f"zone 1 {end}") for end in ("onset", "exit")]
    each = [*([jc.orbits.width(ends[0], ends[1], "zone 1 width")] if all(ends) else []), *trusted.values()]
    tables = [
        jc.show.elasticities_table(name, edges, subject.beside),
        jc.show.width_table(f"Widths of the unstable ranges of {name}", edges, jc.show.FIRST),
        *(jc.show.gradient_table(name, model, s) for s in each),
    ]
    edge, slope = max(trusted.items(), key=lambda item: abs(item[1].elasticity["guidance_gap"]))
    by_gap = f"1 % more guidance gap moves it by {slope.elasticity['guidance_gap']:+.2f} %"
    said = f"{edge.capitalize()}, at {slope.value_rpm:.0f} rpm, answers most to the gap: {by_gap}."
    notes = [f"Left out: {n}, {e.kind} ({e.status})." for n, e in edges.items() if not e.trusted]
    return Answer(said, tables, notes, {}, {"figure": bars(subject, each)})


def bars(subject: Subject, slopes: list[Any]) -> Any:
    """Figure of the elasticities of edges or widths."""
    draw = partial(jc.show.elasticity_bars, jc.show.to_be_turned(subject.model, slopes))
    return jc.show.drawn(draw, 9.0, 2.2 + 1.2 * len(slopes), f"{subject.name}: elasticities of the edges")


def _of_lasting(subject: Subject, over: o.Range, zone: int, names: tuple[str, ...], given: dict[str, Any]) -> Answer:
    """Derivatives of edges and widths of zones of lasting chaos, by survival regression."""
    known = [name for name, value in jc.parameters(subject.model).items() if float(value)]
    if wrong := [name for name in names if name not in known]:
        raise InputError(f"Option --by must name parameters of {subject.name} that are not 0, but has '{wrong[0]}'.")
    edges, notes, speeds = {}, [], subject.range(over, 251)
    found = jc.sweep(subject.model, speeds, method=given["method"], progress=partial(report, "sweep"))
    jc.show.require_some(found)
    zones, horizon = jc.zones(found).zones, found.attrs["horizon"]
    if not zones:
        raise NoResult(f"No chaos lasts beyond {horizon} revolutions: there is no zone to differentiate.")
    if zone > len(zones):
        raise InputError(f"Option --zone must be at most {len(zones)}, the zones of lasting chaos, but is {zone}.")
    for i, each in [pair for pair in enumerate(zones, start=1) if zone in (0, pair[0])]:
        told = {"names": names, "progress": partial(report, f"zone {i}")}
        try:
            ends = jc.design.lasting_edges(subject.model, each, **told, **given)
            edges |= {f"zone {i} {end}": edge for end, edge in ends.items()}
        except ArgumentError as error:
            notes.append(f"Zone {i} is left out: {error}")
    if not edges:
        raise NoResult(" ".join(notes) or "All zones are open at both ends: there is no edge to differentiate.")
    widths = f"Widths of {subject.name} between mean lives of {horizon} revolutions"
    tables = [
        jc.show.lasting_table(subject.name, edges, horizon, subject.beside),
        jc.show.width_table(widths, edges, names),
    ]
    said = f"{len(edges)} edges at which the mean life of chaos passes {horizon} revolutions, with standard errors."
    return Answer(said, tables, notes, {"horizon": horizon})


def _of_means(
    subject: Subject, means: o.MeanOptions, tolerance: float, directions: tuple[str, ...], given: dict[str, Any]
) -> Answer:
    """Derivatives of the means of runs at one speed, from pairs of designs around the given one."""
    at, length = subject.speed(means.speed), means.length(initial_states=2, discard=20, revolutions=40)
    told = {"tolerance": tolerance, "progress": partial(report, "designs")}
    runs = jc.design.Runs(at, **length, blocks=2, exponents=0, **told)
    found = jc.design.mean_gradient(subject.model, runs, directions=directions, **given)
    title, each = f"{subject.name}, {subject.at(at)}", found.statistics.items()
    by = [(abs(x), n, d, x) for n, g in each for d, x in zip(g.directions, g.elasticity) if np.isfinite(x)]
    _, name, direction, most = max(by, default=(0.0, "nothing", "any parameter", 0.0))
    more = f"1 % more {jc.show.direction_words(direction)}"
    said = f"{more} changes {name} by {most:+.2f} %, the largest of all elasticities."
    notes = [f"{found.pairs} pairs of designs; failed: {found.failed} designs; inaccurate: {found.inaccurate} lanes"]
    if drifting := [n for n, g in each if not g.settled]:
        notes.append(f"Not settled, so that more --discard may change it: {', '.join(drifting)}")
    if absent := [n for n, g in each if not np.any(g.value)]:
        notes.append(f"Zero in every run: {', '.join(absent)}")
    document = subject.both(at) | length | {n: getattr(found, n) for n in ("pairs", "failed", "inaccurate")}
    files, tables = {"figure": jc.show.statistic_bars(found, title)}, jc.show.mean_gradient_tables(title, found)
    return Answer(said, tables, notes, document, files, part=f"_{means.speed:g}rpm")


def map_(
    subject: o.Case,
    *,
    y: o.OptionalText = None,
    over: o.Range = o.Range(),
    lower: o.OptionalText = None,
    upper: o.OptionalText = None,
    points: o.Points = None,
    initial_states: o.FromOne = 1,
    persist: o.FromZero = 0,
    quick: o.Quick = False,
    run: o.RunOptions = o.RunOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Stability map over speed and a parameter: labels, largest exponent, reported quantities, edges on top.

    Args:
        y: Parameter; by default guidance_gap, for a bearing with its rollers its load.
        lower: Lowest value of y, in SI units or with a unit, e.g. "0.4 mm"; by default 0.8 of its value.
        upper: Highest value of y; by default 1.25 of its value.
        points: Grid of simulated points, e.g. 300x300.
        initial_states: Initial states at each point.
        persist: Revolutions that chaos must outlast to count.
        quick: Do not follow the edges of the synchronous orbit.
    """
    model, y = subject.model, y or subject.usual("guidance_gap", "load")
    if y not in (info := jc.parameter_info(model)):
        raise InputError(f"Option --y must be {parameters_like(str(y), [*info])}, but '{y}' was given.")
    given: dict[str, Any] = {}
    for end, text in (("lower", lower), ("upper", upper)):
        try:
            given |= {} if text is None else {end: jc.files.to_si(text, info[y].unit)}
        except ValueError as error:
            raise ArgumentError(end, said=f"{error}.") from error
    axis, edges, refused = jc.show.parameter_axis(model, y, **given), {}, {}
    usual = subject.usual({"discard": 1000, "revolutions": 100, "blocks": 20}, {"discard": 20, "revolutions": 20})
    discard = usual["discard"] if run.discard is None else run.discard
    if 0 < persist <= discard:
        raise ArgumentError("persist", said=f"must be 0 or above the {discard} discarded, but is {persist}.")
    if not (quick or subject.with_rollers):
        try:
            edges = _searched(subject, over, discard, run.method, "follow")[1].edges
        except NoResult as error:
            refused = {"edges": str(error).rstrip(".")}
    settings = usual | run.settings | {"initial_states": initial_states, "persist": persist}
    grid = points or subject.usual((50, 12), (13, 8))
    return mapped(subject, subject.ends(over), axis, grid, edges, settings, refused)


def mapped(
    subject: Subject,
    ends: tuple[float, float],
    axis: Any,
    points: tuple[int, int],
    edges: dict[str, Any],
    settings: dict[str, Any],
    refused: dict[str, str] | None = None,
) -> Answer:
    """Answer on a map over speeds [rad/s] and a parameter: simulated points, with edges that are followed on top."""
    y, title = axis.name, f"{subject.name} over speed and {axis.words}"
    grid = {"speed": np.linspace(*ends, points[0]), y: np.linspace(axis.lower, axis.upper, points[1])}
    found = jc.label_map(subject.model, grid, **settings, stage=report)
    jc.show.require_some(found)
    curves, lost = jc.show.follow_edges(subject.model, edges, ends, axis, settings.get("method"), report)
    files = {"figure": jc.show.map_figure(axis, curves, found, title), "data": found}
    labels, tables = counted(found), []
    document = {"x": "speed", "y": y, "x_range": tuple(x * RPM for x in ends), "y_range": (axis.lower, axis.upper)}
    document |= {"points": points, "labels": labels, "exponents": jc.show.top_exponent(found)}
    said = f"Over speed and {axis.words} most points are {max(labels, key=labels.__getitem__)}"
    if curves:
        tables.append(jc.show.curves_table(f"Edges of {title}", curves, axis))
        files["curve_data"] = jc.show.curve_columns(curves, axis)
        said += f"; {jc.show.counted(len(curves), 'edge')} followed"
    tables.append(jc.show.shares_table(f"Points of {title}", "label", labels))
    notes = [f"Not followed: {edge} ({why})" for edge, why in ((refused or {}) | lost).items()]
    return Answer(f"{said}.", tables, notes, document, files, part=f"_speed_{y}")
