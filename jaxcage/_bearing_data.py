"""Bearings of `bearing/catalogue.csv` and materials of `bearing/cage_materials.csv` by name: nothing here loads JAX."""

import csv
import functools
import importlib.resources
from typing import NamedTuple

from ._errors import ArgumentError


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


@functools.cache
def cage_materials() -> dict[str, CageMaterial]:
    """Materials of cages by name."""
    found = {}
    for row in _table("cage_materials.csv"):
        density, modulus, friction, limit = (float(row[k]) for k in ("density", "youngs_modulus", "friction", "limit"))
        found[row["name"]] = CageMaterial(row["name"], density, 1e9 * modulus, friction, limit + 273.15)
    return found


def cage_material(name: str) -> CageMaterial:
    """The material `name`; case does not matter, and the fibres may be left out: `PEEK`.

    **Raises:** `ValueError` that lists the names.
    """
    for known, material in cage_materials().items():
        if name.upper() in (known.upper(), known.partition("-")[0].upper()):
            return material
    raise ArgumentError("name", said=f"must be one of {', '.join(cage_materials())}, but {name!r} was given.")
