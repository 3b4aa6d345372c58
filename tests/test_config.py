"""Configurations and units: TOML to model and back, ranges, defaults, the readings of the paper, units of options."""

import inspect
import math
import tomllib
from pathlib import Path

import pytest
from helpers import elastic, roller_pass

import jaxcage as jc
from jaxcage.files import (
    ConfigError,
    configuration,
    load_model,
    model_from,
    read_bearing,
    save_model,
    template,
    to_si,
    toml_text,
)
from jaxcage.show import readings_words


# --- units -----------------------------------------------------------------------------------


@pytest.mark.parametrize("text, unit, value", [
    ("0.45 mm", "m", 0.45e-3),
    ("23µm", "m", 23e-6),
    ("1e-4 m", "m", 1e-4),
    ("-2E-3 m", "m", -2e-3),
    ("5 m^-1 m^2", "m", 5.0),
    ("-.5 inch", "m", -0.0127),
    ("40 degC", "K", 313.15),
    ("40 °C", "K", 313.15),
    ("104 degF", "K", 313.15),
    ("56 cSt", "m^2/s", 56e-6),
    ("56 mm^2/s", "m^2/s", 56e-6),
    ("0.87 g/cm^3", "kg/m^3", 870.0),
    ("3000 rpm", "rad/s", 314.1592653589793),
    ("900 rad/s", "rpm", 900 * 30 / math.pi),
    ("2 revolutions/second", "rpm", 120.0),
    ("8500rpm", "rpm", 8500.0),
    ("8.5e3", "rpm", 8500.0),
    ("600 us", "ms", 0.6),
    ("210 GPa", "Pa", 210e9),
    ("80.6e3 N/mm^(10/9)", "N/m^(10/9)", 80.6e3 * 1000 ** (10 / 9)),
    ("97 %", "1", 0.97),
    ("0.97", "1", 0.97),
])  # fmt: skip
def test_units(text: str, unit: str, value: float):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("text, unit, said", [
    ("thick", "m", "not a number with a unit"),
    ("", "m", "not a number with a unit"),
    ("1 2 mm", "m", "unknown unit"),
    ("2 1 mm", "m", 'unknown unit "1 mm"'),
    ("2 1", "1", 'unknown unit "1"'),
    ("60 C", "K", 'has the unit "C", where a unit like "degC" is wanted'),
    ("1,450 N", "N", "with a point and without commas"),
    ("1e4 - 1e6 N/m", "N/m", 'a range is written with two points, such as "1e4 .. 1e6 N/m"'),
    ("0.2 mm to 0.3 mm", "m", "a range is written with two points"),
    ("0.45 kg", "m", 'has the unit "kg", where a unit like "m" is wanted'),
    ("0.45 m", "1", 'has the unit "m", where no unit is wanted'),
    ("50 kHz", "rad/s", "is in Hz"),
])  # fmt: skip
def test_wrong_units(text: str, unit: str, said: str):
    with pytest.raises(ValueError, match=said):
        to_si(text, unit)


@pytest.mark.parametrize("gap", ["10 um", "0.01 mm", 1e-5, "10 um .. 1 mm", "0.1 (0.01 .. 1) mm"])
def test_a_bound_may_be_given_in_any_unit(gap: str | float, tmp_path: Path):
    mine = tmp_path / "mine.toml"
    given = configuration(jc.case("1a")) | {"guidance_gap": gap, "eccentricity": "1 um"}
    mine.write_text(toml_text(given))
    read_bearing(mine)
    mine.write_text(toml_text(given | {"guidance_gap": "9.99999 um"}))
    with pytest.raises(ConfigError, match="`guidance_gap` must be a number from 1e-05 to"):
        read_bearing(mine)
    jc.replace(jc.case("1a"), eccentricity=1e-6, guidance_gap=to_si("10 um", "m"))


