"""What the cage does at one speed: time history with each force, and strobe section."""

import dataclasses
from functools import partial
from typing import Any

import numpy as np

from .._errors import InputError, NoResult
from ..analysis import BearingMeasures, OrbitMeasures, Sweep, cage_forces, orbit_measures
from ..io import strobe_columns, trajectory_columns
from ..plotting import simulation_figure, strobe_section
from ..report import Table, chosen, number, require_some
from ..solve import OUTCOMES, simulate
from ..sweeps import rpm, sweep
from ._job import Job, blocks_of, samples_per_revolution
from ._options import PoincareOptions, SimulateOptions
from ._show import Report


def simulate_at(job: Job[SimulateOptions]) -> Report:
    """`jaxcage simulate`: time history, orbit and each force at one speed."""
    options, model = job.options, job.model
    if options.load is not None:
        raise InputError(f"Option --load goes with a whole bearing, but {job.name} is a cage.")
    with job.computing():
        samples = samples_per_revolution(job.method, 128)
        length = job.given("revolutions discard")
        trajectory = simulate(model, rpm(options.speed), **length, samples=samples, method=job.method)
    if trajectory.outcome != "successful":
        raise NoResult(f"The simulation at {options.speed:g} rpm failed ({trajectory.outcome}): try more --steps.")
    forces, measures = cage_forces(model, trajectory), orbit_measures(model, trajectory)
    at, title = f"_{options.speed:g}rpm", f"{job.name}, {job.at_speed}, {options.revolutions} revolutions"
    job.figure(simulation_figure(trajectory, forces, float(model.clearance), title), detail=at)
    job.columns(trajectory_columns(trajectory, forces), detail=at)
    document = {
        "speed_rpm": options.speed,
        "shaft_speed_rpm": options.speed / job.ratio,
        "revolutions": options.revolutions,
        **chosen(trajectory, "outcome peak error"),
        "measures": dataclasses.asdict(measures),
    }
    error = f"Error of a revolution: at most {trajectory.error:.0e} of the clearance"
    return Report(document, [measures_table(title, measures)], [error])


def measures_table(title: str, measures: OrbitMeasures | BearingMeasures) -> Table:
    """Measures with their own words; lengths in millimetres, parts one by one."""
    shown = {"1": ("", 1.0), "m": ("mm", 1e3)}
    rows = []
    for field in dataclasses.fields(measures):
        value = getattr(measures, field.name)
        unit, factor = shown.get(field.metadata["unit"], (field.metadata["unit"], 1.0))
        if isinstance(value, dict):
            rows += [(f"of it {name.replace('_', ' ')}", f"{factor * part:.4g}", unit) for name, part in value.items()]
        else:
            text = value if isinstance(value, str) else f"{factor * value:.4g}"
            rows.append((field.metadata["text"], text, unit))
    return Table(title, ("measure", "value", "unit"), rows)


def poincare_at(job: Job[PoincareOptions]) -> Report:
    """`jaxcage poincare`: strobe section at one speed, from all starts."""
    options = job.options
    with job.computing() as say:
        found = sweep(
            job.model,
            np.array([rpm(options.speed)]),
            **job.given("discard revolutions"),
            blocks=blocks_of(options.revolutions),
            keep=options.revolutions,
            method=job.method,
            progress=partial(say, ""),
        )
    require_some(found.outcome, f" at {options.speed:g} rpm")
    at, title = f"_{options.speed:g}rpm", f"{job.name}, {job.at_speed}, {options.revolutions} revolutions"
    names = [f"start {i + 1}: {label}" for i, label in enumerate(found.label[0])]
    job.draw(lambda ax: strobe_section(found.strobe[0], ax, names=names), (6.5, 5.4), title, detail=at)
    job.columns(strobe_columns(found), detail=at)
    starts = _starts(found)
    columns = {
        "start": "{[start]}",
        "label": "{[label]}",
        "largest exponent per revolution": lambda s: " ± ".join(
            number(s[n], 4) for n in ("exponent", "standard_error")
        ),
    }
    length = f"{options.discard} + {options.revolutions} revolutions"
    table = Table.of(f"Strobe section of {job.name} at {job.at_speed}, {length}", columns, starts)
    return Report({"speed_rpm": options.speed, "shaft_speed_rpm": options.speed / job.ratio, "starts": starts}, [table])


def _starts(found: Sweep) -> list[dict[str, Any]]:
    """For every start its label, exponent, and strobe points (Y, Y')."""
    half = found.strobe.shape[-1] // 2
    return [
        {
            "start": i + 1,
            "label": str(found.label[0, i]),
            "outcome": OUTCOMES[found.outcome[0, i]],
            "exponent": float(found.exponents[0, i, 0]),
            "standard_error": float(found.standard_error[0, i, 0]),
            "y_C": found.strobe[0, i, :, 1],
            "vy_C": found.strobe[0, i, :, 1 + half],
        }
        for i in range(found.strobe.shape[1])
    ]
