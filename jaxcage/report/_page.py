"""Findings as one page of HTML that needs nothing from outside."""

import dataclasses
import datetime
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from .._parameters import parameter_info, parameters
from ..bearing import design_rule_violations
from ..studies import Ensemble
from ._chances import chances_notes, chances_tables, operating_chances
from ._figures import pictures
from ._findings import Findings
from ._operating import CLOSE, Operating, Verdict, chaotic_verdict, loss_verdict
from ._orbit_tables import coexisting_notes, edge_table, loss_table
from ._page_tables import at_speeds_table, checks_table, provenance_table, published_table, slope_tables
from ._sources import parameter_rows, readings_words, shown
from ._statics import statics_table
from ._table import Table, number, with_shaft
from ._zone_tables import transient_tables, zone_span, zones_table


@dataclasses.dataclass(frozen=True)
class Assessed:
    """An operating speed with what each kind of zone says of it."""

    at: Operating
    verdicts: dict[str, Verdict]


def assess(findings: Findings, operating: Sequence[Operating]) -> list[Assessed]:
    """Both verdicts on each operating speed."""
    found, loss = findings.found, findings.loss
    return [
        Assessed(
            at,
            {
                "synchronous-loss": loss_verdict(
                    at, loss.zones, found.lower_rpm, found.upper_rpm, bool(found.stretches)
                ),
                "chaotic": chaotic_verdict(at, findings.zones, findings.sweep),
            },
        )
        for at in operating
    ]


def page(
    findings: Findings,
    operating: Sequence[Operating] = (),
    *,
    table: Mapping[str, Any] | None = None,
    command: str = "",
    chances: Ensemble | None = None,
    left: Sequence[str] = (),
) -> str:
    """The report as HTML.

    **Arguments:** findings; operating speeds; the nested mapping that the design was read from (None: a published
    case); the command line that asked for it; what draws from its ranges do (None: all is known); values that are
    still those of the template, by dotted name.
    """
    assessed = assess(findings, operating)
    return rendered("page.html.j2", **_context(findings, assessed, table, command, chances, left))