def test_rounding_of_units_is_no_reason_to_refuse_an_oil():
    point = dict(density=870.0, temperature_1=to_si("40 degC", "K"), temperature_2=to_si("100 degC", "K"))
    thin, same = to_si("1 mm^2/s", "m^2/s"), to_si("1 cSt", "m^2/s")
    oil = jc.bearing.Lubricant(viscosity_1=thin, viscosity_2=same, **point)
    assert float(oil.kinematic_viscosity) == pytest.approx(1e-6, rel=1e-9)
    point["temperature_2"] = to_si("104 degF", "K")  # 40 degC
    with pytest.raises(ValueError, match="must differ from `temperature_1`"):
        jc.bearing.Lubricant(viscosity_1=2e-6, viscosity_2=thin, **point)


# --- files -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "model",
    [
        jc.case("3b"),
        elastic(jc.case("2a")),
        roller_pass(jc.case("1b")),
        jc.replace(jc.case("1a"), guidance_gap=1 / 3e3, eccentricity=1e-5 / 7),
    ],
    ids=["3b", "elastic", "roller_pass", "replaced"],
)
def test_round_trip_keeps_every_digit(tmp_path: Path, model: jc.CageModel):
    again = load_model(save_model(tmp_path / "model.toml", model))
    assert configuration(again) == configuration(model)
    assert type(again.rib) is type(model.rib) and type(again.impact) is type(model.impact)


def test_every_parameter_is_in_the_configuration():
    model = elastic(roller_pass(jc.case("1a")))

    def count(table: dict) -> int:
        return sum(count(v) if isinstance(v, dict) else isinstance(v, float) for v in table.values())

    assert count(tomllib.loads(toml_text(configuration(model)))) == len(jc.parameters(model))


def test_base_is_changed_only_where_the_file_says_so():
    model = model_from({"base": "1a", "guidance_gap": "0.5 mm", "film": {"model": "full"}})
    expected = configuration(jc.case("1a"))
    expected["guidance_gap"] = 0.5e-3
    expected["film"]["model"] = "full"
    assert configuration(model) == expected
    assert (model.clearance_reading, model.unbalance) == ("as_printed", "as_printed")


def test_tables_start_from_ready_made_modules():
    oil = {"grade": 68, "temperature": "70 degC"}
    model = model_from({"base": "1a", "lubricant": oil, "bearing": {"designation": "NU2310", "radial_clearance": 2e-5}})
    expected = jc.bearing.vg(68.0, 343.15)
    assert float(model.lubricant.dynamic_viscosity) == pytest.approx(float(expected.dynamic_viscosity), rel=1e-12)
    assert (float(model.bearing.radial_clearance), float(model.bearing.roller_diameter)) == (2e-5, 16e-3)


def test_kind_chooses_the_law():
    impact = {"kind": "roller_pass", "harmonics": 8, "oscillator": {"bar_mass": "5 g"}}
    model = model_from({"base": "1a", "impact": impact})
    assert isinstance(model.impact, jc.forces.RollerPassImpact) and model.impact.harmonics == 8
    assert float(model.impact.oscillator.bar_mass) == pytest.approx(5e-3)
    assert float(model.impact.oscillator.bar_stiffness) == float(jc.forces.PocketImpact().bar_stiffness)
    same = model_from({"base": "1a", "impact": {"kind": "synchronous", "reference_speed": "9000 rpm"}}).impact
    assert isinstance(same, jc.forces.SynchronousImpact)
    assert float(same.reference_speed) == pytest.approx(9000 * math.pi / 30)


