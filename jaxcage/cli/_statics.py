"""`jaxcage statics`: load of every roller, loaded zone, static displacement of the cage,
kinematics.
"""

import math
from typing import Any

import numpy as np

from ..bearing import Bearing, load_distribution, raceway_surface_speed
from ..io import write_columns
from ..plotting import load_bars, new_figure
from ..report import displacements
from ._errors import UsageError
from ._inputs import angular_speed, output_folder, save_figure, subject
from ._options import StaticsOptions
from ._report import Report, Table


def run(options: StaticsOptions) -> Report:
    """Carry out `jaxcage statics`."""
    if options.load is not None and not (math.isfinite(options.load) and options.load > 0):
        raise UsageError(f"Option --load must be above 0 N, but {options.load:g} was given.")
    if not (math.isfinite(options.shaft_speed) and options.shaft_speed >= 0):
        raise UsageError(f"Option --shaft-speed must be at least 0 rpm, but {options.shaft_speed:g} was given.")
    about, folder = subject(options), output_folder(options)
    model, bearing = about.model, about.model.bearing
    load = float(model.load) if options.load is None else options.load
    if load <= 0:
        raise UsageError(f"The shaft load of {about.name} must be above 0 N, but it is {load:g}: give one with --load.")
    shaft = angular_speed(options.shaft_speed)
    shared = load_distribution(bearing, load, bearing.roller_centrifugal_force(shaft))
    figure = new_figure(7.0, 3.8)
    load_bars(shared, figure.subplots()).set_title(f"{about.name}, {load:g} N", loc="left", fontsize=11)
    loads = {
        "angle [rad]": np.asarray(shared.roller_angles),
        "inner load [N]": np.asarray(shared.inner_loads),
        "outer load [N]": np.asarray(shared.outer_loads),
    }
    paths = {
        "figure": save_figure(figure, folder / f"statics_{about.name}.png"),
        "data": str(write_columns(folder / f"statics_{about.name}.csv", loads)),
    }
    document = {
        "case": about.name,
        "load": load,
        "shaft_speed_rpm": options.shaft_speed,
        "rollers": [dict(zip(("angle", "inner_load", "outer_load"), row, strict=True)) for row in zip(*loads.values())],
        "max_load": shared.max_load,
        "shaft_shift": shared.shaft_shift,
        "elastic_approach": shared.elastic_approach,
        "half_angle": shared.half_angle,
        "cage_displacement": displacements(model, shared),
        "kinematics": _kinematics(bearing, shaft),
        **paths,
    }
    return Report(document, _tables(document), [f"Figure: {paths['figure']}", f"Data: {paths['data']}"])


def _kinematics(bearing: Bearing, shaft_speed: float) -> dict[str, float]:
    """Speeds [rad/s], [m/s] and the centrifugal force of a roller [N]."""
    return {
        "cage_speed_ratio": float(bearing.cage_speed_ratio),
        "cage_speed": float(bearing.cage_speed(shaft_speed)),
        "inner_raceway_surface_speed": float(raceway_surface_speed(shaft_speed, bearing.inner_raceway_diameter)),
        "roller_centrifugal_force": float(bearing.roller_centrifugal_force(shaft_speed)),
    }


def _tables(document: dict[str, Any]) -> list[Table]:
    rollers = [
        (f"{math.degrees(r['angle']):.1f}", f"{r['inner_load']:.1f}", f"{r['outer_load']:.1f}")
        for r in document["rollers"]
    ]
    moves, motion = document["cage_displacement"], document["kinematics"]
    surface_speed = motion["inner_raceway_surface_speed"]
    half_angle = math.degrees(float(document["half_angle"]))
    values = [
        ("largest roller load", f"{float(document['max_load']):.1f}", "N"),
        ("shift of the shaft", f"{1e6 * float(document['shaft_shift']):.2f}", "µm"),
        ("elastic approach", f"{1e6 * float(document['elastic_approach']):.2f}", "µm"),
        ("half angle of the loaded zone", f"{half_angle:.2f}", "°"),
        *(
            (f"cage displacement, {guidance.replace('_', ' ')} guidance", f"{1e3 * y:.4f}", "mm")
            for guidance, y in moves.items()
        ),
        ("cage speed over shaft speed", f"{motion['cage_speed_ratio']:.4f}", ""),
        ("cage speed", f"{motion['cage_speed'] * 30 / math.pi:.1f}", "rpm"),
        ("surface speed of the inner raceway", f"{surface_speed:.2f}", "m/s"),
        ("centrifugal force of a roller", f"{motion['roller_centrifugal_force']:.1f}", "N"),
    ]
    at = f"{document['load']:g} N, shaft at {document['shaft_speed_rpm']:g} rpm"
    title = f"Statics of {document['case']} at {at}"
    return [
        Table("Rollers", ("angle [°]", "inner load [N]", "outer load [N]"), rollers),
        Table(title, ("quantity", "value", "unit"), values),
    ]
