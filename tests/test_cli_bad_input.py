"""Every bad input is refused with one sentence on standard error and exit status 2."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from jaxcage.cli import main
from jaxcage.io import ConfigError, load_model, read_bytes


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The sentence with which the command refuses `arguments`."""
    assert main(list(arguments)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    lines = [line for line in err.splitlines() if not line.startswith("Warning:")]
    assert len(lines) == 1, err
    assert lines[0].endswith(".")
    return lines[0]


WHOLE = "Interrupted: files of earlier runs are as they were, and the same command starts over.\n"
COMMANDS = (
    "init, simulate, sweep, zones, bifurcations, gradient, compare, runup, map, study, design, "
    "sensitivity, unknowns, identify, poincare, statics, impact, reproduce, report"
)


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("sweep 4z", "'4z' is unknown: it must be one of 1a, 1b, 2a, 2b, 3a, 3b"),
        ("statics 1", "'1' is unknown"),
        ("sweep nowhere.toml", "nowhere.toml' must be a readable TOML file"),
        ("sweep 1a --first 0", "--first must be a speed above 0 rpm, but 0 was given"),
        ("sweep 1a --first -100", "--first must be a speed above 0 rpm, but -100 was given"),
        ("sweep 1a --last nan", "--last must be a speed above 0 rpm, but nan was given"),
        ("sweep 1a --last inf", "--last must be a speed above 0 rpm, but inf was given"),
        ("sweep 1a --first 9000 --last 8000", "the range is 9000 to 8000 rpm"),
        ("zones 1a --first 9000 --last 9000", "the range is 9000 to 9000 rpm"),
        ("zones 1a --count 0", "--count must be at least 1, but 0 was given"),
        ("sweep 1a --count -3", "--count must be at least 1, but -3 was given"),
        ("sweep 1a --count 2.5", "--count"),
        ("sweep 1a --revolutions 0", "--revolutions must be a multiple of 10 above 0, but 0"),
        ("sweep 1a --revolutions 37", "--revolutions must be a multiple of 10 above 0, but 37"),
        ("sweep 1a --discard -1", "--discard must be at least 0, but -1 was given"),
        ("sweep 1a --exponents 0", "--exponents must be at least 1, but 0 was given"),
        ("sweep 1a --exponents 9", "--exponents must be at most 4, but 9 was given"),
        ("sweep 1a --solver euler", "--solver must be one of rodas3, rodas4"),
        ("sweep 1a --steps 0", "--steps` must be at least 1"),
        ("sweep 1a --tolerance 2", "--tolerance must lie between 0 and 1, but 2.0"),
        ("sweep 1a --steps 64 --tolerance 1e-6", "--steps and --tolerance must not both be given"),
        ("poincare 1a --speed 0", "--speed must be a speed above 0 rpm, but 0 was given"),
        ("poincare 1a --speed -8500", "--speed must be a speed above 0 rpm, but -8500"),
        ("poincare 1a --speed 8500 --revolutions 5", "--revolutions must be a multiple of 10"),
        ("poincare 1a", "--speed"),
        ("simulate 1a --speed nan", "--speed must be a speed above 0 rpm, but nan was given"),
        ("simulate 1a --speed 8500 --revolutions 0", "--revolutions must be at least 1, but 0"),
        ("simulate 1a --speed 8500 --discard -1", "--discard must be at least 0, but -1"),
        ("reproduce --constants best", "--constants"),
        ("impact 1a --speed -1", "--speed must be a speed above 0 rpm, but -1 was given"),
        ("impact 1a --speed 8500 --duration 0", "--duration must lie between 0 and 1000 ms, but 0"),
        ("impact 1a --speed 8500 --duration nan", "--duration must lie between 0 and 1000 ms"),
        ("statics 1a --load 0", "--load must be above 0 N, but 0 was given"),
        ("statics 1a --load -4450", "--load must be above 0 N, but -4450 was given"),
        ("statics 1a --load nan", "--load must be above 0 N, but nan was given"),
        ("statics 1a --shaft-speed -1", "--shaft-speed must be at least 0 rpm, but -1"),
        ("statics 1a --load 1e300", "--load must be at most 1e+07 N, but 1e+300 was given"),
        ("statics 1a --shaft-speed 1e9", "--shaft-speed must be at most 1e+06 rpm, but 1e+09 was given"),
        ("simulate 1a --speed 1e308", "--speed must be at most 1e+06 rpm, but 1e+308 was given"),
        ("sweep 1a --first 1e307 --last 1.7e308 --count 2", "must be at most 1e+06 rpm, but 1e+307 was given"),
        ("statics 1a --load heavy", 'is "heavy", which is not a number with a unit'),
        ("compare 1a 1b --at abc", '--at must be speeds and ranges like "8500, 12000-15000 rpm", but "abc" was given'),
        ("sweep", "CASE"),
        ("spin 1a", "Unrecognized options: spin"),
        ("sweep 1a --sped 3", "Unrecognized options: --sped"),
        ("", f"Expected one of {{{COMMANDS}}}"),
    ],
)
def test_bad_arguments(capsys: pytest.CaptureFixture[str], arguments: str, said: str):
    sentence = refused(capsys, *arguments.split())
    assert said.replace("`", "") in sentence.replace("`", "")


