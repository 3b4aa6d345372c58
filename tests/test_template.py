"""Templates that `jaxcage init` writes: complete, correct as they are and with every option; bearings as files."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import declared, elastic, roller_pass

import jaxcage as jc
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.files import configuration, load_model, model_from, read_bearing, save_model, template
from jaxcage.files.description import describe


jc.enable_x64()  # read while the tests are collected
CAGE, WHOLE = template(), template("bearing")
TEMPLATES = pytest.mark.parametrize("text", (CAGE, WHOLE), ids=["cage", "whole bearing"])
OWN = jc.replace(jc.case("1a"), impact=jc.forces.ImpactFromBearing())
MODELS = (*map(jc.case, PUBLISHED_CASES), elastic(jc.case("2a")), roller_pass(jc.case("3b")), OWN)
FIELDS = {path: field for model in MODELS for path, field in declared(model)}
"""Everything that a file of a cage may give: its place and declaration."""
OPTION = re.compile(r"# (?=[a-z_0-9]+ = )")


def assert_alike(found: dict[str, Any], expected: dict[str, Any], rel: float = 1e-3) -> None:
    assert set(found) == set(expected)
    for key, value in found.items():
        if isinstance(value, dict):
            assert_alike(value, expected[key], rel)
        else:
            known = expected[key]
            assert value == (known if isinstance(known, str | int) else pytest.approx(known, rel=rel)), key


def read(template: str, text: str = "") -> dict[str, Any]:
    """Configuration of what a text, or the template itself, describes."""
    return configuration(model_from(tomllib.loads(text or template)))


def test_they_describe_ready_made_bearings():
    """Case 1a but for two misprints of the paper and impacts from the bearing, and NU2310 in oil that resists its
    rollers."""
    own = jc.replace(OWN, clearance_reading="radial", unbalance="physical")
    assert_alike(read(CAGE), configuration(own))
    oil = {"drag.drag_law": "cylinder", "drag.rolling_law": "bath", "drag_coefficient": 1.0, "oil_share": 0.015}
    oil |= {"viscosity_exponent": 0.8, "rolling_coefficient": 1.48e-6, "wear_coefficient": 6e-7}
    assert_alike(read(WHOLE), configuration(jc.replace(jc.whole_bearing("nu2310"), **oil)))
    assert all("$" not in text and max(map(len, text.splitlines())) <= 140 for text in (CAGE, WHOLE))


@pytest.mark.wide
@TEMPLATES
def test_every_option_is_accepted_and_shows_what_it_is_when_left_out(text: str):
    lines, left_out = text.splitlines(), read(text)
    options = [i for i, line in enumerate(lines) if OPTION.match(line)]
    assert len(options) > 20
    for i in options:
        taken = [OPTION.sub("", line) if k == i else line for k, line in enumerate(lines)]
        assert_alike(read(text, "\n".join(taken)), left_out)


def merged(table: dict, new: dict) -> dict:
    """The table with those of `new` in place of its own where they name another kind or designation."""
    place = lambda old, value: merged(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    fresh = {"kind", "designation"} & set(new)
    return new if fresh else table | {key: place(table.get(key), value) for key, value in new.items()}


@TEMPLATES
def test_every_table_that_can_be_put_in_place_of_another_is_accepted(text: str):
    blocks = re.findall(r"(?:^#: .*\n?)+", text, flags=re.M)
    assert len(blocks) > 1
    for block in blocks:
        given = tomllib.loads(re.sub(r"^#: ", "", block, flags=re.M))
        found = configuration(model_from(merged(tomllib.loads(text), given)))
        for key in re.findall(r"^\[(\w+)", re.sub("^#: ", "", block, flags=re.M), flags=re.M):
            assert found[key].get("kind") == given[key].get("kind"), block


def test_nothing_that_can_be_given_is_missing():
    known = {path[-1] for path in FIELDS}
    written = set(re.findall(r"^(?:# |#: )?([a-z_0-9]+) = ", CAGE, flags=re.M))
    assert 'effective_length = "' in CAGE and 'effective_length = "' in WHOLE  # whose default is another value
    known -= {"effective_length"}
    assert written == known | {"kind", "grade", "base", "designation", "material", "speeds", "stiffness"}
    for path, field in FIELDS.items():
        assert all(f'"{option}"' in CAGE for option in field.metadata.get("choice", ())), path


# Whole bearings.


def test_every_parameter_and_choice_of_a_bearing_goes_there_and_back(tmp_path: Path):
    """Each number changed a little, each choice to its last option."""
    model, rng = jc.whole_bearing("nu2310"), np.random.default_rng(1)
    info = jc.parameter_info(model)
    shake = lambda name, x: float(np.clip(x * rng.uniform(0.98, 1.02), info[name].lower, info[name].upper))
    last = {".".join(p): f.metadata["choice"][-1] for p, f in declared(model) if "choice" in f.metadata}
    model = jc.replace(model, **{name: shake(name, float(x)) for name, x in jc.parameters(model).items()})
    model = jc.replace(model, **last, **{"bearing.n_rollers": 12, "film.n_lands": 1})
    again = load_model(save_model(tmp_path / "mine.toml", model))
    assert configuration(again) == configuration(model)


@pytest.mark.parametrize(
    ("name", "material", "rolling", "hardness"),
    [("NU1014", "steel", 1.12e-6, 1.6e9), ("NU2212 ECP", "peek", 1.40e-6, 0.25e9)],
)
def test_rolling_resistance_follows_the_series_and_hardness_the_material(name, material, rolling, hardness):
    """R_1 of SKF by series, unless the file gives its own; the hardness enters the wear."""
    table = tomllib.loads(template("bearing", short=True)) | {"material": material, "bearing": {"designation": name}}
    found = model_from(table | {"film": {"land_width": "2 mm"}})
    assert (found.drag.rolling_coefficient, found.wear.hardness) == (rolling, pytest.approx(hardness))
    own = {"drag": table["drag"] | {"rolling_coefficient": 2e-6}, "wear": {"hardness": "1 GPa"}, "base": "nu2310"}
    found = model_from({"base": "nu2310", "material": material} | own)
    assert (found.drag.rolling_coefficient, found.wear.hardness) == (2e-6, 1e9)
    full = tomllib.loads(template("bearing"))
    assert "drag.rolling_coefficient" not in describe(full).estimated
    del full["drag"]["rolling_coefficient"]  # dimensions tell no series
    assert "drag.rolling_coefficient" in describe(full).estimated


def test_what_a_file_changes_of_a_ready_made_bearing(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'base = "nu2310"\nload = "300 N"\n[bearing]\npocket_clearance = "0.2 .. 0.6 mm"\n[ring]\nring_mass = 3'
    )
    file = read_bearing(path)
    expected = jc.replace(jc.whole_bearing("nu2310"), load=300.0, pocket_clearance=0.4e-3, ring_mass=3.0)
    assert_alike(configuration(file.model), configuration(expected), 1e-12)
    assert file.speeds == "shaft" and [u.names for u in file.unknowns] == [("pocket_clearance",)]
    assert isinstance(file.model, jc.BearingModel) and isinstance(model_from({"base": "1a"}), jc.CageModel)
