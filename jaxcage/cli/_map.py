"""`jaxcage map`: the synchronous-loss edges followed in two parameters, over colours of the largest exponent."""

import concurrent.futures
import dataclasses
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .._parameters import parameter_info, parameters, replace
from ..integrate import AbstractMethod
from ..io import to_si, write_columns
from ..models import CageModel
from ..orbits import Curve, bifurcation, curve
from ..plotting import new_figure, stability_map
from ..sweeps import cores, rpm, sweep
from ._bifurcations import Searched, check_search, require_edges, search_case
from ._console import progress_in_stages
from ._errors import ComputationError, UsageError, require_at_least
from ._inputs import angular_speed, save_figure, subject
from ._options import MapOptions
from ._report import Report, Table


SPEED = "speed"
RPM = 30 / math.pi
BELOW, ABOVE = 0.8, 1.25
"""Range of a parameter over its value, unless told otherwise."""
Exponents = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Speeds [rpm], values of y [SI], largest exponent at each."""


@dataclasses.dataclass(frozen=True)
class Axis:
    """One direction of the map."""

    name: str
    lower: float
    upper: float
    unit: str
    """Unit in which it is shown."""
    factor: float
    """From SI to that unit."""

    @property
    def head(self) -> str:
        """Head of a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def cell(self, value: float) -> str:
        """A value for a table."""
        return f"{value * self.factor:.2f}" if self.name == SPEED else f"{value * self.factor:.6g}"


def run(options: MapOptions) -> Report:
    """Carry out `jaxcage map`."""
    check_search(options)
    _check_counts(options)
    about = subject(options)
    model = about.model
    x, y = _axes(options, model)
    require_at_least("--starts", options.starts, 1)
    own = len(model.starts(1.0))
    if options.starts > own:
        raise UsageError(f"Option --starts must be at most {own}, but {options.starts} was given.")
    searched = search_case(options, about)
    require_edges(searched, "follow")
    began = time.perf_counter()
    with progress_in_stages(f"map of {searched.subject.name}") as bar:
        say = bar or (lambda what, done, of: None)
        curves, refused = follow_edges(searched, x, y, say)
        if not curves:
            said = "; ".join(f"{name}: {why}" for name, why in refused.items())
            raise ComputationError(f"No edge could be followed ({said}).")
        over_speed = x.name == SPEED and options.rows > 0
        exponents = largest_exponents(options, model, y, searched.method, say) if over_speed else None
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


def _axes(options: MapOptions, model: CageModel) -> tuple[Axis, Axis]:
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


def shown_unit(unit: str, value: float) -> tuple[str, float]:
    """Unit in which a parameter is shown, and the factor from SI: lengths are easier to read in mm or µm."""
    if unit == "m":
        return ("µm", 1e6) if abs(value) < 1e-4 else ("mm", 1e3)
    return ("" if unit == "1" else unit), 1.0


def follow_edges(
    searched: Searched, x: Axis, y: Axis, say: Callable[[str, int, int], None]
) -> tuple[list[Curve], dict[str, str]]:
    """A curve through each named edge, and why where there is none."""
    model, method, edges = searched.subject.model, searched.method, searched.loss.edges
    curves, refused = [], {}
    for done, (name, point) in enumerate(edges.items()):
        say("curves", done, len(edges))
        kind: Any = point.kind
        if kind == "branch-point":
            refused[name] = "a branch point"
            continue
        start: Any = point
        if x.name != SPEED:
            start = bifurcation(model, kind, point, x.name, method=method)
            if not bool(start.converged):
                refused[name] = start.status
                continue
        try:
            found = curve(
                model,
                start,
                x.name,
                y.name,
                lower=y.lower,
                upper=y.upper,
                x_lower=x.lower,
                x_upper=x.upper,
                name=name,
                method=method,
            )
            curves.append(found)
        except ValueError:
            refused[name] = "Newton's method did not find it again"
    say("curves", len(edges), len(edges))
    return curves, refused


def largest_exponents(
    options: MapOptions, model: CageModel, y: Axis, method: AbstractMethod, say: Callable[[str, int, int], None]
) -> Exponents:
    """Largest exponent per revolution over speed and y, NaN where every start failed."""
    speeds = rpm(options.first, options.last, options.columns)
    values = np.linspace(y.lower, y.upper, options.rows)

    def row(value: float) -> np.ndarray:
        changed = replace(model, **{y.name: float(value)})
        states = [[[float(c) for c in start] for start in changed.starts(s)[: options.starts]] for s in speeds]
        found = sweep(
            changed,
            speeds,
            starts=np.array(states),
            discard=options.discard,
            revolutions=options.revolutions,
            blocks=1,
            keep=1,
            method=method,
        )
        finished = np.where(found.failed, -np.inf, found.exponents[..., 0])
        top = np.max(finished, axis=1)
        return np.where(np.isfinite(top), top, np.nan)

    rows = []
    with concurrent.futures.ThreadPoolExecutor(cores()) as pool:  # a row alone does not fill two chunks of lanes
        for largest in pool.map(row, values):
            rows.append(largest)
            say("exponents", len(rows), values.size)
    return speeds * RPM, values, np.array(rows).T


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
