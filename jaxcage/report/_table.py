"""Tables of texts, and numbers as texts."""

import dataclasses
import math
from collections.abc import Sequence


@dataclasses.dataclass(frozen=True)
class Table:
    """A titled table of texts; numbers are aligned to the right."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


def number(value: float | None, digits: int = 0, nothing: str = "-") -> str:
    """A number for a table."""
    return nothing if value is None or not math.isfinite(value) else f"{value:.{digits}f}"


def shown_unit(unit: str, value: float) -> tuple[str, float]:
    """Unit in which a parameter is shown, and the factor from SI: lengths are easier to read in mm or µm."""
    if unit == "m":
        return ("µm", 1e6) if abs(value) < 1e-4 else ("mm", 1e3)
    return ("" if unit == "1" else unit), 1.0