@pytest.mark.parametrize(
    "text, said",
    [
        ("guidance_gap = ", "must be valid TOML"),
        ("base = '1a'\nguidence_gap = 4e-4", "Key `guidence_gap` at the top level must be one of"),
        ("base = '1a'\n[film]\nwidth = 4e-3", "Key `width` in [film] must be one of land_width,"),
        ("base = '1a'\nguidance_gap = 0", "`guidance_gap` must be a number from 1e-05 to 0.005 m"),
        ("base = '1a'\nguidance_gap = -4e-4", "but is -0.0004 m"),
        ("base = '1a'\nguidance_gap = 0.45", "but is 0.45 m"),
        ("base = '1a'\nguidance_gap = '0.45 m'", 'but is 0.45 m (given as "0.45 m")'),
        ("base = '1a'\nguidance_gap = '0.45 kg'", 'has the unit "kg"'),
        ("base = '1a'\nguidance_gap = '0.45 fathoom'", 'the unknown unit "fathoom"'),
        ("base = '1a'\nguidance_gap = nan", "but is nan m"),
        ("base = '1a'\neccentricity = '0.5 mm'", "but is 0.5 mm in a gap of 0.45 mm"),
        ("base = '9'", "`base` must be one of 1a, 1b, 2a, 2b, 3a, 3b, but is '9'"),
    ],
)
def test_bad_configurations(capsys: pytest.CaptureFixture[str], tmp_path: Path, text: str, said: str):
    path = tmp_path / "design.toml"
    path.write_text(text)
    sentence = refused(capsys, "sweep", str(path), "--out", str(tmp_path / "out"))
    assert said in sentence
    assert str(path) in sentence
    assert not (tmp_path / "out").exists()


def test_a_folder_is_not_a_configuration(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert "must be a readable TOML file" in refused(capsys, "statics", str(tmp_path))


@pytest.mark.parametrize("command", ["sweep 1a", "zones 1a", "statics 1a", "impact 1a --speed 8500"])
@pytest.mark.parametrize("below", ["", "results"])
def test_unwritable_output_is_refused_before_the_computation(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    command: str,
    below: str,
):
    from jaxcage.cli import _sweep

    monkeypatch.setattr(_sweep, "sweep", lambda *_, **__: pytest.fail("the sweep was started"))
    occupied = tmp_path / "occupied"
    occupied.write_text("a file, not a folder")
    sentence = refused(capsys, *command.split(), "--out", str(occupied / below))
    assert "must be a folder that can be written to" in sentence
    assert occupied.read_text() == "a file, not a folder"


def test_a_name_cannot_turn_the_direction_of_writing(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """Neither on the terminal nor in the command on a page."""
    from jaxcage.cli._options import ReportOptions
    from jaxcage.cli._whole_page import command_line

    path = tmp_path / "a\u202egpj.toml"
    path.write_text("base = '1a'")
    assert "\u202e" not in command_line(ReportOptions(str(path)))
    assert main(["statics", str(path), "--out", str(tmp_path / "\u202eout")]) == 0
    out, err = capsys.readouterr()
    assert "\u202e" not in out + err and r"\u202eout" in out
    assert "\u202e" not in refused(capsys, "statics", str(path) + "x")


def test_loads_that_cannot_be_added_are_said_of_their_options(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    loads = ["--shaft-speed", "1e6", "--load", "1e-6"]
    said = refused(capsys, "statics", "1a", *loads, "--out", str(tmp_path))
    assert "Options --load and --shaft-speed must be of sizes that can be added" in said


def test_interruption(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    from jaxcage.cli import _bearing

    def interrupted(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(_bearing, "statics", interrupted)
    assert main(["statics", "1a"]) == 130
    assert capsys.readouterr().err.endswith(f".\n{WHOLE}")


@pytest.mark.wide
def test_interruption_of_a_sweep_does_not_wait_for_its_threads(tmp_path: Path):
    command = [sys.executable, "-m", "jaxcage", "sweep", "1a", "--out", str(tmp_path)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, text=True, stdout=pipe, stderr=pipe) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("Warning:")
        time.sleep(2)  # the sweep itself begins right after the warning
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=8)
    assert (process.returncode, out, err) == (130, "", WHOLE)
    assert not any(tmp_path.iterdir())


def test_errors_of_our_own_are_not_taken_for_bad_input(monkeypatch: pytest.MonkeyPatch):
    from jaxcage.cli import _bearing

    def broken(_: object) -> None:
        raise ValueError("a mistake in the library")

    monkeypatch.setattr(_bearing, "statics", broken)
    with pytest.raises(ValueError, match="a mistake in the library"):
        main(["statics", "1a"])


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
