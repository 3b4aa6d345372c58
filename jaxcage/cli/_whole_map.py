"""Slip, power lost, largest exponent and state of a whole bearing over its shaft's speed and a parameter."""

from functools import partial

import numpy as np

from .._errors import ArgumentError, InputError, NoResult
from .._parameters import parameter_info, parameters, replace
from ..analysis import BearingSweep
from ..io import to_si
from ..models import BearingModel
from ..plotting import bearing_map_figure
from ..report import Axis, Table, parameter_axis
from ..sweeps import sweep_bearings
from ._job import Job
from ._options import MapOptions
from ._show import Report
from ._whole import shaft_speeds


LOAD, LIGHTEST = "load", 0.05
"""Of its own load, the lowest one of a map over the load."""
CELLS = ("cage_slip", "friction_power_W", "pocket_impulse_N_s", "land_wear_mm3_per_h", "eccentricity_mean", "exponent")


def bearing_map(job: Job[MapOptions], model: BearingModel) -> Report:
    """Carry out `jaxcage map` of a whole bearing."""
    options = job.options
    axis = _axis(job, model)
    speeds = shaft_speeds(job, model, options.columns or 2)
    spaced = np.geomspace if axis.name == LOAD and axis.lower > 0 else np.linspace
    values = spaced(axis.lower, axis.upper, options.rows or 2)
    given = job.given("starts discard revolutions tolerance")
    try:
        models = [replace(model, **{axis.name: float(value)}) for value in values]
    except ValueError as error:
        raise InputError(f"Options --lower and --upper: {error}") from error
    with job.computing("map") as say:
        found = sweep_bearings(models, speeds, blocks=given["revolutions"], progress=partial(say, ""), **given)
    if all(each.failed.all() for each in found):
        raise NoResult("All lanes of the map failed.")
    stem = f"_speed_{axis.name}"
    length = f"{given['discard']} + {given['revolutions']} revolutions"
    title = f"{job.name}: over the shaft's speed and {axis.name.replace('_', ' ')}, {length} of the cage"
    label = f"{axis.name.replace('_', ' ').capitalize()}{f' [{axis.unit}]' if axis.unit else ''}"
    figure = bearing_map_figure(found, values * axis.factor, label, title, logarithmic=spaced is np.geomspace)
    job.figure(figure, detail=stem)
    job.columns(_columns(found, values, axis), detail=stem)
    names, numbers = np.unique([each.outcome for each in found], return_counts=True)
    counts = dict(zip(names.tolist(), numbers.tolist(), strict=True))
    document = {
        "y": axis.name,
        "shaft_speed_rpm": found[0].rpm,
        "y_values": values,
        **given,
        **{name: [_mean(getattr(each, name)) for each in found] for name in CELLS},
        "state": [[_state(each, i) for i in range(speeds.size)] for each in found],
        "outcomes": counts,
    }
    told = ", ".join(f"{n} {name}" for name, n in counts.items())
    tables = [_table(title, what, found, values, axis) for what in ("cage slip [%]", "state")]
    return Report(document, tables, [f"Lanes: {told}"])


def _axis(job: Job[MapOptions], model: BearingModel) -> Axis:
    """What is varied upwards.

    **Raises:** `InputError` for what is no parameter, or a range that it cannot have.
    """
    options, known = job.options, list(parameters(model))
    name = options.y or LOAD
    if name not in known:
        raise InputError(f"Option --y must be one of {', '.join(known)}, but '{name}' was given.")
    if (options.rows or 0) < 2:
        raise InputError(f"Option --rows must be at least 2 for a whole bearing, but {options.rows} was given.")
    ends = given_ends(job, parameter_info(model)[name].unit)
    if name == LOAD:
        ends.setdefault("lower", LIGHTEST * float(model.load))
    return parameter_axis(model, name, **ends)


def given_ends(job: Job[MapOptions], unit: str) -> dict[str, float]:
    """The ends of a map's range that are given, in `unit`.

    **Raises:** `ArgumentError` for what is no number, or has another unit.
    """
    ends = {}
    for end, text in job.given("lower upper").items():
        try:
            ends[end] = to_si(text, unit)
        except ValueError as error:
            raise ArgumentError(end, said=f"{error}.") from error
    return ends


def _mean(values: np.ndarray) -> np.ndarray:
    """Over starts, of those that did not fail."""
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=1)
    return np.where(known.any(axis=1), total / np.maximum(known.sum(axis=1), 1), np.nan)


def _state(found: BearingSweep, i: int) -> str:
    return " or ".join(sorted(set(found.state[i].tolist())))


def _columns(found: list[BearingSweep], values: np.ndarray, axis: Axis) -> dict[str, np.ndarray]:
    """One row for each point of the map."""
    speeds, each = found[0].rpm, len(found[0].rpm)
    columns = {"shaft speed [rpm]": np.tile(speeds, len(found)), axis.head: np.repeat(values * axis.factor, each)}
    return columns | {name: np.concatenate([_mean(getattr(s, name)) for s in found]) for name in CELLS}


def _table(title: str, what: str, found: list[BearingSweep], values: np.ndarray, axis: Axis) -> Table:
    """One row for each value, one column for each speed."""
    rows = []
    for value, each in zip(values, found, strict=True):
        slips = _mean(each.cage_slip)
        cells = [_state(each, i) if what == "state" else f"{100 * slips[i]:.2f}" for i in range(each.rpm.size)]
        rows.append((axis.cell(float(value)), *cells))
    return Table(f"{title}: {what}", (axis.head, *(f"{rpm:.0f} rpm" for rpm in found[0].rpm)), rows)
