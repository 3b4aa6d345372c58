"""What the commands print and write, at tiny sizes."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.cli import main
from jaxcage.io import load_sweep, open_sweep, read_columns
from jaxcage.report import zones_table


TINY = ["--first", "12000", "--last", "13000", "--count", "3", "--discard", "20", "--revolutions"]
TINY += ["20", "--horizon", "0", "--no-confirm", "--solver", "rk4", "--steps", "256"]
PNG = b"\x89PNG\r\n"


def document(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """The only thing that `arguments` with --json print on standard output."""
    assert main([*arguments, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err.startswith("Warning: the design rule T > C_r > G_r is broken: ")
    assert err.count("\n") <= 2
    return json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def is_png(path: str) -> bool:
    return Path(path).read_bytes().startswith(PNG)


def test_sweep(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "sweep", "1a", *TINY, "--out", str(tmp_path))
    assert sum(found["labels"].values()) == 9
    assert found["failed"] == {}
    assert found["beyond_clearance"] >= 0
    assert found["seconds"] > 0
    assert is_png(found["figure"])
    stored = load_sweep(found["data"])
    assert stored.rpm == pytest.approx([12000, 12500, 13000])
    assert (stored.discard, stored.revolutions) == (20, 20)
    length = dict(discard=20, revolutions=20, blocks=20, horizon=0, confirm=False)
    own = jc.sweep(jc.case("1a"), jc.rpm(12000, 13000, 3), method=jc.method("rk4", steps=256), **length)
    np.testing.assert_allclose(stored.last, own.last, rtol=1e-9)
    np.testing.assert_array_equal(stored.label, own.label)
    assert json.loads(open_sweep(found["data"]).attrs["configuration"])["cage_mass"] == float(jc.case("1a").cage_mass)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["sweep_1a.png", "sweep_1a.zarr"]


@pytest.mark.wide
def test_poincare(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    arguments = ["--speed", "15000", "--discard", "20", "--revolutions", "20", "--solver", "rk4", "--steps", "256"]
    found = document(capsys, "poincare", "1a", *arguments, "--out", str(tmp_path))
    assert [start["start"] for start in found["starts"]] == [1, 2, 3]
    columns = read_columns(found["data"])
    assert columns["revolution"].tolist() == 3 * list(range(21, 41))
    for start in found["starts"]:
        rows = columns["start"] == start["start"]
        assert columns["y_C [m]"][rows] == pytest.approx(np.array(start["y_C"]), rel=1e-10)
        assert columns["vy_C [m/s]"][rows] == pytest.approx(np.array(start["vy_C"]), rel=1e-10)
    assert is_png(found["figure"])


def test_simulate(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    arguments = ["--speed", "15000", "--revolutions", "3", "--solver", "rk4", "--steps", "256", "--out", str(tmp_path)]
    found = document(capsys, "simulate", "1a", *arguments)
    assert found["outcome"] == "successful"
    assert found["measures"]["drag_power"] > 0
    columns, mass = read_columns(found["data"]), float(jc.case("1a").cage_mass)
    assert columns["time [s]"].size == 3 * 128
    assert columns["time [s]"][128] == pytest.approx(60 / 15000, rel=1e-9)
    assert columns["y_C [m]"][0] == pytest.approx(-0.45e-3 / 2, rel=1e-9)
    assert columns["weight_y [N]"] == pytest.approx(np.full(384, -mass * 9.81), rel=1e-9)
    amplitude = 2 * mass * 0.023 / 0.45 * 1e-3 * (15000 * np.pi / 30) ** 2  # (20) as printed, in mm
    assert columns["unbalance_x [N]"].max() == pytest.approx(amplitude, rel=1e-9)
    assert is_png(found["figure"])


@pytest.mark.wide
def test_simulation_that_fails_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    arguments = ["--speed", "2500", "--solver", "rk4", "--steps", "8", "--out", str(tmp_path)]
    assert main(["simulate", "1a", *arguments]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "The simulation at 2500 rpm failed (outside)" in err or "failed (not_finite)" in err
    assert not any(tmp_path.iterdir())


def test_statics(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "statics", "1a", "--load", "4450", "--out", str(tmp_path))
    assert found["max_load"] == pytest.approx(2420, rel=1e-3)
    assert found["shaft_shift"] == pytest.approx(26.1e-6, rel=1e-3)
    assert math.degrees(found["half_angle"]) == pytest.approx(40.0, rel=1e-3)
    assert len(found["rollers"]) == 13
    held = sum(r["inner_load"] * -math.sin(r["angle"]) for r in found["rollers"])
    assert held == pytest.approx(4450, rel=1e-9)
    shift = found["shaft_shift"]
    assert found["cage_displacement"] == pytest.approx(
        {"outer_rib": 0.225e-3, "inner_rib": shift + 0.225e-3, "roller": shift + 0.3e-3}
    )
    assert found["kinematics"]["cage_speed_ratio"] == pytest.approx(0.4012, abs=1e-4)
    assert read_columns(found["data"])["inner load [N]"].max() == pytest.approx(found["max_load"])
    assert is_png(found["figure"])


@pytest.mark.wide
def test_impact(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "impact", "1a", "--speed", "8500", "--out", str(tmp_path))
    omega = 8500 * np.pi / 30
    assert found["approach_speed"] == pytest.approx(0.45 * omega * 0.3e-3)
    columns = read_columns(found["data"])
    assert columns["time [s]"][-1] == pytest.approx(0.6e-3)
    assert columns["contact_force [N]"].max() == pytest.approx(found["peak_contact_force"])
    assert columns["contact_force [N]"].min() == 0
    assert columns["bar_force [N]"].min() == pytest.approx(found["lowest_bar_force"])
    # The roller leaves faster than it came by nothing: it cannot give more than twice its momentum.
    assert 0 < found["impulse"] < 2 * 0.0424 * found["approach_speed"]
    assert found["bar"]["bar_mass"] == float(jc.forces.PocketImpact().bar_mass)
    assert is_png(found["figure"])


def test_a_configuration_file_in_place_of_a_case(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    design = tmp_path / "wide.toml"
    design.write_text('base = "1a"\nguidance_gap = "0.28 mm"\n')
    assert main(["statics", str(design), "--out", str(tmp_path), "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["case"] == "wide"
    assert json.loads(out)["cage_displacement"]["outer_rib"] == pytest.approx(0.14e-3)
    assert err == ""  # T = 0.3 mm > C_r = 0.28 mm: the design rule holds


def test_zone_table_puts_published_zones_beside_those_found():
    found = (
        Zone("chaotic", Edge(8000.0, 100.0, "chaotic"), Edge(9000.0, 100.0, "chaotic"), 1.0),
        Zone("chaotic", Edge(9500.0, 100.0, "chaotic", "Neimark-Sacker"), Edge(13e3, 90.0, "chaotic"), 0.5),
    )
    zones = Zones(found, (), 100.0, 500.0)
    swept = (2500.0, 27500.0)
    table = zones_table("1a", zones, PUBLISHED_CASES["1a"], swept)
    assert [row[-1] for row in table.rows] == ["-", "9100 to 12000", "25500 and up"]
    assert [row[1] for row in table.rows] == ["8000 ± 100", "9500 ± 100", "not found"]
    assert table.rows[1][3:6] == ("3500", "Neimark-Sacker / unknown", "50%")
    empty = zones_table("design", Zones((), (), 100.0, 500.0), None, swept)
    assert [row[0] for row in empty.rows] == ["none"]


def test_help_of_every_command(capsys: pytest.CaptureFixture[str]):
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out
    commands = ("simulate", "sweep", "zones", "bifurcations", "gradient", "map", "poincare", "statics", "impact")
    for command in commands:
        assert command in listed
        assert main([command, "--help"]) == 0
        text = capsys.readouterr().out
        assert "CASE" in text and "--json" in text and "--out" in text
    assert main(["reproduce", "--help"]) == 0
    text = capsys.readouterr().out
    assert "CASE" not in text and "--quick" in text and "--json" in text
