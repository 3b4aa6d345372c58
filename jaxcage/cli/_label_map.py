"""`jaxcage map --points NXxNY`: labels lane by lane over two parameters, a coarse picture first, edges on top."""

import json
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .._parameters import parameter_info
from ..io import configuration, replacing
from ..orbits import Curve
from ..plotting import new_figure, stability_map
from ..report import RPM, SPEED, Axis, follow_edges
from ..studies import KINDS, LABELS, PENDING, LabelMap, kinds, label_map
from ._bifurcations import check_search, search_case
from ._console import progress_in_stages, progress_with_rate, warn_of_short
from ._errors import ComputationError, UsageError, require_at_least, require_blocks, require_persist, require_speed
from ._inputs import Subject, angular_speed, output_folder, save_figure, subject, sweep_integration
from ._options import MapOptions
from ._report import Report, Table


FEWEST, MOST = 2, 10_000
"""Points along one side."""
ADVICE = "the picture and data of the last stage stay"


def run_label_map(options: MapOptions) -> Report:
    """Carry out `jaxcage map --points`."""
    from ._map import axes_of  # which imports this file

    check_search(options)
    if (options.rows, options.columns) != (MapOptions.rows, MapOptions.columns):
        raise UsageError("Options --rows and --columns do not go with --points, which says how many there are.")
    if options.refine != MapOptions.refine and not options.adaptive:
        raise UsageError("Option --refine goes with --adaptive.")
    points = _points(options.points or "")
    blocks = require_blocks("--revolutions", options.revolutions)
    if options.most is not None:
        require_at_least("--most", options.most, 4)
    require_persist(options.persist, options.discard)
    method, about = sweep_integration(options), subject(options)
    x, y = axes_of(options, about.model)
    speed = _fixed_speed(options, x)
    own = len(about.model.starts(1.0))
    if not 1 <= options.starts <= own:
        raise UsageError(f"Option --starts must lie between 1 and {own}, but {options.starts} was given.")
    length = {"discard": options.discard, "revolutions": options.revolutions, "persist": options.persist}
    files = _Files(about, output_folder(options), x, y, length)
    began = time.perf_counter()
    with progress_with_rate(f"map of {about.name}", "lanes", ADVICE) as bar:
        found = label_map(
            about.model,
            {x.name: np.linspace(x.lower, x.upper, points[0])},
            {y.name: np.linspace(y.lower, y.upper, points[1])},
            speed=speed,
            refine_by=options.refine if options.adaptive else "everything",
            most=options.most,
            starts=options.starts,
            **length,
            blocks=blocks,
            method=method,
            report=files.write,
            stage=bar,
        )
    curves, refused = ([], {}) if options.no_curves or x.name != SPEED else _curves(options, about, x, y)
    seconds = time.perf_counter() - began
    files.draw(found, curves)
    counts = np.bincount(kinds(found.label)[found.grid.known], minlength=len(KINDS))
    document = {
        "case": about.name,
        "x": x.name,
        "y": y.name,
        "x_range": [x.lower * (RPM if x.name == SPEED else 1.0), x.upper * (RPM if x.name == SPEED else 1.0)],
        "y_range": [y.lower, y.upper],
        "points": list(points),
        **length,
        "computed": found.grid.points,
        "complete": found.grid.complete,
        "kinds": dict(zip(KINDS, counts.tolist(), strict=True)),
        "too_short": int(np.sum(found.too_short)),
        "curves": [c.name for c in curves],
        "refused": refused,
        "seconds": round(seconds, 2),
        "figure": str(files.figure),
        "data": str(files.data),
    }
    warn_of_short(document["too_short"])
    share = found.grid.points / found.grid.known.size
    rows = [(kind, str(n), f"{n / found.grid.points:.1%}") for kind, n in zip(KINDS, counts, strict=True)]
    total = f"{found.grid.points} computed of {found.grid.known.size}"
    title = f"Points of {about.name} over {x.name} and {y.name}: {total}"
    notes = [f"Not followed: {name} ({why})" for name, why in refused.items()]
    if not found.grid.complete:
        notes.append(f"Not complete: with more than --most {options.most} points, edges would be followed closer.")
    notes += [f"Computed: {share:.1%} of the grid", f"Time: {seconds:.1f} s", f"Figure: {files.figure}"]
    return Report(document, [Table(title, ("kind", "points", "share"), rows)], [*notes, f"Data: {files.data}"])


