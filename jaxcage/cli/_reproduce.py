"""`jaxcage reproduce`: the published edges, figures and conclusions beside ours."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..bearing import FIGURE_AXES, PUBLISHED_CASES
from ..models import case
from ..plotting import new_figure, paper_figures, zoomed_diagram
from ..report import Table, number
from ..reproduction import (
    ComparedEdge,
    ReadingResult,
    Runs,
    compare_edges,
    conclusions,
    run_all,
    try_readings,
    zones_in_range,
)
from ._job import Job, save_figure
from ._options import ReproduceOptions
from ._show import Report, chosen


QUICK: dict[str, Any] = {"speeds": 126, "discard": 150, "revolutions": 100, "section_revolutions": 504, "orbits": False}
QUICK_READINGS: dict[str, Any] = {"speeds": 48, "discard": 150, "revolutions": 100}


def reproduce(job: Job[ReproduceOptions]) -> Report:
    """Carry out `jaxcage reproduce`."""
    options = job.options
    models = {name: case(name, options.constants) for name in PUBLISHED_CASES}
    with job.computing() as say:
        runs = run_all(models, report=say, **(QUICK if options.quick else {}))
        checked = conclusions(runs)
        read = try_readings(models, report=say, **(QUICK_READINGS if options.quick else {}))
    figures = {**dict(paper_figures(runs)), "readings": _readings_figure(read)}
    edges = [row for name in PUBLISHED_CASES for row in _edges(runs, name)]
    ranges = _ranges(runs)
    document = {
        **chosen(options, "quick constants"),
        "resolution_rpm": float(next(iter(runs.sweeps.values())).resolution_rpm),
        "edges": [vars(row) | {"error_percent": row.error_percent} for row in edges],
        "summary": {kind: _summary(edges, kind) for kind in ("chaotic", "synchronous-loss")},
        "zones": {name: len(zones_in_range(z.zones)) for name, z in runs.zones.items()},
        "ranges": ranges,
        "conclusions": [vars(c) for c in checked],
        "readings": [_reading_document(r) for r in read],
        "figures": [
            str(save_figure(figure, job.folder / f"{name}.png", options.style)) for name, figure in figures.items()
        ],
    }
    tables = [
        _edges_table(edges, document["resolution_rpm"]),
        _ranges_table(ranges),
        Table("The paper's conclusions", ("claim", "verdict"), [(c.claim, c.verdict) for c in checked]),
        _readings_table(read),
    ]
    evidence = [f"  {c.claim.split('.')[0].split(':')[0]}: {c.evidence}" for c in checked]
    return Report(document, tables, ["Evidence", *evidence, *_notes(document), f"Figures: {job.folder}"])


def _edges(runs: Runs, name: str) -> list[ComparedEdge]:
    published = PUBLISHED_CASES[name]
    found = compare_edges(published, runs.zones[name].zones, "chaotic")
    if name in runs.loss:
        found += compare_edges(published, runs.loss[name].zones, "synchronous-loss")
    return found


def _summary(edges: list[ComparedEdge], kind: str) -> dict[str, Any]:
    """How many of the published edges were found, how many within 10 %, and the median error."""
    own = [row for row in edges if row.kind == kind]
    errors = np.array([abs(row.error_percent) for row in own if row.error_percent is not None])
    return {
        "published": len(own),
        "found": int(errors.size),
        "within_10_percent": int(np.sum(errors <= 10)),
        "median_error_percent": float(np.median(errors)) if errors.size else None,
    }


def _edges_table(edges: list[ComparedEdge], resolution: float) -> Table:
    rows = []
    for row in edges:
        plus = "" if row.uncertainty_rpm is None else f" ± {row.uncertainty_rpm:.3g}"
        ours = "none" if row.ours_rpm is None else f"{row.ours_rpm:.0f}{plus}"
        error = "-" if row.error_percent is None else f"{row.error_percent:+.1f} %"
        rows.append((row.case, row.edge, number(row.published_rpm), row.kind, ours, error, row.mechanism or "-"))
    columns = ("case", "edge", "published", "kind", "ours", "error", "mechanism")
    return Table(f"Published edges and ours [rpm], sweeps at {resolution:.0f} rpm", columns, rows)


def _ranges(runs: Runs) -> list[dict[str, Any]]:
    """Ranges of the strobe points beside the limits of the printed axes, which are not ranges of the motion."""
    found = []
    for name, figure, low, high in (("fig. 7", "7", 2500.0, 27500.0), ("fig. 8a", "8a", 7000.0, 22000.0)):
        ys = [
            s.strobe[(s.rpm >= low) & (s.rpm <= high)][..., 1]
            for c, s in runs.sweeps.items()
            if figure == "7" or c[0] == "1"
        ]
        found.append(_range(name, "vertical displacement", "mm", figure, np.concatenate([1e3 * y.ravel() for y in ys])))
    sections = np.concatenate([s.strobe[0, 0] for s in runs.sections.values()])
    half = sections.shape[-1] // 2
    found.append(_range("fig. 9", "vertical displacement", "mm", "9", 1e3 * sections[:, 1]))
    found.append(_range("fig. 9", "vertical velocity", "mm/s", "9", 1e3 * sections[:, 1 + half]))
    return found


def _range(name: str, quantity: str, unit: str, figure: str, values: np.ndarray) -> dict[str, Any]:
    axis = next(a for a in FIGURE_AXES if a.figure == figure and a.quantity == quantity)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    inside = axis.lower <= low and high <= axis.upper
    printed = {"axis_lower": axis.lower, "axis_upper": axis.upper, "inside": inside}
    return {"figure": name, "quantity": quantity, "unit": unit, "lower": low, "upper": high, **printed}


def _ranges_table(ranges: list[dict[str, Any]]) -> Table:
    rows = [
        (
            r["figure"],
            f"{r['quantity']} [{r['unit']}]",
            f"{r['lower']:.3g} to {r['upper']:.3g}",
            f"{r['axis_lower']:g} to {r['axis_upper']:g}",
            "yes" if r["inside"] else "no",
        )
        for r in ranges
    ]
    return Table("Ranges of the strobe points", ("figure", "quantity", "ours", "printed axis", "inside"), rows)


def _reading_document(r: ReadingResult) -> dict[str, Any]:
    return {
        **chosen(r.reading, "case question answer"),
        **chosen(r, "chaotic_share zones failed"),
        "edges": {e.edge: e.ours_rpm for e in r.edges},
    }


def _readings_table(read: list[ReadingResult]) -> Table:
    rows = [
        (
            r.reading.case,
            f"{r.reading.question}: {r.reading.answer}",
            f"{100 * r.chaotic_share:.0f} %",
            str(r.zones),
            *(number(e.ours_rpm) for e in r.edges),
            str(r.failed),
        )
        for r in read
    ]
    columns = ("case", "reading", "chaotic", "zones", "zone 1 onset", "zone 1 exit", "zone 2 onset", "failed")
    return Table("Readings of the paper [rpm]", columns, rows)


def _readings_figure(read: list[ReadingResult]) -> Figure:
    columns = 3
    figure = new_figure(12.0, 2.4 * -(-len(read) // columns))
    cells = figure.subplots(-(-len(read) // columns), columns, sharex=True, squeeze=False).ravel()
    for ax, r in zip(cells, read, strict=False):
        zoomed_diagram(r.sweep, 4000.0, 27500.0, 1, ax)
        ax.set_title(f"{r.reading.case}, {r.reading.question}: {r.reading.answer}", loc="left", fontsize=9)
        ax.set_xlabel("")
    for ax in cells[len(read) :]:
        ax.set_visible(False)
    return figure


def _notes(document: dict[str, Any]) -> list[str]:
    notes = []
    for kind, s in document["summary"].items():
        if s["published"]:
            median = "-" if s["median_error_percent"] is None else f"{s['median_error_percent']:.1f} %"
            notes.append(
                f"{kind}: {s['found']} of {s['published']} edges found, {s['within_10_percent']} within 10 %, "
                f"median error {median}"
            )
    listed = ", ".join(f"{name} {n}" for name, n in document["zones"].items())
    return [*notes, f"Chaotic zones between 4000 and 27500 rpm: {listed}"]
