"""`jaxcage reproduce`: the published edges, figures and conclusions beside ours."""

from typing import Any

from ..bearing import PUBLISHED_CASES
from ..models import case
from ..plotting import paper_figures, readings_figure
from ..report import Table, chosen, compared_table, ranges_table, readings_table, two_zones_table
from ..reproduction import (
    OBSERVERS,
    ReadingResult,
    conclusions,
    edges_of,
    ranges_of,
    run_all,
    summary,
    try_readings,
    wide_zones,
)
from ._job import Job
from ._options import ReproduceOptions
from ._show import Report


QUICK: dict[str, Any] = {
    "speeds": 101,
    "discard": 150,
    "revolutions": 100,
    "section_revolutions": 504,
    "orbits": False,
    "observers": OBSERVERS[:1],
}
QUICK_READINGS: dict[str, Any] = {"speeds": 24, "discard": 150, "revolutions": 100}


def reproduce(job: Job[ReproduceOptions]) -> Report:
    """Carry out `jaxcage reproduce`."""
    options = job.options
    models = {name: case(name, options.constants) for name in PUBLISHED_CASES}
    with job.computing() as say:
        runs = run_all(models, report=say, **(QUICK if options.quick else {}))
        checked = conclusions(runs)
        read = try_readings(models, report=say, **(QUICK_READINGS if options.quick else {}))
    figures = {**dict(paper_figures(runs)), "readings": readings_figure(read)}
    edges = [row for name in PUBLISHED_CASES for row in edges_of(runs, name)]
    kinds = list(dict.fromkeys(row.kind for row in edges))
    wide = {name: {k: len(wide_zones(z)) for k, z in runs.zones_by_kind(name).items()} for name in PUBLISHED_CASES}
    ranges = ranges_of(runs)
    document = {
        **chosen(options, "quick constants"),
        "resolution_rpm": float(next(iter(runs.sweeps.values())).resolution_rpm),
        "edges": [vars(row) | {"error_percent": row.error_percent} for row in edges],
        "summary": {kind: summary(edges, kind) for kind in kinds},
        "zones": wide,
        "observers": {o.name: o.settings() for o in OBSERVERS if o.name in runs.diagrams},
        "ranges": ranges,
        "conclusions": [vars(c) for c in checked],
        "readings": [_reading_document(r) for r in read],
        "figures": [str(job.saved(figure, job.folder / f"{name}.png")) for name, figure in figures.items()],
    }
    tables = [
        two_zones_table(wide),
        compared_table(edges, document["resolution_rpm"]),
        ranges_table(ranges),
        Table("The paper's conclusions", ("claim", "verdict"), [(c.claim, c.verdict) for c in checked]),
        readings_table(read),
    ]
    evidence = [f"  {c.claim.split('.')[0].split(':')[0]}: {c.evidence}" for c in checked]
    return Report(document, tables, ["Evidence", *evidence, *_notes(document), f"Figures: {job.folder}"])


def _reading_document(r: ReadingResult) -> dict[str, Any]:
    return {
        **chosen(r.reading, "case question answer"),
        **chosen(r, "chaotic_share zones failed"),
        "edges": {e.edge: e.ours_rpm for e in r.edges},
    }


def _notes(document: dict[str, Any]) -> list[str]:
    notes = []
    for kind, s in document["summary"].items():
        median = "-" if s["median_error_percent"] is None else f"{s['median_error_percent']:.1f} %"
        notes.append(
            f"{kind}: {s['found']} of {s['published']} edges found, {s['within_10_percent']} within 10 %, "
            f"median error {median}"
        )
    return [*notes, *(f"{name}: {how}" for name, how in document["observers"].items())]
