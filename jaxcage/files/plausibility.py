"""Checks of values that must fit together, which the range of a single value cannot express. Nothing here loads JAX but
`check_together`, for a model that is already built.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from .._allowed import within
from .._errors import ConfigError


HEAVIEST = 8900.0
"""Density of bronze [kg/m^3]."""


def check_together(model: Any) -> None:
    """Check gap, rings, land, masses and oil of a cage or a whole bearing against each other.

    **Raises:** `ConfigError`.
    """
    from .._parameters import parameters

    choices = {"n_rollers": model.bearing.n_rollers, "guidance": getattr(model, "guidance", "outer")}
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
    """True for a wrong value, with its key and the words for what it must be and what it is."""
    mm = lambda *names: 1e3 * sum(n[name] for name in names)
    gap, eccentricity, rib = mm("guidance_gap"), mm("eccentricity"), mm("rib_diameter")
    must = f"be smaller than `guidance_gap`, but is {eccentricity:g} mm in a gap of {gap:g} mm"
    yield eccentricity >= gap, "eccentricity", must
    pitch, outside = mm("inner_raceway_diameter", "roller_diameter"), mm("outside_diameter")
    raceway = pitch + mm("roller_diameter")
    must = f"lie between the pitch circle and the outer raceway, {pitch:g} and {raceway:g} mm, but is {rib:g} mm"
    yield not pitch < rib < raceway, "bearing.rib_diameter", must
    must = f"be above the outer raceway, {raceway:g} mm, but is {outside:g} mm"
    yield raceway >= outside, "bearing.outside_diameter", must
    length, width, bore = mm("roller_length"), mm("width"), mm("bore")
    yield length >= width, "bearing.roller_length", f"fit into the rings, {width:g} mm, but is {length:g} mm"
    if "effective_length" in n:
        carries = mm("effective_length")
        must = f"be at most `roller_length`, {length:g} mm, but is {carries:g} mm"
        yield not within(carries, 0.0, length), "bearing.effective_length", must
    pocket, room = mm("roller_diameter", "pocket_clearance"), math.pi * pitch / n["n_rollers"]
    must = f"leave a bar between pockets, which are {room:.4g} mm apart, but makes them {pocket:g} mm wide"
    yield pocket >= room, "bearing.pocket_clearance", must
    yield gap >= rib, "guidance_gap", f"leave room for the cage, but is {gap:g} mm in a rib of {rib:g} mm"
    if n.get("guidance") == "inner" and "inner_land_diameter" in n:
        land = mm("inner_land_diameter")
        yield land <= bore, "inner_land_diameter", f"be above the bore, {bore:g} mm, but is {land:g} mm"
        must = f"leave room for the cage within the outer ring's ribs, {rib:g} mm, but are {land:g} and {gap:g} mm"
        yield land + gap >= rib, "inner_land_diameter` and `guidance_gap", must
    mass, volume = n["cage_mass"], 1e-9 * math.pi / 4 * (outside**2 - bore**2) * width
    most = HEAVIEST * volume  # between shaft and housing
    must = f"be at most {most:.3g} kg, as of a bearing of this size full of bronze, but is {mass:g} kg"
    yield mass > most, "cage_mass", f'{must}; grams are written "60 g"'
    if "cage_inertia" in n:
        inertia, ring = n["cage_inertia"], mass * (1e-3 * pitch) ** 2 / 4
        must = f"be that of a ring, between a tenth and ten times {ring:.2g} kg m^2 for a cage of {1e3 * mass:g} g"
        yield not 0.1 * ring <= inertia <= 10 * ring, "cage_inertia", f"{must}, but is {inertia:g} kg m^2"
    land, limit = mm("land_width"), (width - length) / 2
    yield land > limit, "film.land_width", f"fit beside the rollers, in {limit:g} mm, but is {land:g} mm"
