"""Statics as a table: load of the rollers, loaded zone, resting place of the cage."""

import math
from typing import get_args

from ..bearing import Guidance, LoadDistribution, static_cage_displacement
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


def statics_table(model: CageModel, shared: LoadDistribution) -> Table:
    """What a designer asks of the bearing at rest."""
    rows = [
        ("largest roller load", f"{float(shared.max_load):.1f}", "N"),
        ("shift of the shaft", f"{1e6 * float(shared.shaft_shift):.2f}", "µm"),
        ("elastic approach", f"{1e6 * float(shared.elastic_approach):.2f}", "µm"),
        ("half angle of the loaded zone", f"{math.degrees(float(shared.half_angle)):.2f}", "°"),
        *(
            (f"cage displacement, {guidance.replace('_', ' ')} guidance", f"{1e3 * y:.4f}", "mm")
            for guidance, y in displacements(model, shared).items()
        ),
        ("cage speed over shaft speed", f"{float(model.bearing.cage_speed_ratio):.4f}", ""),
    ]
    return Table(f"At rest under {float(model.load):g} N", ("quantity", "value", "unit"), rows)
