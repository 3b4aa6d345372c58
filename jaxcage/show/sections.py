"""Sections of the report, each from what was found of a model; a section without contents is left out."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._parameters import parameter_info, parameters, readings_of
from ..analysis import Zones, failed, resolution_rpm, restless
from ..bearing import design_rule_violations
from .bearing_figures import load_bars
from .chance_tables import chances_answer, chances_notes, chances_tables, operating_chances
from .checks import checks_table, provenance_table
from .design_figures import chance_of_chaos, elasticity_bars
from .diagrams import SWEPT, reported, sweep_figure
from .findings import Findings, Orbits
from .gradient_tables import elasticities_table, to_be_turned
from .maps import stability_map
from .operating import CLOSE, Operating, Verdict, chaotic_verdict, loss_verdict, motion_verdict
from .orbit_figures import multiplier_circle, orbit_diagram_with_branches
from .orbit_tables import coexisting_notes, edge_table, loss_table
from .quantity_tables import quantities_table, statics_table
from .sources import readings_words, shown, sources_table
from .speed_axes import mark_operating, zone_strip
from .style import new_figure
from .tables import Beside, Column, Table, rows_table
from .zone_tables import stretches_table, transient_tables, zone_span, zones_table


if TYPE_CHECKING:
    from ..design import Ensemble


COUNTED = ("No", "One", "Two", "Three", "Four", "Five", "Six")
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
    key_figures: Sequence[tuple[str, str]] = ()


def sections_of(
    findings: Findings,
    table: Mapping[str, Any] | None,
    chances: "Ensemble | None",
    left: Sequence[str],
    more: Sequence[Section],
) -> list[Section]:
    """All sections of the page; arguments as for `page`."""
    orbits = findings.orbits
    return [
        _result(findings, chances, left),
        *([Section("operating", "Operating speeds", tables=[verdict_table(findings)])] if findings.operating else []),
        *([_known(findings, chances)] if chances is not None else []),
        _zones(findings),
        *([_synchronous(findings, orbits), _map(findings, orbits)] if orbits is not None else []),
        *([_gradients(findings, orbits)] if orbits is not None and orbits.slopes else []),
        *more,
        *([_statics(findings)] if findings.statics is not None else []),
        _design(findings, table, left),
        Section("checks", "How sure this is", tables=[checks_table(findings)]),
        Section("computed", "How it was computed", tables=[provenance_table(findings)], notes=[PAPER]),
    ]


def beside(findings: Findings) -> Beside:
    """The shaft speed, if the model's is that of the cage, and its ratio to it."""
    found = findings.sweep
    return ("shaft", float(found["shaft_rpm"][-1] / found["rpm"][-1])) if "shaft_rpm" in found.coords else None


def _both(findings: Findings, at: Operating) -> str:
    other = beside(findings)
    return str(at) if other is None else f"{at} (shaft {at.of_shaft(1 / other[1])})"


class Assessed(NamedTuple):
    """An operating speed with the verdicts on it by kind of zone."""

    at: Operating
    verdicts: dict[str, Verdict]


def assess(findings: Findings) -> list[Assessed]:
    """Verdicts on each operating speed."""
    return [Assessed(at, _verdicts(findings, at)) for at in findings.operating]


def _verdicts(findings: Findings, at: Operating) -> dict[str, Verdict]:
    orbits, found = findings.orbits, findings.zones
    if orbits is None or not isinstance(found, Zones):
        assert not isinstance(found, Zones)
        return {"motion": motion_verdict(at, found, findings.sweep)}
    searched = orbits.found.lower_rpm, orbits.found.upper_rpm
    return {
        "synchronous-loss": loss_verdict(at, orbits.loss.zones, *searched, bool(orbits.found.stretches)),
        "chaotic": chaotic_verdict(at, found, findings.sweep),
    }


def verdict_table(findings: Findings) -> Table:
    """Operating speeds with the verdicts on them."""
    rows = [
        vars(v) | {"speed": _both(findings, at), "kind": kind, "verdict": v.state}
        for at, verdicts in assess(findings)
        for kind, v in verdicts.items()
    ]
    columns = [
        *(Column(head, ()) for head in ("speed", "kind", "verdict", "where")),
        Column("nearest edge", (), key="edge"),
        Column("away [rpm]", (), key="distance_rpm", digits=0),
        Column("away [%]", (), key="percent", digits=1),
    ]
    title = f"Close: an edge within {100 * CLOSE:g} % of the speed or within its own uncertainty"
    return rows_table(title, rows, columns)


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


def _counted(n: int, what: str) -> str:
    return f"{COUNTED[n] if n < len(COUNTED) else n} {what}{'' if n == 1 else 's'}"


