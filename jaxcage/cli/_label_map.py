"""`jaxcage map --points NXxNY`: labels lane by lane over two parameters, a coarse picture first, edges on top."""

import json
from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from .._errors import NoResult
from ..io import configuration
from ..orbits import Curve
from ..plotting import stability_map
from ..report import SPEED, Axis, follow_edges, shares_table
from ..studies import KINDS, LabelMap, kinds, label_map
from ..sweeps import rpm
from ._console import warn_of_short
from ._job import Job, blocks_of
from ._options import MapOptions
from ._orbits import searched
from ._show import Report


ADVICE = "the picture and data of the last stage stay"


def label_map_of(job: Job[MapOptions], x: Axis, y: Axis, points: tuple[int, int]) -> Report:
    """Carry out `jaxcage map --points`."""
    options = job.options
    length = job.given("discard revolutions persist")
    job.files["data"] = None
    with job.computing("map", "lanes", ADVICE) as say:
        found = label_map(
            job.model,
            {x.name: np.linspace(x.lower, x.upper, points[0])},
            {y.name: np.linspace(y.lower, y.upper, points[1])},
            speed=None if options.speed is None else rpm(options.speed),
            refine_by=options.refine if options.adaptive else "everything",
            **job.given("most starts"),
            **length,
            blocks=blocks_of(length["revolutions"]),
            method=job.method,
            report=partial(_write, job, x, y, length),
            stage=say,
        )
    curves, refused = ([], {}) if options.no_curves or x.name != SPEED else _curves(job, x, y)
    _draw(job, x, y, found, curves)
    counts = np.bincount(kinds(found.label)[found.grid.known], minlength=len(KINDS))
    document = {
        "x": x.name,
        "y": y.name,
        "x_range": x.range,
        "y_range": y.range,
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
    return Report(document, [shares_table(title, "kind points", document["kinds"])], notes)


def _curves(job: Job[MapOptions], x: Axis, y: Axis) -> tuple[list[Curve], dict[str, str]]:
    """Synchronous-loss edges to draw on top; without any the map stands on its own."""
    try:
        _, loss = searched(job)
    except NoResult as error:
        return [], {"edges": str(error).rstrip(".")}
    with job.computing("edges") as say:
        return follow_edges(job.model, loss.edges, x, y, job.asked, say)


def _write(job: Job[MapOptions], x: Axis, y: Axis, length: dict[str, int], found: LabelMap) -> None:
    """Figure and data of a map, written anew at every stage."""
    _draw(job, x, y, found, [])
    made = {"title": "jaxcage map", **length, "configuration": json.dumps(configuration(job.model))}
    with job.written("data", job.path(f"{_stem(x, y)}.zarr")) as temporary:
        found.dataset(job.model).assign_attrs(made).to_zarr(temporary, mode="w", consolidated=False)


def _draw(job: Job[MapOptions], x: Axis, y: Axis, found: LabelMap, curves: Sequence[Curve]) -> None:
    """The largest exponent in colours, what was left out filled from the nearest point."""
    exponents = (found.x_value * x.factor, found.y_value, found.filled_exponent)

    def draw(ax: Axes) -> None:
        label = _words(y.name)
        stability_map(curves, ax, exponents=exponents, y_unit=y.unit, y_factor=y.factor, y_label=label)
        if x.name != SPEED:
            ax.set_xlabel(f"{_words(x.name)} [{x.unit}]" if x.unit else _words(x.name))

    stride = "" if found.grid.stride == 1 else f", so far every {found.grid.stride} points"
    job.draw(draw, (10.0, 6.0), f"{job.name}: largest exponent{stride}", detail=_stem(x, y))


def _stem(x: Axis, y: Axis) -> str:
    return f"_{x.name}_{y.name}_labels"


def _words(name: str) -> str:
    return name.replace(".", " ").replace("_", " ").capitalize()
