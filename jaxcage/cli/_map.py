"""`jaxcage map`: the synchronous-loss edges followed in two parameters, over colours of the largest exponent."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .._errors import ArgumentError, InputError, NoResult
from .._parameters import parameter_info, parameters
from ..orbits import Curve
from ..plotting import stability_map
from ..report import SPEED, Axis, Exponents, Table, chosen, follow_edges, largest_exponents, parameter_axis, speed_axis
from ..sweeps import rpm
from ._job import Job
from ._label_map import label_map_of
from ._options import MapOptions
from ._orbits import require_edges, searched
from ._show import Report
from ._whole_map import given_ends


def map_of(job: Job[MapOptions]) -> Report:
    """Carry out `jaxcage map` of a cage."""
    options, (x, y) = job.options, _axes(job)
    own = len(job.model.starts(1.0))
    if options.starts > own:
        raise ArgumentError("starts", said=f"must be at most {own}, but {options.starts} was given.")
    if options.points is not None:
        return label_map_of(job, x, y, options.points)
    found, loss = searched(job)
    require_edges(found, loss, "follow")
    exponents = None
    with job.computing() as say:
        curves, refused = follow_edges(job.model, loss.edges, x, y, job.asked, say)
        if not curves:
            said = "; ".join(f"{name}: {why}" for name, why in refused.items())
            raise NoResult(f"No edge could be followed ({said}).")
        if x.name == SPEED and options.rows and options.columns:
            exponents = largest_exponents(
                job.model,
                rpm(options.first, options.last, options.columns),
                y,
                options.rows,
                **job.given("starts discard revolutions"),
                method=job.asked,
                say=say,
            )
    _write(job, curves, exponents, x, y)
    notes = [f"Not followed: {name} ({why})" for name, why in refused.items()]
    if x.name != SPEED:
        notes.append("Each curve holds at its own edge's speed; figure and exponents are made over speed only.")
    return Report(_document(curves, exponents, x, y) | {"refused": refused}, _tables(job.name, curves, x, y), notes)


def _axes(job: Job[MapOptions]) -> tuple[Axis, Axis]:
    """Both directions."""
    options, known = job.options, list(parameters(job.model))
    assert options.y is not None
    for option, given, allowed in (("--y", options.y, known), ("--x", options.x, [SPEED, *known])):
        if given not in allowed:
            raise InputError(f"Option {option} must be one of {', '.join(allowed)}, but '{given}' was given.")
    if options.x == options.y:
        raise InputError(f"Options --x and --y must be two different parameters, but both are {options.x}.")
    y = parameter_axis(job.model, options.y, **given_ends(job, parameter_info(job.model)[options.y].unit))
    return (
        speed_axis(rpm(options.first), rpm(options.last))
        if options.x == SPEED
        else parameter_axis(job.model, options.x)
    ), y


def _write(job: Job[MapOptions], curves: Sequence[Curve], exponents: Exponents | None, x: Axis, y: Axis) -> None:
    """Figure and data: None for what is not made."""
    stem = f"_{x.name}_{y.name}"
    job.files["figure"] = job.files["exponent_data"] = None
    joined = lambda rows: np.concatenate([np.asarray(row) for row in rows])
    columns = {
        "curve": joined(np.full(c.x_value.size, i) for i, c in enumerate(curves, start=1)),
        x.head: joined(c.x_value * x.factor for c in curves),
        y.head: joined(c.y_value * y.factor for c in curves),
        "genuine": joined(c.genuine for c in curves),
    }
    job.columns(columns, detail=stem)
    if x.name == SPEED:
        xlim, ylim = (x.lower * x.factor, x.upper * x.factor), (y.lower * y.factor, y.upper * y.factor)

        def draw(ax: Axes) -> None:
            stability_map(curves, ax, exponents=exponents, y_unit=y.unit, y_factor=y.factor)
            if exponents is None:
                ax.set(xlim=xlim, ylim=ylim)

        job.draw(draw, (10.0, 6.0), f"{job.name}: synchronous-loss edges", detail=stem)
    if exponents is not None:
        across, upward = np.meshgrid(exponents[0], exponents[1] * y.factor, indexing="ij")
        grid = {x.head: across.ravel(), y.head: upward.ravel(), "largest exponent": exponents[2].ravel()}
        job.columns(grid, "exponent_data", f"{stem}_exponents")


def _document(curves: Sequence[Curve], exponents: Exponents | None, x: Axis, y: Axis) -> dict[str, Any]:
    """Curves for programs: a speed in rpm, all else in SI units."""
    rows = [
        {
            **chosen(c, "name kind genuine"),
            "x": x.told(c.x_value),
            "y": c.y_value,
            "ended": list(c.ended),
        }
        for c in curves
    ]
    grid = exponents and {"x": exponents[0], "y": exponents[1], "largest": exponents[2].T}
    return {"x": x.name, "y": y.name, "x_range": x.range, "y_range": y.range, "curves": rows, "exponents": grid}


def _tables(name: str, curves: Sequence[Curve], x: Axis, y: Axis) -> list[Table]:
    """What the curves cover, and why they end."""
    span = lambda axis, values: (axis.cell(np.min(values)), axis.cell(np.max(values)))
    rows = [
        (c.name, c.kind, *span(x, c.x_value), *span(y, c.y_value), str(c.x_value.size), " / ".join(c.ended))
        for c in curves
    ]
    columns = ("edge", "kind", f"{x.head} from", "to", f"{y.head} from", "to", "points", "ends")
    return [Table(f"Edges of {name} over {x.name} and {y.name}", columns, rows)]