def _result(findings: Findings, chances: "Ensemble | None", left: Sequence[str]) -> Section:
    sweep, found, orbits = findings.sweep, findings.zones, findings.orbits
    lost, said, figures = failed(sweep), [], {}
    if orbits is not None and isinstance(found, Zones):
        chaotic, loss = len(found.zones), len(orbits.loss.zones)
        said.append(
            f"{_counted(chaotic, 'chaotic zone')} and {_counted(loss, 'zone').lower()} without a stable synchronous "
            f"orbit. At {np.mean(restless(sweep)):.0%} of the {sweep.sizes['speed']} speeds that were swept some "
            f"initial state of {sweep.sizes['start']} leads to chaos, for a while at least."
        )
        if (calm := calmest(findings)) is not None:
            said.append(f"The widest range outside all zones goes from {calm[0]:.0f} to {calm[1]:.0f} rpm.")
        spans = [(at.low_rpm, at.high_rpm) for at in findings.operating]
        limits = float(sweep["rpm"][0]), float(sweep["rpm"][-1])
        height = 1.9 if spans else 1.5
        draw = lambda ax: zone_strip(orbits.loss.zones, found.zones, limits, spans, findings.published, ax)
        figures["strip"] = _alone(9.5, height, draw), "Zones of both kinds over speed, with any operating speeds."
    else:
        chaotic = sum(each.speeds for each in found if each.chaotic)  # pyright: ignore
        said.append(f"The largest exponent is positive beyond doubt at {chaotic} of {sweep.sizes['speed']} speeds.")
    for at, verdicts in assess(findings):
        each = (f"{v.where} ({kind})" if kind == "motion" else _words(kind, v.state) for kind, v in verdicts.items())
        said.append(f"{_both(findings, at)}: {', '.join(each)}.")
    if readings_of(findings.model):
        said.append(f"All of this rests on two readings: {readings_words(findings.model)}.")
    if np.any(lost):
        said.append(f"{int(np.sum(lost))} of {lost.size} simulations failed: nothing is known of them.")
    if chances is not None:
        said.append(
            f"All zones of this page are those of the best guesses: {len(chances.unknowns)} values are known within "
            f"ranges only. {chances_answer(chances)}"
        )
    if left:
        said.append(f"Values that are still the template's, another bearing's: {', '.join(left)}.")
    return Section("result", "In short", said, figures, key_figures=_key_figures(findings.model))


def _words(kind: str, state: str) -> str:
    said = {"close": "close to", "clear": "clear of", "unknown": "not known for"}.get(state, state)
    return said if said.endswith("chaos") else f"{said} {kind} zones"


def _key_figures(model: Any) -> list[tuple[str, str]]:
    value, info, named = parameters(model), parameter_info(model), []
    for name in (name for name in KEY_PARAMETERS if name in value):
        unit, number = shown(float(value[name]), info[name].unit)
        named.append((name.replace("_", " "), f"{number:.4g} {unit}"))
    oil = 1e3 * float(model.lubricant.dynamic_viscosity)
    rollers = f"{model.bearing.n_rollers} of {1e3 * float(model.bearing.roller_diameter):.4g} mm"
    return [*named, ("viscosity of the oil", f"{oil:.3g} mPa s"), ("rollers", rollers)]


def _known(findings: Findings, chances: "Ensemble") -> Section:
    """Chances of chaos over draws from the ranges of a design."""
    other = beside(findings)
    tables = chances_tables(findings.name, chances, other)
    if findings.operating and other is not None:
        tables = [operating_chances(chances, findings.operating, 1 / other[1]), *tables]
    figure = _alone(9.5, 4.6, lambda ax: chance_of_chaos(chances.rpm, chances.chance, chances.interval, ax))
    _mark(figure, findings)
    caption = f"Share of {chances.place.shape[0]} draws from the ranges that are chaotic, with 95 % bars."
    return Section(
        "known", "What is known, and what it decides", chances_notes(chances), {"chance": (figure, caption)}, tables
    )


def _zones(findings: Findings) -> Section:
    sweep, found, orbits, other, name = findings.sweep, findings.zones, findings.orbits, beside(findings), findings.name
    figure = sweep_figure(sweep, found, findings.published)
    _mark(figure, findings)
    if orbits is None or not isinstance(found, Zones):
        assert not isinstance(found, Zones)
        said = "A zone is a stretch of speeds with one motion of the cage. Bars are standard errors."
        caption = "Quantities that the model reports over speed, a line for each initial state; zones are shaded."
        tables = [
            stretches_table(name, found),
            quantities_table("Means over initial states", sweep, reported(sweep, SWEPT)),
        ]
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
    span = float(sweep["rpm"][0]), float(sweep["rpm"][-1])
    tables = [
        loss_table(name, orbits.found, orbits.loss, findings.published, other),
        zones_table(name, found, findings.published, span, other),
        *transient_tables(name, found, other),
    ]
    return Section("zones", "Zones", [said], {"orbits": (figure, caption)}, tables, coexisting_notes(orbits.loss))


