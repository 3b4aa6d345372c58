"""What a command has to say, apart from how it is shown: tables for people, one document for
programs.
"""

import dataclasses
import json
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np

from ..report import Table


@dataclasses.dataclass(frozen=True)
class Report:
    """What a command has to say; the runner adds case, time and files."""

    document: Mapping[str, Any]
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()
    """Lines below the tables."""
    failure: str = ""
    """What the command says, with exit status 1, after it has shown a report of something that failed."""


def show(report: Report, as_json: bool) -> None:
    """Print a report on standard output: one JSON document, or tables (plain text when piped)."""
    if as_json:
        print(json.dumps(plain(report.document), indent=2, allow_nan=False))
        return
    for table in report.tables:
        _show_rich(table) if sys.stdout.isatty() else _show_plain(table)
    for note in report.notes:
        print(note)


def plain(value: Any) -> Any:
    """Numbers of NumPy and JAX as JSON has them; what is not finite becomes null."""
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, np.ndarray | np.generic | jax.Array) and not isinstance(value, float):
        return plain(value.tolist())
    number = float(value)
    return number if math.isfinite(number) else None


def _show_rich(table: Table) -> None:
    import rich.box
    import rich.console
    import rich.table
    from rich.text import Text

    # Text and not str: units in square brackets are not markup.
    box, title = rich.box.SIMPLE_HEAD, Text(table.title)
    drawn = rich.table.Table(title=title, title_justify="left", box=box, pad_edge=False)
    for i, column in enumerate(table.columns):
        drawn.add_column(Text(column), justify="left" if i == 0 else "right")
    for row in table.rows:
        drawn.add_row(*map(Text, row))
    rich.console.Console().print(drawn)


def _show_plain(table: Table) -> None:
    lines = [list(table.columns), *map(list, table.rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(table.columns))]
    print(table.title)
    for line in lines:
        first, *rest = (f"{cell:>{width}}" for cell, width in zip(line, widths, strict=True))
        print("  ".join([f"{line[0]:<{len(first)}}", *rest]).rstrip())
    print()
