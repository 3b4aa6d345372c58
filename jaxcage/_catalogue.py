"""Rows of `bearing/catalogue.csv` by designation: nothing here loads JAX."""

import csv
import functools
import importlib.resources

from ._errors import ArgumentError


@functools.cache
def rows() -> dict[str, dict[str, str]]:
    """Rows of the catalogue by designation, such as `NU2310`."""
    text = importlib.resources.files("jaxcage").joinpath("bearing", "catalogue.csv").read_text(encoding="utf-8")
    return {row["designation"]: row for row in csv.DictReader(x for x in text.splitlines() if not x.startswith("#"))}


def designated(given: str) -> str:
    """The designation in the catalogue that a text means; spaces, case and what stands behind it do not matter.

    **Raises:** `ValueError` that lists the designations.
    """
    name = given.upper().replace(" ", "").replace("-", "")
    if name not in rows():
        name = name.rstrip("ABCDEFGHIJKLMNOPQRSTVWXYZ")
    if name not in rows():
        raise ArgumentError(
            "designation", said=f"must be one of {', '.join(rows())}, but {given!r} was given: give dimensions."
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
