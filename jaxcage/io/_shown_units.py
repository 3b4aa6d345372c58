"""Units at the door out: tables, figures and files in the units that people ask for. pint is loaded only then.

Inside and in JSON all is SI. What is shown carries its unit beside it, `Orbit [mm]`, `guidance gap 0.45 mm` or a column
`unit`; where another one of the same kind is asked for, the number changes with it.
"""

import dataclasses
import functools
import re
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Shaped

from ._units import known_unit, printable, times


_NUMBER = r"[-+−]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_EACH = re.compile(_NUMBER)
_SHOWN = "N s/m|N m/s|mm²/s|mm/s|m/s|N/m|mPa s|mN s|GPa|bar|Pa|µm|um|mm|kN|kg|ms|mJ|N|m|g|s|J"
_IN_TEXT = re.compile(rf"(?<![\w.])((?:{_NUMBER} (?:to|±) )?{_NUMBER}) ({_SHOWN})(?![\w/^²³·])")
"""A number, or two, and a unit that the package writes behind numbers."""
_IN_HEAD = re.compile(r"\[([^\]]+)\]")
_ROTATION, _TEMPERATURE = ("1/second", "1 / second"), "kelvin"
UNIT = "unit"
"""A column with the unit of the other cells of its row,"""
PER_UNIT, BARE = "per unit", ("elasticity", "change", "from")
"""but of a slope, which is by that unit, and of what has none."""
FEWEST = 3
"""Digits of a number that is shown in another unit."""


@dataclasses.dataclass(frozen=True)
class ShownUnits:
    """Units by the kind of quantity that they measure; what none is named for stays as it is."""

    names: tuple[str, ...] = ()

    @classmethod
    def read(cls, text: str) -> "ShownUnits":
        """Units with commas between them, such as `inch, lbf`.

        **Raises:** `ValueError` with half a sentence ("must ...") for a unit nobody knows, a speed of rotation, a
        temperature, and two units of one kind.
        """
        names = tuple(name.strip() for name in text.split(","))
        kinds: dict[str, str] = {}
        for name in names:
            kind = known_unit(name)
            if kind is None:
                raise ValueError(f'must be units such as "um, mm/s" or "inch, lbf", but "{printable(name)}" is none')
            if kind in ("", *_ROTATION, _TEMPERATURE):
                raise ValueError(
                    f'must be units of lengths, forces and the like, but "{name}" is not: speeds are shown in rpm, '
                    "temperatures in degC"
                )
            if kind in kinds:
                raise ValueError(f'must name one unit of each kind, but "{kinds[kind]}" and "{name}" are of one')
            kinds[kind] = name
        return cls(names)

    def of(self, unit: str) -> tuple[str, float]:
        """The unit in the place of `unit`, and how many of it make one of that."""
        return _instead(self.names, unit) if self.names else (unit, 1.0)

    def in_text(self, text: str) -> str:
        """Every `0.45 mm` of a text in the unit that is asked for."""

        def new(match: re.Match[str]) -> str:
            name, factor = self.of(match[2])
            return match[0] if name == match[2] else f"{_times(match[1], factor)} {name}"

        return _IN_TEXT.sub(new, text) if self.names else text

    def in_head(self, head: str) -> tuple[str, float]:
        """The head of a column or the label of an axis, and the factor of what it stands over."""
        match = _IN_HEAD.search(head)
        if match is None or not self.names:
            return head, 1.0
        name, factor = self.of(match[1])
        return head.replace(match[0], f"[{name}]"), factor

    def in_rows(
        self, columns: Sequence[str], rows: Sequence[Sequence[str]]
    ) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heads and rows of a table: by the unit in the head, the one in the column `unit`, or the one in a cell."""
        heads, factors = zip(*(self.in_head(head) for head in columns), strict=True)
        at = list(columns).index(UNIT) if UNIT in columns else None
        found = []
        for row in rows:
            name, of_row = ("", 1.0) if at is None else self.of(row[at])
            cells = [
                _times(cell, factor) if factor != 1.0 else self._cell(cell, _power(head, of_row))
                for head, cell, factor in zip(columns, row, factors, strict=True)
            ]
            if at is not None:
                cells[at] = name
            found.append(tuple(cells))
        return heads, found

    def _cell(self, cell: str, of_row: float) -> str:
        if of_row != 1.0 and re.fullmatch(rf"{_NUMBER}(?: (?:to|±) {_NUMBER})?", cell):
            return _times(cell, of_row)
        return self.in_text(cell)

    def in_columns(self, columns: Mapping[str, Shaped[np.ndarray, " rows"]]) -> dict[str, Shaped[np.ndarray, " rows"]]:
        """Columns of numbers by the unit in their head."""
        found = {}
        for head, values in columns.items():
            new, factor = self.in_head(head)
            found[new] = values if factor == 1.0 else np.asarray(values) * factor
        return found


def _power(head: str, of_row: float) -> float:
    if head in BARE:
        return 1.0
    return 1 / of_row if head.endswith(PER_UNIT) else of_row


@functools.cache
def _instead(names: tuple[str, ...], unit: str) -> tuple[str, float]:
    kind = known_unit(unit)
    name = next((n for n in names if kind and known_unit(n) == kind), unit)
    return (unit, 1.0) if name == unit else (name, times(unit, name))


def _times(text: str, factor: float) -> str:
    """Every number of a text times a factor, with as many digits as it had."""

    def new(match: re.Match[str]) -> str:
        digits = len(re.sub(r"e.*|[^\d]", "", match[0]).lstrip("0"))
        value = float(f"{float(match[0].replace('−', '-')) * factor:.{max(digits, FEWEST)}g}")
        return np.format_float_positional(value, trim="-") if 1e-6 < abs(value) < 1e7 or not value else f"{value:g}"

    return _EACH.sub(new, text)
