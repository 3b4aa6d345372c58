"""`jaxcage sweep`: orbit diagram, exponents and zones of a case over speed."""

import collections
import dataclasses
import time
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis import Sweep, Zones, waterfall, zones
from ..integrate import OUTCOMES
from ..io import save_sweep
from ..plotting import new_figure, sweep_figure, waterfall_map, zoomed_diagram
from ..report import transient_tables, zones_document, zones_table
from ..sweeps import rpm, sweep
from ._console import progress, say, warn_of_short
from ._errors import (
    ComputationError,
    UsageError,
    require_at_least,
    require_blocks,
    require_range,
    require_speed,
)
from ._inputs import (
    Subject,
    output_folder,
    samples_per_revolution,
    save_figure,
    subject,
    sweep_integration,
)
from ._options import SweepOptions
from ._report import Report, Table


@dataclasses.dataclass(frozen=True)
class Swept:
    """A sweep that is done and stored."""

    subject: Subject
    sweep: Sweep
    folder: Path
    data: str
    seconds: float

    @property
    def range_rpm(self) -> tuple[float, float]:
        """First and last speed [rpm]."""
        return float(self.sweep.rpm[0]), float(self.sweep.rpm[-1])


def _check(options: SweepOptions) -> None:
    require_speed("--first", options.first)
    require_speed("--last", options.last)
    require_at_least("--count", options.count, 1)
    if options.count > 1:
        require_range(options.first, options.last)
    require_at_least("--discard", options.discard, 0)
    require_at_least("--horizon", options.horizon, 0)
    require_at_least("--exponents", options.exponents, 1)
    require_at_least("--waterfall", options.waterfall, 0)


def sweep_case(options: SweepOptions) -> Swept:
    """Check everything, run the sweep that the options describe, and store it."""
    _check(options)
    blocks = require_blocks("--revolutions", options.revolutions)
    chosen = sweep_integration(options)
    about = subject(options)
    if options.exponents > about.model.dimension:
        raise UsageError(
            f"Option --exponents must be at most {about.model.dimension}, but {options.exponents} was given."
        )
    folder = output_folder(options)
    speeds = rpm(options.first, options.last, options.count)
    began = time.perf_counter()
    with progress(f"sweep {about.name}") as bar:
        found = sweep(
            about.model,
            speeds,
            discard=options.discard,
            revolutions=options.revolutions,
            confirm=options.confirm,
            horizon=options.horizon,
            exponents=options.exponents,
            blocks=blocks,
            method=chosen,
            progress=bar,
        )
    seconds = time.perf_counter() - began
    if np.all(found.failed):
        names = ", ".join(sorted({OUTCOMES[code] for code in found.outcome.ravel()}))
        raise ComputationError(f"All {found.outcome.size} lanes failed ({names}): try more --steps.")
    data = save_sweep(folder / f"sweep_{about.name}.zarr", found, about.model)
    return Swept(about, found, folder, str(data), seconds)


def run(options: SweepOptions) -> Report:
    """Carry out `jaxcage sweep`."""
    swept = sweep_case(options)
    about, found = swept.subject, swept.sweep
    edges = zones(found)
    figure = sweep_figure(found, edges, about.published, _title(swept))
    stem = f"sweep_{about.name}"
    figures = {"figure": save_figure(figure, swept.folder / f"{stem}.png")}
    figures |= _zoom(swept, edges) | _waterfall(swept, options)
    counts = collections.Counter(found.label.ravel().tolist())
    document = zones_document(about.name, edges, about.published) | {
        "labels": dict(sorted(counts.items())),
        "failed": failed_lanes(found),
        "beyond_clearance": int(np.sum(found.peak > 1)),
        "too_short": int(np.sum(found.too_short)),
        **extent(found),
        "confirmed": [each._asdict() for each in found.confirmed],
        "seconds": round(swept.seconds, 2),
        **figures,
        "data": swept.data,
    }
    zone_table = zones_table(about.name, edges, about.published, swept.range_rpm)
    tables = [_label_table(found, counts), zone_table, *transient_tables(about.name, edges)]
    return Report(document, tables, _notes(document))


