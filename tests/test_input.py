"""Input that an engineer has: wrong files refused at once, balance grades, catalogue bearings, short files."""

import json
import math
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import jaxcage as jc
from jaxcage.bearing import PUBLISHED_CASES, catalogue, line_contact_stiffness, listed
from jaxcage.cli.subject import check_speeds, described, read_case
from jaxcage.files import (
    ConfigError,
    SpeedOf,
    configuration,
    declarations,
    load_model,
    model_from,
    read_bearing,
    template,
)
from jaxcage.files.schema import schema


SHORT = 40
"""Most lines of a short file."""


def test_the_exported_declarations_are_those_of_the_modules():
    assert declarations() == json.loads(json.dumps(schema())), "run python -m jaxcage.files.schema"


def test_every_base_has_the_first_law_of_each_table():
    """The first pass takes a law that a file does not choose from there."""
    models = [*map(jc.case, PUBLISHED_CASES), jc.whole_bearing("nu2310")]
    for model in models:
        tables = declarations()["modules"][type(model).__name__]["tables"]
        assert all(type(getattr(model, name)).__name__ == first for name, (first, *_) in tables.items())


WRONG = {
    "guidence_gap = 1": "Key `guidence_gap` at the top level is unknown (did you mean `guidance_gap`?).",
    'guidance_gap = "0,25 mm"': 'is "0,25 mm": numbers are written with a point and without commas.',
    "guidance_gap = 0.25": '1e-05 to 0.005 m, but is 0.25 m; with its unit it is written "0.25 mm".',
    'guidance_gap = "0.25 kg"': 'has the unit "kg", where a unit like "m" is wanted.',
    'guidance_gap = "-0.25 mm"': 'to 0.005 m, but is -0.00025 m (given as "-0.25 mm").',
    'guidance_gap = "0.25"': 'but "0.25" has no unit: write "0.25 mm" if that is meant.',
    'cage_mass = "0.1 .. 0.2"': 'but "0.1 .. 0.2" has no unit: write "0.1 .. 0.2 g" if that is meant.',
    "lubricant.temperature = 55": '200 to 600 K, but is 55 K; with its unit it is written "55 degC".',
    'cage_mass = "3 t"': 'from 0.001 to 100 kg, but is 3000 kg (given as "3 t").',
    'eccentricity = "G6.3"': 'speed of its balance grade, such as "G6.3 at 12000 rpm shaft", but is "G6.3".',
    'eccentricity = "G-4 at 900 rpm"': 'grade, such as "G6.3 at 12000 rpm shaft", but is "G-4 at 900 rpm".',
    'eccentricity = "G6.3 at 200 Hz shaft"': 'such as "G6.3 at 12000 rpm shaft", but is in Hz',
    'guidance = "inner"': 'Key `guidance` at the top level needs model = "bearing".',
    'bearing.designation = "6204"': "`bearing.designation` must be one of NU1010, NU1014,",
    'bearing.pocket_clearance = "3.45 mm"': "which are 19.38 mm apart, but makes them 19.45 mm wide.",
    'eccentricity = "0.5 mm"': "`eccentricity` must be smaller than `guidance_gap`, but is 0.5 mm in a gap of 0.45 mm.",
    'eccentricity = "G6300 at 1200 rpm cage"': 'but is 0.0501338 m (given as "G6300 at 1200 rpm cage").',
    'bearing.bore = "70 mm"': "`bearing.bore` must be below the inner raceway, 65 mm, but is 70 mm.",
    'film.land_width = "8 mm"': "`film.land_width` must fit beside the rollers, in 6.5 mm, but is 8 mm.",
}
REFUSALS = """
import sys, time
from jaxcage.cli import main
for path in sys.argv[1:]:
    print(main(["statics", path]), file=sys.stderr)
print(sorted({"jax", "equinox"} & set(sys.modules)), file=sys.stderr)
"""
REFUSED = {
    "poincare nu2310 --speed 9000": "Command poincare takes a cage, but nu2310 is a bearing with its rollers.",
    "simulate 1a --speed 9000 --load 3": "Option --load goes with a bearing with its rollers, but 1a is a cage.",
    "gradient 1a --load 3": "Option --load goes with a bearing with its rollers, but 1a is a cage.",
    # 300 m/s over half of 91.65 mm; the cage of nu2310 turns at 65/162 of its shaft, and mine.toml is an NU1014.
    "poincare 1a --speed 70000rpm": "cage at most 62516 rpm, which is 300 m/s at its land",
    "poincare nu2310 --speed 160000rpm": "cage at most 62516 rpm, which is 300 m/s at its land",
    "sweep mine.toml --first 3000 --last 140000": "cage at most 60153 rpm, which is 300 m/s at its land",
    "check 1a --operating 4000-70000": "cage at most 62516 rpm, which is 300 m/s at its land",
    "design 1a --operating 4000-70000": "cage at most 62516 rpm, which is 300 m/s at its land",
    "compare 1a nu2310": "Case 'nu2310' must be a cage, as the first one is: two of a kind are compared.",
    "sweep 1a --first 9000 --last 3000": "above --first, but the range is 9000 to 3000 rpm of the cage.",
    "sweep 1a --first 1.500": 'but is "1.500": write 1500 or 1.5, whichever is meant.',
    "check 1a --operating 1.500-3.600rpm": '"1.500-3.600rpm" is "1.500 rpm": write 1500 or 1.5, whichever is meant.',
    "identify 1a none.csv": 'with ranges, such as stiffness = "1e4 .. 1e6 N/m", but has none.',
}