def _synchronous(findings: Findings, orbits: Orbits) -> Section:
    found, figures, notes = orbits.found, {}, []
    if found.branches:
        draw = lambda ax: orbit_diagram_with_branches(findings.sweep, found.branches, 1, ax)
        caption = "Orbits that turn with the cage, stable (thick) and unstable (thin), over the simulations (grey)."
        figures["branches"] = _alone(9.5, 5.4, draw), caption
        principal = orbits.loss.principal
        branch = found.branches[0 if principal is None else principal.branch]
        caption = (
            "Floquet multipliers along the branch on which most simulations settled. The orbit is stable while all are "
            "inside the unit circle; how one leaves it tells what follows."
        )
        figures["multipliers"] = _alone(7.0, 5.8, lambda ax: multiplier_circle(branch, ax)), caption
    if further := len(found.edges) - len({id(p) for p in orbits.loss.edges.values()}):
        notes.append(f"{further} further ends of stable stretches bound no zone (jaxcage bifurcations lists them).")
    tables = [edge_table(found, orbits.loss, beside(findings), named=True)]
    return Section("stability", "The synchronous orbit", (), figures, tables, notes)


def _map(findings: Findings, orbits: Orbits) -> Section:
    chart = orbits.map
    figure = _alone(9.5, 5.0, lambda ax: stability_map(chart.curves, ax, found=chart.found, unit=chart.axis.unit))
    own = chart.axis.shown(np.array([float(parameters(findings.model)[chart.axis.name])]))[0]
    figure.axes[0].axhline(own, color="#000000", linewidth=1.0, linestyle=":")
    _mark(figure, findings)
    curves = " The lines are its edges, solved for." if chart.curves else ""
    caption = (
        f"Largest exponent per revolution over speed and guidance gap (red: chaotic). Dotted: this design.{curves}"
    )
    notes = [f"Not followed: {name} ({why})." for name, why in chart.refused.items()]
    return Section("map", "Stability map", (), {"map": (figure, caption)}, notes=notes)


def _gradients(findings: Findings, orbits: Orbits) -> Section:
    edges = [s for name, s in orbits.slopes.items() if s.trusted and name in orbits.loss.edges]
    trusted, figures = to_be_turned(findings.model, edges), {}
    if trusted:
        caption = (
            "Change of the synchronous-loss edges: per cent of speed for one per cent of a parameter that a designer "
            "can choose."
        )
        height = 2.2 + 0.95 * len(trusted)
        figures["elasticities"] = _alone(9.5, height, lambda ax: elasticity_bars(trusted, ax)), caption
    said = (
        "Exact derivatives of the edges with respect to every parameter. An elasticity of 0.10 means that one per cent "
        "more of the parameter moves the edge up by a tenth of a per cent."
    )
    tables = [elasticities_table(findings.name, orbits.slopes, beside(findings))]
    return Section("gradients", "What moves the edges", [said], figures, tables)


def _statics(findings: Findings) -> Section:
    shared, title = findings.statics, f"Load of every roller at rest under {float(findings.model.load):g} N"
    figure = _alone(7.0, 3.2, lambda ax: load_bars(shared, ax))  # pyright: ignore[reportArgumentType]
    table = statics_table(f"At rest under {float(findings.model.load):g} N", findings.model, shared)  # pyright: ignore
    return Section("statics", "Statics", (), {"statics": (figure, f"{title}.")}, [table])


def _design(findings: Findings, table: Mapping[str, Any] | None, left: Sequence[str]) -> Section:
    model = findings.model
    warnings = [*design_rule_violations(model.bearing, model.guidance_gap), *model.lubricant.doubts()]
    said = [f"Warning: {warning}" for warning in warnings]
    return Section("design", "The design", said, tables=[sources_table(model, table, left)])


def _alone(width: float, height: float, draw: Callable[[Axes], Any]) -> Figure:
    figure = new_figure(width, height)
    draw(figure.subplots())
    return figure


def _mark(figure: Figure, findings: Findings) -> None:
    """Mark the operating speeds on every axis of speed."""
    for ax in figure.axes:
        if ax.get_label() != "<colorbar>":
            mark_operating(ax, [(at.low_rpm, at.high_rpm) for at in findings.operating])
