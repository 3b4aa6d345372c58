"""Statics and the impact of a roller as tables."""

import math
from collections.abc import Mapping
from typing import Any, get_args

import jax.numpy as jnp
import numpy as np

from ..bearing import Guidance, LoadDistribution, raceway_surface_speed, static_cage_displacement
from ..forces import ImpactHistory
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


_SHOWN = {
    "approach_speed": ("approach speed", 1.0, "m/s"),
    "peak_contact_force": ("peak contact force", 1.0, "N"),
    "peak_bar_force": ("peak bar force", 1.0, "N"),
    "lowest_bar_force": ("lowest bar force", 1.0, "N"),
    "contact_duration": ("time in contact", 1e3, "ms"),
    "contacts": ("contacts", 1.0, ""),
    "impulse": ("impulse of the contact force", 1e3, "mN s"),
}
"""Words, and factor to the unit that is shown."""


def impact_document(history: ImpactHistory) -> dict[str, Any]:
    """Peaks, time in contact and impulse, over the whole history: a bar that swings back may be hit
    again.
    """
    touching = np.asarray(history.contact_force) > 0
    step = float(history.time[1] - history.time[0])
    return {
        "peak_contact_force": float(jnp.max(history.contact_force)),
        "peak_bar_force": float(jnp.max(history.bar_force)),
        "lowest_bar_force": float(jnp.min(history.bar_force)),
        "contact_duration": float(np.sum(touching)) * step,
        "contacts": int(np.sum(touching[1:] & ~touching[:-1])),
        "impulse": float(history.impulse),
        "ends_in_contact": bool(touching[-1]),
    }


def impact_table(title: str, values: Mapping[str, Any]) -> Table:
    """An impact in words; `values` are those of its document, and the speed of approach."""
    rows = [(text, f"{factor * values[name]:.4g}", unit) for name, (text, factor, unit) in _SHOWN.items()]
    ends = "yes, give a longer --duration" if values["ends_in_contact"] else "no"
    return Table(title, ("quantity", "value", "unit"), [*rows, ("still in contact at the end", ends, "")])