def test_wrong_files_are_refused_before_jax_is_loaded(tmp_path: Path):
    paths = [tmp_path / f"{i}.toml" for i in range(len(WRONG))]
    for path, line in zip(paths, WRONG, strict=True):
        path.write_text(f'base = "1a"\n{line}\n')
    command = [sys.executable, "-c", REFUSALS, *map(str, paths), str(tmp_path / "none.toml"), "1c"]
    found = subprocess.run(command, capture_output=True, text=True, check=True).stderr.splitlines()
    assert found[-1] == "[]" and found[1:-1:2] == ["2"] * (len(WRONG) + 2)
    for said, ends in zip(found[::2], WRONG.values(), strict=False):
        assert ends in said and said.startswith("File '")
    assert "none.toml' must be a readable TOML file, but: No such file or directory." in found[-5]
    assert found[-3].startswith("Case '1c' is unknown: it must be one of 1a,")


def test_cases_of_the_wrong_kind_and_wrong_speeds_are_refused_before_jax_is_loaded(tmp_path: Path):
    (tmp_path / "mine.toml").write_text(template(short=True).replace("NU2310", "NU1014"))
    script = REFUSALS.replace('["statics", path]', "path.split()")
    command = [sys.executable, "-c", script, *REFUSED]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    found = ran.stderr.splitlines()
    assert found[-1] == "[]" and found[1:-1:2] == ["2"] * len(REFUSED)
    assert all(ends in said for said, ends in zip(found[:-1:2], REFUSED.values(), strict=True))


def test_a_long_name_of_a_file_leaves_room_for_names_of_output_files(tmp_path: Path):
    (path := tmp_path / f"{'n' * 240}.toml").write_text('base = "1a"\n')
    assert read_case(str(path)).name == "n" * 50


def test_ends_of_a_range_are_compared_as_speeds_of_one_ring():
    """15000 rpm of the shaft are 6018 rpm of the cage of case 1a: 65/162 of it."""
    shaft, cage = SpeedOf(15000.0, "shaft"), SpeedOf(6100.0, "cage")
    check_speeds(described("1a"), {"first": shaft, "last": cage})
    with pytest.raises(ValueError, match="range is 15000 to 6100 rpm of the cage"):
        check_speeds(described("1a"), {"first": 15000.0, "last": cage})


def test_eccentricity_by_a_balance_grade():
    """e = G/omega: 6.3 mm/s at 12000 rpm are 5.013 um; the cage of an NU 1014 turns at 80/180 of the shaft's speed."""
    read = lambda text, **more: model_from(
        {"base": "1a", "eccentricity": text, "bearing": {"designation": "NU1014"}} | more
    )
    of_cage = 6.3e-3 / (12000 * math.pi / 30)
    assert of_cage == pytest.approx(5.013e-6, rel=1e-4)
    for text, expected in (
        ("G6.3 at 12000 rpm cage", of_cage),
        ("G 6.3 at 12000 rpm shaft", of_cage * 180 / 80),
        ("g2.5 at 1256.637 rad/s shaft", 2.5 / 6.3 * of_cage * 180 / 80),
    ):
        assert float(read(text).eccentricity) == pytest.approx(expected, rel=1e-6)
    assert float(read("G6.3 at 12000 rpm").eccentricity) == pytest.approx(of_cage)
    assert float(read("G6.3 at 12000 rpm", speeds="shaft").eccentricity) == pytest.approx(of_cage * 180 / 80)
    whole = model_from({"base": "nu2310", "eccentricity": "G6.3 at 12000 rpm"})
    assert float(whole.eccentricity) == pytest.approx(of_cage * 162 / 65)
    planet = model_from({"base": "nu2310", "eccentricity": "G6.3 at 12000 rpm", "outer_speed": "-3000 rpm"})
    assert float(planet.eccentricity) == pytest.approx(of_cage * 162 / (65 - 97 / 4))


# Bearings of the catalogue.


