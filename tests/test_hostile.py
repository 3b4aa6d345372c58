"""Hostile files are refused in one sentence; nothing in them is run."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from helpers import declared, elastic, roller_pass

import jaxcage as jc
from jaxcage.files import ConfigError, load_model, model_from, save_model, to_si


@pytest.mark.wide
@pytest.mark.parametrize("wrong", ["nan", "-inf", '"nan mm"', '"1e999"'])
def test_nan_and_infinity_are_refused_at_every_key(tmp_path: Path, wrong: str):
    model = elastic(roller_pass(jc.case("2a")))
    text = save_model(tmp_path / "model.toml", model).read_text()
    keys = [path for path, field in declared(model) if "choice" not in field.metadata]
    assert len(keys) > len(jc.parameters(model))
    for path in keys:
        table = tomllib.loads(text)
        place: Any = table
        for name in path[:-1]:
            place = place[name]
        place[path[-1]] = tomllib.loads(f"x = {wrong}")["x"]
        with pytest.raises(ConfigError, match=f"`{'.'.join(path)}` must be a"):
            model_from(table)


@pytest.mark.parametrize(
    "text, unit",
    [
        *((text, "m") for text in ("9**9**9**9 mm", "0.4 m^(9^9^9^9)", "1 km^400/m^400 m")),  # no sum to be worked out
        *((f"3000 {rate}", "rad/s") for rate in ("1/min", "Bq", "Hz")),  # a rate is no angular speed
        *((text, "m") for text in ("0.4 mm # or so", "0.4 mm\0", "0.4 mm; mm", "0.4 mm\nmm")),  # nothing is passed over
    ],
)
def test_units_are_units_only(text: str, unit: str):
    with pytest.raises(ValueError, match="unit|is wanted"):
        to_si(text, unit)


@pytest.mark.parametrize(
    "given, said",
    [
        ("[lubricant]\nviscosity_1 = 2e-6\nviscosity_2 = 1e-6\nreference_viscosity = 1e-5", "must have a viscosity"),
        ("load = 1" + "0" * 400, "`load` must be a number from 0 to 1e+07 N"),
        ("load = 0x" + "f" * 5000, "`load` must be a number from 0 to 1e+07 N"),
        ("load = " + "9" * 5000, "must be valid TOML"),
        ("load = " + "[" * 5000, "must be valid TOML"),
        ("load" + ".a" * 3000 + " = 1", "`load` must be a number from 0 to 1e+07 N"),
        ('"\\u001b[31m" = 1', r"Key `\x1b[31m` at the top level"),
    ],
    ids=["viscosity", "whole", "hexadecimal", "long", "deep array", "deep key", "control"],
)
def test_monsters(tmp_path: Path, given: str, said: str):
    path = tmp_path / "design.toml"
    path.write_text(f"base = '1a'\n{given}")
    with pytest.raises(ConfigError) as refusal:
        load_model(path)
    assert said in str(refusal.value) and len(str(refusal.value)) < 600


@pytest.mark.parametrize(
    "value", ["!!python/object/apply:os.system ['true']", "0.4 __import__('os').system('true')", "$(true)", "{{ 7*7 }}"]
)
def test_a_configuration_cannot_run_code(tmp_path: Path, value: str):
    path = tmp_path / "design.toml"
    path.write_text(f'base = "1a"\nguidance_gap = "{value}"')
    with pytest.raises(ConfigError, match="`guidance_gap` must be a number"):
        load_model(path)
