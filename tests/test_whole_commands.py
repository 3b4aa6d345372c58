"""The commands for a whole bearing print, draw and store what the same calls of the library find."""

import json
import pathlib
import re

import numpy as np
import pytest
from helpers import document, is_png, read_columns, refused

import jaxcage as jc
from jaxcage.design import Runs, mean_gradient
from jaxcage.files import load_model, model_from
from jaxcage.lanes import load, stored_configuration


jc.enable_x64()
SPEED = float(jc.rpm(10000))
RANGE = ["nu2310", "--first", "8000", "--last", "10000", "--discard", "0"]


@pytest.fixture
def mine(tmp_path: pathlib.Path) -> str:
    (path := tmp_path / "mine.toml").write_text('base = "nu2310"\nload = "1 kN"')
    return str(path)


def test_simulate(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, mine: str):
    """A file's bearing at a load of the command line."""
    asked = ["simulate", mine, "--speed", "10000 rpm", "--load", "4.45 kN", "--revolutions", "1", "--discard", "0"]
    found = document(capsys, *asked, "--out", str(tmp_path))
    assert found["outcome"] == "successful" and found["shaft_speed_rpm"] == 10000 and found["load_N"] == 4450
    measures = found["measures"]
    parts = [x for name, x in measures.items() if name.startswith("power_") and name.endswith("_W")]
    assert measures["friction_power_W"] == pytest.approx(sum(parts))
    assert is_png(found["figure"]) and read_columns(found["data"])["pocket_force_13 [N]"].size == 129
    assert len(found["around"]["roller_slip"]) == 36
    model = jc.whole_bearing("nu2310")
    expected = jc.measures(model, jc.simulate(model, SPEED, revolutions=1, samples=128))
    for name in ("cage_slip", "pocket_force_mean_sum_N", "eccentricity_mean"):
        assert measures[name] == pytest.approx(expected[name].value, rel=1e-9)
    of = expected["whirl_ratio"]._replace(value=0.0002518, error=0.0047)
    assert jc.show.quantity_words(of) == "whirl ratio 0.0003 ± 0.0047"


@pytest.mark.wide
def test_sweep(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, mine: str):
    asked = ["sweep", mine, "--first", "8000", "--last", "12000 rpm shaft", "--count", "2", "--discard", "1"]
    found = document(capsys, *asked, "--revolutions", "10", "--out", str(tmp_path))
    model = jc.replace(jc.whole_bearing("nu2310"), load=1000.0)
    expected = jc.sweep(model, jc.rpm(8000, 12000, 2), discard=1, revolutions=10, blocks=10)
    assert found["failed"] == {} and found["load_N"] == 1000 and is_png(found["figure"])
    stored = load(found["data"])
    for i, row in enumerate(found["means"]):
        for name in ("cage_slip", "pocket_force_mean_sum_N", "friction_power_W"):
            assert row[name] == pytest.approx(float(expected[name][i].mean()), rel=1e-9)
    np.testing.assert_allclose(stored["rpm"].values, [8000, 12000])
    assert stored["label"].values.tolist() == expected["label"].values.tolist()
    configured = stored_configuration(stored)
    assert configured is not None and float(model_from(configured).load) == 1000


