"""Runs that are interrupted: the answer so far, what is kept, and how they go on."""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.cli.progress import progress, report


LENGTH = {"discard": 1, "revolutions": 2, "blocks": 2}
SHORT = "--discard 1 --revolutions 2"


@pytest.fixture
def eight_at_once(monkeypatch: pytest.MonkeyPatch):
    """Eight lanes run to their end before others begin, if they are stored."""
    monkeypatch.setattr("jaxcage.lanes.run.cores", lambda: 1)


def stop_at_half(done: int, total: int) -> None:
    if done > total / 2:
        raise jc.lanes.Stop


def goes_on(store: Path, *given: Any, **settings: Any) -> None:
    """A sweep that is stopped has the finished speeds, and goes on, with another number of cores, to the data set of
    one that was not stopped."""
    whole = jc.sweep(*given, **settings)
    part = jc.sweep(*given, **settings, store=store, progress=stop_at_half)
    count = part.sizes["speed"]
    raw = jc.sweep(*given, **settings | {"confirm": False, "horizon": 0})
    assert 0 < count < whole.sizes["speed"] and part.identical(raw.isel(speed=slice(count)))
    seen: list[int] = []
    with pytest.MonkeyPatch.context() as other:
        other.setattr("jaxcage.lanes.run.cores", lambda: 3)
        again = jc.sweep(*given, **settings, store=store, progress=lambda done, total: seen.append(done))
    assert again.identical(whole) and seen[0] == part["label"].size


def test_a_stopped_sweep_goes_on(tmp_path: Path, eight_at_once: None):
    goes_on(tmp_path / "lanes.zarr", jc.case("1a"), jc.rpm(9000, 12000, 9), discard=100, revolutions=100, horizon=400)
    with pytest.raises(ValueError, match="holds another study, which differs in horizon, revolutions"):
        jc.sweep(jc.case("1a"), jc.rpm(9000, 12000, 9), discard=100, store=tmp_path / "lanes.zarr")
    with pytest.raises(jc.lanes.Stop):
        jc.sweep(jc.case("1a"), jc.rpm(9000, 12000, 9), progress=lambda done, total: stop_at_half(1, 1))


@pytest.mark.wide
def test_a_stopped_sweep_of_a_whole_bearing_goes_on(tmp_path: Path, eight_at_once: None):
    goes_on(tmp_path / "lanes.zarr", jc.whole_bearing("nu2310"), jc.rpm(8000, 12000, 6), **LENGTH)


INTERRUPTED = """
import os, signal, sys
from jaxcage.cli import main, progress
import jaxcage.lanes.run as run

def interrupt(stage, done, total):
    if done > 0.6 * total:
        os.kill(os.getpid(), signal.SIGINT)

run.cores = lambda: 1
sys.modules["jaxcage.lanes.study"].LANES = 8
if sys.argv.pop(1) == "interrupted":
    progress._timed = lambda text, bar: interrupt
sys.exit(main())
"""


def ran(out: Path, how: str, command: str) -> tuple[int, Any, str]:
    line = [sys.executable, "-c", INTERRUPTED, how, *command.split(), "--json", "--out", str(out)]
    done = subprocess.run(line, capture_output=True, text=True)
    return done.returncode, json.loads(done.stdout), done.stderr


@pytest.mark.parametrize(
    "command",
    [
        "sweep 1a --count 9 --no-confirm --horizon 0",
        pytest.param("study 1a --vary speed=9000:12000:16", marks=pytest.mark.wide),
        pytest.param("check 1a --operating 9000-9500", marks=pytest.mark.wide),
        pytest.param(f"sweep nu2310 --count 6 {SHORT}", marks=pytest.mark.wide),
    ],
)
def test_an_interrupted_command_answers_from_what_is_finished(tmp_path: Path, command: str):
    status, found, err = ran(tmp_path, "interrupted", command)
    assert status == 130 and found["partial"] is True
    assert "Interrupted: the answer from what is finished follows" in err and err.count("Interrupted") == 2
    kept = list(tmp_path.glob("*_unfinished_*.zarr"))
    assert len(kept) == ("nu2310" in command)
    status, whole, err = ran(tmp_path, "not", command)
    assert status == 0 and "partial" not in whole and not list(tmp_path.glob("*_unfinished_*.zarr"))
    if "speeds" in whole:
        assert 0 < found["speeds"] < whole["speeds"] == int(command.split()[3])
    if "stored" in whole:
        assert 0 < whole["stored_before"] == found["stored"] < whole["stored"]


@pytest.mark.wide
def test_an_interrupted_report_ends_with_the_verdict_so_far(tmp_path: Path):
    status, found, _ = ran(tmp_path, "interrupted", "report 1a --operating 9000-9500")
    assert status == 130 and found["partial"] and found["verdict"] and not list(tmp_path.glob("*.html"))


def test_unfinished_speeds_are_those_of_one_bearing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A law that is chosen, with the same numbers, makes another bearing."""
    path, kept = tmp_path / "own.toml", []

    def sweep(*_: Any, store: Path, **__: Any):
        kept.append(store)
        raise jc.lanes.Stop

    monkeypatch.setattr(jc, "sweep", sweep)
    for law in ("constant", "cylinder", "constant"):
        path.write_text(f'model = "bearing"\nbase = "nu2310"\n[drag]\ndrag_law = "{law}"\n')
        main(["sweep", str(path), "--out", str(tmp_path)])
    assert kept[0] == kept[2] != kept[1]


def test_the_time_is_estimated_if_it_is_long(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    for seconds, said in ((5.0, ["sweep 1a, lanes: 1 of 100, 8.2 min left"]), (0.4, [])):
        with progress("sweep 1a"):
            for done in range(5):
                now[0] += seconds
                report("lanes", done, 100)
        lines = capsys.readouterr().err.splitlines()
        assert lines[:1] == said
