"""Sweeps over speed: orbit diagram, exponents and zones; exact edges and their gradients beside them."""

import collections
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..analysis import Sweep, Zones, waterfall, zones
from ..integrate import OUTCOMES
from ..io import save_sweep
from ..orbits import Cascade, Explained, Sensitivity, explain, loss_zones, synchronous_orbits
from ..plotting import new_figure, sweep_figure, waterfall_map, zoomed_diagram
from ..report import (
    Table,
    contact_notes,
    edge_slopes,
    error_cell,
    loss_table,
    number,
    require_some,
    transient_tables,
    unsettled_notes,
    zone_document,
    zones_document,
    zones_table,
)
from ..sweeps import rpm, sweep
from ._console import say, warn_of_short
from ._job import Job, blocks_of, samples_per_revolution
from ._options import SweepOptions, ZonesOptions
from ._show import Report, chosen, shares_table


SHOWN = ("guidance_gap", "eccentricity")
"""Parameters in the table of elasticities."""


def _swept(job: Job[SweepOptions]) -> Sweep:
    """The sweep that the options describe, stored."""
    options = job.options
    with job.computing("sweep") as say:
        found = sweep(
            job.model,
            rpm(options.first, options.last, options.count),
            discard=options.discard,
            revolutions=options.revolutions,
            confirm=options.confirm,
            horizon=options.horizon,
            exponents=options.exponents,
            blocks=blocks_of(options.revolutions),
            method=job.method,
            progress=lambda done, total: say("", done, total),
        )
    require_some(found.outcome)
    job.listed("data", save_sweep(job.folder / f"sweep_{job.name}.zarr", found, job.model))
    return found


def sweep_over_speed(job: Job[SweepOptions]) -> Report:
    """`jaxcage sweep`: orbit diagram, exponents and zones of a case over speed."""
    found = _swept(job)
    edges = zones(found)
    job.figure(sweep_figure(found, edges, job.published, _title(job, found)))
    _zoom(job, found, edges)
    _waterfall(job, found)
    beyond, short = int(np.sum(found.peak > 1)), int(np.sum(found.too_short))
    if beyond:
        say(f"Warning: {beyond} lanes went beyond eps = 1, where the surfaces would overlap.")
    warn_of_short(short)
    counts = dict(sorted(collections.Counter(found.label.ravel().tolist()).items()))
    document = zones_document(job.name, edges, job.published) | _extent(found)
    document |= {"labels": counts, "beyond_clearance": beyond, "too_short": short}
    document["confirmed"] = [each._asdict() for each in found.confirmed]
    speeds, starts = found.outcome.shape
    title = f"Lanes: {speeds} speeds x {starts} starts, {found.length}"
    tables = [shares_table(title, ("label", "lanes", "share"), counts), *_zone_tables(job, found, edges)]
    return Report(document, tables, _sweep_notes(document))


def _extent(found: Sweep) -> dict[str, Any]:
    """What was swept, how long, what failed, and the largest error of a revolution [system's scale], for programs."""
    speeds, starts = found.outcome.shape
    codes = collections.Counter(found.outcome[found.failed].tolist())
    return {
        "speeds": speeds,
        "starts": starts,
        **chosen(found, "discard revolutions"),
        "failed": {OUTCOMES[code]: n for code, n in sorted(codes.items())},
        "error": float(np.max(found.error[~found.failed])),
    }


def _zone_tables(job: Job[SweepOptions], found: Sweep, edges: Zones) -> list[Table]:
    span = float(found.rpm[0]), float(found.rpm[-1])
    return [zones_table(job.name, edges, job.published, span), *transient_tables(job.name, edges)]


def _sweep_notes(document: Mapping[str, Any]) -> list[str]:
    failed = ", ".join(f"{n} {name}" for name, n in document["failed"].items())
    return [
        f"Failed lanes: {failed or 'none'}",
        f"Lanes beyond eps = 1: {document['beyond_clearance']}",
        f"Error of a revolution: at most {document['error']:.0e} of the clearance",
        *(
            f"Confirmed by steps at most 1/{2 << i} as long: {each['changed']} of {each['lanes']} labels changed"
            for i, each in enumerate(document["confirmed"])
        ),
    ]


def _title(job: Job[SweepOptions], found: Sweep) -> str:
    what = job.name if job.published is None else f"Case {job.name}"
    gap, e = 1e3 * float(job.model.guidance_gap), 1e6 * float(job.model.eccentricity)
    lasting = f", chaos followed to {found.horizon} revolutions" if found.horizon else ""
    return f"{what}: guidance gap {gap:.3g} mm, eccentricity {e:.3g} µm{lasting}"


