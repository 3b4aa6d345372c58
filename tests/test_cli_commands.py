"""What the commands print and write, at tiny sizes."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.cli import main
from jaxcage.cli._show import Report, show
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


ZONE_KEYS = {
    "kind",
    "onset_rpm",
    "exit_rpm",
    "onset_uncertainty_rpm",
    "exit_uncertainty_rpm",
    "mean_life_revolutions",
    "mean_life_seconds",
    "mean_life_is_lower_bound",
    "mechanism",
    "onset_mechanism",
    "exit_mechanism",
    "width_rpm",
    "share",
}


@pytest.mark.wide
def test_zones(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "zones", "1a", *TINY, "--out", str(tmp_path))
    assert found["case"] == "1a"
    assert found["resolution_rpm"] == pytest.approx(500)
    assert found["published"] == [
        {"zone": 1, "onset_rpm": 9100.0, "exit_rpm": 12000.0},
        {"zone": 2, "onset_rpm": 25500.0, "exit_rpm": None},
    ]
    for zone in found["zones"]:
        ends = {f"{end}_{what}" for end in ("onset", "exit") for what in ("basis", "cascade_rpm", "gradient")}
        assert set(zone) == ZONE_KEYS | ends | {"width_kind"}
        assert zone["kind"] == zone["width_kind"] == "chaotic"
        assert (zone["onset_rpm"] is None) == (zone["onset_uncertainty_rpm"] is None)
        if zone["onset_rpm"] is None or zone["exit_rpm"] is None:
            assert zone["width_rpm"] is None
    assert Path(found["data"]).is_dir()


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


def test_sweep_prints_the_zone_table_beside_the_published_edges(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert main(["sweep", "1a", *TINY, "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "Chaotic zones of 1a [rpm], resolution 500 rpm" in out
    rows = out.splitlines()
    assert any(row.startswith("zone ") and row.endswith("published") for row in rows)
    assert any("9100 to 12000" in row for row in rows)
    assert any(row.endswith("25500 and up") for row in rows)
    assert f"Figure: {tmp_path / 'sweep_1a.png'}" in out
    assert f"Data: {tmp_path / 'sweep_1a.zarr'}" in out
    assert "Failed lanes: none" in out


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


def test_statics_with_a_turning_shaft(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "statics", "1a", "--shaft-speed", "10000", "--out", str(tmp_path))
    speed = 10000 * np.pi / 30 * (1 - 16 / 81) / 2
    assert found["kinematics"]["cage_speed"] == pytest.approx(speed)
    centrifugal = found["kinematics"]["roller_centrifugal_force"]
    assert centrifugal == pytest.approx(0.0423 * speed**2 * 0.0405, rel=2e-3)
    for roller in found["rollers"]:
        assert roller["outer_load"] - roller["inner_load"] == pytest.approx(centrifugal)


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


@pytest.mark.wide
@pytest.mark.parametrize("name", PUBLISHED_CASES)
def test_every_published_case_is_known(capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str):
    found = document(capsys, "statics", name, "--out", str(tmp_path))
    gap = PUBLISHED_CASES[name].guidance_gap_mm * 1e-3
    assert found["cage_displacement"]["outer_rib"] == pytest.approx(gap / 2)


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


def test_table_on_a_terminal_keeps_its_brackets_and_fits(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    zone = Zone("chaotic", Edge(9100.0, 100.0, "chaotic"), Edge(12e3, 100.0, "chaotic"), 1.0)
    zones = Zones((zone,), (), 100.0, 500.0)
    table = zones_table("1a", zones, PUBLISHED_CASES["1a"], (2500.0, 27500.0))
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    show(Report({}, [table]), as_json=False)
    out = capsys.readouterr().out
    assert "Chaotic zones of 1a [rpm], resolution 100 rpm" in out
    assert "9100 to 12000" in out and "25500 and up" in out and "…" not in out


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


@pytest.mark.wide
def test_as_a_module_from_a_shell(tmp_path: Path):
    command = [sys.executable, "-m", "jaxcage", "statics", "1a", "--json", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert json.loads(done.stdout)["case"] == "1a"


@pytest.mark.wide
def test_status_of_a_mistake_in_a_shell():
    command = [sys.executable, "-m", "jaxcage", "statics", "4z"]
    wrong = subprocess.run(command, capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
    assert wrong.stdout == ""
    assert wrong.stderr.count("\n") == 1


@pytest.mark.wide
def test_sweep_of_a_cage(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    tiny = [
        "--first",
        "9000",
        "--last",
        "13000",
        "--count",
        "5",
        "--discard",
        "20",
        "--revolutions",
        "20",
        "--horizon",
        "0",
    ]
    found = document(capsys, "sweep", "1a", *tiny, "--solver", "rk4", "--steps", "256", "--out", str(tmp_path))
    assert is_png(found["figure"])
    assert all(z["kind"] == "synchronous" for z in found["synchronous"])  # where the orbit is, not where it is lost
    closed = [z for z in found["zones"] if z["width_rpm"]]
    assert ("zoom" in found) == bool(closed)


@pytest.mark.wide
def test_programs_kept_on_disk_are_used_again_without_a_word(tmp_path: Path):
    """XLA's loader calls its own tuning flags errors on some processors: nobody should see that."""
    options = ["--speed", "8500", "--discard", "10", "--revolutions", "10", "--out", str(tmp_path)]
    command = [sys.executable, "-m", "jaxcage", "poincare", "1a", *options]
    environment = {k: v for k, v in os.environ.items() if not k.startswith("TF_CPP")}
    environment["JAXCAGE_CACHE"] = str(tmp_path / "programs")
    first, again = (subprocess.run(command, capture_output=True, text=True, env=environment) for _ in range(2))
    assert first.returncode == again.returncode == 0
    assert list((tmp_path / "programs").rglob("*")), "nothing was kept"
    assert first.stdout == again.stdout
    assert again.stderr.count("\n") == first.stderr.count("\n") == 1  # the design rule
