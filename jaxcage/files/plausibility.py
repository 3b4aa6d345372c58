"""Checks of values that must fit together, which the range of a single value cannot express. Nothing here loads JAX but
`check_together`, for a model that is already built.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from .._allowed import ROUNDING
from .._errors import ConfigError


HEAVIEST = 8900.0
"""Density of bronze [kg/m^3]."""
SYNCHRONOUS = "SynchronousImpact"
"""Law of impacts that needs no load of the bearing."""


def check_together(model: Any) -> None:
    """Check gap, rings, land, masses and oil of a cage or a whole bearing against each other.

    **Raises:** `ConfigError`.
    """
    from .._parameters import parameters

    choices = {"n_rollers": model.bearing.n_rollers, "guidance": getattr(model, "guidance", "outer")}
    if hasattr(model, "impact"):
        choices["impact"] = type(model.impact).__name__
    check_numbers({name: float(value) for name, value in parameters(model).items()} | choices)
    if not math.isfinite(float(model.lubricant.dynamic_viscosity)):
        points = "by ASTM D341 its two points, reference and temperature give none"
        raise ConfigError(f"`lubricant` must have a viscosity at its temperature, but {points}.")


def check_numbers(numbers: Mapping[str, Any]) -> None:
    """Check parameters [SI] by name against each other. **Raises:** `ConfigError`."""
    for wrong, keys, must in _checks(numbers):
        if wrong:
            raise ConfigError(f"`{keys}` must {must}.")


def _checks(n: Mapping[str, Any]) -> Iterator[tuple[bool, str, str]]:
    """True for a wrong value, with its key and the words for what it must be and what it is; False for one that is not
    known yet, whose comparisons are those of NaN."""
    number = lambda name: float(n.get(name, math.nan))
    mm = lambda name: 1e3 * number(name)
    gap, eccentricity, rib = mm("guidance_gap"), mm("eccentricity"), mm("rib_diameter")
    must = f"be smaller than `guidance_gap`, but is {eccentricity:g} mm in a gap of {gap:g} mm"
    yield eccentricity >= gap, "eccentricity", must
    roller, outside = mm("roller_diameter"), mm("outside_diameter")
    inner, bore = mm("inner_raceway_diameter"), mm("bore")
    yield bore >= inner, "bearing.bore", f"be below the inner raceway, {inner:g} mm, but is {bore:g} mm"
    pitch, raceway = inner + roller, inner + 2 * roller
    must = f"lie between the pitch circle and the outer raceway, {pitch:g} and {raceway:g} mm, but is {rib:g} mm"
    yield rib <= pitch or rib > raceway * (1 + ROUNDING), "bearing.rib_diameter", must  # type N has no ribs
    must = f"be above the outer raceway, {raceway:g} mm, but is {outside:g} mm"
    yield raceway >= outside, "bearing.outside_diameter", must
    length, width = mm("roller_length"), mm("width")
    yield length >= width, "bearing.roller_length", f"fit into the rings, {width:g} mm, but is {length:g} mm"
    carries = mm("effective_length")
    must = f"be at most `roller_length`, {length:g} mm, but is {carries:g} mm"
    yield carries > length * (1 + ROUNDING), "bearing.effective_length", must
    pocket, room = roller + mm("pocket_clearance"), pitch * math.sin(math.pi / number("n_rollers"))
    must = f"leave a bar between pockets, which are {room:.4g} mm apart, but makes them {pocket:g} mm wide"
    yield pocket >= room, "bearing.pocket_clearance", must
    yield gap >= rib, "guidance_gap", f"leave room for the cage, but is {gap:g} mm in a rib of {rib:g} mm"
    if n.get("guidance") == "inner":
        land = mm("inner_land_diameter")
        must = f"lie between the inner raceway and the pitch circle, {inner:g} and {pitch:g} mm, but is {land:g} mm"
        yield land < inner or land >= pitch, "inner_land_diameter", must
        must = f"leave room for the cage within the outer ring's ribs, {rib:g} mm, but are {land:g} and {gap:g} mm"
        yield land + gap >= rib, "inner_land_diameter` and `guidance_gap", must
    mass, volume = number("cage_mass"), 1e-9 * math.pi / 4 * (outside**2 - bore**2) * width
    most = HEAVIEST * volume  # between shaft and housing
    must = f"be at most {most:.3g} kg, as of a bearing of this size full of bronze, but is {mass:g} kg"
    yield mass > most, "cage_mass", f'{must}; grams are written "60 g"'
    inertia, ring = number("cage_inertia"), mass * (1e-3 * pitch) ** 2 / 4
    must = f"be that of a ring, between a tenth and ten times {ring:.2g} kg m^2 for a cage of {1e3 * mass:g} g"
    yield inertia < 0.1 * ring or inertia > 10 * ring, "cage_inertia", f"{must}, but is {inertia:g} kg m^2"
    must = "be above 0 N for impacts of rollers that enter and leave the loaded zone, but is 0 N"
    yield n.get("impact", SYNCHRONOUS) != SYNCHRONOUS and number("load") == 0, "load", must
    land, limit = mm("land_width"), (width - length) / 2
    yield land > limit, "film.land_width", f"fit beside the rollers, in {limit:g} mm, but is {land:g} mm"