def _zoom(job: Job[SweepOptions], found: Sweep, edges: Zones) -> None:
    """The widest closed zone enlarged, with a fifth of its width at either side."""
    closed = [z for z in edges.zones if z.width_rpm]
    if closed:
        zone = max(closed, key=lambda z: z.width_rpm or 0.0)
        assert zone.onset is not None and zone.exit is not None and zone.width_rpm is not None
        onset, leaves, width = zone.onset.speed_rpm, zone.exit.speed_rpm, zone.width_rpm
        figure = new_figure(9.0, 5.0)
        zoomed_diagram(found, onset - 0.2 * width, leaves + 0.2 * width, ax=figure.subplots())
        figure.suptitle(f"{_title(job, found)}, widest zone", fontsize=11)
        job.figure(figure, "zoom", "_zoom")


def _waterfall(job: Job[SweepOptions], found: Sweep) -> None:
    """Spectra of the vertical motion over speed, if asked for."""
    if job.options.waterfall:
        speeds = np.linspace(found.speed[0], found.speed[-1], job.options.waterfall)
        samples = samples_per_revolution(job.method)
        spectra = waterfall(job.model, speeds, component=1, samples=samples, method=job.method)
        figure = new_figure(9.0, 5.0)
        waterfall_map(spectra.rpm, spectra.order, spectra.amplitude, figure.subplots())
        figure.suptitle(f"{_title(job, found)}: spectra of the vertical motion", fontsize=11)
        job.figure(figure, "waterfall", "_waterfall")


def zones_over_speed(job: Job[ZonesOptions]) -> Report:
    """`jaxcage zones`: where the synchronous orbit is lost, with exact edges and gradients, beside where chaos is."""
    swept = _swept(job)
    first, last = float(swept.speed[0]), float(swept.speed[-1])
    with job.computing("synchronous orbits") as say:
        found = synchronous_orbits(job.model, first, last, settled=swept, method=job.asked, progress=say)
        loss = loss_zones(found)
        explained = explain(zones(swept), found, job.model, job.asked)
        slopes = {} if job.options.quick else edge_slopes(job.model, loss, explained, job.asked)
    edges = explained.zones
    document = zones_document(job.name, edges, job.published) | _extent(swept)
    document["synchronous_loss"] = [
        zone_document(zone) | {f"{end}_gradient": _slopes(slopes, f"zone {i} {end}") for end in ("onset", "exit")}
        for i, zone in enumerate(loss.zones, start=1)
    ]
    for i, zone in enumerate(document["zones"], start=1):
        zone |= _source_document(i, explained, slopes)
    tables = [
        loss_table(job.name, found, loss, job.published),
        *([_elasticities_table(job.name, slopes)] if slopes else []),
        *_zone_tables(job, swept, edges),
    ]
    notes = [*_source_notes(explained), *contact_notes(job.model, loss.edges, job.asked), *unsettled_notes(found)]
    return Report(document, tables, notes)


def _slopes(slopes: Mapping[str, Sensitivity], edge: str) -> dict[str, Any] | None:
    """The gradient of an edge [rpm per SI unit], None where it was left out."""
    if edge not in slopes:
        return None
    return chosen(slopes[edge], "trusted status error_rpm steps transversality derivative elasticity")


def _source_document(i: int, explained: Explained, slopes: Mapping[str, Sensitivity]) -> dict[str, Any]:
    """What the edges of a chaotic zone were taken from; a bifurcation brings its gradient."""
    found: dict[str, Any] = {}
    zone = explained.zones.zones[i - 1]
    for end, edge in (("onset", zone.onset), ("exit", zone.exit)):
        source = explained.sources.get(f"zone {i} {end}")
        found[f"{end}_basis"] = edge and edge.basis
        found[f"{end}_cascade_rpm"] = _cascade_rpm(source) if isinstance(source, Cascade) else None
        found[f"{end}_gradient"] = _slopes(slopes, f"chaotic zone {i} {end}")
    return found


def _cascade_rpm(cascade: Cascade) -> list[float]:
    return [float(p.speed_rpm) for p in cascade.points]


def _elasticities_table(name: str, slopes: Mapping[str, Sensitivity]) -> Table:
    """Relative change of an edge per relative change of the parameter."""
    rows = [
        (
            edge,
            s.kind,
            number(s.value_rpm, 2),
            error_cell(s.error_rpm),
            *(f"{s.elasticity[n]:+.4f}" for n in SHOWN),
            s.status,
        )
        for edge, s in slopes.items()
    ]
    columns = ("edge", "by", "speed [rpm]", "±", *(n.replace("_", " ") for n in SHOWN), "status")
    return Table(f"Elasticities of the exact edges of {name}", columns, rows)


def _source_notes(explained: Explained) -> list[str]:
    edges = [e for zone in explained.zones.zones for e in (zone.onset, zone.exit) if e is not None]
    statistical = sum(e.basis == "statistical" for e in edges)
    notes = [f"Chaotic edges that stay statistical: {statistical} of {len(edges)}"]
    for name, source in explained.sources.items():
        if isinstance(source, Cascade):
            doublings = ", ".join(number(rpm, 1) for rpm in _cascade_rpm(source))
            notes.append(f"Chaotic {name}: limit of the cascade with period doublings at {doublings} rpm")
        else:
            notes.append(f"Chaotic {name}: coincides with the {source.kind} at {source.speed_rpm:.2f} rpm")
    return notes
