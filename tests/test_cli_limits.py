"""What a command will take is known before it begins: what is not there is refused with the number."""

import os
from pathlib import Path

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.cli import _limits, _study, _sweep, main
from jaxcage.io import ConfigError, load_model, read_bytes
from jaxcage.studies import Plan, Study


@pytest.fixture(autouse=True)
def small_machine(monkeypatch: pytest.MonkeyPatch):
    """8 GB of memory, and whoever begins to compute fails."""
    monkeypatch.setattr(_limits, "free_memory", lambda: 8e9)
    monkeypatch.setattr(_limits, "cores", lambda: 2)
    for module, name in ((_sweep, "sweep"), (_study, "run_study")):
        monkeypatch.setattr(module, name, lambda *_, **__: pytest.fail("it was started"))


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(list(arguments)) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("Warning:")]
    assert out == "" and len(lines) == 1 and lines[0].endswith("."), err
    return lines[0]


@pytest.mark.parametrize(
    "line, said",
    [
        ("sweep 1a --count 10000000", "30000000 lanes of 600 revolutions, about 212 GB of memory, but 8 GB are free"),
        ("sweep 1a --count 350000", " GB of memory, but 8 GB are free, of which 90% may be taken: choose"),
        ("zones 1a --count 10000000", "about 212 GB of memory, but 8 GB are free: choose a smaller --count"),
        ("sweep 1a --revolutions 10000000 --count 10000", "about 347 days, more than the 90 days"),
        (
            "simulate 1a --speed 8500 --revolutions 10000000",
            "for 1 lane of 10000000 revolutions, about 205 GB",
        ),
        ("bifurcations 1a --count 10000000", "GB of memory, but 8 GB are free: choose a smaller --count"),
        ("map 1a --points 10000x10000", "100000000 lanes of 1100 revolutions, about 245 GB of memory"),
        ("report 1a --count 10000000", "30000000 lanes"),
        ("design 1a --speeds 10000000", " TB of memory, but 8 GB are free: choose a smaller --speeds or --batch"),
        ("study 1a --vary speed=1:2:3000 --vary load=1:2:10000 --strobe 300", " GB on disk, but "),
        ("study 1a --vary speed=1:2:3000000 --chunk 10000000", "GB of memory, but 8 GB are free: choose a smaller"),
    ],
)
def test_what_there_is_no_room_for_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path, line: str, said: str):
    assert said in refused(capsys, *line.split(), "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_a_full_disk_is_refused_and_a_long_run_is_announced(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    line = ["study", "1a", "--vary", "speed=1:2:20000", "--out", str(tmp_path)]
    monkeypatch.setattr(_study, "run_study", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
    assert main(line) == 130
    said = capsys.readouterr().err
    assert "Estimate: 60000 lanes of 600 revolutions, about " in said and " on disk and 60 min." in said
    monkeypatch.setattr(_limits.shutil, "disk_usage", lambda _: type("Usage", (), {"free": 1e6}))
    assert "about 2.1 MB on disk, but 1 MB are free: choose a smaller --vary" in refused(capsys, *line)


def test_a_usual_command_is_not_commented_upon(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    options = [_limits.demand_of(kind("1a"), jc.case("1a")) for kind in (_sweep.SweepOptions, _sweep.ZonesOptions)]
    assert all(each.seconds < _limits.WORTH_SAYING and each.memory < 1e8 for each in options)


def test_the_estimate_of_a_store_is_what_it_holds():
    """Uncompressed: four numbers and three codes of each lane, and what is asked for beside them."""
    grid = {"speed": np.linspace(1.0, 2.0, 50)}
    for exponents, strobe, each in ((1, 0, 35), (2, 5, 35 + 32 + 160)):
        work = Study(jc.case("1a"), Plan(grid, {}, 0, 0, 2, 50), jc.method(), 10, 20, 4, exponents, strobe)
        assert _limits.demand_of_study(work).disk == 100 * each


def test_free_memory_is_a_sensible_number(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.undo()
    assert 1e7 < _limits.free_memory() < 1e15


# Files.


@pytest.mark.parametrize("kind", ["pipe", "device", "large"])
def test_only_files_of_a_sensible_size_are_read(capsys: pytest.CaptureFixture[str], tmp_path: Path, kind: str):
    path = tmp_path / "design.toml"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with open(path, "wb") as file:
            file.truncate(10**12)  # holds nothing, and is a terabyte long
    why = "it has 1000000000000 bytes, more than the 10000000 that are read" if kind == "large" else "no regular file"
    with pytest.raises(ConfigError, match=f"must be a readable TOML file, but: .*{why}"):
        load_model(path)
    assert why in refused(capsys, "statics", str(path), "--out", str(tmp_path))
    with pytest.raises(OSError):
        read_bytes(path)
