"""The report as one page of HTML that needs nothing from outside, made of sections; what was not found is left out."""

import base64
import dataclasses
import datetime
import io
import json
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import matplotlib
import numpy as np
from matplotlib.collections import Collection
from matplotlib.figure import Figure

from .. import __version__
from .._parameters import parameter_info, parameters, readings_of
from ..analysis import Zones, failed, length, measures, resolution_rpm, restless
from ..bearing import design_rule_violations
from ..design import Ensemble
from .chance_tables import chances_answer, chances_notes, chances_tables
from .design_figures import chance_of_chaos, elasticity_bars, statistic_bars
from .diagrams import SWEPT, add_shaft_axes, mark_operating, reported, sweep_figure, zone_strip
from .findings import Findings, OneSpeed, Orbits
from .maps import stability_map
from .operating import CLOSE
from .orbit_figures import multiplier_circle, orbit_diagram_with_branches
from .parameter_tables import readings_words, shown, sources_table
from .quantity_tables import quantities_table, run_tables, statics_table
from .run_figures import load_bars, rollers_of, run_figure
from .slope_tables import elasticities_table, mean_gradient_tables, residual_words, to_be_turned
from .style import drawn
from .tables import Column, Table, counted, table as table_of
from .zone_tables import coexisting_notes, edge_table, loss_table, motion_tables, zone_span


RASTER_DPI = 150
"""Resolution of clouds of points, which would weigh megabytes as points."""
KEY_PARAMETERS = ("guidance_gap", "eccentricity", "cage_mass")
PAPER = (
    "Equations: L. Chen, X. Xia, H. Zheng, M. Qiu, Chaotic Dynamics of Cage Behavior in a High-Speed Cylindrical "
    "Roller Bearing, Shock and Vibration 2016, article 9120505, with its misprints corrected."
)


@dataclasses.dataclass(frozen=True)
class Section:
    """A part of the page."""

    key: str
    title: str
    sentences: Sequence[str] = ()
    figures: Mapping[str, tuple[Figure, str]] = dataclasses.field(default_factory=dict)
    """Figures by name, each with its caption."""
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()


def page(
    findings: Findings,
    *,
    table: Mapping[str, Any] | None = None,
    command: str = "",
    chances: Ensemble | None = None,
    left: Sequence[str] = (),
) -> str:
    """The report as HTML.

    **Arguments:** findings; the nested mapping that the design was read from (None: a published case); the command line
    that asked for the page; the results of draws from its ranges (None: all values are known); values that are still
    those of the template, by dotted name.
    """
    model, rpm = findings.model, findings.sweep["rpm"].values
    what = f"Case {findings.name}" if findings.published is not None else findings.name
    about = "where the cage moves chaotically" if findings.orbits is not None else "slip, forces and wear"
    quick = ", quick report: no gradients, a coarser sweep" if findings.quick else ""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    return environment.get_template("page.html.j2").render(
        title=f"{what}: {about}",
        subtitle=f"Cylindrical roller bearing, {rpm[0]:.0f} to {rpm[-1]:.0f} rpm of the {model.speed_text.split()[0]}"
        + quick,
        sections=_sections(findings, table, chances, left),
        picture=lambda figure: _picture(add_shaft_axes(figure, findings.sweep)),
        version=__version__,
        command=command,
        date=datetime.date.today().isoformat(),
    )


