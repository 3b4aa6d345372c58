"""Whole bearings as TOML files: the template, every parameter there and back, refusals, what commands say of them."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import declared
from test_init import OPTION

import jaxcage as jc
from jaxcage.io import (
    ConfigError,
    configuration,
    load_whole_bearing,
    read_whole_bearing,
    save_model,
    subject_of,
    template,
    whole_bearing_from,
)


jc.enable_x64()
TEXT = template("bearing")
FIELDS = dict(declared(jc.whole_bearing("nu2310")))


def assert_alike(found: dict[str, Any], expected: dict[str, Any], rel: float = 1e-3) -> None:
    assert set(found) == set(expected)
    for key, value in found.items():
        if isinstance(value, dict):
            assert_alike(value, expected[key], rel)
        else:
            known = expected[key]
            assert value == (known if isinstance(known, str | int) else pytest.approx(known, rel=rel)), key


def test_the_template_is_nu2310():
    assert "$" not in TEXT and max(map(len, TEXT.splitlines())) <= 140
    assert_alike(configuration(whole_bearing_from(tomllib.loads(TEXT))), configuration(jc.whole_bearing("nu2310")))


def test_every_option_is_accepted_and_shows_what_it_is_when_left_out():
    lines, left_out = TEXT.splitlines(), configuration(whole_bearing_from(tomllib.loads(TEXT)))
    options = [i for i, line in enumerate(lines) if OPTION.match(line)]
    assert len(options) > 30
    for i in options:
        taken = [OPTION.sub("", line) if k == i else line for k, line in enumerate(lines)]
        assert_alike(configuration(whole_bearing_from(tomllib.loads("\n".join(taken)))), left_out)


def test_every_table_that_can_be_put_in_place_of_another_is_accepted():
    blocks = re.findall(r"(?:^#: .*\n?)+", TEXT, flags=re.M)
    assert len(blocks) == 2
    for block in blocks:
        given = tomllib.loads(re.sub(r"^#: ", "", block, flags=re.M))
        bearing = tomllib.loads(TEXT)["bearing"] | given["bearing"]
        if "designation" in given["bearing"]:
            bearing = given["bearing"]
        assert whole_bearing_from(tomllib.loads(TEXT) | {"bearing": bearing}).bearing.n_rollers == 13


def test_every_parameter_and_choice_goes_there_and_back(tmp_path: Path):
    """Each number changed a little, each choice to its last option."""
    model, rng = jc.whole_bearing("nu2310"), np.random.default_rng(1)
    info = jc.parameter_info(model)
    shake = lambda name, x: float(np.clip(x * rng.uniform(0.98, 1.02), info[name].lower, info[name].upper))
    model = jc.replace(model, **{name: shake(name, float(x)) for name, x in jc.parameters(model).items()})
    last = {".".join(p): f.metadata["choice"][-1] for p, f in FIELDS.items() if "choice" in f.metadata}
    model = jc.replace(model, **last, **{"bearing.n_rollers": 12, "film.n_lands": 1})
    again = load_whole_bearing(save_model(tmp_path / "mine.toml", model))
    assert configuration(again) == configuration(model)
    assert again.guidance == "inner" and again.bearing.n_rollers == 12 and again.pockets.pocket_law == "power"


def test_what_a_file_changes_of_a_ready_made_bearing(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'base = "nu2310"\nload = "300 N"\n[bearing]\npocket_clearance = "0.2 .. 0.6 mm"\n[ring]\nring_mass = 3'
    )
    file = read_whole_bearing(path)
    expected = jc.replace(jc.whole_bearing("nu2310"), load=300.0, pocket_clearance=0.4e-3, ring_mass=3.0)
    assert_alike(configuration(file.model), configuration(expected), 1e-12)
    assert file.speeds == "shaft" and [u.names for u in file.unknowns] == [("pocket_clearance",)]
    assert subject_of(path) == "bearing" and subject_of({"base": "1a"}) == "cage"


@pytest.mark.parametrize(
    "text, said",
    [
        ('model = "bearing"\nbase = "1a"', "`base` must be one of nu2310, but is '1a'"),
        (
            'base = "nu2310"\nlaod = 3',
            "Key `laod` at the top level must be one of base, model, speeds, cage_mass",
        ),
        ('base = "nu2310"\n[traction]\npeak = 0.01', "`peak` must be above `rest` and `limit`, but is 0.01"),
        ('base = "nu2310"\nguidance = "inner"\ninner_land_diameter = "45 mm"', "above the bore, 50 mm, but is 45 mm"),
        ('model = "bearing"\nguidance = "inner"', '`inner_land_diameter` must be given with guidance = "inner"'),
        ('base = "nu2310"\ncage_mass = "90 kg"', "`cage_mass` must be at most"),
        ('base = "nu2310"\n[film]\nland_width = "7 mm"', "must fit beside the rollers, in 6.5 mm, but is 7 mm"),
        ('model = "bearing"', 'must be given, unless `base = "nu2310"` or the like gives the rest'),
    ],
)
def test_refusals(text: str, said: str, tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as refused:
        load_whole_bearing(path)
    assert said in str(refused.value) and str(path) in str(refused.value) and "\n" not in str(refused.value)
