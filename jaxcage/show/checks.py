"""Tables of the report that no command prints: orbits at operating speeds, elasticities, checks, provenance."""

import dataclasses
import json
import os
import platform
from collections.abc import Mapping
from typing import Any

import numpy as np

from .._parameters import parameter_info, parameter_paths, parameters
from ..analysis import Zones, failed, length, resolution_rpm
from ..orbits import Sensitivity
from .design_figures import largest_first
from .findings import Findings, Orbits
from .reproduction import compare_edges
from .sources import readings_words, shown
from .style import readable
from .tables import Column, Table, rows_table


MOST = 14
"""Number of parameters in a table of elasticities."""


def _pairs(title: str, heads: tuple[str, str], rows: Mapping[str, str]) -> Table:
    return Table(title, [Column(heads[0], list(rows)), Column(heads[1], list(rows.values()))])


def at_speeds_table(findings: Findings, orbits: Orbits) -> Table:
    """Synchronous orbits and simulations at the operating speeds, of a range at both its ends."""
    sweep, rows = findings.sweep, []
    rpm = sweep["rpm"].values
    for at in sorted({end for at in findings.operating for end in (at.low_rpm, at.high_rpm)}):
        if not rpm[0] <= at <= rpm[-1]:
            continue
        near = int(np.argmin(np.abs(rpm - at)))
        known = orbits.found.coexisting(at * np.pi / 30)
        sizes = [f"{float(np.max(np.abs(mu))):.3f}" for _, stable, _, mu in known if stable]
        labels = f"{', '.join(sweep['label'].values[near].tolist())} at {rpm[near]:.0f} rpm"
        unstable = sum(not stable for _, stable, _, _ in known)
        rows.append({"speed": at, "stable": ", ".join(sizes) or "none", "unstable": unstable, "labels": labels})
    columns = [
        Column("speed [rpm]", (), key="speed", digits=0),
        Column("stable orbits, by largest |multiplier|", (), key="stable"),
        Column("unstable orbits", (), key="unstable"),
        Column("simulations by initial state", (), key="labels"),
    ]
    return rows_table("Orbits and simulations at the operating speeds", rows, columns)


def elasticity_tables(model: Any, slopes: Mapping[str, Sensitivity]) -> list[Table]:
    """Elasticities of the edges of both kinds, guidance gap and eccentricity on top, then the largest."""
    trusted = {n: with_full_names(model, s) for n, s in slopes.items() if s.trusted}
    kinds = {
        "Elasticities of the synchronous-loss edges": {n: s for n, s in trusted.items() if not n.startswith("chaotic")},
        "Elasticities of the chaotic edges that coincide with a bifurcation or the limit of a cascade": {
            n.removeprefix("chaotic "): s for n, s in trusted.items() if n.startswith("chaotic")
        },
    }
    return [_elasticities(model, title, edges) for title, edges in kinds.items() if edges]


def with_full_names(model: Any, slopes: Sensitivity) -> Sensitivity:
    """Parameters named with the part of the model that they belong to: `contact.onset` and not `onset`."""
    paths = parameter_paths(model)
    change = {".".join(paths[name]): value for name, value in slopes.elasticity.items()}
    return dataclasses.replace(slopes, elasticity=change)


def _elasticities(model: Any, title: str, edges: dict[str, Sensitivity]) -> Table:
    info, value = parameter_info(model), parameters(model)
    short = {".".join(path): name for name, path in parameter_paths(model).items()}
    names = largest_first(list(edges.values()), MOST)
    values = [shown(float(value[short[name]]), info[short[name]].unit) for name in names]
    return Table(
        title,
        [
            Column("parameter", [readable(name) for name in names]),
            Column("value", [f"{number:.4g} {unit}".strip() for unit, number in values]),
            *(
                Column(f"{edge} ({s.value_rpm:.0f} rpm)", [s.elasticity[name] for name in names], digits=3)
                for edge, s in edges.items()
            ),
        ],
    )


def checks_table(findings: Findings) -> Table:
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
            residuals = [abs(r) for s in orbits.slopes.values() if s.trusted for r in s.homogeneity.values()]
            untrusted = [f"{n} ({s.status})" for n, s in orbits.slopes.items() if not s.trusted]
            worst = f"{max(residuals):.0e}" if residuals else "none is to be trusted"
            rows["gradients against the scaling of units, largest relative residual"] = worst
            rows["edges whose gradient is not to be trusted"] = ", ".join(untrusted) or "none"
    return _pairs("Checks of this report", ("check", "result"), rows)


def published_table(findings: Findings) -> list[Table]:
    """Edges beside those of a published case; nothing for another design."""
    published, orbits, zones = findings.published, findings.orbits, findings.zones
    if published is None or orbits is None or not isinstance(zones, Zones):
        return []
    edges = [
        *compare_edges(published, orbits.loss.zones, "synchronous-loss"),
        *compare_edges(published, zones.zones, "chaotic"),
    ]
    rows = [vars(e) | {"here": e.ours_rpm, "difference": e.error_percent} for e in edges]
    columns = [
        Column("edge", ()),
        Column("kind", ()),
        Column("published", (), key="published_rpm", digits=0),
        Column("here", (), digits=0),
        Column("difference [%]", (), key="difference", digits=1),
    ]
    return [rows_table("Against the published edges [rpm]", rows, columns)]


def provenance_table(findings: Findings) -> Table:
    """Versions, machine and settings that a report was made with."""
    sweep, settings = findings.sweep, json.loads(findings.sweep.attrs["settings"])
    versions = [f"{k.removeprefix('version_')} {v}" for k, v in settings.items() if k.startswith("version_")]
    rpm, zones = sweep["rpm"].values, findings.zones
    closed = f"; windows below {zones.close_below_rpm:g} rpm closed" if isinstance(zones, Zones) else ""
    rows = {
        "versions": ", ".join([*versions, f"Python {platform.python_version()}"]),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "readings": readings_words(findings.model),
        "sweep": f"{rpm.size} speeds from {rpm[0]:.0f} to {rpm[-1]:.0f} rpm, {sweep.sizes['start']} initial states",
        "length": length(sweep),
        "resolution": f"{resolution_rpm(sweep):.0f} rpm{closed}",
        "steps of the sweep": " ".join(str(settings.get("method", "")).split()),
        "steps of orbits": "" if findings.orbits is None else findings.orbits.method,
        "random numbers": "none: the initial states are fixed",
        "time": ", ".join(f"{stage} {s:.0f} s" for stage, s in findings.seconds.items()),
    }
    return _pairs("Settings", ("what", "value"), {name: words for name, words in rows.items() if words})
