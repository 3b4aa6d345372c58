"""Tables, figures and files in the units that are asked for."""

import json
from pathlib import Path

import numpy as np
import pytest
from report_example import findings

from jaxcage.cli import main
from jaxcage.io import ConfigError, ShownUnits, read_bearing, read_columns, write_template
from jaxcage.plotting import in_units, new_figure
from jaxcage.report import Table, in_units as table_in_units, page, read_operating


INCHES = ShownUnits.read("inch, lbf")


def test_a_number_changes_with_its_unit():
    """An inch is 25.4 mm, a pound of force 4.4482216 N; a velocity has no unit among these two."""
    text = "gap 0.450 mm, eccentricity 25.4 µm, 0.254 to 0.508 mm under 4450 N, 13 rollers, 3.00 m/s, 70 mm²/s"
    assert INCHES.in_text(text) == (
        "gap 0.0177 inch, eccentricity 0.001 inch, 0.01 to 0.02 inch under 1000 lbf, 13 rollers, 3.00 m/s, 70 mm²/s"
    )
    assert INCHES.of("m") == ("inch", pytest.approx(1 / 0.0254)) and INCHES.of("rpm") == ("rpm", 1.0)
    assert ShownUnits.read("um, mm/s").in_text("0.118 mm at 0.25 m/s") == "118 um at 250 mm/s"
    assert ShownUnits().in_text(text) == text


@pytest.mark.parametrize(
    "given, said",
    [
        ("parrots", 'must be units such as "um, mm/s" or "inch, lbf", but "parrots" is none'),
        ("um, ", 'but "" is none'),
        ("Hz", "speeds are shown in rpm"),
        ("rad/s", "speeds are shown in rpm"),
        ("degF", "temperatures in degC"),
        ("mm, inch", 'must name one unit of each kind, but "mm" and "inch" are of one'),
        ("9**9**9 mm", "is none"),
    ],
)
def test_what_is_no_unit_is_refused(given: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(ValueError) as error:
        ShownUnits.read(given)
    assert said in str(error.value)
    assert main(["statics", "1a", "--out", str(tmp_path), "--units", given]) == 2
    assert said in capsys.readouterr().err
    (tmp_path / "mine.toml").write_text(f'base = "1a"\nunits = "{given}"\n')
    with pytest.raises(ConfigError, match="`units` must"):
        read_bearing(tmp_path / "mine.toml")


def test_tables_by_the_head_the_column_unit_or_the_cell():
    table = Table(
        "Orbits with a gap of 0.254 mm",
        ("orbit [mm]", "force [N]", "value", "unit", "change"),
        [("0.508", "44.5 ± 8.9", "25.40", "µm", "+3 %"), ("-", "0.0", "12.0", "", "1 in 20")],
    )
    shown = table_in_units(table, INCHES)
    assert shown.title == "Orbits with a gap of 0.01 inch" and shown.columns[:2] == ("orbit [inch]", "force [lbf]")
    assert shown.rows == [("0.02", "10 ± 2", "0.001", "inch", "+3 %"), ("-", "0", "12.0", "", "1 in 20")]
    assert table_in_units(table, ShownUnits()) is table
    slopes = Table(
        "",
        ("parameter", "value", "unit", "rpm of the cage per unit", "elasticity"),
        [("gap", "0.000254", "m", "-508", "-0.5")],
    )
    assert table_in_units(slopes, INCHES).rows == [("gap", "0.01", "inch", "-12.9", "-0.5")]


def test_an_axis_has_round_numbers_of_the_new_unit():
    figure = new_figure()
    ax = figure.subplots()
    ax.plot([0.0, 1.0], [-0.254, 0.254])  # -0.01 to 0.01 inch
    ax.set(ylabel="Displacement [mm]", xlabel="Time [ms]", title="gap 0.254 mm")
    in_units(figure, INCHES).canvas.draw()
    assert ax.get_ylabel() == "Displacement [inch]" and ax.get_xlabel() == "Time [ms]"
    assert ax.get_title() == "gap 0.01 inch" and ax.get_lines()[0].get_ydata()[1] == 0.254  # pyright: ignore
    low, high = ax.get_ylim()
    told = {label.get_text(): y for y, label in zip(ax.get_yticks(), ax.get_yticklabels(), strict=True)}
    assert told["0.0050"] == pytest.approx(0.127) and told["−0.0100"] == pytest.approx(-0.254)
    assert sum(low <= y <= high for y in told.values()) >= 5


@pytest.mark.wide
def test_commands_show_them_and_json_stays(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    path = write_template(tmp_path / "mine.toml")
    path.write_text(path.read_text().replace('# units = "um, mm/s"', 'units = "um, kN"'))
    where = ["--out", str(tmp_path)]
    assert main(["statics", str(path), *where]) == 0
    text = capsys.readouterr().out
    assert "2.4" in text and "kN" in text and "µm" not in text and " mm" not in text
    assert main(["statics", str(path), *where, "--units", "inch"]) == 0
    assert "inch" in capsys.readouterr().out
    quick = ["--speed", "9000", "--revolutions", "1", "--discard", "0", "--solver", "rk4", "--steps", "256"]
    found, given = {}, {}
    for units in ("m", "um, mm/s"):
        assert main(["simulate", "1a", *quick, *where, "--units", units, "--json"]) == 0
        given[units] = json.loads(capsys.readouterr().out)
        found[units] = read_columns(given[units]["data"])
    for name in ("x_C", "y_C"):
        assert 1e6 * found["m"][f"{name} [m]"] == pytest.approx(found["um, mm/s"][f"{name} [um]"], rel=1e-9)
    assert 1e3 * found["m"]["vx_C [m/s]"] == pytest.approx(found["um, mm/s"]["vx_C [mm/s]"], rel=1e-9)
    assert given["m"]["measures"] == given["um, mm/s"]["measures"]


@pytest.mark.wide
def test_the_page_shows_them():
    text = page(findings(), read_operating("6500"), table={"base": "1a"}, units=ShownUnits.read("inch"))
    assert "inch" in text and "<td>mm</td>" not in text and "<td>µm</td>" not in text
    assert "0.45 mm" not in text and "0.0177 inch" in text
    assert np.all([word not in text for word in (" mm<", " µm<")])