def rendered(template: str, **context: Any) -> str:
    """A page made of a template and what it holds, with the date of today."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    return environment.get_template(template).render(context, date=datetime.date.today().isoformat())


def _context(
    findings: Findings,
    assessed: list[Assessed],
    table: Mapping[str, Any] | None,
    command: str,
    chances: Ensemble | None,
    left: Sequence[str],
) -> dict[str, Any]:
    name, model, swept, found = findings.name, findings.model, findings.sweep, findings.found
    span = float(swept.rpm[0]), float(swept.rpm[-1])
    what = f"Case {name}" if findings.published is not None else name
    drawn = pictures(findings, [j.at for j in assessed], chances)
    ratio = float(model.bearing.cage_speed_ratio)
    both = lambda table: with_shaft(table, ratio)
    slopes, statics, at_rest = slope_tables(findings), findings.statics, f"At rest under {float(model.load):g} N"
    context: dict[str, Any] = {
        "title": f"{what}: where the cage moves chaotically",
        "subtitle": f"Cage of a cylindrical roller bearing, {span[0]:.0f} to {span[1]:.0f} rpm of the cage "
        f"({span[0] / ratio:.0f} to {span[1] / ratio:.0f} rpm of the shaft)"
        + (", quick report: no gradients, a coarser sweep" if findings.quick else ""),
        "summary": [*_summary(findings, assessed), *_of_the_unknown(chances, left)],
        "known_tables": [both(t) for t in _known_tables(findings, assessed, chances)],
        "known_notes": [] if chances is None else chances_notes(chances),
        "key_figures": _key_figures(findings),
        "pictures": drawn,
        "operating": [_operating_rows(findings, j) for j in assessed],
        "close_percent": f"{100 * CLOSE:g}",
        "at_speeds": both(at_speeds_table(findings, [j.at for j in assessed])) if assessed else None,
        "resolution": number(swept.resolution_rpm),
        "loss_table": both(loss_table(name, found, findings.loss, findings.published)),
        "zones_table": both(zones_table(name, findings.zones, findings.published, span)),
        "transient_tables": [both(t) for t in transient_tables(name, findings.zones)],
        "zone_notes": coexisting_notes(findings.loss),
        "edge_table": both(_named_edges(findings)),
        "further_edges": len(found.edges) - len({id(p) for p in findings.loss.edges.values()}),
        "map_notes": [
            f"Not followed: {n} ({why})." for n, why in (findings.map.refused if findings.map else {}).items()
        ],
        "slope_tables": slopes,
        "statics": None if statics is None else both(statics_table(at_rest, model, statics)),
        "warnings": [
            *design_rule_violations(model.bearing, model.guidance_gap),
            *model.lubricant.doubts(),
        ],
        "parameters": [
            (group, list(rows))
            for group, rows in itertools.groupby(parameter_rows(model, table, left), key=lambda row: row.group)
        ],
        "checks": checks_table(findings),
        "published_table": published_table(findings),
        "provenance": provenance_table(findings),
        "version": swept.settings.get("version_jaxcage", ""),
        "command": command,
    }
    there = {"operating": bool(assessed), "map": "map" in drawn, "gradients": bool(slopes)}
    there |= {"statics": statics is not None, "known": chances is not None}
    return context | {"links": [(k, text) for k, text in _SECTIONS.items() if there.get(k, True)]}


_SECTIONS = {
    "result": "In short",
    "operating": "Operating speeds",
    "known": "What is known",
    "zones": "Zones",
    "stability": "Synchronous orbit",
    "map": "Map",
    "gradients": "What moves the edges",
    "statics": "Statics",
    "design": "Design",
    "checks": "How sure",
    "computed": "How computed",
}


_STATES = {"close": "close to", "clear": "clear of", "unknown": "not known for"}
"""States as they are said before a kind of zone; others are said as they are."""


def _summary(findings: Findings, assessed: list[Assessed]) -> list[str]:
    swept = findings.sweep
    chaotic, loss = len(findings.zones.zones), len(findings.loss.zones)
    share = float(np.mean(swept.restless))
    said = [
        f"{_counted(chaotic, 'chaotic zone')} and {_counted(loss, 'zone').lower()} without a stable synchronous orbit. "
        f"At {share:.0%} of the {swept.rpm.size} speeds that were swept some start "
        f"of {swept.outcome.shape[1]} is chaotic, for a while at least."
    ]
    calm = calmest(findings)
    if calm is not None:
        said.append(f"The widest range outside all zones goes from {calm[0]:.0f} to {calm[1]:.0f} rpm.")
    for j in assessed:
        states = [_state_words(kind, v.state) for kind, v in j.verdicts.items()]
        said.append(f"{_with_shaft(findings, j.at)}: {', '.join(states)}.")
    said.append(f"All of this rests on two readings: {readings_words(findings.model)}.")
    if np.any(swept.failed):
        said.append(f"{int(np.sum(swept.failed))} of {swept.failed.size} simulations failed: nothing is known of them.")
    return said


def _state_words(kind: str, state: str) -> str:
    return state if state.endswith("chaos") else f"{_STATES.get(state, state)} {kind} zones"


def _of_the_unknown(chances: Ensemble | None, left: Sequence[str]) -> list[str]:
    """What the zones are worth where values are not known, or are those of another bearing."""
    said = []
    if chances is not None:
        said.append(
            f"All zones of this page are those of the best guesses: {len(chances.unknowns)} values are known within "
            f"ranges only. {chances_notes(chances)[0]}"
        )
    if left:
        said.append(f"Values that are still the template's, another bearing's: {', '.join(left)}.")
    return said


def _known_tables(findings: Findings, assessed: list[Assessed], chances: Ensemble | None) -> list[Table]:
    if chances is None:
        return []
    ratio = float(findings.model.bearing.cage_speed_ratio)
    at = [operating_chances(chances, [j.at for j in assessed], ratio)] if assessed else []
    return [*at, *chances_tables(findings.name, chances)]


def _named_edges(findings: Findings) -> Table:
    """The bifurcations that bound a zone; there may be dozens that bound nothing but a small stretch."""
    whole = edge_table(findings.name, findings.found, findings.loss)
    columns = (whole.columns[-1], *whole.columns[:-2])
    rows = [(row[-1], *row[:-2]) for row in whole.rows if row[-1] != "-"]
    nothing = ("none", *(len(columns) - 1) * ("-",))
    return Table("Bifurcations of the synchronous orbit that bound a zone", columns, rows or [nothing], whole.speeds)


def _counted(n: int, what: str) -> str:
    words = {0: "No", 1: "One", 2: "Two", 3: "Three", 4: "Four", 5: "Five", 6: "Six"}
    return f"{words.get(n, str(n))} {what}{'' if n == 1 else 's'}"


def calmest(findings: Findings) -> tuple[float, float] | None:
    """The widest range of the sweep [rpm] outside all zones, transient chaos included; None if there is none."""
    first, last = float(findings.sweep.rpm[0]), float(findings.sweep.rpm[-1])
    taken = sorted(
        zone_span(z, first, last) for z in (*findings.loss.zones, *findings.zones.zones, *findings.zones.transient)
    )
    free, at = [], first
    for low, high in taken:
        free.append((at, low))
        at = max(at, high)
    low, high = max([*free, (at, last)], key=lambda pair: pair[1] - pair[0])
    return (low, high) if high > low else None


def _key_figures(findings: Findings) -> list[tuple[str, str]]:
    model = findings.model
    value, info = parameters(model), parameter_info(model)
    named = []
    for name in ("guidance_gap", "eccentricity", "cage_mass"):
        unit, number_ = shown(float(value[name]), info[name].unit)
        named.append((name.replace("_", " "), f"{number_:.4g} {unit}"))
    oil = 1e3 * float(model.lubricant.dynamic_viscosity)
    rollers = f"{model.bearing.n_rollers} of {1e3 * float(model.bearing.roller_diameter):.4g} mm"
    return [*named, ("viscosity of the oil", f"{oil:.3g} mPa s"), ("rollers", rollers)]


def _with_shaft(findings: Findings, at: Operating) -> str:
    ratio = float(findings.model.bearing.cage_speed_ratio)
    return f"{at} (shaft {at.of_shaft(ratio)})"


def _operating_rows(findings: Findings, assessed: Assessed) -> dict[str, Any]:
    rows = [
        {
            "kind": kind,
            "state": v.state,
            "where": v.where,
            "edge": v.edge or "-",
            "distance": number(v.distance_rpm),
            "percent": number(v.percent, 1),
        }
        for kind, v in assessed.verdicts.items()
    ]
    return {"text": _with_shaft(findings, assessed.at), "verdicts": rows}
