"""Tables of texts, and numbers as texts."""

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from ..io import ShownUnits


Row = TypeVar("Row")


@dataclasses.dataclass(frozen=True)
class Table:
    """A titled table of texts; numbers are aligned to the right."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    speeds: Sequence[str] = ()
    """Columns that hold cage speeds or differences of them [rpm]: people are shown the shaft's beside them."""

    @classmethod
    def of(
        cls,
        title: str,
        columns: Mapping[str, str | Callable[[Row], str]],
        found: Iterable[Row],
        speeds: Sequence[str] = (),
    ) -> "Table":
        """A row for each thing `found`; a column says how its texts are made of it, by a format or a function."""
        cell = lambda how, one: how.format(one) if isinstance(how, str) else how(one)
        return cls(title, tuple(columns), [tuple(cell(how, one) for how in columns.values()) for one in found], speeds)


_NUMBER = re.compile(r"\d+(?:\.(\d+))?(?:e[+-]?\d+)?")


def with_shaft(table: Table, cage_speed_ratio: float) -> Table:
    """The table with a column of the shaft's speed after each of the cage's."""

    def times(match: re.Match[str]) -> str:
        value = float(match[0]) / cage_speed_ratio
        return f"{value:.1g}" if "e" in match[0] else f"{value:.{len(match[1] or '')}f}"

    def each(cells: Sequence[str], new: Callable[[str], str]) -> tuple[str, ...]:
        pairs = zip(table.columns, cells, strict=True)
        return tuple(c for head, cell in pairs for c in ((cell, new(cell)) if head in table.speeds else (cell,)))

    if not table.speeds:
        return table
    heads = each(
        table.columns, lambda head: head.replace(" [rpm]", "") + ", shaft" + (" [rpm]" if "[rpm]" in head else "")
    )
    rows = [each(row, lambda cell: _NUMBER.sub(times, cell)) for row in table.rows]
    return Table(table.title, heads, rows)


def in_units(table: Table, units: ShownUnits) -> Table:
    """The table in the units that are asked for."""
    if not units.names:
        return table
    columns, rows = units.in_rows(table.columns, table.rows)
    return Table(units.in_text(table.title), columns, rows, table.speeds)


def chosen(found: object, names: str) -> dict[str, Any]:
    """Some attributes of a result by name."""
    return {name: getattr(found, name) for name in names.split()}


def shares_table(title: str, what: str, counts: Mapping[str, int]) -> Table:
    """How many of each sort there are, and their share of all."""
    total, (sort, unit) = sum(counts.values()), what.split()
    rows = [(name, str(n), f"{n / total:.1%}" if total else "-") for name, n in counts.items()]
    return Table(title, (sort, unit, "share"), rows)


def number(value: float | None, digits: int = 0, nothing: str = "-") -> str:
    """A number for a table."""
    return nothing if value is None or not math.isfinite(value) else f"{value:.{digits}f}"


def shown_unit(unit: str, value: float) -> tuple[str, float]:
    """Unit in which a parameter is shown, and the factor from SI: lengths are easier to read in mm or µm."""
    if unit == "m":
        return ("µm", 1e6) if abs(value) < 1e-4 else ("mm", 1e3)
    return ("" if unit == "1" else unit), 1.0
