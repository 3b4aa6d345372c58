"""Commands for a cage: what they compute, print and store, at small sizes, beside the same calls of the library."""

import html
import json
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from helpers import document, is_png, raw_sweep, read_columns, refused

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.files import load_model, read_bearing, write_template
from jaxcage.lanes import load


RK4 = ["--solver", "rk4", "--steps", "256"]
LENGTH = ["--discard", "20", "--revolutions", "20"]
TINY = ["--first", "12000", "--last", "13000", "--count", "3", *LENGTH, "--horizon", "0", "--no-confirm", *RK4]
RATIO = (1 - 16 / 81) / 2
"""(7)-(8) of an NU2310 whose outer ring stands still: half of 1 - d_w/d_m."""


def test_sweep(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "sweep", "1a", *TINY, "--out", str(tmp_path))
    stored = load(found["data"])
    assert sum(found["labels"].values()) == 9 and found["failed"] == {} and is_png(found["figure"])
    length = dict(discard=20, revolutions=20, blocks=20, horizon=0, confirm=False)
    own = jc.sweep(jc.case("1a"), jc.rpm(12000, 13000, 3), method=jc.method("rk4", steps=256), **length)
    np.testing.assert_allclose(stored.last, own.last, rtol=1e-9)
    np.testing.assert_array_equal(stored.label, own.label)
    assert json.loads(load(found["data"]).attrs["configuration"])["cage_mass"] == float(jc.case("1a").cage_mass)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["sweep_1a.png", "sweep_1a.zarr"]


@pytest.mark.wide
def test_poincare(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "poincare", "1a", "--speed", "15000", *LENGTH, *RK4, "--out", str(tmp_path))
    columns = read_columns(found["data"])
    assert columns["revolution"].tolist() == 3 * list(range(21, 41))
    assert [start["initial_state"] for start in found["initial_states"]] == [1, 2, 3]
    length = dict(discard=20, revolutions=20, blocks=20, method=jc.method("rk4", steps=256))
    strobe = jc.sweep(jc.case("1a"), jc.rpm(15000), **length)["strobe"].values[0]
    assert columns["y_C [m]"] == pytest.approx(strobe[..., 1].ravel(), rel=1e-10)
    assert is_png(found["figure"])


