"""Tables: columns of numbers with their units, turned into text only when they are shown.

A table is shown on a terminal, in a report page, or as records of a JSON document, always from the same numbers. Units
are converted by pint when a table is shown, and numbers carry the digits of their error.
"""

import dataclasses
import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np


SHOWN = {"m": "mm", "rad/s": "rpm", "rad": "deg", "1": ""}
"""Units in which quantities of an SI unit are shown, unless a column says otherwise."""
Beside = tuple[str, float] | None
"""Speed that is shown beside the model's: `shaft` or `cage`, and its ratio to the model's."""
NOTHING = "-"
"""Cell of a value that is not known."""


@functools.cache
def factor(unit: str, shown: str) -> float:
    """Factor from one unit to another."""
    if unit == shown or {unit, shown} <= {"1", ""}:
        return 1.0
    if (unit, shown) == ("1", "%"):
        return 100.0
    from ..files import to_si  # pint takes a while to load

    return to_si(f"1 {unit}", shown)


@dataclasses.dataclass(frozen=True)
class Column:
    """A column: its head, its values, and how they are shown."""

    head: str
    values: Sequence[Any]
    """Numbers in `unit`, texts, or None for what is not known."""
    unit: str = "1"
    shown: str | None = None
    """Unit in which numbers are shown; None takes that of `SHOWN`."""
    errors: Sequence[float | None] | str | None = None
    """Standard errors, or uncertainties, in `unit`; of a column for `rows_table` the key that holds them."""
    digits: int | None = None
    """Digits after the point; None takes those of the error, or four significant ones."""
    key: str = ""
    """Name in a document; the head if it is left out."""
    nothing: str = NOTHING
    """Cell of a value that is not known."""

    @property
    def unit_shown(self) -> str:
        """Unit in which the numbers are shown."""
        return SHOWN.get(self.unit, self.unit) if self.shown is None else self.shown

    @property
    def title(self) -> str:
        """Head with the unit."""
        return f"{self.head} [{self.unit_shown}]" if self.unit_shown else self.head

    @property
    def cells(self) -> list[str]:
        """Values as texts."""
        errors = [None] * len(self.values) if self.errors is None or isinstance(self.errors, str) else self.errors
        return [self._cell(value, error) for value, error in zip(self.values, errors, strict=True)]

    def _cell(self, value: Any, error: float | None) -> str:
        if value is None or isinstance(value, str):
            return value or self.nothing
        if not math.isfinite(float(value)):
            return self.nothing
        if isinstance(value, bool | np.bool_):
            return "yes" if value else "no"
        if isinstance(value, int | np.integer) and self.unit_shown == SHOWN.get(self.unit, self.unit):
            return str(value)
        times = factor(self.unit, self.unit_shown)
        return number(times * float(value), None if error is None else times * float(error), self.digits)


def number(value: float, error: float | None = None, digits: int | None = None) -> str:
    """A number as text: with the digits of its error, with given digits, or with four significant ones."""
    if not math.isfinite(value):
        return NOTHING
    if error is None or not math.isfinite(error) or error <= 0:
        return f"{value:.{digits}f}" if digits is not None else _significant(value)
    places = digits if digits is not None else max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{places}f} ± {error:.{places}f}"


def _significant(value: float, digits: int = 4) -> str:
    """A number with so many significant digits, without an exponent where it is neither large nor small."""
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        places = digits - 1 - (math.floor(math.log10(abs(value))) if value else 0)
        return f"{value:.{max(places, 0)}f}"
    return f"{value:.{digits - 1}e}"


