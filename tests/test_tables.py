"""Tables as CSV and as workbooks."""

import csv
from pathlib import Path

import openpyxl
import pytest

from jaxcage.cli import main
from jaxcage.io import write_tables


TABLES = [
    ("Zones [rpm] of a/b", [("zone", "onset", "note"), ("1", "9050.5", "=1+1"), ("2", "-", "−0.5")]),
    ("Zones [rpm] of a/b", [("none",), ("-",)]),
]


def test_a_csv_file_holds_all_tables(tmp_path: Path):
    path = write_tables(tmp_path / "t.csv", TABLES)
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    assert rows[0] == ["Zones [rpm] of a/b"] and rows[1:4] == [list(row) for row in TABLES[0][1]]
    assert rows[4] == [] and rows[5:] == [["Zones [rpm] of a/b"], ["none"], ["-"]]


def test_a_workbook_has_a_sheet_each_numbers_and_no_formulas(tmp_path: Path):
    book = openpyxl.load_workbook(write_tables(tmp_path / "t.xlsx", TABLES))
    first, second = book.worksheets
    assert first.title != second.title and len(book.sheetnames) == 2
    rows = [[cell.value for cell in row] for row in first.iter_rows(min_row=2)]
    assert rows == [["zone", "onset", "note"], [1, 9050.5, "'=1+1"], [2, "-", -0.5]]


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
def test_a_command_writes_what_it_prints(capsys: pytest.CaptureFixture[str], tmp_path: Path, ending: str):
    path = tmp_path / f"loads.{ending}"
    assert main(["statics", "1a", "--table", path.name, "--out", str(tmp_path)]) == 0
    assert f"Table: {path}" in capsys.readouterr().out
    if ending == "xlsx":
        rollers = openpyxl.load_workbook(path).worksheets[0]
        assert rollers.max_row == 2 + 13 and isinstance(rollers["B3"].value, int | float)
    else:
        assert len(path.read_text().splitlines()) > 16


def test_another_ending_is_refused_before_anything_is_computed(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert main(["sweep", "1a", "--table", "t.ods", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said == "Option --table must name a .csv or .xlsx file within --out, but 't.ods' was given."
    assert main(["sweep", "1a", "--table", "../t.csv", "--out", str(tmp_path)]) == 2
