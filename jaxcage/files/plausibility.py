"""Checks of values that must fit together, which the range of a single value cannot express."""

import math
from collections.abc import Iterator
from typing import Any

from .._parameters import within
from ..models import BearingModel, CageModel
from .description import ConfigError


HEAVIEST = 8900.0
"""Density of bronze [kg/m^3]."""


def check_together(model: CageModel | BearingModel) -> None:
    """Check gap, rings, land, masses and oil of a model against each other.

    **Raises:** `ConfigError`.
    """
    for wrong, keys, must in _checks(model):
        if wrong:
            raise ConfigError(f"`{keys}` must {must}.")


def _checks(model: CageModel | BearingModel) -> Iterator[tuple[bool, str, str]]:
    """True for a wrong value, with its key and the words for what it must be and what it is."""
    b: Any = model.bearing
    mm = lambda value: 1e3 * float(value)
    gap, eccentricity, rib = mm(model.guidance_gap), mm(model.eccentricity), mm(b.rib_diameter)
    must = f"be smaller than `guidance_gap`, but is {eccentricity:g} mm in a gap of {gap:g} mm"
    yield eccentricity >= gap, "eccentricity", must
    pitch, raceway, outside = mm(b.pitch_diameter), mm(b.outer_raceway_diameter), mm(b.outside_diameter)
    must = f"lie between the pitch circle and the outer raceway, {pitch:g} and {raceway:g} mm, but is {rib:g} mm"
    yield not pitch < rib < raceway, "bearing.rib_diameter", must
    must = f"be above the outer raceway, {raceway:g} mm, but is {outside:g} mm"
    yield raceway >= outside, "bearing.outside_diameter", must
    length, width = mm(b.roller_length), mm(b.width)
    yield length >= width, "bearing.roller_length", f"fit into the rings, {width:g} mm, but is {length:g} mm"
    if b.effective_length is not None:
        carries = mm(b.effective_length)
        must = f"be at most `roller_length`, {length:g} mm, but is {carries:g} mm"
        yield not within(carries, 0.0, length), "bearing.effective_length", must
    pocket, room = mm(b.roller_diameter + b.pocket_clearance), math.pi * pitch / b.n_rollers
    must = f"leave a bar between pockets, which are {room:.4g} mm apart, but makes them {pocket:g} mm wide"
    yield pocket >= room, "bearing.pocket_clearance", must
    yield gap >= rib, "guidance_gap", f"leave room for the cage, but is {gap:g} mm in a rib of {rib:g} mm"
    if isinstance(model, BearingModel) and model.guidance == "inner":
        land, bore = mm(model.inner_land_diameter), mm(b.bore)
        yield land <= bore, "inner_land_diameter", f"be above the bore, {bore:g} mm, but is {land:g} mm"
        must = f"leave room for the cage within the outer ring's ribs, {rib:g} mm, but are {land:g} and {gap:g} mm"
        yield land + gap >= rib, "inner_land_diameter` and `guidance_gap", must
    mass, volume = float(model.cage_mass), math.pi / 4 * float((b.outside_diameter**2 - b.bore**2) * b.width)
    most = HEAVIEST * volume  # between shaft and housing
    must = f"be at most {most:.3g} kg, as of a bearing of this size full of bronze, but is {mass:g} kg"
    yield mass > most, "cage_mass", f'{must}; grams are written "60 g"'
    if isinstance(model, BearingModel):
        inertia, ring = float(model.cage_inertia), mass * float(b.pitch_diameter) ** 2 / 4
        must = f"be that of a ring, between a tenth and ten times {ring:.2g} kg m^2 for a cage of {1e3 * mass:g} g"
        yield not 0.1 * ring <= inertia <= 10 * ring, "cage_inertia", f"{must}, but is {inertia:g} kg m^2"
    elif model.impact.kind != "synchronous":
        must = "be above 0 N for impacts of rollers that enter and leave the loaded zone, but is 0 N"
        yield float(model.load) == 0, "load", must
    points = "by ASTM D341 its two points, reference and temperature give none"
    known = math.isfinite(float(model.lubricant.dynamic_viscosity))
    yield not known, "lubricant", f"have a viscosity at its temperature, but {points}"
    land, limit = mm(model.film.land_width), mm(b.land_width_limit)
    yield land > limit, "film.land_width", f"fit beside the rollers, in {limit:g} mm, but is {land:g} mm"
