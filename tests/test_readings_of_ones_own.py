"""Two readings of the paper that nobody takes by accident: without them a model is refused; results name them."""

import dataclasses
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.files import ConfigError, load_model, model_from, template
from jaxcage.show import readings_words


READINGS = {
    "clearance_reading": ('"radial" (c = C_r/2', '"as_printed" (c = C_r,'),
    "unbalance": ('"physical" (M e omega^2)', '"as_printed" (2 M rho omega^2'),
}


def without(name: str) -> str:
    return "\n".join(line for line in template().splitlines() if not line.startswith(f"{name} ="))


@pytest.mark.parametrize("name", READINGS)
def test_a_file_without_a_reading_is_refused_with_both_of_them(name: str, tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(without(name))
    with pytest.raises(ConfigError) as refusal:
        load_model(path)
    said = str(refusal.value)
    assert f"`{name}` must be given" in said and all(words in said for words in READINGS[name])
    assert "\n" not in said and said.endswith(".") and "before, a file without it meant" in said


def test_a_base_brings_its_own_readings():
    model = model_from({"base": "1a", "guidance_gap": "0.5 mm"})
    assert (model.clearance_reading, model.unbalance) == ("as_printed", "as_printed")
    assert all(jc.case(name).clearance_reading == "as_printed" for name in ("1a", "1b", "2a", "2b", "3a", "3b"))


@pytest.mark.parametrize("name", READINGS)
def test_a_model_built_in_python_without_a_reading_is_refused(name: str):
    whole = {f.name: getattr(jc.case("1a"), f.name) for f in dataclasses.fields(jc.CageModel)}
    assert jc.CageModel(**whole).unbalance == "as_printed"
    del whole[name]
    with pytest.raises(ValueError, match=f"`{name}` must be given, ") as refusal:
        jc.CageModel(**whole)
    assert all(words in str(refusal.value) for words in READINGS[name])


def test_the_template_takes_the_clearance_as_radial_and_the_unbalance_as_physical():
    mine, printed = model_from(tomllib.loads(template())), jc.case("1a")
    assert float(mine.clearance) == pytest.approx(float(printed.clearance) / 2)
    arm = lambda model: float(model.cage_at(900.0).law("unbalance").unbalance / model.cage_mass)
    assert arm(mine) == pytest.approx(23e-6) and arm(printed) == pytest.approx(2 * 23e-6 / 0.45e-3 * 1e-3)
    assert readings_words(mine) == (
        'radial clearance c = C_r/2, as C_r is defined ("radial"), unbalance M e omega^2 ("physical")'
    )


def test_commands_name_the_readings(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert main(["statics", "1a", "--out", str(tmp_path)]) == 0
    assert 'Readings: radial clearance c = C_r, as the paper uses it ("as_printed")' in capsys.readouterr().out
    assert main(["statics", "1a", "--out", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["readings"] == {"clearance_reading": "as_printed", "unbalance": "as_printed"}
    assert np.isfinite(found["load"])