@pytest.mark.parametrize("table, said", [
    ({}, "`bearing`, `lubricant`, `film`, `contact`, `support`, `impact`, .* must be given"),
    ({"rib": {"kind": "elastic", "mass": 1.0}}, "`rib.stiffness`, `rib.damping` must be given"),
    ({"rib": {"kind": "soft"}}, "`rib.kind` must be one of rigid, elastic, but is 'soft'"),
    ({"film": {"model": "half"}}, "`film.model` must be one of fixed_half, positive_pressure,"),
    ({"film": {"n_lands": 2.5}}, "`film.n_lands` must be a whole number from 1 to 4, but is 2"),
    ({"film": {"n_lands": True}}, "`film.n_lands` must be a whole number"),
    ({"film": 3}, "`film` must be a table of values, but is 3"),
    ({"cage_mass": True}, "`cage_mass` must be a number from 0.001 to 100 kg, but is True"),
    ({"cage_mass": [1.0]}, r"`cage_mass` must be a number .*, but is \[1.0\]"),
    # The NU2310 has 2.68 kg of bronze between shaft and housing: pi/4 (0.11^2 - 0.05^2) 0.04 m^3 of 8900 kg/m^3.
    ({"cage_mass": 60}, "`cage_mass` must be at most 2.68 kg, .* but is 60 kg; grams are written"),
    ({"lubricant": {"grade": "68"}}, "`lubricant.grade` must be a number from 2"),
    ({"bearing": {"n_rollers": 40}}, "must leave a bar between pockets, which are 6.355 mm apart"),
    ({"bearing": {"rib_diameter": "98 mm"}}, "between the pitch circle and the outer raceway, 81 and 97 mm"),
    ({"bearing": {"outside_diameter": "96 mm"}}, "`bearing.outside_diameter` must be above the outer raceway"),
    ({"bearing": {"roller_length": "41 mm"}}, "`bearing.roller_length` must fit into the rings, 40 mm"),
    ({"contact": {"smoothing": 1e-5}, "guidance_gap": 5e-5}, "a tenth of the clearance, 0.05"),
    ({"base": ["1a"]}, "`base` must be one of"),
    ({"base": "1a", "model": "bearing"}, "`base` must be one of nu2310"),
    ({"model": "bearing"}, "must be given, unless"),
    ({"base": "nu2310", "traction": {"peak": 0.01}}, "`peak` must be above `rest` and `limit`"),
    ({"base": "nu2310", "guidance": "inner", "inner_land_diameter": "60 mm"}, "pitch circle, 65 and 81 mm, but is 60"),
    ({"base": "nu2310", "guidance": "inner", "inner_land_diameter": "85 mm"}, "pitch circle, 65 and 81 mm, but is 85"),
])  # fmt: skip
def test_refused(table: dict, said: str):
    with pytest.raises(ConfigError, match=said):
        model_from(table if not table or "model" in table else {"base": "1a", **table})


def test_an_outer_ring_without_ribs_is_given_by_its_raceway():
    """A bearing of type N, whose cage runs on the inner ring: 65 mm + 2 x 16 mm."""
    inner = {"guidance": "inner", "inner_land_diameter": "69 mm", "bearing": {"rib_diameter": "97 mm"}}
    assert float(model_from({"base": "nu2310", **inner}).land_radius) == pytest.approx(34.725e-3)


def test_example_in_the_documentation_is_valid(tmp_path: Path):
    shown = inspect.getdoc(inspect.getmodule(load_model))
    assert shown is not None
    path = tmp_path / "example.toml"
    path.write_text(shown.split("\n\n", 1)[1])
    model = load_model(path)
    assert float(model.guidance_gap) == pytest.approx(0.5e-3)
    assert float(model.impact.oscillator.bar_mass) == pytest.approx(4e-3)


# --- readings of the paper -------------------------------------------------------------------


READINGS = {
    "clearance_reading": ('"radial" (c = C_r/2', '"as_printed" (c = C_r,'),
    "unbalance": ('"physical" (M e omega^2)', '"as_printed" (2 M rho omega^2'),
}


@pytest.mark.parametrize("name", READINGS)
def test_a_file_without_a_reading_is_refused_with_both_of_them(name: str, tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text("\n".join(line for line in template().splitlines() if not line.startswith(f"{name} =")))
    with pytest.raises(ConfigError) as refusal:
        load_model(path)
    said = str(refusal.value)
    assert f"`{name}` must be given" in said and all(words in said for words in READINGS[name])
    assert "\n" not in said and said.endswith(".")


@pytest.mark.parametrize("name", READINGS)
def test_a_model_built_in_python_without_a_reading_is_refused(name: str):
    case = jc.case("1a")
    names = "bearing", "lubricant", "forces", "cage_mass", "guidance_gap", "eccentricity", *READINGS
    whole = {name: getattr(case, name) for name in names}
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
    words = 'radial clearance c = C_r/2, as C_r is defined ("radial"), unbalance M e omega^2 ("physical")'
    assert readings_words(mine) == words
