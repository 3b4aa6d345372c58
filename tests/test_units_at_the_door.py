"""Options and files take numbers with units; what makes no sense gets one sentence."""

import math
from pathlib import Path

import pytest

from jaxcage._errors import InputError
from jaxcage.cli._main import _parse
from jaxcage.cli._readers import read_quantity
from jaxcage.files import model_from


@pytest.mark.parametrize(
    "text, unit, value",
    [
        ("8500", "rpm", 8500.0),
        ("8500 rpm", "rpm", 8500.0),
        ("8500rpm", "rpm", 8500.0),
        ("900 rad/s", "rpm", 900 * 30 / math.pi),
        ("2 revolutions/second", "rpm", 120.0),
        ("8.5e3", "rpm", 8500.0),
        ("4.45 kN", "N", 4450.0),
        ("600 us", "ms", 0.6),
        ("0.6", "ms", 0.6),
    ],
)
def test_a_number_alone_or_with_its_unit(text: str, unit: str, value: float):
    assert read_quantity(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("name", ["--first", "--last"])
@pytest.mark.parametrize("command", ["sweep", "zones", "bifurcations", "gradient", "map"])
def test_ranges_take_units(command: str, name: str):
    options = _parse([command, "1a", name, "1000 rad/s"])
    assert getattr(options, name[2:]) == pytest.approx(9549.296585513721, rel=1e-12)


@pytest.mark.parametrize("command", ["poincare", "simulate", "impact"])
def test_speeds_take_units(command: str):
    assert _parse([command, "1a", "--speed", "8500 rpm"]).speed == pytest.approx(8500.0, rel=1e-12)


def test_loads_and_durations_take_units():
    statics = _parse(["statics", "1a", "--load", "4.45 kN", "--shaft-speed", "100 rad/s"])
    assert (statics.load, statics.shaft_speed) == pytest.approx((4450.0, 3000 / math.pi), rel=1e-12)
    assert _parse(["statics", "1a"]).load is None
    assert _parse(["impact", "1a", "--speed", "9550", "--duration", "1e-3 s"]).duration == pytest.approx(1.0)


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["poincare", "1a", "--speed", "0.45 mm"], 'has the unit "mm", where a unit like "rpm" is wanted'),
        (["poincare", "1a", "--speed", "140 Hz"], 'is in Hz, where "rpm" or "rad/s" is wanted'),
        (["poincare", "1a", "--speed", "8500 fathom/day"], 'where a unit like "rpm" is wanted'),
        (["poincare", "1a", "--speed", "fast"], 'is "fast", which is not a number with a unit'),
        (["statics", "1a", "--load", "4.45 mm"], 'has the unit "mm", where a unit like "N" is wanted'),
        (["impact", "1a", "--speed", "1", "--duration", "3 N"], 'has the unit "N", where a unit like "ms" is wanted'),
        (["sweep", "1a", "--steps", "2.5"], 'Option --steps must be a whole number, but is "2.5"'),
        (["sweep", "1a", "--tolerance", "low"], 'Option --tolerance must be a number, but is "low"'),
    ],
)
def test_a_wrong_dimension_gets_one_sentence(arguments: list[str], said: str):
    with pytest.raises(InputError) as refusal:
        _parse(arguments)
    sentence = str(refusal.value)
    assert said in sentence and sentence.startswith("Option --") and sentence.endswith(".")
    assert "\n" not in sentence and "Traceback" not in sentence


def test_help_names_defaults_in_words(capsys: pytest.CaptureFixture[str]):
    assert _parse(["statics", "--help"]) is None
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "--load N" in text and "(default: own)" in text and "{None}" not in text
    assert _parse(["sweep", "--help"]) is None
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "--first RPM" in text and "(default: 2500)" in text and "{None}" not in text


def test_files_take_the_same_units(tmp_path: Path):
    speed = model_from({"base": "1a", "impact": {"kind": "synchronous", "reference_speed": "9000 rpm"}})
    assert float(speed.impact.reference_speed) == pytest.approx(9000 * math.pi / 30)  # pyright: ignore[reportAttributeAccessIssue]
