"""Measurements on a machine from a CSV file: whirl frequencies, sizes of orbits, speeds at which it rattles.

    quantity, speed, value, tolerance
    whirl frequency, 12000 rpm shaft, 83 Hz, 2 Hz
    orbit size, 20000 rpm shaft, 0.12 mm, 10 um
    calm, 15000 rpm shaft
    rattles, 24000 rpm shaft

Quantities, speeds and lengths may be in any order of rows; a tolerance is what the measured value may be off at most.
"""

import csv
import dataclasses
import math
import re
from pathlib import Path
from typing import Any, Literal

from .._errors import ConfigError, printable
from .disk import read_bytes
from .units import Whose, split_owner, to_si


Quantity = Literal["whirl frequency", "orbit size", "rattles", "calm"]
UNITS: dict[str, str] = {"whirl frequency": "Hz", "orbit size": "m", "rattles": "", "calm": ""}
"""Quantity -> its unit; none where it is either seen or not."""
HEAD = ("quantity", "speed", "value", "tolerance")
_NUMBER = re.compile(r"[-+.\deE]+")
_EXAMPLES = {"Hz": ("83 Hz", "2 Hz"), "m": ("0.12 mm", "10 um")}


@dataclasses.dataclass(frozen=True)
class Measurement:
    """One row."""

    quantity: Quantity
    cage_rpm: float
    """Speed of the cage [rpm]."""
    value: float = math.nan
    """[SI]; NaN for `rattles` and `calm`."""
    tolerance: float = math.nan
    """Largest error of the value [SI]."""

    def __str__(self) -> str:
        at = f"{self.quantity} at {self.cage_rpm:.0f} rpm of the cage"
        return f"{at}: {self.words}" if self.words else at

    @property
    def words(self) -> str:
        """The value with its tolerance and unit; nothing where something is seen or not."""
        if not UNITS[self.quantity]:
            return ""
        unit, factor = ("mm", 1e3) if UNITS[self.quantity] == "m" else (UNITS[self.quantity], 1.0)
        return f"{factor * self.value:.4g} ± {factor * self.tolerance:.2g} {unit}"


def read_measurements(path: str | Path, speeds: Whose = "cage", cage_speed_ratio: float = 1.0) -> list[Measurement]:
    """The measurements in the CSV file at `path`; empty lines and those that begin with # are passed over.

    **Arguments:** file; whose speeds bare numbers are; cage speed over shaft speed.

    **Raises:** `ConfigError`, one sentence with file and line.
    """
    try:
        text = read_bytes(path).decode()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or printable(str(error).rstrip("."))
        raise ConfigError(f"File '{path}' must be a readable CSV file, but: {reason}.") from error
    lines = [(i, row) for i, row in enumerate(text.splitlines(), start=1) if row.strip() and row.strip()[0] != "#"]
    cells = [(i, [cell.strip() for cell in next(csv.reader([row], skipinitialspace=True))]) for i, row in lines]
    if not cells or tuple(cell.lower() for cell in cells[0][1]) != HEAD:
        raise ConfigError(f"File '{path}': the first line must be '{', '.join(HEAD)}', the columns' names.")
    found = []
    for i, row in cells[1:]:
        try:
            found.append(_measurement(row, speeds, cage_speed_ratio))
        except ValueError as error:
            raise ConfigError(f"File '{path}', line {i}: {error}.") from error
    if not found:
        raise ConfigError(f"File '{path}' must hold a measurement, but has none under its head.")
    return found


def _measurement(row: list[str], speeds: Whose, ratio: float) -> Measurement:
    """A row; raises `ValueError` with half a sentence."""
    quantity, speed, value, tolerance, *more = [*row, "", "", "", ""]
    if any(more):
        raise ValueError(f"must have {len(HEAD)} columns, but has {len(row)}")
    quantity: Any = quantity.lower()
    if quantity not in UNITS:
        raise ValueError(f'`quantity` must be one of {", ".join(UNITS)}, but is "{printable(quantity)}"')
    bare, whose = split_owner(speed)
    rpm = _size(bare, "rpm", "speed", "12000 rpm shaft") * (ratio if (whose or speeds) == "shaft" else 1.0)
    unit = UNITS[quantity]
    if not unit:
        if value or tolerance:
            raise ValueError(f'`{quantity}` is seen or not and must have no value, but has "{printable(value)}"')
        return Measurement(quantity, rpm)
    each = zip((value, tolerance), ("value", "tolerance"), _EXAMPLES[unit], strict=True)
    return Measurement(quantity, rpm, *(_size(text, unit, name, example) for text, name, example in each))


def _size(text: str, unit: str, name: str, example: str) -> float:
    if unit != "rpm" and _NUMBER.fullmatch(text):
        raise ValueError(f'`{name}` must have its unit, like "{example}", but is "{printable(text)}"')
    try:
        value = to_si(text, unit)
    except ValueError as error:
        raise ValueError(f'`{name}` must be like "{example}", but {error}') from None
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f'`{name}` must be above 0, like "{example}", but is "{printable(text)}"')
    return value
