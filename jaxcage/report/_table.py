"""Tables of texts, and numbers as texts."""

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar


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


class Speeds(str):
    """Cage speeds, or differences of them [rpm], as a text that keeps its numbers."""

    form: str
    values: tuple[float, ...]

    def __new__(cls, form: str, *values: float) -> "Speeds":
        self = super().__new__(cls, form.format(*values))
        self.form, self.values = form, values
        return self

    def of_shaft(self, cage_speed_ratio: float) -> "Speeds":
        """The same of the shaft."""
        return Speeds(self.form, *(value / cage_speed_ratio for value in self.values))


def with_shaft(table: Table, cage_speed_ratio: float) -> Table:
    """The table with a column of the shaft's speed after each of the cage's."""
    if not table.speeds:
        return table
    shaft = lambda cell: cell.of_shaft(cage_speed_ratio) if isinstance(cell, Speeds) else cell
    called = lambda head: head.replace(" [rpm]", "") + ", shaft" + (" [rpm]" if "[rpm]" in head else "")

    def each(cells: Sequence[str], new: Callable[[str], str]) -> tuple[str, ...]:
        pairs = zip(table.columns, cells, strict=True)
        return tuple(c for head, cell in pairs for c in ((cell, new(cell)) if head in table.speeds else (cell,)))

    return Table(table.title, each(table.columns, called), [each(row, shaft) for row in table.rows])


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


def speed(value: float | None, digits: int = 0, nothing: str = "-") -> str:
    """A cage speed [rpm] for a table."""
    return nothing if value is None or not math.isfinite(value) else Speeds(f"{{:.{digits}f}}", value)


def shown_unit(unit: str, value: float) -> tuple[str, float]:
    """Unit in which a parameter is shown, and the factor from SI: lengths are easier to read in mm or µm."""
    if unit == "m":
        return ("µm", 1e6) if abs(value) < 1e-4 else ("mm", 1e3)
    return ("" if unit == "1" else unit), 1.0
