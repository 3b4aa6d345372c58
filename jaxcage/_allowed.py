"""Declarations of parameters and the words about allowed values; nothing here loads JAX."""

import dataclasses
from typing import Any, Literal

import numpy as np


Kind = Literal["drawing", "catalogue", "oil", "operating", "unknown", "fixed"]
SOURCES: dict[Kind, str] = {
    "drawing": "drawing, or weighed and measured",
    "catalogue": "catalogue of the bearing",
    "oil": "data sheet of the oil",
    "operating": "the machine",
    "unknown": "not known unless it is measured",
    "fixed": "constant of nature, of a law, or numerical",
}
"""Kinds of parameters, and where a value comes from."""


@dataclasses.dataclass(frozen=True)
class ParameterInfo:
    """Declaration of a parameter: SI unit, closed range of allowed values, description, source."""

    unit: str
    lower: float
    upper: float
    text: str
    kind: Kind = "fixed"
    """Kind of source, see `SOURCES`."""
    source: str = ""
    """Source of the value, or how to measure it."""


UNKNOWN = "?"
"""Unit of a parameter that is not declared."""


def allowed(info: ParameterInfo) -> str:
    """Allowed range of a parameter, as messages state it."""
    unit = "" if info.unit in ("1", UNKNOWN) else f" {info.unit}"
    return f"must be a number from {info.lower:g} to {info.upper:g}{unit}"


ROUNDING = 1e-12
"""Relative difference of numbers that are the same but for a conversion of units."""


def within(numbers: Any, lower: float, upper: float) -> np.ndarray:
    """True for numbers from `lower` to `upper`, up to rounding: 10 um, converted, is a little less than 1e-5 m."""
    given = np.asarray(numbers, dtype=float)
    return np.asarray((given >= lower - ROUNDING * abs(lower)) & (given <= upper + ROUNDING * abs(upper)))


def must_be_given(options: dict[str, str]) -> str:
    """Message for a reading that was not chosen."""
    return "must be given, " + " or ".join(f'"{name}" ({words})' for name, words in options.items())
