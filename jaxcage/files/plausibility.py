"""Checks of values that must fit together, which the range of a single value cannot express."""

import math

from ..bearing import Bearing
from ..models import BearingModel, CageModel
from .schema import ConfigError


HEAVIEST = 8900.0
"""Density of bronze [kg/m^3]."""


def _check_rings(bearing: Bearing) -> None:
    """**Raises:** `ConfigError` for impossible ribs or rollers."""
    mm = lambda value: 1e3 * float(value)
    pitch, raceway = mm(bearing.pitch_diameter), mm(bearing.outer_raceway_diameter)
    if not pitch < (rib := mm(bearing.rib_diameter)) < raceway:
        raise ConfigError(
            f"`bearing.rib_diameter` must lie between the pitch circle and the outer raceway, {pitch:g} and "
            f"{raceway:g} mm, but is {rib:g} mm."
        )
    if raceway >= (outside := mm(bearing.outside_diameter)):
        raise ConfigError(
            f"`bearing.outside_diameter` must be above the outer raceway, {raceway:g} mm, but is {outside:g} mm."
        )
    if (length := mm(bearing.roller_length)) >= (width := mm(bearing.width)):
        raise ConfigError(f"`bearing.roller_length` must fit into the rings, {width:g} mm, but is {length:g} mm.")
    pocket, room = mm(bearing.roller_diameter + bearing.pocket_clearance), math.pi * pitch / bearing.n_rollers
    if pocket >= room:
        raise ConfigError(
            f"`bearing.pocket_clearance` must leave a bar between pockets, which are {room:.4g} mm apart, but makes "
            f"them {pocket:g} mm wide."
        )


def check_together(model: CageModel | BearingModel) -> None:
    """Check gap, rings, land, masses and oil of a model against each other.

    **Raises:** `ConfigError`.
    """
    gap, eccentricity = 1e3 * float(model.guidance_gap), 1e3 * float(model.eccentricity)
    if eccentricity >= gap:
        raise ConfigError(
            f"`eccentricity` must be smaller than `guidance_gap`, but is {eccentricity:g} mm in a gap of {gap:g} mm."
        )
    _check_rings(model.bearing)
    rib = 1e3 * float(model.bearing.rib_diameter)
    if gap >= rib:
        raise ConfigError(f"`guidance_gap` must leave room for the cage, but is {gap:g} mm in a rib of {rib:g} mm.")
    if isinstance(model, BearingModel) and model.guidance == "inner":
        land = 1e3 * float(model.inner_land_diameter)
        if land <= (bore := 1e3 * float(model.bearing.bore)):
            raise ConfigError(f"`inner_land_diameter` must be above the bore, {bore:g} mm, but is {land:g} mm.")
        if land + gap >= rib:
            raise ConfigError(
                f"`inner_land_diameter` and `guidance_gap` must leave room for the cage within the outer ring's ribs, "
                f"{rib:g} mm, but are {land:g} and {gap:g} mm."
            )
    b = model.bearing
    volume = math.pi / 4 * float((b.outside_diameter**2 - b.bore**2) * b.width)  # between shaft and housing
    mass, most = float(model.cage_mass), HEAVIEST * volume
    if mass > most:
        raise ConfigError(
            f"`cage_mass` must be at most {most:.3g} kg, as of a bearing of this size full of bronze, but is "
            f'{mass:g} kg; grams are written "60 g".'
        )
    if isinstance(model, BearingModel):
        inertia, ring = float(model.cage_inertia), mass * float(model.bearing.pitch_diameter) ** 2 / 4
        if not 0.1 * ring <= inertia <= 10 * ring:
            raise ConfigError(
                f"`cage_inertia` must be that of a ring, between a tenth and ten times {ring:.2g} kg m^2 for a cage of "
                f"{1e3 * mass:g} g, but is {inertia:g} kg m^2."
            )
    if not math.isfinite(float(model.lubricant.dynamic_viscosity)):
        raise ConfigError(
            "`lubricant` must have a viscosity at its temperature, but by ASTM D341 its two points, reference and "
            "temperature give none."
        )
    width, limit = 1e3 * float(model.film.land_width), 1e3 * float(model.bearing.land_width_limit)
    if width > limit:
        raise ConfigError(f"`film.land_width` must fit beside the rollers, in {limit:g} mm, but is {width:g} mm.")