def test_simulate(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    asked = "simulate 1a --speed 15000 --revolutions 3 --discard 0".split()
    found = document(capsys, *asked, *RK4, "--out", str(tmp_path))
    assert found["outcome"] == "successful" and found["measures"]["drag_power"] > 0 and is_png(found["figure"])
    columns, mass = read_columns(found["data"]), float(jc.case("1a").cage_mass)
    assert columns["time [s]"].size == 3 * 256
    assert columns["time [s]"][256] == pytest.approx(60 / 15000, rel=1e-9)
    assert columns["weight_y [N]"] == pytest.approx(np.full(768, -mass * 9.81), rel=1e-9)
    amplitude = 2 * mass * 0.023 / 0.45 * 1e-3 * (15000 * np.pi / 30) ** 2  # (20) as printed, in mm
    assert columns["unbalance_x [N]"].max() == pytest.approx(amplitude, rel=1e-9)


@pytest.mark.wide
def test_a_simulation_that_fails_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    arguments = ["--speed", "2500", "--solver", "rk4", "--steps", "8", "--out", str(tmp_path)]
    assert main(["simulate", "1a", *arguments]) == 1
    out, err = capsys.readouterr()
    assert out == "" and "The simulation at 2500 rpm of the cage" in err and not any(tmp_path.iterdir())


def test_statics(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """Three rollers carry 4450 N, as the physics page prints it."""
    found = document(capsys, "statics", "1a", "--load", "4.45 kN", "--out", str(tmp_path))
    assert found["max_load"] == pytest.approx(2420, rel=1e-3)
    assert found["shaft_shift"] == pytest.approx(26.1e-6, rel=1e-3)
    assert math.degrees(found["half_angle"]) == pytest.approx(40.0, rel=1e-3)
    assert len(found["roller_angles"]) == 13
    assert np.dot(found["inner_loads"], -np.sin(found["roller_angles"])) == pytest.approx(4450, rel=1e-9)
    shift = found["shaft_shift"]
    assert found["cage_displacement"] == pytest.approx(
        {"outer_rib": 0.225e-3, "inner_rib": shift + 0.225e-3, "roller": shift + 0.3e-3}
    )
    assert found["kinematic_viscosity"] == pytest.approx(56e-6, rel=1e-9)
    assert found["kinematics"]["cage_speed_ratio"] == pytest.approx(RATIO, rel=1e-9)
    assert read_columns(found["data"])["inner load [N]"].max() == pytest.approx(found["max_load"])
    assert is_png(found["figure"])


def test_a_speed_may_be_the_shafts_or_the_cages(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = lambda *given: document(capsys, *given, "--out", str(tmp_path))
    cage = found("statics", "1a", "--speed", "10000 rpm cage")
    shaft = found("statics", "1a", "--speed", f"{10000 / RATIO!r} rpm shaft")
    assert cage["inner_loads"] == shaft["inner_loads"] and cage["kinematics"] == shaft["kinematics"]
    assert cage["kinematics"]["cage_speed"] == pytest.approx(10000 * math.pi / 30)
    run = lambda *given: found("simulate", *given, "--revolutions", "1", *RK4)
    one = run("1a", "--speed", "20000 rpm shaft")
    assert one["shaft_speed_rpm"] == pytest.approx(20000) and one["speed_rpm"] == pytest.approx(20000 * RATIO)
    path = write_template(tmp_path / "mine.toml")  # its speeds are the shaft's
    assert read_bearing(path).speeds == "shaft"
    assert run(str(path), "--speed", "20000")["speed_rpm"] == pytest.approx(20000 * RATIO)


def test_an_answer_begins_with_the_speed_that_the_file_means(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    (path := tmp_path / "mine.toml").write_text('base = "1a"\nspeeds = "shaft"')
    asked = ["--speed", "20000", "--revolutions", "1", "--discard", "0", *RK4, "--out", str(tmp_path)]
    assert main(["simulate", str(path), *asked]) == 0
    assert capsys.readouterr().out.startswith("At 20000 rpm of the shaft (cage 8025 rpm): largest eccentricity ratio")


def test_estimated_values_are_printed(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """A gap of 0.5 mm is wider than the pocket clearance that is estimated for an NU 220, as the warning says."""
    path = tmp_path / "mine.toml"
    path.write_text('base = "1a"\nguidance_gap = "0.5 mm"\n[bearing]\ndesignation = "NU220"\n')
    assert main(["statics", str(path), "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert out.count("displacement of the cage") == 1  # for the guide that the file has, and no other
    clearances = "bearing.radial_clearance = 67.5 µm, bearing.pocket_clearance = 0.412 mm"  # 67.5: ISO 5753-1
    assert f"{clearances}, bearing.effective_length = 22.5 mm" in out
    assert "T is estimated: give pocket_clearance below [bearing]" in err


def test_init_writes_a_new_file_only(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    path = tmp_path / "my_bearing.toml"
    assert document(capsys, "init", str(path)) == {"file": str(path)}
    assert float(load_model(path).guidance_gap) == pytest.approx(0.45e-3)
    path.write_text("mine")
    assert "must be a new one" in refused(capsys, "init", str(path)) and path.read_text() == "mine"
    assert "must end in .toml" in refused(capsys, "init", str(tmp_path / "bearing.txt"))
    assert "No such file" in refused(capsys, "init", str(tmp_path / "no/such/b.toml"))


# Synchronous orbits: from 10000 to 13500 rpm the one of case 1a is lost below a period doubling.

RANGE = ["1a", "--first", "10000", "--last", "13500"]
EXIT = 12355.5353


@pytest.mark.wide
def test_bifurcations(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "bifurcations", *RANGE, "--count", "8", "--out", str(tmp_path))
    (point,), (zone,) = found["points"], found["unstable_ranges"]
    assert point["kind"] == "period-doubling" and point["speed_rpm"] == pytest.approx(EXIT, abs=2e-3)
    assert point["multiplier"] == pytest.approx([-1.0, 0.0], abs=1e-6)
    assert zone["onset_rpm"] is None and zone["exit_rpm"] == point["speed_rpm"]
    columns = read_columns(found["data"])
    size = np.hypot(columns["multiplier 1 (real part)"], columns["multiplier 1 (imaginary part)"])
    assert np.array_equal(columns["stable"] == 1, size < 1)
    assert is_png(found["figure"]) and is_png(found["multipliers"])


@pytest.mark.wide
def test_zones(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    small = ["--count", "8", "--discard", "50", "--revolutions", "50", "--quick"]
    found = document(capsys, "zones", *RANGE, *small, "--out", str(tmp_path))
    for zone in (found["zones"][0], found["unstable_ranges"][0]):
        assert zone["exit_rpm"] == pytest.approx(EXIT, abs=2e-3) and zone["exit_mechanism"] == "period-doubling"
    assert load(found["data"])["rpm"].values == pytest.approx(np.linspace(10000, 13500, 8))


@pytest.mark.wide
def test_report(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """The command and its page begin with the answer of `check`, whose margin is that to the exact edge."""
    small = ["--count", "8", "--discard", "50", "--revolutions", "50", "--quick", "--operating", "13000-13500 rpm"]
    assert main(["report", *RANGE, *small, "--out", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.partition("\n\n")[0].split())
    assert f"{100 * (1 - EXIT / 13000):.2g} % of its speed away" in said
    text = Path(tmp_path, "report_1a.html").read_text()
    assert said in html.unescape(text.partition("<h2>Verdict</h2>")[2].partition("</p>")[0])
    titles = "Verdict", "Zones", "The synchronous orbit", "Stability map", "Statics"
    assert all(f"<h2>{title}</h2>" in text for title in titles)
    assert "Minimum load against skidding at 33646 rpm of the shaft" in text.partition("<h2>Statics</h2>")[2]
    assert main(["check", "1a", "--operating", "13000-13500 rpm", "--out", str(tmp_path)]) == 0
    assert " ".join(capsys.readouterr().out.partition("\n\n")[0].split()) == said


def test_a_range_is_named_by_the_speeds_that_were_given(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """A file whose bare speeds are those of the shaft, of a cage without an edge."""
    file = str(write_template(tmp_path / "mine.toml", short=True))
    assert main(["gradient", file, "--first", "9000", "--last", "9500", "--count", "3"]) == 1
    said = "ends within 9000 to 9500 rpm of the shaft: there is no edge"
    assert said in " ".join(capsys.readouterr().err.split())
    few = "--first 9000 --last 9500 --count 2 --samples 2 --quick --out".split()
    light = tmp_path / "light.toml"  # its support damps it: exponents are about -0.3
    light.write_text(Path(file).read_text().replace('"brass" ', '"PA66-GF25" '))
    assert main(["sensitivity", str(light), *few, str(tmp_path)]) == 0
    assert capsys.readouterr().out.startswith("No design is chaotic within 9000 to 9500 rpm of the shaft: there is no")
    said = "but the range is 9000 to 8000 rpm of the shaft."
    assert refused(capsys, "gradient", file, "--first", "9000", "--last", "8000").endswith(said)


@pytest.mark.wide
def test_gradient(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """Elasticities of a speed by mass, length and time add up to the powers in its unit."""
    found = document(capsys, "gradient", *RANGE, "--count", "8", "--out", str(tmp_path))
    (edge,) = found["edges"]
    assert edge["trusted"] and edge["speed_rpm"] == pytest.approx(EXIT, abs=2e-3) and is_png(found["figure"])
    assert all(abs(left) < 1e-9 for left in edge["homogeneity"].values())
    gap = float(jc.case("1a").guidance_gap)
    slope = edge["derivative"]["guidance_gap"]
    assert edge["elasticity"]["guidance_gap"] == pytest.approx(slope * gap / edge["speed_rpm"], rel=1e-9)


@pytest.mark.wide
def test_map_of_an_edge(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    short = ["--points", "4x3", "--discard", "10", "--revolutions", "20"]
    found = document(capsys, "map", *RANGE, *short, "--steps", "128", "--out", str(tmp_path))
    (edge,) = found["curves"]
    assert (found["x"], found["y"], edge["kind"]) == ("speed", "guidance_gap", "period-doubling")
    order = np.argsort(edge["y"])
    assert np.interp(0.45e-3, np.array(edge["y"])[order], np.array(edge["x"])[order]) == pytest.approx(EXIT, abs=5.0)
    assert read_columns(found["curve_data"])["guidance_gap [mm]"] == pytest.approx(1e3 * np.array(edge["y"]))
    assert is_png(found["figure"])


@pytest.mark.wide
def test_map_of_labels(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    asked = ["--points", "9x7", "--discard", "10", "--revolutions", "20", "--steps", "64", "--quick"]
    found = document(capsys, "map", "1a", *asked, "--first", "3000", "--last", "9000", "--out", str(tmp_path))
    assert found["points"] == [9, 7] and sum(found["labels"].values()) == 63 and is_png(found["figure"])
    data = xr.open_zarr(found["data"], consolidated=False, chunks=None)
    assert data["label"].dims == ("speed", "guidance_gap", "initial_state") and int(np.min(data["label"])) >= 0
    np.testing.assert_allclose(data["speed"], jc.rpm(3000, 9000, 9), rtol=1e-14)


@pytest.mark.wide
def test_study_is_stored_and_goes_on(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    asked = "study 1a --vary speed=9000:12000rpm:6 --vary guidance_gap=0.4mm:0.5mm:2 --initial-states 2".split()
    asked += "--discard 10 --revolutions 20 --solver rk4 --steps 128".split() + ["--out", str(tmp_path)]
    whole = document(capsys, *asked, "--shard", "1/2")  # 24 lanes are one chunk
    assert whole["axes"] == {"speed": 6, "guidance_gap": 2, "initial_state": 2}
    assert (whole["lanes"], whole["stored"], whole["stored_before"]) == (24, 24, 0)
    assert document(capsys, *asked)["stored_before"] == 24
    assert "differs in discard" in refused(capsys, *asked, "--discard", "20")
    assert "but 2/2 has none" in refused(capsys, *asked, "--shard", "2/2", "--out", str(tmp_path / "other"))
    stored = jc.open_study(whole["store"])
    model, speeds = jc.replace(jc.case("1a"), guidance_gap=0.5e-3), jc.rpm(9000, 12000, 6)
    length = dict(discard=10, revolutions=20, blocks=20, keep=16, method=jc.method("rk4", steps=128))
    swept, mine = raw_sweep(model, speeds, initial_states=2, **length), stored.isel(guidance_gap=1)
    # rounding grows with the exponent: 30 revolutions are short enough
    np.testing.assert_allclose(mine["exponents"], swept["exponents"], rtol=0, atol=1e-3)
    np.testing.assert_allclose(mine["peak"], swept["peak"], rtol=0, atol=1e-3)
    counts = dict(zip(*np.unique(stored["label"].values, return_counts=True), strict=True))
    assert whole["labels"] == counts and sum(counts.values()) == 24


@pytest.mark.wide
def test_compare(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    other = tmp_path / "narrow.toml"
    other.write_text('base = "1a"\nguidance_gap = "0.3 mm"\n[bearing]\nroller_diameter = "15 mm"\n')
    found = document(capsys, "compare", "1a", str(other), *TINY, "--out", str(tmp_path))
    assert {row["name"] for row in found["differences"]} == {"guidance_gap", "bearing.roller_diameter"}
    first, second = found["designs"]["1a"], found["designs"]["narrow"]
    assert first["speed_rpm"] == pytest.approx([12000, 12500, 13000])
    assert second["shaft_speed_rpm"] == pytest.approx(first["shaft_speed_rpm"])
    assert is_png(found["figure"])


@pytest.mark.wide
def test_runup(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    asked = "--first 14000 --last 15000 --rate 500 --discard 20".split()
    found = document(capsys, "runup", "1a", *asked, *RK4, "--out", str(tmp_path))
    up, down, columns = found["up"], found["down"], read_columns(found["data"])
    assert found["ramp_seconds"] == pytest.approx(2.0, rel=0.1)
    assert up["rpm"] == pytest.approx(down["rpm"], rel=2e-3) and up["rpm"][0] < 14100
    assert columns["size up [m]"] == pytest.approx(up["size"])
    assert columns["shaft speed [rpm]"] * found["cage_speed_ratio"] == pytest.approx(columns["cage speed [rpm]"])


@pytest.mark.wide
def test_a_design_that_breaks_the_design_rule_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """The gap that a design of 1a asks for, 0.63 mm, is wider than these pockets are clear."""
    (path := tmp_path / "wide.toml").write_text('base = "1a"\n[bearing]\npocket_clearance = "0.5 mm"')
    assert main(["design", str(path), "--operating", "31500-44000 rpm shaft", "--out", str(tmp_path)]) == 0
    assert "breaks the design rule T > C_r > G_r: Pocket clearance T = 0.5 mm" in capsys.readouterr().out


@pytest.mark.wide
def test_design_and_sensitivity(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """A search too short to find much; balance in closed form."""
    few = ["--first", "8000rpm", "--last", "14000rpm", "--count", "6", "--out", str(tmp_path)]
    search = ["--steps", "1", "--discard", "20", "--revolutions", "20"]
    found = document(capsys, "design", "1b", *few, *search)
    rows = {row["name"]: row for row in found["before_and_after"]}
    change = rows["objective"]["change"]
    assert is_png(found["figure"]) and found["better"] == (rows["objective"]["known"] and change < 0)
    stays = found["optimum"]["guidance_gap"] == pytest.approx(0.6e-3, rel=1e-12)
    assert stays == all(row["change"] == 0 for row in rows.values())
    assert found["vary"]["eccentricity"] == pytest.approx([4.6e-6, 23e-6])  # no worse balanced than it is
    grade = 23e-6 * 14000 * np.pi / 30 * 1e3  # [mm/s]
    assert rows["balance_grade_mm_per_s"]["before"] == pytest.approx(grade, rel=0.01)  # the highest speed of the grid
    shares = document(capsys, "sensitivity", "1a", *few, "--samples", "2", "--quick")
    assert {row["value"] for row in shares["sobol"]} == {"guidance_gap", "eccentricity"} and shares["budgets"] == []