def test_what_is_estimated_of_a_catalogue_bearing_is_named(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text('base = "1a"\n[bearing]\ndesignation = "NU1020"\npocket_clearance = "0.2 mm"')
    rollers = "n_rollers", "roller_diameter", "roller_length"
    names = "radial_clearance", "effective_length", *rollers
    file = read_bearing(path)
    assert file.estimated == tuple(f"bearing.{name}" for name in names)
    rows = jc.show.sources_table(file.model, file).records
    found = {row["name"].removeprefix("bearing."): row["from"] for row in rows if row["name"].startswith("bearing.")}
    assert {name for name, source in found.items() if source == "estimated from dimensions"} == {*names}
    assert (found["bore"], found["pocket_clearance"]) == ("catalogue, NU1020", "this file")
    values = {row["name"]: row["value"] for row in rows}
    assert (values["bearing.radial_clearance"], values["cage_mass"]) == ("67.5", "0.252088")  # the mass is that of 1a
    path.write_text('base = "1a"\n[bearing]\ndesignation = "NU2310"')
    assert read_bearing(path).estimated == ()


def test_clearances_that_dimensions_leave_out_are_estimated(tmp_path: Path):
    path, text = tmp_path / "mine.toml", template()
    text = re.sub(r"(?m)^(radial|pocket)_clearance = .*$", "", text)
    path.write_text(text)
    file = read_bearing(path)
    assert file.estimated == ("bearing.radial_clearance", "bearing.pocket_clearance", "load")
    bearing = listed("NU2210").bearing  # of the same bore; 0.3 mm is the pocket clearance of the paper's rollers
    assert float(file.model.bearing.radial_clearance) == float(bearing.radial_clearance)
    assert float(file.model.bearing.pocket_clearance) == pytest.approx(0.3e-3)
    rows = {row["name"]: row["from"] for row in jc.show.sources_table(file.model, file).records}
    assert rows["bearing.radial_clearance"] == "estimated from dimensions"
    path.write_text(text.replace('bore = "50 mm"', 'bore = "130 mm"'))
    with pytest.raises(ConfigError, match="`bearing.radial_clearance` must be given"):
        read_bearing(path)


@pytest.mark.parametrize("name", ["NU1014", "NU2210"])
def test_rollers_weigh_by_their_length_and_carry_by_their_effective_length(name: str):
    b = listed(name).bearing
    l, effective = float(b.roller_length), float(b.effective_length)
    assert l - effective == pytest.approx(1.5e-3)
    assert float(b.raceway_stiffness) == pytest.approx(float(line_contact_stiffness(b.palmgren_constant, effective)))
    assert float(b.roller_mass) == pytest.approx(7800 * math.pi / 4 * float(b.roller_diameter) ** 2 * l)


def test_the_effective_length_of_a_file(tmp_path: Path):
    """Palmgren: K goes as the length to 8/9. Left out, it is the roller's, whatever that is changed to."""
    plain, shorter = (model_from({"base": "nu2310", "bearing": b}) for b in ({}, {"effective_length": "25.5 mm"}))
    ratio = float(shorter.bearing.raceway_stiffness / plain.bearing.raceway_stiffness)
    assert ratio == pytest.approx((25.5 / 27) ** (8 / 9))
    assert "effective_length" not in jc.parameters(plain)
    assert float(jc.parameters(shorter)["effective_length"]) == pytest.approx(25.5e-3)
    assert configuration(load_model(jc.files.save_model(tmp_path / "m.toml", shorter))) == configuration(shorter)
    longer = jc.replace(plain, roller_length=30e-3).bearing
    assert float(longer.raceway_stiffness / plain.bearing.raceway_stiffness) == pytest.approx((30 / 27) ** (8 / 9))
    with pytest.raises(ConfigError, match="`bearing.effective_length` must be at most `roller_length`, 27 mm"):
        model_from({"base": "nu2310", "bearing": {"effective_length": "28 mm"}})


def test_every_bearing_of_the_catalogue_makes_a_whole_bearing():
    for name in catalogue():
        b = listed(name).bearing
        inertia, land = 0.06 * float(b.pitch_diameter) ** 2 / 4, 0.8 * float(b.land_width_limit)
        table = {"base": "nu2310", "bearing": {"designation": name}, "cage_mass": "60 g", "cage_inertia": inertia}
        model = model_from(table | {"film": {"land_width": land}})
        assert float(model.bearing.bore) == float(b.bore)


# Short files.


@pytest.mark.parametrize("subject", ["cage", "bearing"])
def test_a_short_file_says_the_same_as_the_long_one(subject):
    text = template(subject, short=True)
    assert len(text.splitlines()) <= SHORT and max(map(len, text.splitlines())) <= 125
    short, full = (jc.parameters(model_from(tomllib.loads(template(subject, s)))) for s in (True, False))
    assert {n: float(x) for n, x in short.items()} == pytest.approx({n: float(x) for n, x in full.items()}, rel=0.03)


def test_a_value_is_the_users_once_its_line_is_edited(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(template(short=True))
    assert {"load", "guidance_gap", "lubricant.grade"} <= set(read_bearing(path).left)
    lines = template(short=True).splitlines()
    edited = [line.partition("#")[0] if line.startswith(("load", "grade")) else line for line in lines]
    edited = [line.replace("0.45 mm +- 0.05", "0.25 mm +- 0.05") for line in edited]
    path.write_text("\n".join(edited))
    left = set(read_bearing(path).left)
    assert not {"load", "guidance_gap", "lubricant.grade"} & left and "eccentricity" in left
