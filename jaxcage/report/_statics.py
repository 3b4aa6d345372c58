"""Statics as a table: load of the rollers, loaded zone, resting place of the cage."""

import math
from typing import get_args

from ..bearing import Guidance, LoadDistribution, raceway_surface_speed, static_cage_displacement
from ..models import CageModel
from ._table import Table


def displacements(model: CageModel, shared: LoadDistribution) -> dict[str, float]:
    """Static displacement of the cage [m] for the three types of guidance."""
    return {
        guidance: float(
            static_cage_displacement(
                guidance,
                guidance_gap=model.guidance_gap,
                pocket_clearance=model.bearing.pocket_clearance,
                radial_clearance=model.bearing.radial_clearance,
                elastic_approach=shared.elastic_approach,
            )
        )
        for guidance in get_args(Guidance)
    }


def statics_table(title: str, model: CageModel, shared: LoadDistribution, shaft_speed: float | None = None) -> Table:
    """What a designer asks of the bearing at rest, and of its kinematics if a shaft speed [rad/s] is given."""
    bearing = model.bearing
    rows = [
        ("largest roller load", f"{float(shared.max_load):.1f}", "N"),
        ("shift of the shaft", f"{1e6 * float(shared.shaft_shift):.2f}", "µm"),
        ("elastic approach", f"{1e6 * float(shared.elastic_approach):.2f}", "µm"),
        ("half angle of the loaded zone", f"{math.degrees(float(shared.half_angle)):.2f}", "°"),
        *(
            (f"cage displacement, {guidance.replace('_', ' ')} guidance", f"{1e3 * y:.4f}", "mm")
            for guidance, y in displacements(model, shared).items()
        ),
        ("cage speed over shaft speed", f"{float(bearing.cage_speed_ratio):.4f}", ""),
    ]
    if shaft_speed is not None:
        surface = float(raceway_surface_speed(shaft_speed, bearing.inner_raceway_diameter))
        rows += [
            ("cage speed", f"{float(bearing.cage_speed(shaft_speed)) * 30 / math.pi:.1f}", "rpm"),
            ("surface speed of the inner raceway", f"{surface:.2f}", "m/s"),
            ("centrifugal force of a roller", f"{float(bearing.roller_centrifugal_force(shaft_speed)):.1f}", "N"),
        ]
    return Table(title, ("quantity", "value", "unit"), rows)
