"""`jaxcage map --points NXxNY`: labels lane by lane over two parameters, a coarse picture first, edges on top."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from .._errors import NoResult
from .._parameters import parameter_info
from ..io import configuration, replacing
from ..orbits import Curve
from ..plotting import new_figure, stability_map
from ..report import RPM, SPEED, Axis, follow_edges
from ..studies import KINDS, LABELS, PENDING, LabelMap, kinds, label_map
from ..sweeps import rpm
from ._console import warn_of_short
from ._job import Job, blocks_of
from ._options import MapOptions
from ._orbits import searched
from ._show import Report, shares_table


ADVICE = "the picture and data of the last stage stay"


def label_map_of(job: Job[MapOptions], x: Axis, y: Axis, points: tuple[int, int]) -> Report:
    """Carry out `jaxcage map --points`."""
    options = job.options
    length = {"discard": options.discard, "revolutions": options.revolutions, "persist": options.persist}
    files = _Files(job, x, y, length)
    with job.computing("map", "lanes", ADVICE) as say:
        found = label_map(
            job.model,
            {x.name: np.linspace(x.lower, x.upper, points[0])},
            {y.name: np.linspace(y.lower, y.upper, points[1])},
            speed=None if options.speed is None else rpm(options.speed),
            refine_by=options.refine if options.adaptive else "everything",
            most=options.most,
            starts=options.starts,
            **length,
            blocks=blocks_of(options.revolutions),
            method=job.method,
            report=files.write,
            stage=say,
        )
    curves, refused = ([], {}) if options.no_curves or x.name != SPEED else _curves(job, x, y)
    files.draw(found, curves)
    counts = np.bincount(kinds(found.label)[found.grid.known], minlength=len(KINDS))
    to_x = RPM if x.name == SPEED else 1.0
    document = {
        "x": x.name,
        "y": y.name,
        "x_range": [x.lower * to_x, x.upper * to_x],
        "y_range": [y.lower, y.upper],
        "points": list(points),
        **length,
        "computed": found.grid.points,
        "complete": found.grid.complete,
        "kinds": dict(zip(KINDS, counts.tolist(), strict=True)),
        "too_short": int(np.sum(found.too_short)),
        "curves": [c.name for c in curves],
        "refused": refused,
    }
    warn_of_short(document["too_short"])
    total = f"{found.grid.points} computed of {found.grid.known.size}"
    title = f"Points of {job.name} over {x.name} and {y.name}: {total}"
    notes = [f"Not followed: {name} ({why})" for name, why in refused.items()]
    if not found.grid.complete:
        notes.append(f"Not complete: with more than --most {options.most} points, edges would be followed closer.")
    notes.append(f"Computed: {found.grid.points / found.grid.known.size:.1%} of the grid")
    return Report(document, [shares_table(title, ("kind", "points", "share"), document["kinds"])], notes)


def _curves(job: Job[MapOptions], x: Axis, y: Axis) -> tuple[list[Curve], dict[str, str]]:
    """Synchronous-loss edges to draw on top; without any the map stands on its own."""
    try:
        _, loss = searched(job)
    except NoResult as error:
        return [], {"edges": str(error).rstrip(".")}
    with job.computing("edges") as say:
        return follow_edges(job.model, loss.edges, x, y, job.asked, say)


class _Files:
    """Figure and data of a map, written anew at every stage."""

    def __init__(self, job: Job[MapOptions], x: Axis, y: Axis, length: dict[str, int]):
        self.job, self.x, self.y, self.length = job, x, y, length
        self.stem = f"_{x.name}_{y.name}_labels"

    def write(self, found: LabelMap) -> None:
        self.draw(found, [])
        path = self.job.path(f"{self.stem}.zarr")
        with replacing(path) as temporary:
            self._dataset(found).to_zarr(temporary, mode="w", consolidated=False)
        self.job.listed("data", path)

    def draw(self, found: LabelMap, curves: Sequence[Curve]) -> None:
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
        figure.suptitle(f"{self.job.name}: largest exponent{stride}", fontsize=11)
        self.job.figure(figure, detail=self.stem)

    def _dataset(self, found: LabelMap) -> xr.Dataset:
        model = self.job.model
        unit = lambda a: {"units": "rad/s" if a.name == SPEED else parameter_info(model)[a.name].unit}
        codes = [PENDING, *range(len(LABELS))]
        flags: dict[str, Any] = {"flag_values": codes, "flag_meanings": " ".join(["pending", *LABELS])}
        dims = (found.x, found.y, "start")
        return xr.Dataset(
            {
                "label": (dims, found.label, {"long_name": "what each lane does", **flags}),
                "largest_exponent": (dims, found.largest_exponent, {"units": "1"}),
            },
            coords={found.x: (found.x, found.x_value, unit(self.x)), found.y: (found.y, found.y_value, unit(self.y))},
            attrs={"title": "jaxcage map", **self.length, "configuration": json.dumps(configuration(model))},
        )


def _words(name: str) -> str:
    return name.replace(".", " ").replace("_", " ").capitalize()