def _picture(figure: Figure) -> tuple[str, int, int]:
    """A figure as an address that holds the drawing itself, its width and its height [px at 96 per inch]."""
    for cloud in figure.findobj(Collection):
        cloud.set_rasterized(True)
    width, height = (round(96 * float(x)) for x in figure.get_size_inches())
    box = io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "jaxcage"}):
        figure.savefig(box, format="svg", dpi=RASTER_DPI, metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(box.getvalue()).decode("ascii"), width, height


def _sections(
    findings: Findings, table: Mapping[str, Any] | None, chances: Ensemble | None, left: Sequence[str]
) -> list[Section]:
    model, orbits, statics = findings.model, findings.orbits, findings.statics
    sections = [_result(findings, chances, left)]
    if findings.operating:
        sections.append(Section("operating", "Operating speeds", tables=[verdict_table(findings)]))
    if chances is not None:
        sections.append(_known(findings, chances))
    sections.append(_zones(findings))
    if orbits is not None:
        sections += [_synchronous(findings, orbits), _map(findings, orbits)]
        sections += [_gradients(findings, orbits)] if orbits.slopes else []
    if findings.one_speed is not None:
        sections += _one_speed(findings, findings.one_speed)
    if statics is not None:
        said = f"under {float(model.load):g} N"
        figure = drawn(lambda ax: load_bars(statics, ax), 7.0, 3.2), f"Load of every roller at rest {said}."
        rows = statics_table(f"At rest {said}", model, statics)
        sections.append(Section("statics", "Statics", (), {"statics": figure}, [rows]))
    doubts = [*design_rule_violations(model.bearing, model.guidance_gap), *model.lubricant.doubts()]
    warnings = [f"Warning: {doubt}" for doubt in doubts]
    return [
        *sections,
        Section("design", "The design", warnings, tables=[sources_table(model, table, left)]),
        Section("checks", "How sure this is", tables=[_checks(findings)]),
        Section("computed", "How it was computed", tables=[_settings(findings)], notes=[PAPER]),
    ]


def verdict_table(findings: Findings) -> Table:
    """Operating speeds with the verdicts on them."""
    rows = [
        vars(v) | {"speed": findings.words(at), "kind": kind, "verdict": v.state}
        for at, verdicts in findings.assessed
        for kind, v in verdicts.items()
    ]
    away = [Column("away [rpm]", "distance_rpm", digits=0), Column("away [%]", "percent", digits=1)]
    close = f"close: an edge within {100 * CLOSE:g} % of the speed or within its own uncertainty"
    title = f"Operating speeds of {findings.name} beside its zones ({close})"
    return table_of(title, rows, ["speed", "kind", "verdict", "where", Column("nearest edge", "edge"), *away])


def calmest(findings: Findings) -> tuple[float, float] | None:
    """The widest range of the sweep [rpm] outside all zones, transient chaos included; None if there is none."""
    found, orbits = findings.zones, findings.orbits
    if orbits is None or not isinstance(found, Zones):
        return None
    first, last = (float(findings.sweep["rpm"][i]) for i in (0, -1))
    taken = sorted(zone_span(z, first, last) for z in (*orbits.loss.zones, *found.zones, *found.transient))
    free, at = [], first
    for low, high in taken:
        free.append((at, low))
        at = max(at, high)
    low, high = max([*free, (at, last)], key=lambda pair: pair[1] - pair[0])
    return (low, high) if high > low else None


def _result(findings: Findings, chances: Ensemble | None, left: Sequence[str]) -> Section:
    sweep, found, orbits = findings.sweep, findings.zones, findings.orbits
    lost, said, figures, speeds = failed(sweep), [], {}, counted(sweep.sizes["speed"], "speed")
    if orbits is not None and isinstance(found, Zones):
        said.append(
            f"{counted(len(found.zones), 'chaotic zone')} and {counted(len(orbits.loss.zones), 'zone')} without a "
            f"stable synchronous orbit. At {np.mean(restless(sweep)):.0%} of {speeds} "
            f"some initial state of {sweep.sizes['start']} leads to chaos, for a while at least."
        )
        if (calm := calmest(findings)) is not None:
            said.append(f"The widest range outside all zones goes from {calm[0]:.0f} to {calm[1]:.0f} rpm.")
        spans = [(at.low_rpm, at.high_rpm) for at in findings.operating]
        limits = float(sweep["rpm"][0]), float(sweep["rpm"][-1])
        draw = lambda ax: zone_strip(orbits.loss.zones, found.zones, limits, spans, findings.published, ax)
        figures["strip"] = drawn(draw, 9.5, 1.5), "Zones of both kinds over speed, with any operating speeds."
    else:
        chaotic = sum(each.speeds for each in found if each.chaotic)  # pyright: ignore
        said.append(f"The largest exponent is positive beyond doubt at {chaotic} of {speeds}.")
    for at, verdicts in findings.assessed:
        each = (v.where if kind == "motion" else _words(kind, v.state) for kind, v in verdicts.items())
        said.append(f"{findings.words(at)}: {', '.join(each)}.")
    if readings_of(findings.model):
        said.append(f"All of this rests on two readings: {readings_words(findings.model)}.")
    if np.any(lost):
        said.append(f"{int(np.sum(lost))} of {counted(lost.size, 'simulation')} failed: nothing is known of them.")
    if chances is not None:
        said.append(
            f"All zones of this page are those of the best guesses: {counted(len(chances.unknowns), 'value')} known "
            f"within ranges only. {chances_answer(chances)}"
        )
    if left:
        said.append(f"Values that are still the template's, another bearing's: {', '.join(left)}.")
    value, info, named = parameters(findings.model), parameter_info(findings.model), []
    for name in (name for name in KEY_PARAMETERS if name in value):
        unit, number = shown(float(value[name]), info[name].unit)
        named.append(f"{name.replace('_', ' ')} {number:.4g} {unit}")
    return Section("result", "In short", said, figures, notes=[f"The design: {', '.join(named)}."])


def _words(kind: str, state: str) -> str:
    said = {"close": "close to", "clear": "clear of", "unknown": "not known for"}.get(state, state)
    return said if said.endswith("chaos") else f"{said} {kind} zones"


def _known(findings: Findings, chances: Ensemble) -> Section:
    """Chances of chaos over draws from the ranges of a design."""
    caption = f"Share of {len(chances.place)} draws from the ranges that are chaotic, with 95 % bars."
    figures = {"chance": (_marked(drawn(lambda ax: chance_of_chaos(chances, ax), 9.5, 4.6), findings), caption)}
    tables = chances_tables(findings.name, chances, findings.beside)
    return Section("known", "What is known, and what it decides", chances_notes(chances), figures, tables)


def _zones(findings: Findings) -> Section:
    """Chaotic zones beside zones without a stable synchronous orbit; or stretches of speed with one motion."""
    sweep, found, other, orbits = findings.sweep, findings.zones, findings.beside, findings.orbits
    tables = motion_tables(findings.name, sweep, found, findings.published, other)
    figure = _marked(sweep_figure(sweep, found, findings.published), findings)
    if orbits is None:
        said = "A zone is a stretch of speeds with one motion of the cage. Bars are standard errors."
        caption = "Quantities that the model reports over speed, means over initial states; zones are shaded."
        tables.append(quantities_table("Means over initial states", sweep, reported(sweep, SWEPT)))
        return Section("zones", "Over speed", [said], {"sweep": (figure, caption)}, tables)
    said = (
        "Two kinds of zone are never mixed. In a synchronous-loss zone the orbit that turns with the cage is not "
        "stable; its edges are bifurcations, solved for. In a chaotic zone some initial state leads to chaos; its "
        f"edges are seen in a sweep and no sharper than its grid ({resolution_rpm(sweep):.0f} rpm), unless they "
        "coincide with a bifurcation."
    )
    caption = (
        "Vertical displacement once a revolution, over cage speed, from all initial states; beneath it the largest "
        "exponent. Chaotic zones are shaded."
    )
    tables = [loss_table(findings.name, orbits.found, orbits.loss, findings.published, other), *tables]
    return Section("zones", "Zones", [said], {"orbits": (figure, caption)}, tables, coexisting_notes(orbits.loss))


def _synchronous(findings: Findings, orbits: Orbits) -> Section:
    found, figures, notes, principal = orbits.found, {}, [], orbits.loss.principal
    if found.branches:
        draw = lambda ax: orbit_diagram_with_branches(findings.sweep, found.branches, ax)
        caption = "Orbits that turn with the cage, stable (thick) and unstable (thin), over the simulations (grey)."
        figures["branches"] = drawn(draw, 9.5, 5.4), caption
        branch = found.branches[0 if principal is None else principal.branch]
        caption = (
            "Floquet multipliers along the branch on which most simulations settled. The orbit is stable while all are "
            "inside the unit circle; how one leaves it tells what follows."
        )
        figures["multipliers"] = drawn(lambda ax: multiplier_circle(branch, ax), 7.0, 5.8), caption
    if further := len(found.edges) - len({id(p) for p in orbits.loss.edges.values()}):
        notes.append(f"{further} further ends of stable stretches bound no zone (jaxcage bifurcations lists them).")
    tables = [edge_table(found, orbits.loss, findings.beside, named=True)]
    return Section("stability", "The synchronous orbit", (), figures, tables, notes)


def _map(findings: Findings, orbits: Orbits) -> Section:
    axis = orbits.axis
    figure = drawn(lambda ax: stability_map(axis, orbits.curves, ax, orbits.map), 9.5, 5.0)
    own = float(axis.shown(float(parameters(findings.model)[axis.name])))
    figure.axes[0].axhline(own, color="#000000", linewidth=1.0, linestyle=":")
    curves = " The lines are its edges, solved for." if orbits.curves else ""
    caption = (
        f"Largest exponent per revolution over speed and guidance gap (red: chaotic). Dotted: this design.{curves}"
    )
    notes = [f"Not followed: {name} ({why})." for name, why in orbits.refused.items()]
    return Section("map", "Stability map", (), {"map": (_marked(figure, findings), caption)}, notes=notes)


def _gradients(findings: Findings, orbits: Orbits) -> Section:
    edges = [s for name, s in orbits.slopes.items() if s.trusted and name in orbits.loss.edges]
    trusted, figures = to_be_turned(findings.model, edges), {}
    if trusted:
        caption = (
            "Change of the synchronous-loss edges: per cent of speed for one per cent of a parameter that a designer "
            "can choose."
        )
        bars = drawn(lambda ax: elasticity_bars(trusted, ax), 9.5, 2.2 + 0.95 * len(trusted))
        figures["elasticities"] = bars, caption
    said = (
        "Exact derivatives of the edges with respect to every parameter. An elasticity of 0.10 means that one per cent "
        "more of the parameter moves the edge up by a tenth of a per cent."
    )
    tables = [elasticities_table(findings.name, orbits.slopes, findings.beside)]
    return Section("gradients", "What moves the edges", [said], figures, tables)


def _one_speed(findings: Findings, one: OneSpeed) -> list[Section]:
    """A run at the first operating speed, and slopes of means there."""
    rollers, title = rollers_of(findings.model, one.run), f"At {one.at}"
    caption = "The bearing at its largest pocket force, the path of its cage, slips and forces around it, spectra."
    figures = {"run": (run_figure(findings.model, one.run, rollers), caption)}
    found = [Section("run", title, (), figures, run_tables(title, measures(findings.model, one.run), rollers))]
    if one.slopes is not None:
        caption = "Per cent of a mean for one per cent of a parameter, with two standard errors."
        figures = {"slopes": (statistic_bars(one.slopes), caption)}
        tables = mean_gradient_tables(f"at {one.at}", one.slopes)
        found.append(Section("slopes", "What moves the means", (), figures, tables))
    return found


def _marked(figure: Figure, findings: Findings) -> Figure:
    """The figure with the operating speeds on every axis of speed."""
    for ax in figure.axes:
        if ax.get_label() != "<colorbar>":
            mark_operating(ax, [(at.low_rpm, at.high_rpm) for at in findings.operating])
    return figure


def _pairs(title: str, left: str, right: str, rows: Mapping[str, str]) -> Table:
    return table_of(title, [{left: words, right: said} for words, said in rows.items() if said], [left, right])


def _checks(findings: Findings) -> Table:
    """Checks of the numbers of a report."""
    sweep, orbits, zones, lost = findings.sweep, findings.orbits, findings.zones, failed(findings.sweep)
    changed = ", then ".join(f"{changed} of {lanes}" for lanes, changed, _ in json.loads(sweep.attrs["confirmed"]))
    rows = {
        "simulations that failed": f"{int(np.sum(lost))} of {lost.size}",
        "labels that changed when confirmed by finer steps": changed or "none confirmed",
        "largest error of a revolution, of the scale": f"{np.max(sweep['error'].values[~lost], initial=0.0):.0e}",
        "simulations beyond eps = 1, where surfaces would overlap": str(int(np.sum(sweep["peak"].values > 1))),
        "simulations whose label is undecided": str(int(np.sum(sweep["label"].values == "undecided"))),
    }
    if orbits is not None and isinstance(zones, Zones):
        edges = [e for zone in zones.zones for e in (zone.onset, zone.exit) if e is not None]
        exact = f"{sum(e.basis != 'statistical' for e in edges)} of {len(edges)}"
        rows["settled synchronous orbits that lie on no branch that was followed"] = str(orbits.found.missed)
        rows["chaotic edges that coincide with something solved for"] = "not tried" if findings.quick else exact
        if orbits.slopes:
            untrusted = [f"{n} ({s.status})" for n, s in orbits.slopes.items() if not s.trusted]
            rows["gradients against the scaling of units, largest relative residual"] = residual_words(orbits.slopes)
            rows["edges whose gradient is not to be trusted"] = ", ".join(untrusted) or "none"
    return _pairs("Checks of this report", "check", "result", rows)


def _settings(findings: Findings) -> Table:
    """Versions, machine and settings that a report was made with."""
    sweep, settings = findings.sweep, json.loads(findings.sweep.attrs["settings"])
    versions = [f"{k.removeprefix('version_')} {v}" for k, v in settings.items() if k.startswith("version_")]
    rpm, zones = sweep["rpm"].values, findings.zones
    closed = f"; windows below {zones.close_below_rpm:g} rpm closed" if isinstance(zones, Zones) else ""
    speeds = f"{counted(rpm.size, 'speed')} from {rpm[0]:.0f} to {rpm[-1]:.0f} rpm"
    rows = {
        "versions": ", ".join([*versions, f"Python {platform.python_version()}"]),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "readings": readings_words(findings.model),
        "sweep": f"{speeds}, {counted(sweep.sizes['start'], 'initial state')}, {length(sweep)}",
        "resolution": f"{resolution_rpm(sweep):.0f} rpm{closed}",
        "steps of the sweep": " ".join(str(settings.get("method", "")).split()),
        "steps of orbits": "" if findings.orbits is None else findings.orbits.method,
        "random numbers": "none: the initial states are fixed",
        "time": ", ".join(f"{stage} {s:.0f} s" for stage, s in findings.seconds.items()),
    }
    return _pairs("Settings", "what", "value", rows)
