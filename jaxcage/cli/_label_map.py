"""`jaxcage map --points NXxNY`: labels lane by lane over two parameters, edges on top."""

import json
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from .._errors import NoResult
from ..io import configuration
from ..orbits import Curve
from ..plotting import stability_map
from ..report import SPEED, Axis, follow_edges, shares_table
from ..studies import KINDS, LabelMap, label_map
from ..sweeps import rpm
from ._console import warn_of_short
from ._job import Job, blocks_of
from ._options import MapOptions
from ._orbits import searched
from ._show import Report


def label_map_of(job: Job[MapOptions], x: Axis, y: Axis, points: tuple[int, int]) -> Report:
    """Carry out `jaxcage map --points`."""
    options = job.options
    length = job.given("discard revolutions persist")
    with job.computing("map", "lanes") as say:
        found = label_map(
            job.model,
            {x.name: np.linspace(x.lower, x.upper, points[0])},
            {y.name: np.linspace(y.lower, y.upper, points[1])},
            speed=None if options.speed is None else rpm(options.speed),
            starts=options.starts,
            **length,
            blocks=blocks_of(length["revolutions"]),
            method=job.method,
            stage=say,
        )
    made = {"title": "jaxcage map", **length, "configuration": json.dumps(configuration(job.model))}
    stem = f"_{x.name}_{y.name}_labels"
    with job.written("data", job.path(f"{stem}.zarr")) as temporary:
        found.dataset(job.model).assign_attrs(made).to_zarr(temporary, mode="w", consolidated=False)
    curves, refused = ([], {}) if options.no_curves or x.name != SPEED else _curves(job, x, y)
    job.draw(lambda ax: _draw(ax, x, y, found, curves), (10.0, 6.0), f"{job.name}: largest exponent", detail=stem)
    counts = np.bincount(found.kind.ravel(), minlength=len(KINDS))
    document = {
        "x": x.name,
        "y": y.name,
        "x_range": x.range,
        "y_range": y.range,
        "points": list(points),
        **length,
        "kinds": dict(zip(KINDS, counts.tolist(), strict=True)),
        "too_short": int(np.sum(found.too_short)),
        "curves": [c.name for c in curves],
        "refused": refused,
    }
    warn_of_short(document["too_short"])
    title = f"Points of {job.name} over {x.name} and {y.name}: {found.kind.size}"
    notes = [f"Not followed: {name} ({why})" for name, why in refused.items()]
    return Report(document, [shares_table(title, "kind points", document["kinds"])], notes)


def _curves(job: Job[MapOptions], x: Axis, y: Axis) -> tuple[list[Curve], dict[str, str]]:
    """Synchronous-loss edges to draw on top; without any the map stands on its own."""
    try:
        _, loss = searched(job)
    except NoResult as error:
        return [], {"edges": str(error).rstrip(".")}
    with job.computing("edges") as say:
        return follow_edges(job.model, loss.edges, x, y, job.asked, say)


def _draw(ax: Axes, x: Axis, y: Axis, found: LabelMap, curves: Sequence[Curve]) -> None:
    """The largest exponent in colours, curves on top."""
    exponents = (found.x_value * x.factor, found.y_value, found.top_exponent)
    stability_map(curves, ax, exponents=exponents, y_unit=y.unit, y_factor=y.factor, y_label=_words(y.name))
    if x.name != SPEED:
        ax.set_xlabel(f"{_words(x.name)} [{x.unit}]" if x.unit else _words(x.name))


def _words(name: str) -> str:
    return name.replace(".", " ").replace("_", " ").capitalize()