@pytest.mark.wide
def test_zones_map_and_runup(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    out = ["--out", str(tmp_path)]
    zones = document(capsys, "zones", *RANGE, "--count", "2", "--revolutions", "10", "--load", "1 kN", *out)
    assert zones["load_N"] == 1000 and zones["zones"][-1]["high_rpm"] == pytest.approx(1e4)
    assert sum(zone["speeds"] for zone in zones["zones"]) == 2
    mapped = document(capsys, "map", *RANGE, "--lower", "1 kN", "--points", "2x2", "--revolutions", "2", *out)
    assert mapped["y"] == "load" and mapped["y_range"] == pytest.approx([1000, 1.25 * 4450])
    models = [jc.replace(jc.whole_bearing("nu2310"), load=x) for x in mapped["y_range"]]
    each = jc.sweep(models, jc.rpm(8000, 10000, 2), initial_states=1, discard=0, revolutions=2, blocks=2)
    power = load(mapped["data"])["friction_power_W"].isel(initial_state=0)
    np.testing.assert_allclose(power, each["friction_power_W"].isel(initial_state=0).T, rtol=0.05)
    ramped = document(capsys, "runup", *RANGE[:-2], "--rate", "2400", *out)
    assert len(ramped["up"]["cage_slip"]) >= 2 and is_png(mapped["figure"]) and is_png(ramped["figure"])


@pytest.mark.wide
def test_gradient(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    names = ("guidance_gap", "cage_mass+cage_inertia")
    asked = "gradient nu2310 --speed 10000rpm --load 1kN --designs 10 --initial-states 1".split()
    asked += ["--by", *names, "--discard", "1", "--revolutions", "2"]
    found = document(capsys, *asked, "--out", str(tmp_path))
    model = jc.replace(jc.whole_bearing("nu2310"), load=1000.0)
    runs = Runs(SPEED, initial_states=1, discard=1, revolutions=2, blocks=2, exponents=0, tolerance=1e-4)
    expected = mean_gradient(model, runs, directions=names, designs=10)
    rows = {row["name"]: row for row in found["statistics"]}
    power, each = rows["friction_power_W"], expected.statistics["friction_power_W"]
    assert power["value"] == pytest.approx(each.value, rel=1e-9) and is_png(found["figure"])
    for i, name in enumerate(names):
        assert power["by"][name]["elasticity"] == pytest.approx(each.elasticity[i], rel=1e-6)
        assert power["by"][name]["error"] == pytest.approx(each.elasticity_error[i], rel=1e-6)


@pytest.mark.wide
def test_design(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    """Power alone by the gap: a wider gap drags less (Petroff), which the search finds and the check confirms."""
    asked = ["design", "nu2310", "--speed", "10000 rpm shaft", "--vary", "guidance_gap=0.4mm:0.6mm"]
    asked += ["--initial-states", "2", "--discard", "2", "--revolutions", "2", "--steps", "2"]
    asked += [x for name in ("wear", "force", "impulse", "slip", "balance") for x in ("--price", f"{name}=0")]
    found = document(capsys, *asked, "--out", str(tmp_path))
    rows = {row["name"]: row for row in found["before_and_after"]}
    power = rows["friction_power_W"]
    assert found["optimum"]["guidance_gap"] > 0.48e-3 and power["known"] and power["change"] < 0
    assert all(np.isfinite([row["before"], row["after"]]).all() for row in rows.values())


@pytest.mark.wide
def test_study(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    asked = ["study", "nu2310", "--vary", "speed=9000rpm,5000 rpm cage", "--vary", "load=1kN:2kN:2"]
    asked += "--initial-states 1 --discard 1 --revolutions 10 --out".split() + [str(tmp_path)]
    found = document(capsys, *asked)
    assert found["axes"] == {"speed": 2, "load": 2, "initial_state": 1} and sum(found["labels"].values()) == 4
    stored = jc.open_study(found["store"])
    ratio = float(jc.whole_bearing("nu2310").rolling_cage_speed(1.0))
    np.testing.assert_allclose(stored["speed"], jc.rpm(1.0) * np.array([9000, 5000 / ratio]))
    again = document(capsys, *asked)
    assert again["stored_before"] == again["stored"] == 4


@pytest.mark.wide
def test_report(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    """A page that needs nothing from outside, with what the document says."""
    asked = ["report", *RANGE, "--count", "2", "--quick", "--revolutions", "10", "--operating", "8500-9500 rpm shaft"]
    found = document(capsys, *asked, "--out", str(tmp_path))
    text = pathlib.Path(found["report"]).read_text()
    assert found["operating_rpm"] == pytest.approx([8500, 9500]) and "At 9000 rpm of the shaft" in text
    assert "data:image/svg+xml;base64," in text and "http" not in text.replace("http-equiv", "")
    ids = re.findall('id="([^"]+)"', text)
    assert len(ids) == len(set(ids)) and set(re.findall('href="#([^"]+)"', text)) <= set(ids)


def test_init(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    path = tmp_path / "mine.toml"
    assert json.dumps(document(capsys, "init", str(path), "--model", "bearing")) == json.dumps({"file": str(path)})
    assert isinstance(load_model(path), jc.BearingModel)
    assert "takes a cage" in refused(capsys, "poincare", str(path), "--speed", "1e4")
    assert "--solver" in refused(capsys, "simulate", str(path), "--speed", "1e4", "--solver", "rk4")


def test_speeds_of_the_cage_with_a_turning_outer_ring(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    """The outer ring turns the cage by itself; what it does is neither forgotten nor asked back of the shaft."""
    (path := tmp_path / "planet.toml").write_text('base = "nu2310"\nouter_speed = "1500 rpm"')
    said = refused(capsys, "sweep", str(path), "--first", "500 rpm cage", "--out", str(tmp_path / "out"))
    assert "--first must be above 898.075 rpm of the cage" in said
    planet = jc.replace(jc.whole_bearing("nu2310"), outer_speed=float(jc.rpm(1500)))
    ratio = float(planet.rolling_cage_speed(1.0) - planet.rolling_cage_speed(0.0))
    at_rest = float(planet.rolling_cage_speed(0.0)) * 30 / np.pi
    for text in ("1200 rpm cage", f"{(1200 - at_rest) / ratio:.6f} rpm shaft"):
        found = jc.files.own_rpm(planet, jc.files.read_rpm(text))
        assert found == pytest.approx((1200 - at_rest) / ratio, abs=1e-3)
    found = document(capsys, "statics", str(path), "--speed", "4000 rpm shaft", "--out", str(tmp_path))
    cage = at_rest + 4000 * ratio
    assert found["kinematics"] == pytest.approx({"cage_speed_ratio": cage / 4000, "cage_speed": cage * np.pi / 30})
    centrifugal = np.array(found["outer_loads"]) - np.array(found["inner_loads"])
    np.testing.assert_allclose(centrifugal, float(planet.bearing.roller_mass) * (cage * np.pi / 30) ** 2 * 40.5e-3)