def extent(found: Sweep) -> dict[str, Any]:
    """What was swept, how long, and the largest error of a revolution [system's scale], for programs."""
    speeds, starts = found.outcome.shape
    length = {"discard": found.discard, "revolutions": found.revolutions}
    return {"speeds": speeds, "starts": starts, **length, "error": float(np.max(found.error[~found.failed]))}


def _zoom(swept: Swept, edges: Zones) -> dict[str, str]:
    """The widest closed zone enlarged, with a fifth of its width at either side."""
    closed = [zone for zone in edges.zones if zone.width_rpm]
    if not closed:
        return {}
    zone = max(closed, key=lambda z: z.width_rpm or 0.0)
    assert zone.onset is not None and zone.exit is not None and zone.width_rpm is not None
    margin = 0.2 * zone.width_rpm
    figure = new_figure(9.0, 5.0)
    axes = figure.subplots()
    zoomed_diagram(swept.sweep, zone.onset.speed_rpm - margin, zone.exit.speed_rpm + margin, ax=axes)
    figure.suptitle(f"{_title(swept)}, widest zone", fontsize=11)
    return {"zoom": save_figure(figure, swept.folder / f"sweep_{swept.subject.name}_zoom.png")}


def _waterfall(swept: Swept, options: SweepOptions) -> dict[str, str]:
    """Spectra of the vertical motion over speed, if asked for."""
    if options.waterfall == 0:
        return {}
    speeds = np.linspace(swept.sweep.speed[0], swept.sweep.speed[-1], options.waterfall)
    chosen = sweep_integration(options)
    samples = samples_per_revolution(chosen, 64)
    found = waterfall(swept.subject.model, speeds, component=1, samples=samples, method=chosen)
    figure = new_figure(9.0, 5.0)
    waterfall_map(found.rpm, found.order, found.amplitude, figure.subplots())
    figure.suptitle(f"{_title(swept)}: spectra of the vertical motion", fontsize=11)
    return {"waterfall": save_figure(figure, swept.folder / f"sweep_{swept.subject.name}_waterfall.png")}


def failed_lanes(found: Sweep) -> dict[str, int]:
    """How many lanes failed, by what went wrong."""
    codes = collections.Counter(found.outcome[found.failed].tolist())
    return {OUTCOMES[code]: n for code, n in sorted(codes.items())}


def _title(swept: Swept) -> str:
    published, model = swept.subject.published, swept.subject.model
    what = f"Case {swept.subject.name}" if published is not None else swept.subject.name
    gap, e = 1e3 * float(model.guidance_gap), 1e6 * float(model.eccentricity)
    lasting = f", chaos followed to {swept.sweep.horizon} revolutions" if swept.sweep.horizon else ""
    return f"{what}: guidance gap {gap:.3g} mm, eccentricity {e:.3g} µm{lasting}"


def _label_table(found: Sweep, counts: collections.Counter) -> Table:
    speeds, starts = found.outcome.shape
    title = f"Lanes: {speeds} speeds x {starts} starts, {found.length}"
    rows = [(label, str(n), f"{n / found.outcome.size:.1%}") for label, n in sorted(counts.items())]
    return Table(title, ("label", "lanes", "share"), rows)


def _notes(document: dict[str, Any]) -> list[str]:
    failed = ", ".join(f"{n} {name}" for name, n in document["failed"].items())
    beyond = document["beyond_clearance"]
    if beyond:
        say(f"Warning: {beyond} lanes went beyond eps = 1, where the surfaces would overlap.")
    warn_of_short(document["too_short"])
    return [
        f"Failed lanes: {failed or 'none'}",
        f"Lanes beyond eps = 1: {beyond}",
        f"Error of a revolution: at most {document['error']:.0e} of the clearance",
        *(
            f"Confirmed by steps at most 1/{2 << i} as long: {each['changed']} of {each['lanes']} labels changed"
            for i, each in enumerate(document["confirmed"])
        ),
        f"Time: {document['seconds']:.1f} s",
        *(f"{name.capitalize()}: {document[name]}" for name in ("figure", "zoom", "waterfall") if name in document),
        f"Data: {document['data']}",
    ]
