"""The tables of the page that no command prints."""

import dataclasses
import os
import platform
from collections.abc import Sequence

import numpy as np

from .._parameters import parameter_info, parameter_paths, parameters
from ..orbits import Sensitivity
from ..plotting._elasticities import largest_first
from ._findings import Findings
from ._operating import Operating
from ._reproduce import compare_edges
from ._sources import readings_words, shown
from ._table import Table, number, speed


MOST = 14
"""Parameters in a table of elasticities."""


def at_speeds_table(findings: Findings, operating: Sequence[Operating]) -> Table:
    """Synchronous orbits and simulations at the operating speeds, of a range at both its ends."""
    found, swept, rows = findings.found, findings.sweep, []
    for rpm in sorted({rpm for at in operating for rpm in (at.low_rpm, at.high_rpm)}):
        if not swept.rpm[0] <= rpm <= swept.rpm[-1]:
            continue
        near = int(np.argmin(np.abs(swept.rpm - rpm)))
        labels = ", ".join(str(label) for label in swept.label[near])
        orbits = found.coexisting(rpm * np.pi / 30)
        sizes = [f"{float(np.max(np.abs(mu))):.3f}" for _, stable, _, mu in orbits if stable]
        unstable = str(sum(not stable for _, stable, _, _ in orbits))
        rows.append((speed(rpm), ", ".join(sizes) or "none", unstable, f"{labels} at {swept.rpm[near]:.0f} rpm"))
    columns = (
        "speed [rpm]",
        "stable orbits, by largest |multiplier|",
        "unstable orbits",
        "simulations by start",
    )
    return Table("Orbits and simulations at the operating speeds", columns, rows, ("speed [rpm]",))


def slope_tables(findings: Findings) -> list[Table]:
    """Elasticities of the edges of both kinds, guidance gap and eccentricity on top, then the largest."""
    trusted = {n: with_full_names(findings, s) for n, s in findings.slopes.items() if s.trusted}
    kinds = {
        "Elasticities of the synchronous-loss edges": {n: s for n, s in trusted.items() if not n.startswith("chaotic")},
        "Elasticities of the chaotic edges that coincide with a bifurcation or the limit of a cascade": {
            n.removeprefix("chaotic "): s for n, s in trusted.items() if n.startswith("chaotic")
        },
    }
    return [_slope_table(findings, title, edges) for title, edges in kinds.items() if edges]


def with_full_names(findings: Findings, slopes: Sensitivity) -> Sensitivity:
    """Parameters called by the part of the model that they belong to: `contact.onset` and not `onset`."""
    paths = parameter_paths(findings.model)
    change = {".".join(paths[name]): value for name, value in slopes.elasticity.items()}
    return dataclasses.replace(slopes, elasticity=change)


def _slope_table(findings: Findings, title: str, edges: dict[str, Sensitivity]) -> Table:
    info, value = parameter_info(findings.model), parameters(findings.model)
    short = {".".join(path): name for name, path in parameter_paths(findings.model).items()}
    rows = []
    for name in largest_first(list(edges.values()), MOST):
        unit, number_ = shown(float(value[short[name]]), info[short[name]].unit)
        cells = (f"{s.elasticity[name]:+.3f}".replace("-", "−") for s in edges.values())
        rows.append((name.replace("_", " ").replace(".", " "), f"{number_:.4g} {unit}".strip(), *cells))
    heads = (f"{n} ({s.value_rpm:.0f} rpm)" for n, s in edges.items())
    return Table(title, ("parameter", "value", *heads), rows)


def checks_table(findings: Findings) -> Table:
    """What this report itself can say about its numbers."""
    swept, found = findings.sweep, findings.found
    edges = [e for zone in findings.zones.zones for e in (zone.onset, zone.exit) if e is not None]
    exact = f"{sum(e.basis != 'statistical' for e in edges)} of {len(edges)}" if not findings.quick else "not tried"
    changed = ", then ".join(f"{each.changed} of {each.lanes}" for each in swept.confirmed)
    rows = [
        ("simulations that failed", f"{int(np.sum(swept.failed))} of {swept.outcome.size}"),
        ("labels that changed when confirmed by finer steps", changed or "none confirmed"),
        ("largest error of a revolution, of the clearance", f"{np.max(swept.error[~swept.failed], initial=0.0):.0e}"),
        ("simulations that went beyond eps = 1, where surfaces would overlap", str(int(np.sum(swept.peak > 1)))),
        ("simulations of which it is undecided what they do", str(int(np.sum(swept.label == "undecided")))),
        ("settled synchronous orbits that lie on no branch that was followed", str(found.missed)),
        ("chaotic edges that coincide with something solved for", exact),
    ]
    if findings.slopes:
        residuals = [abs(r) for s in findings.slopes.values() if s.trusted for r in s.homogeneity.values()]
        lost = [f"{n} ({s.status})" for n, s in findings.slopes.items() if not s.trusted]
        worst = f"{max(residuals):.0e}" if residuals else "none is to be trusted"
        rows.append(("gradients against the scaling of units, largest relative residual", worst))
        rows.append(("edges whose gradient is not to be trusted", ", ".join(lost) or "none"))
    return Table("Checks of this report", ("check", "result"), rows)


def published_table(findings: Findings) -> Table | None:
    if findings.published is None:
        return None
    compared = [
        *compare_edges(findings.published, findings.loss.zones, "synchronous-loss"),
        *compare_edges(findings.published, findings.zones.zones, "chaotic"),
    ]
    off = lambda row: "-" if row.error_percent is None else f"{row.error_percent:+.1f} %".replace("-", "−")
    columns = {
        "edge": "{.edge}",
        "kind": "{.kind}",
        "published": lambda row: number(row.published_rpm),
        "here": lambda row: number(row.ours_rpm, nothing="none"),
        "difference": off,
    }
    return Table.of("Against the published edges [rpm]", columns, compared)


def provenance_table(findings: Findings) -> Table:
    swept = findings.sweep
    settings = swept.settings
    versions = [f"{k.removeprefix('version_')} {v}" for k, v in settings.items() if k.startswith("version_")]
    speeds, starts = swept.outcome.shape
    rows = [
        ("versions", ", ".join([*versions, f"Python {platform.python_version()}"])),
        ("machine", f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"),
        ("readings", readings_words(findings.model)),
        ("sweep", f"{speeds} speeds from {swept.rpm[0]:.0f} to {swept.rpm[-1]:.0f} rpm, {starts} starts"),
        ("revolutions", f"{swept.discard} left out, {swept.revolutions} observed, chaos followed to {swept.horizon}"),
        ("resolution", f"{swept.resolution_rpm:.0f} rpm; windows below {findings.zones.close_below_rpm:g} rpm closed"),
        ("steps of the sweep", " ".join(str(settings.get("method", "")).split())),
        ("steps of orbits", " ".join(findings.orbit_method.split())),
        ("random numbers", "none: the starts are fixed"),
        ("time", ", ".join(f"{stage} {s:.0f} s" for stage, s in findings.seconds.items())),
    ]
    return Table("Settings", ("what", "value"), rows)
