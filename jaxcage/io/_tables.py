"""Tables of texts as CSV, or as a workbook of Excel with a sheet for each."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .._errors import InputError
from ._files import replacing
from ._units import NUMBER


LONGEST = 31
"""Characters in the name of a sheet."""
Rows = Sequence[Sequence[str]]


def write_tables(path: str | Path, tables: Sequence[tuple[str, Rows]]) -> Path:
    """Write tables to a file, whole or not at all.

    **Arguments:** file that ends in .csv (one table under the other, each below its title, empty lines between them) or
    .xlsx (a sheet each; what is a number becomes one); title and rows of each, the heads of the columns first.

    **Raises:** `ValueError` for another ending.
    """
    target = Path(path)
    if target.suffix.lower() not in (".csv", ".xlsx"):
        raise InputError(f"File '{path}' must end in .csv or .xlsx.")
    with replacing(target) as temporary:
        _write_csv(temporary, tables) if target.suffix.lower() == ".csv" else _write_workbook(temporary, tables)
    return target


def _write_csv(path: Path, tables: Sequence[tuple[str, Rows]]) -> None:
    with open(path, "w", encoding="utf-8", newline="") as file:
        write = csv.writer(file)
        for i, (title, rows) in enumerate(tables):
            write.writerows([*([[]] if i else []), [title], *rows])


def _write_workbook(path: Path, tables: Sequence[tuple[str, Rows]]) -> None:
    import openpyxl  # takes a third of a second to load
    from openpyxl.utils import get_column_letter

    book, names = openpyxl.Workbook(), set()
    book.remove(book.worksheets[0])
    for title, (head, *rows) in tables:
        sheet = book.create_sheet(_sheet_name(title, names))
        sheet.append([_safe(title)])
        sheet.append([_safe(cell) for cell in head])
        for row in rows:
            sheet.append([_cell(cell) for cell in row])
        sheet.freeze_panes = "A3"
        for i, column in enumerate(zip(head, *rows, strict=True), start=1):
            sheet.column_dimensions[get_column_letter(i)].width = 2 + max(map(len, column))
    book.save(path)


def _cell(text: str) -> Any:
    """A number where a text is nothing else."""
    plain = text.replace("−", "-")
    return float(plain) if re.fullmatch(NUMBER, plain) else _safe(text)


def _safe(text: str) -> str:
    """A text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith("=") else text


def _sheet_name(title: str, names: set[str]) -> str:
    """A name that is allowed and not taken yet."""
    base = re.sub(r"[\[\]:*?/\\']", " ", title).strip()[: LONGEST - 3].strip() or "table"
    name = next(n for n in (base, *(f"{base} {i}" for i in range(2, 100))) if n.lower() not in names)
    names.add(name.lower())
    return name
