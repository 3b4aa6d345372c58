"""What needs no motion of the cage: a file to start from, loads at rest, the impact of one roller."""

import jax.numpy as jnp
import numpy as np

from .._errors import InputError
from .._parameters import parameters
from ..bearing import load_distribution, raceway_surface_speed
from ..forces import PocketImpact, RollerPassImpact, approach_speed, impact_history
from ..io import shaft_rpm, write_template
from ..plotting import impact_forces, load_bars
from ..report import Table, chosen, displacements, impact_document, impact_table, statics_table
from ..sweeps import rpm
from ._job import Job
from ._options import WHOLE_COMMANDS, ImpactOptions, InitOptions, StaticsOptions
from ._show import Report


AT_SPEED = ' --speed "10000 rpm shaft"'
NEEDED = dict.fromkeys(("simulate", "gradient", "design", "sensitivity"), AT_SPEED) | {
    "compare": " nu2310",
    "study": " --vary guidance_gap=0.3mm:0.6mm:3",
}
"""What commands about a whole bearing ask for beside it, as an example."""


def init(job: Job[InitOptions]) -> Report:
    """`jaxcage init`: a commented description of a bearing to fill in."""
    subject = job.options.model
    path = write_template(job.options.path, subject)
    commands = ("statics", "sweep", "zones", "report") if subject == "cage" else WHOLE_COMMANDS
    goes_on = [f"  jaxcage {command} {path}{NEEDED.get(command, '')}" for command in commands]
    described = "the NU2310 of case 1a" if subject == "cage" else "the NU2310 with its rollers"
    told = f"It describes {described}: change the values and go on with"
    return Report({"file": str(path)}, notes=[f"Written: {path}", told, *goes_on])


def statics(job: Job[StaticsOptions]) -> Report:
    """`jaxcage statics`: load of every roller, loaded zone, static displacement of the cage, kinematics."""
    options, model, bearing = job.options, job.model, job.model.bearing
    load = float(model.load) if options.load is None else options.load
    if load <= 0:
        raise InputError(f"The shaft load of {job.name} must be above 0 N, but it is {load:g}: give one with --load.")
    at = shaft_rpm(options.shaft_speed, "shaft", job.ratio)
    shaft = rpm(at)
    with job.computing():
        shared = load_distribution(bearing, load, bearing.roller_centrifugal_force(shaft))
    loads = {
        "angle [rad]": np.asarray(shared.roller_angles),
        "inner load [N]": np.asarray(shared.inner_loads),
        "outer load [N]": np.asarray(shared.outer_loads),
    }
    job.draw(lambda ax: load_bars(shared, ax), (7.0, 3.8), f"{job.name}, {load:g} N")
    job.columns(loads)
    document = {
        "load": load,
        "shaft_speed_rpm": at,
        "rollers": [dict(zip(("angle", "inner_load", "outer_load"), row, strict=True)) for row in zip(*loads.values())],
        **chosen(shared, "max_load shaft_shift elastic_approach half_angle"),
        "cage_displacement": displacements(model, shared),
        "kinematics": {
            "cage_speed_ratio": float(bearing.cage_speed_ratio),
            "cage_speed": float(bearing.cage_speed(shaft)),
            "inner_raceway_surface_speed": float(raceway_surface_speed(shaft, bearing.inner_raceway_diameter)),
            "roller_centrifugal_force": float(bearing.roller_centrifugal_force(shaft)),
        },
    }
    degrees = np.degrees(loads["angle [rad]"])
    rollers = [tuple(f"{x:.1f}" for x in row) for row in zip(degrees, shared.inner_loads, shared.outer_loads)]
    title = f"Statics of {job.name} at {load:g} N, shaft at {at:g} rpm"
    tables = [
        Table("Rollers", ("angle [°]", "inner load [N]", "outer load [N]"), rollers),
        statics_table(title, model, shared, shaft),
    ]
    return Report(document, tables)


def impact(job: Job[ImpactOptions]) -> Report:
    """`jaxcage impact`: one roller on a cage bar, the history of (14) and fig. 5."""
    options, model = job.options, job.model
    # The synchronous law has no oscillator: its amplitude is all that it knows of the impact.
    law = model.impact.oscillator if isinstance(model.impact, RollerPassImpact) else PocketImpact()
    if not float(model.bearing.pocket_clearance) > 0:
        raise InputError(f"The pocket clearance of {job.name} must be above 0 for an impact, but it is 0.")
    with job.computing():
        v0 = approach_speed(law.approach_ratio, rpm(options.speed), model.bearing.pocket_clearance)
        history = impact_history(law, model.bearing.roller_mass, v0, jnp.asarray(1e-3 * options.duration))
    at, title = f"_{options.speed:g}rpm", f"{job.name}, {job.at_speed}, approach at {float(v0):.3g} m/s"
    job.draw(lambda ax: impact_forces(history, ax), (7.0, 4.0), title, detail=at)
    units = {"time": "s", "contact_force": "N", "bar_force": "N", "roller_position": "m", "bar_position": "m"}
    job.columns({f"{n} [{unit}]": np.asarray(getattr(history, n)) for n, unit in units.items()}, detail=at)
    values = {"approach_speed": float(v0)} | impact_document(history)
    table = impact_table(f"Impact in {job.name} at {job.at_speed}", values)
    assumed = {name: float(getattr(law, name)) for name in parameters(law)}
    whose = "of the file" if isinstance(model.impact, RollerPassImpact) else "assumed, as a synchronous impact has none"
    said = f"Bar and contact, {whose}: " + ", ".join(f"{name} {value:g}" for name, value in assumed.items()) + " (SI)"
    speeds = {"speed_rpm": options.speed, "shaft_speed_rpm": options.speed / job.ratio}
    return Report({**speeds, **values, "bar": assumed}, [table], [said])
