"""What a whole bearing does at one shaft speed: slips, forces, losses, the cage's motion."""

import dataclasses

from .._errors import InputError, NoResult
from ..analysis import BearingMeasures, bearing_measures
from ..integrate import simulate_bearing
from ..io import SpeedOf, cage_rpm
from ..models import BearingModel
from ..report import Table, chosen
from ..sweeps import rpm
from ._job import Job
from ._options import SimulateOptions
from ._show import Report


SAMPLES = 32
"""Of a revolution of the cage."""
TOLERANCE = 1e-5
"""Of a step, in units of the state's scale."""


def bearing_at(job: Job[SimulateOptions], model: BearingModel) -> Report:
    """`jaxcage simulate` of a whole bearing."""
    options = job.options
    if options.solver is not None or options.steps is not None:
        raise InputError("Options --solver and --steps do not go with a whole bearing: its steps are controlled.")
    shaft_rpm = cage_rpm(options.speed, "shaft", 1.0)
    if isinstance(options.speed, SpeedOf) and options.speed.whose == "cage":
        shaft_rpm /= float(model.rolling_cage_speed(1.0))
    speed = float(rpm(shaft_rpm))
    tolerance = TOLERANCE if options.tolerance is None else options.tolerance
    run = simulate_bearing(model, speed, **job.given("revolutions discard"), samples=SAMPLES, tolerance=tolerance)
    if run.outcome not in ("successful", "inaccurate"):
        raise NoResult(f"The simulation at {shaft_rpm:g} rpm of the shaft failed ({run.outcome}).")
    measures = bearing_measures(model, run, speed)
    document = {
        "shaft_speed_rpm": shaft_rpm,
        **chosen(options, "revolutions discard"),
        **chosen(run, "outcome error estimate steps"),
        **dataclasses.asdict(measures),
    }
    title = f"{job.name}, {shaft_rpm:g} rpm of the shaft, {options.revolutions} revolutions of the cage"
    said = f"Error between two samples: at most {run.error:.0e} of the state's scale ({run.outcome})"
    return Report(document, [Table(title, ("measure", "value", "unit"), _rows(measures))], [said])


def _rows(measures: BearingMeasures) -> list[tuple[str, str, str]]:
    """Measures with their own words; the parts of the power one by one."""
    rows = []
    for field in dataclasses.fields(measures):
        value, unit = getattr(measures, field.name), field.metadata["unit"]
        if isinstance(value, dict):
            rows += [(f"of it {name.replace('_', ' ')}", f"{part:.4g}", unit) for name, part in value.items()]
        else:
            shown = value if isinstance(value, str) else f"{value:.4g}"
            rows.append((field.metadata["text"], shown, "" if unit == "1" else unit))
    return rows