@dataclasses.dataclass(frozen=True)
class Table:
    """A titled table of columns that have the same length."""

    title: str
    columns: Sequence[Column]
    key: str = ""
    """Name under which the records stand in a document; without one they do not."""
    data: Sequence[Mapping[str, Any]] | None = None
    """The records, where they hold more than the columns show."""

    @property
    def heads(self) -> list[str]:
        """Heads of the columns with their units."""
        return [column.title for column in self.columns]

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Cells as texts, row by row."""
        return list(zip(*(column.cells for column in self.columns), strict=True))

    @property
    def records(self) -> list[dict[str, Any]]:
        """Numbers in SI units, or in the unit of the head, row by row, for a document."""
        if self.data is not None:
            return [dict(row) for row in self.data]
        found = [{(c.key or c.head): c.values[i] for c in self.columns} for i in range(len(self))]
        for column in self.columns:
            if column.errors is not None and not isinstance(column.errors, str):
                for record, error in zip(found, column.errors, strict=True):
                    record[f"{column.key or column.head}_error"] = error
        return found

    def __len__(self) -> int:
        return len(self.columns[0].values)

    def __str__(self) -> str:
        lines = [self.heads, *map(list, self.rows)]
        widths = [max(len(line[i]) for line in lines) for i in range(len(self.columns))]
        first = lambda line: f"{line[0]:<{widths[0]}}"
        rest = lambda line: [f"{cell:>{width}}" for cell, width in zip(line[1:], widths[1:], strict=True)]
        return "\n".join([self.title, *("  ".join([first(line), *rest(line)]).rstrip() for line in lines)])


def rows_table(
    title: str, rows: Iterable[Mapping[str, Any]], columns: Iterable[Column], key: str = "", empty: str = "none"
) -> Table:
    """A table of records, which stand in a document under `key`: each column takes the values, and the errors, under
    its keys. Without a record there is a row that says `empty`."""
    found, columns = list(rows), list(columns)
    shown = found or [{columns[0].key or columns[0].head: empty}]
    pick = lambda key: [row.get(key) for row in shown]

    def filled(column: Column) -> Column:
        errors = pick(column.errors) if isinstance(column.errors, str) else column.errors
        nothing = column.nothing if found else ""
        return dataclasses.replace(column, values=pick(column.key or column.head), errors=errors, nothing=nothing)

    return Table(title, [filled(column) for column in columns], key, found)


@dataclasses.dataclass(frozen=True)
class Scaled(Column):
    """A column that shows its values times a ratio."""

    ratio: float = 1.0

    def _cell(self, value: Any, error: float | None) -> str:
        return super()._cell(value if value is None or isinstance(value, str) else self.ratio * float(value), None)


def speed_columns(
    head: str, key: str, beside: Beside, errors: str | None = None, digits: int = 0, nothing: str = NOTHING
) -> list[Column]:
    """Columns for `rows_table` of a speed [rpm], or a difference of speeds, and of the speed that goes with it."""
    own = Column(head, (), key=key, errors=errors, digits=None if errors else digits, nothing=nothing)
    return [own] if beside is None else [own, Scaled(beside[0], (), key=key, digits=digits, ratio=beside[1])]


def shares_table(title: str, sort: str, counts: Mapping[str, int]) -> Table:
    """Numbers of each sort, and their shares of all."""
    total = sum(counts.values())
    shares = Column("share", [n / total for n in counts.values()], "1", "%", digits=1)
    return Table(title, [Column(sort, list(counts)), Column("number", list(counts.values())), shares])


def value_table(title: str, rows: Iterable[tuple[str, Any, str]], errors: Sequence[float] | None = None) -> Table:
    """A table of quantities: their words, values and SI units, and standard errors."""
    found = list(rows)
    each = [
        Column("", [value], unit, errors=[e]) for (_, value, unit), e in zip(found, errors or [math.nan] * len(found))
    ]
    units = ["" if isinstance(column.values[0], str) else column.unit_shown for column in each]
    words = Column("quantity", [what for what, _, _ in found])
    return Table(title, [words, Column("value", [c.cells[0] for c in each]), Column("unit", units, nothing="")])


def counted(number: int, what: str) -> str:
    """A number with the name of what it counts: `1 speed`, `3 speeds`."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def chosen(found: object, names: str) -> dict[str, Any]:
    """Some attributes of a result by name."""
    return {name: getattr(found, name) for name in names.split()}
