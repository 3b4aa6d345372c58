"""Tables of records and columns with units, for the terminal, the report page and JSON documents.

Units are converted by pint when a table is shown, and numbers carry the digits of their error.
"""

import dataclasses
import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np


SHOWN = {"m": "mm", "rad/s": "rpm", "rad": "deg", "1": ""}
"""Display units by SI unit, unless a column has its own."""
Beside = tuple[str, float] | None
"""Speed that is shown in place of the model's: `shaft` or `cage`, and its ratio to the model's."""
NOTHING = "-"
"""Cell of an unknown value."""
OWN = "each its own"
"""Unit of a column whose records have different units, each under the key `unit`."""


@functools.cache
def factor(unit: str, shown: str) -> float:
    if unit == shown or {unit, shown} <= {"1", ""}:
        return 1.0
    if (unit, shown) == ("1", "%"):
        return 100.0
    from ..files import to_si  # pint takes a while to load

    return to_si(f"1 {unit}", shown)


def number(value: float, error: float | None = None, digits: int | None = None) -> str:
    """A number as text: with the digits of its error, with given digits, or with four significant ones; what is rounded
    to zero has no sign."""
    if not math.isfinite(value):
        return NOTHING
    if error is not None and math.isfinite(error) and error > 0:
        places = digits if digits is not None else max(0, 1 - math.floor(math.log10(error)))
        return f"{value:z.{places}f} ± {error:.{places}f}"
    if digits is not None:
        return f"{value:z.{digits}f}"
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.{max(3 - math.floor(math.log10(abs(value) or 1.0)), 0)}f}"
    return f"{value:.3e}"


@dataclasses.dataclass(frozen=True)
class Column:
    """Column of a table; its values are numbers, texts, or None if unknown."""

    head: str
    key: str = ""
    """Key of the values in the records; by default the head."""
    unit: str = "1"
    """SI unit of numbers, or `OWN`."""
    shown: str | None = None
    """Display unit of numbers; None takes that of `SHOWN`."""
    error: str = ""
    """Key of the standard errors, or uncertainties, in the same unit."""
    digits: int | None = None
    """Decimal places; None takes those of the error, or four significant digits."""
    nothing: str = NOTHING
    times: float = 1.0
    """Factor by which numbers are multiplied."""

    @property
    def name(self) -> str:
        """Key of the values."""
        return self.key or self.head

    @property
    def title(self) -> str:
        """Head with the display unit."""
        shown = "" if self.unit == OWN else SHOWN.get(self.unit, self.unit) if self.shown is None else self.shown
        return f"{self.head} [{shown}]" if shown else self.head

    @property
    def label(self) -> str:
        """Axis label of a figure: the title in words."""
        words = self.title.replace("_", " ").replace(".", " ")
        return words[:1].upper() + words[1:]

    @property
    def scale(self) -> float:
        """Factor from values to displayed numbers."""
        return self._scale(self.unit)

    def _scale(self, unit: str) -> float:
        return self.times * factor(unit, SHOWN.get(unit, unit) if self.shown is None else self.shown)

    def cell(self, record: Mapping[str, Any]) -> str:
        """Text of the value of a record."""
        value = record.get(self.name)
        if value is None or isinstance(value, str):
            return (SHOWN.get(value, value) if value and self.name == "unit" else value) or self.nothing
        if isinstance(value, bool | np.bool_):
            return "yes" if value else "no"
        if not math.isfinite(float(value)):
            return self.nothing
        times = self._scale(record["unit"] if self.unit == OWN else self.unit)
        if isinstance(value, int | np.integer) and times == 1.0:
            return str(value)
        error = record.get(self.error)
        return number(times * float(value), None if error is None else times * float(error), self.digits)


UNIT = Column("unit", nothing="")
"""Column of the display unit of each record, for columns of unit `OWN`."""


@dataclasses.dataclass(frozen=True)
class Table:
    """A titled table of records."""

    title: str
    columns: Sequence[Column]
    records: Sequence[Mapping[str, Any]]
    key: str = ""
    """Name of the records in a document; empty to leave them out."""
    empty: str = "none"
    """Text in place of the table where there are no records."""
    detail: bool = False
    """True for a table that a command prints on request only."""

    @property
    def heads(self) -> list[str]:
        """Heads of the columns with their units."""
        return [column.title for column in self.columns]

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Cells as texts, row by row."""
        return [tuple(c.cell(record) for c in self.columns) for record in self.records]

    @property
    def texts(self) -> list[bool]:
        """True for each column that holds no numbers."""
        return [all(isinstance(r.get(c.name), str | None) for r in self.records) for c in self.columns]

    def __str__(self) -> str:
        if not self.records:
            return f"{self.title}: {self.empty}"
        lines = [tuple(self.heads), *self.rows]
        widths = [max(map(len, cells)) for cells in zip(*lines, strict=True)]
        aligned = lambda line: [f"{cell:>{width}}" for cell, width in zip(line[1:], widths[1:], strict=True)]
        return "\n".join([self.title, *("  ".join([f"{x[0]:<{widths[0]}}", *aligned(x)]).rstrip() for x in lines)])


def table(
    title: str,
    records: Iterable[Mapping[str, Any]],
    columns: Iterable[Column | str],
    key: str = "",
    empty: str = "none",
    detail: bool = False,
) -> Table:
    """Table of records, which are in a document under `key`; a column given as text is the key of its values."""
    columns = [Column(column) if isinstance(column, str) else column for column in columns]
    return Table(title, columns, list(records), key, empty, detail)


def speed_columns(
    head: str, key: str, beside: Beside, error: str = "", digits: int = 0, nothing: str = NOTHING
) -> list[Column]:
    """The column of a speed [rpm], or a difference of speeds, of the model or of what `beside` names."""
    words, unit, _ = head.partition(" [rpm]")
    head, times = (head, 1.0) if beside is None else (f"{words} ({beside[0]}){unit}", beside[1])
    return [Column(head, key, error=error, digits=None if error else digits, nothing=nothing, times=times)]


def shares_table(title: str, sort: str, counts: Mapping[str, int]) -> Table:
    """Table of counts by category, and their shares of all."""
    total = sum(counts.values())
    rows = [{sort: what, "number": n, "share": n / total} for what, n in counts.items()]
    return table(title, rows, [sort, "number", Column("share", shown="%", digits=1)])


def counted(number: int, what: str) -> str:
    """A number with the name of what it counts: `1 speed`, `3 speeds`."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def chosen(found: object, names: str) -> dict[str, Any]:
    """Named attributes of a result."""
    return {name: getattr(found, name) for name in names.split()}
