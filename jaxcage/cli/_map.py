"""`jaxcage map`: the synchronous-loss edges followed in two parameters, over colours of the largest exponent."""

import time
from typing import Any

import numpy as np

from .._parameters import parameter_info, parameters
from ..integrate import AbstractMethod
from ..io import to_si, write_columns
from ..models import CageModel
from ..orbits import Curve
from ..plotting import new_figure, stability_map
from ..report import RPM, SPEED, Axis, Exponents, Say, follow_edges, largest_exponents, shown_unit
from ..sweeps import rpm
from ._bifurcations import Searched, check_search, require_edges, search_case
from ._console import progress_in_stages
from ._errors import ComputationError, UsageError, require_at_least
from ._inputs import angular_speed, save_figure, subject
from ._label_map import run_label_map
from ._options import MapOptions
from ._report import Report, Table


BELOW, ABOVE = 0.8, 1.25
"""Range of a parameter over its value, unless told otherwise."""


def run(options: MapOptions) -> Report:
    """Carry out `jaxcage map`."""
    if options.points is not None:
        return run_label_map(options)
    only = (
        options.adaptive,
        options.no_curves,
        options.persist != 0,
        options.most is not None,
        options.speed is not None,
    )
    if any(only) or options.refine != MapOptions.refine:
        raise UsageError(
            "Options --adaptive, --refine, --no-curves, --persist, --most and --speed go with --points, "
            "e.g. --points 300x300."
        )
    check_search(options)
    _check_counts(options)
    about = subject(options)
    model = about.model
    x, y = axes_of(options, model)
    require_at_least("--starts", options.starts, 1)
    own = len(model.starts(1.0))
    if options.starts > own:
        raise UsageError(f"Option --starts must be at most {own}, but {options.starts} was given.")
    searched = search_case(options, about)
    require_edges(searched, "follow")
    began = time.perf_counter()
    with progress_in_stages(f"map of {searched.subject.name}") as bar:
        say = bar or (lambda what, done, of: None)
        curves, refused = follow_edges(model, searched.loss.edges, x, y, searched.method, say)
        if not curves:
            said = "; ".join(f"{name}: {why}" for name, why in refused.items())
            raise ComputationError(f"No edge could be followed ({said}).")
        over_speed = x.name == SPEED and options.rows > 0
        exponents = _exponents(options, model, y, searched.method, say) if over_speed else None
    seconds = searched.seconds + time.perf_counter() - began
    files = _files(searched, curves, exponents, x, y)
    document = map_document(searched.subject.name, curves, exponents, x, y) | {
        "refused": refused,
        "seconds": round(seconds, 2),
        **files,
    }
    notes = [f"Not followed: {name} ({why})" for name, why in refused.items()]
    if x.name != SPEED:
        notes.append("Each curve holds at its own edge's speed; figure and exponents are made over speed only.")
    notes.append(f"Time: {seconds:.1f} s")
    notes += [f"{name.replace('_', ' ').capitalize()}: {path}" for name, path in files.items() if path is not None]
    return Report(document, map_tables(searched.subject.name, curves, x, y), notes)


def _check_counts(options: MapOptions) -> None:
    if options.rows != 0:
        require_at_least("--rows", options.rows, 2)
    require_at_least("--columns", options.columns, 2)
    require_at_least("--revolutions", options.revolutions, 1)


def axes_of(options: MapOptions, model: CageModel) -> tuple[Axis, Axis]:
    """Both directions.

    **Raises:** `UsageError` for names the model does not have, and for ranges that make no sense.
    """
    known = list(parameters(model))
    if options.y not in known:
        raise UsageError(f"Option --y must be one of {', '.join(known)}, but '{options.y}' was given.")
    if options.x not in [SPEED, *known]:
        raise UsageError(f"Option --x must be one of {', '.join([SPEED, *known])}, but '{options.x}' was given.")
    if options.x == options.y:
        raise UsageError(f"Options --x and --y must be two different parameters, but both are {options.x}.")
    y = _parameter_axis(model, options.y, options.lower, options.upper)
    if options.x != SPEED:
        return _parameter_axis(model, options.x, None, None), y
    return Axis(SPEED, angular_speed(options.first), angular_speed(options.last), "rpm", RPM), y


