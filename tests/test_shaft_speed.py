"""Speeds of the shaft at the door, and beside those of the cage in tables and figures."""

import json
import math
from pathlib import Path
from typing import Any

import matplotlib
import pytest

import jaxcage as jc
from jaxcage._errors import InputError
from jaxcage.cli import main
from jaxcage.cli._job import Job
from jaxcage.cli._main import _parse
from jaxcage.cli._vary import read_vary
from jaxcage.io import ConfigError, model_from, read_bearing, write_template
from jaxcage.plotting import add_shaft_axes, new_figure
from jaxcage.plotting._orbit_diagram import label_speed
from jaxcage.report import Speeds, Table, read_operating, with_shaft


RATIO = (1 - 16 / 81) / 2
"""(7)-(8) of an NU2310 whose outer ring stands still: half of 1 - d_w/d_m."""


@pytest.fixture
def mine(tmp_path: Path) -> str:
    return str(write_template(tmp_path / "mine.toml"))


def asked(*arguments: str):
    return Job(arguments[0], _parse(list(arguments))).options


def test_a_speed_of_the_shaft_becomes_one_of_the_cage(mine: str):
    assert asked("simulate", "1a", "--speed", "20000 rpm shaft").speed == pytest.approx(20000 * RATIO, rel=1e-12)
    assert asked("simulate", "1a", "--speed", "2000 rad/s shaft").speed == pytest.approx(
        2000 * RATIO * 30 / math.pi, rel=1e-12
    )
    assert asked("simulate", "1a", "--speed", "9000").speed == 9000
    assert asked("simulate", mine, "--speed", "20000").speed == pytest.approx(20000 * RATIO, rel=1e-12)
    assert asked("simulate", mine, "--speed", "9000 rpm cage").speed == pytest.approx(9000, rel=1e-12)


def test_ends_of_a_range_may_belong_to_either(mine: str):
    found = asked("sweep", "1a", "--first", "20000 rpm shaft", "--last", "9000")
    assert (found.first, found.last) == pytest.approx((20000 * RATIO, 9000), rel=1e-12)
    swept = asked("sweep", mine)
    assert (swept.first, swept.last) == pytest.approx((2500 * RATIO, 27500 * RATIO), rel=1e-12)
    with pytest.raises(InputError, match="Option --last must be above --first, but the range is 9000 to 8024.69 rpm"):
        asked("sweep", "1a", "--first", "9000", "--last", "20000 rpm shaft")


def test_a_cage_that_would_burst_is_refused():
    with pytest.raises(
        InputError, match="Option --speed must be a cage speed of at most 62516 rpm, .*100000 rpm was given"
    ):
        asked("simulate", "1a", "--speed", "100000")
    assert asked("simulate", "1a", "--speed", "100000 rpm shaft").speed == pytest.approx(100000 * RATIO)


@pytest.mark.parametrize("text", ["20000 rpm shaft cage", "20000 rpm spindle", "20000 shafts"])
def test_whose_speed_is_said_in_one_word(text: str):
    with pytest.raises(InputError, match="Option --speed must be a number in rpm") as refusal:
        _parse(["simulate", "1a", "--speed", text])
    assert "\n" not in str(refusal.value)


def test_the_switch_of_a_file(mine: str):
    assert read_bearing(mine).speeds == "shaft"
    with pytest.raises(ConfigError, match="`speeds` must be one of cage, shaft, but is 'roller'"):
        model_from({"base": "1a", "speeds": "roller"})


def test_operating_ranges_and_studies_take_either():
    (at, other) = read_operating("20000-24000 rpm shaft, 8500", RATIO)
    assert (at.low_rpm, at.high_rpm) == pytest.approx((20000 * RATIO, 24000 * RATIO))
    assert other.low_rpm == 8500 and str(at.of_shaft(RATIO)) == "20000 to 24000 rpm"
    assert read_operating("20000", RATIO, "shaft")[0].low_rpm == pytest.approx(20000 * RATIO)
    with pytest.raises(ValueError, match="names both cage and shaft"):
        read_operating("20000 rpm shaft - 9000 rpm cage", RATIO)
    found = read_vary(["speed=20000 rpm shaft:24000 rpm shaft:3"], jc.case("1a"))["speed"]
    assert list(found) == pytest.approx([n * RATIO * math.pi / 30 for n in (20000, 22000, 24000)])  # pyright: ignore


def test_a_table_shows_the_shaft_beside_the_cage():
    onset = Speeds("{:.0f} ± {:.0f}", 8000.2, 50.0)
    table = Table("Zones", ("zone", "onset", "share"), [("1", onset, "5%"), ("2", "past range", "-")], ("onset",))
    both = with_shaft(table, 0.4)
    assert both.columns == ("zone", "onset", "onset, shaft", "share")
    assert both.rows == [("1", "8000 ± 50", "20000 ± 125", "5%"), ("2", "past range", "past range", "-")]
    exact = with_shaft(
        Table("", ("speed [rpm]",), [(Speeds("{:.2f} ± {:.1g}", 12355.5, 2e-5),)], ("speed [rpm]",)), 0.5
    )
    assert exact.columns[1] == "speed, shaft [rpm]" and exact.rows == [("12355.50 ± 2e-05", "24711.00 ± 4e-05")]


def test_a_figure_over_speed_has_the_shaft_on_a_second_axis():
    figure = new_figure(6.0, 4.0)
    above, below = figure.subplots(2, 1)
    label_speed(below).set_xlim(4000, 8000)
    above.set_xlabel("Time [s]")
    add_shaft_axes(figure, 0.4)
    figure.draw_without_rendering()
    (axis,) = [a for a in figure.findobj(matplotlib.axes._secondary_axes.SecondaryAxis)]  # pyright: ignore
    assert axis.get_xlim() == pytest.approx((10000, 20000)) and axis.get_xlabel() == "Shaft speed [rpm]"


def test_statics_takes_a_cage_speed_as_the_cages(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    def found(speed: str) -> dict[str, Any]:
        assert main(["statics", "1a", "--shaft-speed", speed, "--out", str(tmp_path), "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    cage, shaft = found("10000 rpm cage"), found(f"{10000 / RATIO!r} rpm shaft")
    assert cage["shaft_speed_rpm"] == pytest.approx(24923, abs=0.5)
    assert cage["rollers"] == shaft["rollers"] and cage["kinematics"] == shaft["kinematics"]
    assert cage["kinematics"]["cage_speed"] == pytest.approx(10000 * math.pi / 30)
    assert found("10000")["shaft_speed_rpm"] == found("10000 rpm shaft")["shaft_speed_rpm"] == 10000


def test_one_speed_is_named_for_both(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    arguments = ["impact", "1a", "--speed", "20000 rpm shaft", "--out", str(tmp_path), "--json"]
    assert main(arguments) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["shaft_speed_rpm"] == pytest.approx(20000) and found["speed_rpm"] == pytest.approx(20000 * RATIO)
    assert found["cage_speed_ratio"] == pytest.approx(RATIO)