def _points(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×]\s*(\d{1,9})\s*", text)
    sides = (int(match[1]), int(match[2])) if match else (0, 0)
    if not all(FEWEST <= n <= MOST for n in sides):
        allowed = f"ACROSSxUPWARDS, each from {FEWEST} to {MOST}, e.g. 300x300"
        raise UsageError(f"Option --points must be {allowed}, but '{text}' was given.")
    return sides


def _fixed_speed(options: MapOptions, x: Axis) -> float | None:
    if x.name == SPEED:
        if options.speed is not None:
            raise UsageError("Option --speed goes with an --x that is not the speed.")
        return None
    if options.speed is None:
        raise UsageError(f"Option --speed must be given for a map over {x.name}.")
    return angular_speed(require_speed("--speed", options.speed))


def _curves(options: MapOptions, about: Subject, x: Axis, y: Axis) -> tuple[list[Curve], dict[str, str]]:
    """Synchronous-loss edges to draw on top; without any the map stands on its own."""
    try:
        searched = search_case(options, about)
    except ComputationError as error:
        return [], {"edges": str(error).rstrip(".")}
    with progress_in_stages(f"edges of {about.name}") as bar:
        say = bar or (lambda what, done, of: None)
        return follow_edges(about.model, searched.loss.edges, x, y, searched.method, say)


class _Files:
    """Figure and data of a map, written anew at every stage."""

    def __init__(self, about: Subject, folder: Path, x: Axis, y: Axis, length: dict[str, int]):
        self.about, self.x, self.y, self.length = about, x, y, length
        stem = f"map_{about.name}_{x.name}_{y.name}_labels"
        self.figure, self.data = folder / f"{stem}.png", folder / f"{stem}.zarr"

    def write(self, found: LabelMap) -> None:
        self.draw(found, [])
        with replacing(self.data) as temporary:
            self._dataset(found).to_zarr(temporary, mode="w", consolidated=False)

    def draw(self, found: LabelMap, curves: list[Curve]) -> None:
        """The largest exponent in colours, what was left out filled from the nearest point."""
        figure, x, y = new_figure(10.0, 6.0), self.x, self.y
        exponents = (found.x_value * x.factor, found.y_value, found.filled_exponent)
        words = _words(y.name)
        axes = stability_map(
            curves, figure.subplots(), exponents=exponents, y_unit=y.unit, y_factor=y.factor, y_label=words
        )
        if x.name != SPEED:
            axes.set_xlabel(f"{_words(x.name)} [{x.unit}]" if x.unit else _words(x.name))
        stride = "" if found.grid.stride == 1 else f", so far every {found.grid.stride} points"
        figure.suptitle(f"{self.about.name}: largest exponent{stride}", fontsize=11)
        save_figure(figure, self.figure)

    def _dataset(self, found: LabelMap) -> xr.Dataset:
        unit = lambda a: {"units": "rad/s" if a.name == SPEED else parameter_info(self.about.model)[a.name].unit}
        codes = [PENDING, *range(len(LABELS))]
        flags: dict[str, Any] = {"flag_values": codes, "flag_meanings": " ".join(["pending", *LABELS])}
        dims = (found.x, found.y, "start")
        return xr.Dataset(
            {
                "label": (dims, found.label, {"long_name": "what each lane does", **flags}),
                "largest_exponent": (dims, found.largest_exponent, {"units": "1"}),
            },
            coords={found.x: (found.x, found.x_value, unit(self.x)), found.y: (found.y, found.y_value, unit(self.y))},
            attrs={"title": "jaxcage map", **self.length, "configuration": json.dumps(configuration(self.about.model))},
        )


def _words(name: str) -> str:
    return name.replace(".", " ").replace("_", " ").capitalize()