def _parameter_axis(model: CageModel, name: str, lower: str | None, upper: str | None) -> Axis:
    info, value = parameter_info(model)[name], float(parameters(model)[name])
    default = sorted((BELOW * value, ABOVE * value))
    low = max(default[0], info.lower) if lower is None else _limit("--lower", lower, info.unit)
    high = min(default[1], info.upper) if upper is None else _limit("--upper", upper, info.unit)
    unit = "" if info.unit == "1" else f" {info.unit}"
    for option, given in (("--lower", low), ("--upper", high)):
        if not info.lower <= given <= info.upper:
            raise UsageError(
                f"Option {option} must be a value of {name} from {info.lower:g} to {info.upper:g}{unit}, "
                f"but {given:g}{unit} was given."
            )
    if not low < value < high:
        raise UsageError(
            f"Options --lower and --upper must have {name} = {value:g}{unit} between them, "
            f"but the range is {low:g} to {high:g}{unit}."
        )
    return Axis(name, low, high, *shown_unit(info.unit, value))


def _limit(option: str, text: str, unit: str) -> float:
    try:
        return to_si(text, unit)
    except ValueError as error:
        raise UsageError(f"Option {option} {error}.") from error


def _exponents(options: MapOptions, model: CageModel, y: Axis, method: AbstractMethod | None, say: Say) -> Exponents:
    return largest_exponents(
        model,
        rpm(options.first, options.last, options.columns),
        y,
        options.rows,
        starts=options.starts,
        discard=options.discard,
        revolutions=options.revolutions,
        method=method,
        say=say,
    )


def _files(searched: Searched, curves: list[Curve], exponents: Exponents | None, x: Axis, y: Axis) -> dict[str, Any]:
    """Figure and data. **Returns:** their paths, None for what was not made."""
    name = searched.subject.name
    stem = searched.folder / f"map_{name}_{x.name}_{y.name}"
    path = lambda ending: stem.with_name(stem.name + ending)
    joined = lambda rows: np.concatenate([np.asarray(row) for row in rows])
    columns = {
        "curve": joined(np.full(c.x_value.size, i) for i, c in enumerate(curves, start=1)),
        x.head: joined(c.x_value * x.factor for c in curves),
        y.head: joined(c.y_value * y.factor for c in curves),
        "genuine": joined(c.genuine for c in curves),
    }
    files: dict[str, Any] = {"figure": None, "data": str(write_columns(path(".csv"), columns)), "exponent_data": None}
    if x.name == SPEED:
        figure = new_figure(10.0, 6.0)
        axes = stability_map(curves, figure.subplots(), exponents=exponents, y_unit=y.unit, y_factor=y.factor)
        if exponents is None:
            axes.set(xlim=(x.lower * x.factor, x.upper * x.factor), ylim=(y.lower * y.factor, y.upper * y.factor))
        figure.suptitle(f"{name}: synchronous-loss edges", fontsize=11)
        files["figure"] = save_figure(figure, path(".png"))
    if exponents is not None:
        across, upward = np.meshgrid(exponents[0], exponents[1] * y.factor, indexing="ij")
        grid = {x.head: across.ravel(), y.head: upward.ravel(), "largest exponent": exponents[2].ravel()}
        files["exponent_data"] = str(write_columns(path("_exponents.csv"), grid))
    return files


def map_document(name: str, curves: list[Curve], exponents: Exponents | None, x: Axis, y: Axis) -> dict[str, Any]:
    """Curves for programs: a speed in rpm, all else in SI units."""
    to_x = RPM if x.name == SPEED else 1.0
    rows = [
        {
            "name": c.name,
            "kind": c.kind,
            "x": c.x_value * to_x,
            "y": c.y_value,
            "genuine": c.genuine,
            "special": [{"kind": p.kind, "x": p.x_value * to_x, "y": p.y_value} for p in c.special],
            "ended": list(c.ended),
        }
        for c in curves
    ]
    grid = exponents and {"x": exponents[0], "y": exponents[1], "largest": exponents[2].T}
    ranges = {"x_range": [x.lower * to_x, x.upper * to_x], "y_range": [y.lower, y.upper]}
    return {"case": name, "x": x.name, "y": y.name, **ranges, "curves": rows, "exponents": grid}


def map_tables(name: str, curves: list[Curve], x: Axis, y: Axis) -> list[Table]:
    """What the curves cover, and the points of codimension two on them."""
    span = lambda axis, values: (axis.cell(np.min(values)), axis.cell(np.max(values)))
    rows = [
        (c.name, c.kind, *span(x, c.x_value), *span(y, c.y_value), str(c.x_value.size), " / ".join(c.ended))
        for c in curves
    ]
    points = [(c.name, p.kind, x.cell(p.x_value), y.cell(p.y_value)) for c in curves for p in c.special]
    columns = ("edge", "kind", f"{x.head} from", "to", f"{y.head} from", "to", "points", "ends")
    return [
        Table(f"Edges of {name} over {x.name} and {y.name}", columns, rows),
        Table("Points of codimension two", ("edge", "kind", x.head, y.head), points or [("none", *3 * ("-",))]),
    ]
