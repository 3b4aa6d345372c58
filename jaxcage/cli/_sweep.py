"""Sweeps over speed: orbit diagram, exponents and zones; exact edges and their gradients beside them."""

import collections
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from .. import report
from ..analysis import Sweep, Zones, zones
from ..io import save_sweep
from ..orbits import explain, loss_zones, synchronous_orbits
from ..plotting import sweep_figure, zoomed_diagram
from ..solve import OUTCOMES
from ..sweeps import rpm, sweep
from ._chances import chances
from ._console import say, warn_of_short
from ._job import Job, blocks_of
from ._options import SweepOptions, ZonesOptions
from ._show import Report


ENDS = ("onset", "exit")
SPEEDS = 251


def _swept(job: Job[SweepOptions]) -> Sweep:
    """The sweep that the options describe, stored."""
    options = job.options
    with job.computing("sweep") as say:
        found = sweep(
            job.model,
            rpm(options.first, options.last, options.count or SPEEDS),
            **job.given("discard revolutions confirm horizon exponents"),
            blocks=blocks_of(options.revolutions),
            method=job.method,
            progress=partial(say, ""),
        )
    report.require_some(found.outcome)
    job.listed("data", save_sweep(job.folder / f"sweep_{job.name}.zarr", found, job.model))
    return found


def sweep_over_speed(job: Job[SweepOptions]) -> Report:
    """`jaxcage sweep`: orbit diagram, exponents and zones of a case over speed."""
    if job.unknowns and not job.options.nominal:
        return chances(job)
    found = _swept(job)
    edges = zones(found)
    job.figure(sweep_figure(found, edges, job.published, _title(job, found)))
    _zoom(job, found, edges)
    beyond, short = int(np.sum(found.peak > 1)), int(np.sum(found.too_short))
    if beyond:
        say(f"Warning: {beyond} lanes went beyond eps = 1, where the surfaces would overlap.")
    warn_of_short(short, found.cure)
    counts = dict(sorted(collections.Counter(found.label.ravel().tolist()).items()))
    document = report.zones_document(job.name, edges, job.published) | _extent(found)
    document |= {"labels": counts, "beyond_clearance": beyond, "too_short": short}
    document["confirmed"] = [each._asdict() for each in found.confirmed]
    speeds, starts = found.outcome.shape
    title = f"Lanes: {speeds} speeds x {starts} starts, {found.length}"
    tables = [report.shares_table(title, "label lanes", counts), *_zone_tables(job, found, edges)]
    return Report(document, tables, _sweep_notes(document))


def _extent(found: Sweep) -> dict[str, Any]:
    """What was swept, how long, what failed, and the largest error of a revolution [system's scale], for programs."""
    speeds, starts = found.outcome.shape
    codes = collections.Counter(found.outcome[found.failed].tolist())
    return {
        "speeds": speeds,
        "starts": starts,
        **report.chosen(found, "discard revolutions"),
        "failed": {OUTCOMES[code]: n for code, n in sorted(codes.items())},
        "error": float(np.max(found.error[~found.failed])),
    }


def _zone_tables(job: Job[SweepOptions], found: Sweep, edges: Zones) -> list[report.Table]:
    span = float(found.rpm[0]), float(found.rpm[-1])
    return [report.zones_table(job.name, edges, job.published, span), *report.transient_tables(job.name, edges)]


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
    return f"{what}: guidance gap {gap:.3g} mm, eccentricity {e:.3g} µm\n{report.short_readings(job.model)}{lasting}"


def _zoom(job: Job[SweepOptions], found: Sweep, edges: Zones) -> None:
    """The widest closed zone enlarged, with a fifth of its width at either side."""
    zone = max(edges.zones, key=lambda z: z.width_rpm or 0.0, default=None)
    if zone and zone.width_rpm and zone.onset and zone.exit:
        low, high = zone.onset.speed_rpm - 0.2 * zone.width_rpm, zone.exit.speed_rpm + 0.2 * zone.width_rpm
        title = f"{_title(job, found)}, widest zone"
        job.draw(lambda ax: zoomed_diagram(found, low, high, ax=ax), (9.0, 5.0), title, "zoom", "_zoom")


def zones_over_speed(job: Job[ZonesOptions]) -> Report:
    """`jaxcage zones`: where the synchronous orbit is lost, with exact edges and gradients, beside where chaos is."""
    if job.unknowns and not job.options.nominal:
        return chances(job)
    swept = _swept(job)
    first, last = float(swept.speed[0]), float(swept.speed[-1])
    with job.computing("synchronous orbits") as say:
        found = synchronous_orbits(job.model, first, last, settled=swept, method=job.asked, progress=say)
        loss = loss_zones(found)
        explained = explain(zones(swept), found, job.model, job.asked)
        slopes = {} if job.options.quick else report.edge_slopes(job.model, loss, explained, job.asked)
    edges = explained.zones
    document = report.zones_document(job.name, edges, job.published) | _extent(swept)
    slopes_of = lambda edge: report.slopes_document(slopes, edge)
    document["synchronous_loss"] = [
        report.zone_document(zone) | {f"{end}_gradient": slopes_of(f"zone {i} {end}") for end in ENDS}
        for i, zone in enumerate(loss.zones, start=1)
    ]
    for i, zone in enumerate(document["zones"], start=1):
        zone |= report.source_document(i, explained, slopes)
    tables = [
        report.loss_table(job.name, found, loss, job.published),
        *([report.elasticities_table(job.name, slopes)] if slopes else []),
        *_zone_tables(job, swept, edges),
    ]
    notes = [
        *report.source_notes(explained),
        *report.contact_notes(job.model, loss.edges, job.asked),
        *report.unsettled_notes(found),
    ]
    return Report(document, tables, notes)
