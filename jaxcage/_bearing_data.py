"""Bearings of `bearing/catalogue.csv` and materials of `bearing/cage_materials.csv` by name, and speeds of a cage.

Files are checked with these before JAX is loaded.
"""

import csv
import functools
import importlib.resources
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from ._errors import ArgumentError, InputError


FASTEST = 300.0
"""Surface speed of the cage at its land [m/s] beyond which no cage runs: rho v^2 alone is 765 MPa of hoop stress in
brass, twice what it bears, and what is given in rpm for rad/s is 9.5 times as fast as meant."""


@functools.cache
def rows() -> dict[str, dict[str, str]]:
    """Rows of the catalogue by designation, such as `NU2310`."""
    return {row["designation"]: row for row in _table("catalogue.csv")}


def _table(file: str) -> csv.DictReader:
    text = importlib.resources.files("jaxcage").joinpath("bearing", file).read_text(encoding="utf-8")
    return csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))


def designated(given: str) -> str:
    """The designation in the catalogue that a text means; spaces, case and what stands behind it do not matter.

    **Raises:** `ValueError` that lists the designations.
    """
    name = given.upper().replace(" ", "").replace("-", "")
    if name not in rows():
        name = name.rstrip("ABCDEFGHIJKLMNOPQRSTVWXYZ")
    if name not in rows():
        raise ArgumentError(
            "designation",
            said=f"must be one of {', '.join(rows())}, but {given!r} was given: leave out a suffix such as C3, or give "
            "dimensions.",
        )
    return name


DIMENSIONS = {"bore": "d", "outside_diameter": "D", "width": "B", "roller_diameter": "Dw", "roller_length": "Lw"}
DIMENSIONS |= {"rib_diameter": "D1", "inner_raceway_diameter": "F"}
"""Parameters of a bearing and their columns."""


def dimensions(designation: str) -> dict[str, float]:
    """Parameters [m] that stand in the catalogue."""
    return {name: 1e-3 * float(rows()[designation][column]) for name, column in DIMENSIONS.items()}


NORMAL_CLEARANCE = {24: 32.5, 30: 32.5, 40: 37.5, 50: 45.0, 65: 55.0, 80: 57.5, 100: 67.5, 120: 70.0}
"""Largest bore [mm] -> middle of the normal radial clearance of cylindrical roller bearings [um]; ISO 5753-1."""
POCKET = 0.3 / 16
"""Pocket clearance over roller diameter where none is known: that of the paper's bearing."""


def clearances(sizes: Mapping[str, float]) -> dict[str, float]:
    """Estimates of clearances [m] from bore and roller diameter; the radial one needs a bore of at most 120 mm."""
    found = {}
    if normal := [um for most, um in NORMAL_CLEARANCE.items() if sizes.get("bore", math.inf) <= 1e-3 * most]:
        found["radial_clearance"] = 1e-6 * normal[0]
    if "roller_diameter" in sizes:
        found["pocket_clearance"] = POCKET * sizes["roller_diameter"]
    return found


ROLLING = {"2": 1.09e-6, "3": 1.09e-6, "10": 1.12e-6, "20": 1.23e-6, "22": 1.40e-6, "23": 1.48e-6}
"""Series of cylindrical roller bearings -> R_1 of the rolling resistance; source in `bearing.oil_drag`."""


def rolling_coefficient(designation: str) -> float:
    """R_1 of SKF's rolling resistance for a bearing of the catalogue, from the series in its designation."""
    return ROLLING[designation.rstrip("ABCDEFGHIJKLMNOPQRSTVWXYZ")[2:-2]]


def estimated(designation: str) -> tuple[str, ...]:
    """Parameters of a bearing of the catalogue that nobody prints; those of the paper's bearing are in the paper."""
    if designation == "NU2310":
        return ()
    rollers = ("n_rollers", "roller_diameter", "roller_length") if rows()[designation]["estimated"] else ()
    return ("radial_clearance", "pocket_clearance", "effective_length", *rollers)


class CageMaterial(NamedTuple):
    """A material of cages: `cage_materials.csv` has the source of each number."""

    name: str
    density: float
    """[kg/m^3]."""
    youngs_modulus: float
    """[Pa]."""
    friction: float
    """Coefficient of friction of the oiled material on steel."""
    limit: float
    """Highest temperature [K]."""
    hardness: float
    """Indentation hardness [Pa]."""


@functools.cache
def cage_materials() -> dict[str, CageMaterial]:
    """Materials of cages by name."""
    found = {}
    for row in _table("cage_materials.csv"):
        density, modulus, friction, limit, hardness = (float(row[k]) for k in list(row)[1:])
        found[row["name"]] = CageMaterial(row["name"], density, 1e9 * modulus, friction, limit + 273.15, 1e9 * hardness)
    return found


def cage_material(name: str) -> CageMaterial:
    """The material `name`; case does not matter, and the fibres may be left out: `PEEK`.

    **Raises:** `ValueError` that lists the names.
    """
    for known, material in cage_materials().items():
        if name.upper() in (known.upper(), known.partition("-")[0].upper()):
            return material
    raise ArgumentError("name", said=f"must be one of {', '.join(cage_materials())}, but {name!r} was given.")


def cage_speed_ratio(inner_raceway_diameter: Any, roller_diameter: Any) -> Any:
    """Cage speed over shaft speed, from (8): (1 - d_w/d_m)/2 with d_m = d_i + d_w [1]."""
    return (1 - roller_diameter / (inner_raceway_diameter + roller_diameter)) / 2


def land_radius(rib_diameter: Any, guidance_gap: Any) -> Any:
    """Radius of the guiding surface of a cage within the outer ring's ribs, (d_g - C_r)/2 [m]."""
    return (rib_diameter - guidance_gap) / 2


def require_cage_rpm(option: str, cage: float, radius: float) -> None:
    """Compare a speed of the cage [rpm] with that at which its land, of a radius [m], runs at `FASTEST`.

    **Raises:** `InputError` about the option.
    """
    limit = FASTEST / radius * 30 / math.pi
    if not 0 < cage <= limit:
        raise InputError(
            f"Option {option} must be above 0 and leave the cage at most {limit:.0f} rpm, which is {FASTEST:g} m/s at "
            f"its land, but {cage:g} rpm of the cage were given; speeds of the shaft are written "
            '"20000 rpm shaft".'
        )
