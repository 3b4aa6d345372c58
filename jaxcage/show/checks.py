"""Tables of the report that say how sure its numbers are and how they were computed."""

import json
import os
import platform
from collections.abc import Mapping

import numpy as np

from ..analysis import Zones, failed, length, resolution_rpm
from .findings import Findings
from .sources import readings_words
from .tables import Column, Table


def _pairs(title: str, heads: tuple[str, str], rows: Mapping[str, str]) -> Table:
    return Table(title, [Column(heads[0], list(rows)), Column(heads[1], list(rows.values()))])


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
