"""The command line: bad input gets one sentence and exit status 2, hostile files are data, signals end a run."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from helpers import refused
from matplotlib.figure import Figure

import jaxcage
from jaxcage.cli import main
from jaxcage.design import Design
from jaxcage.files import ConfigError, load_model, read_bytes


COMMANDS = """check simulate sweep zones bifurcations gradient compare runup map study design sensitivity identify
poincare statics report""".split()
STUDY = "study 1a --vary speed=9000:12000:3"
GAP = f"{STUDY} --vary guidance_gap"
WEIGHTS = " ".join(f"--price {name}=0" for name in ("wear", "force", "impulse", "power", "slip", "balance"))
REFUSED = [
    ("", "Expected one of"),
    ("spin 1a", "Unrecognized options: spin"),
    ("sweep", "CASE"),
    ("sweep 4z", "'4z'"),
    (f"sweep {'x' * 300}", "is unknown"),
    ("sweep nowhere.toml", "must be a readable TOML file"),
    ("sweep 1a --sped 3", "--sped, 3 (see jaxcage sweep --help)"),
    ("sweep 1a --first 0", "--first"),
    ("sweep 1a --count 2.5", "--count"),
    ("sweep 1a --count 1000000000000", "at most 10000000"),
    ("sweep 1a --revolutions 37", "--revolutions must be a multiple of 10"),
    ("sweep 1a --exponents 9", "--exponents must be at most 4"),
    ("sweep 1a --solver euler", "--solver must be one of"),
    ("sweep 1a --tolerance 2", "--tolerance"),
    ("sweep 1a --tolerance low", '--tolerance must be a number, but is "low"'),
    ("sweep 1a --steps 64 --tolerance 1e-6", "--steps and --tolerance"),
    ("sweep 1a --out=", "--out must name a folder"),
    ("simulate 1a --speed 1e308", "--speed must be at most 1e+06 rpm"),
    ("poincare 1a", "--speed"),
    ("poincare 1a --speed '0.45 mm'", 'has the unit "mm", where a unit like "rpm" is wanted'),
    ("statics 1a --load -4450", "--load must be above 0 N"),
    ("statics 1a --load heavy", '"heavy"'),
    ("statics 1a --speed 6e4 --load 1e-10", "--load and --speed"),
    ("runup 1a --rate 1e6", "--rate"),
    ("runup 1a --rate 1e-9", "--rate must leave two revolutions for each of 100 windows, and at most 10000000 in all"),
    ("map 1a --y gap", "--y must be a parameter (did you mean guidance_gap?), but 'gap' was given"),
    ("map 1a --lower 0.4kg", "--lower"),
    ("map 1a --lower 0.5mm", "guidance_gap = 0.00045 m between them"),
    ("map 1a --points 300", "--points must be ACROSSxUPWARDS"),
    ("map 1a --points 4x4 --persist 300", "--persist"),
    ("study 1a", "--vary must be given for the speed"),
    ("study 1a --vary speed=140Hz", "is in Hz"),
    (f"{STUDY} --vary gap=0.4mm", "'gap'"),
    (f"{STUDY} --vary speed=3000", "speed was given twice"),
    (f"{STUDY} --vary oil=1", "Option --vary viscosity_1 and viscosity_2 must not rise"),
    (f"{STUDY} --vary eccentricity=0.5mm", "must be smaller than"),
    (f"{GAP}=0.4kg", 'guidance_gap has the unit "kg"'),
    (f"{GAP}=0.4mm:0.5mm:many", "'many'"),
    (f"{GAP}=0.4mm,0.4mm", "distinct"),
    (f"{GAP}=0.5mm:0.4mm --sample 4", "must ascend"),
    (f"{GAP}=0.4mm:0.5mm", "--sample must say how many"),
    (f"{STUDY} --sample 8", "--sample needs an interval or a tolerance"),
    (f"{STUDY} --shard 1/{'9' * 5000}", "--shard must be I/N"),
    ("design 1a --price wear=100", "--price must name one of cost"),
    ("design 1a --price cost=5 --operating 9000-9500", "--price and --steps go with a search on simulations"),
    ("design 1a --search surrogate --operating 9000-9500", "--search surrogate goes without --operating"),
    ("design 1a --operating 9000-9500 --least-film thin", "--least-film must be a number in m, or one with a unit"),
    ("design 1a --operating 9000-9500 --tolerance guidance_gap=+-0.02", "must fit between 1e-05 and 0.005 m"),
    ("design 1a --vary load=1:2 --vary load=1:3", "load was given twice"),
    ("design 1a --vary eccentricity=30um:60um", "--vary must let the eccentricity become smaller"),
    ("sensitivity 1a --samples 3", "--samples must be a power of 2"),
    ("report 1a --operating fast", "--operating must be a range of speed"),
    ("check 1a --operating 8500", "--operating must be two speeds"),
    ("check 1a --operating 900-4,2e3", "without commas"),
    ("gradient 1a --speed 1e4", "--speed goes with a bearing"),
    # Whole bearings.
    ("sweep nu2310 --exponents 2", "--exponents must be at most 1"),
    ("sweep nu2310 --horizon 5", "Option --horizon must be left out for a model whose revolutions do not repeat"),
    ("runup nu2310 --last 200000", "300 m/s at its land"),
    ("compare nu2310 1a", "must be a bearing with its rollers"),
    ("gradient nu2310", "--speed must be given"),
    ("gradient nu2310 --speed 1e4 --by gap", "--by"),
    ("design nu2310 --speed 1e4 --vary load=1kN:5kN", "--vary must name one of"),
    (f"design nu2310 --speed 1e4 {WEIGHTS}", "--price must be at least 0 and not all 0"),
    ("sensitivity nu2310 --speed 1e4 --of noise", "--of must be one of"),
    ("study nu2310 --vary load=1kN", "--vary must be given for the speed"),
]


@pytest.mark.parametrize("arguments, said", REFUSED, ids=[arguments[:60] for arguments, _ in REFUSED])
def test_bad_arguments(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: str, said: str
):
    monkeypatch.chdir(tmp_path)
    assert said.replace("`", "") in refused(capsys, *shlex.split(arguments)).replace("`", "")
    assert not any(path.is_file() for path in tmp_path.rglob("*"))


@pytest.mark.wide
@pytest.mark.parametrize("command", COMMANDS)
def test_nan_and_infinity_are_refused_in_every_option(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, command: str
):
    """The options are those that `--help` lists with a number."""
    monkeypatch.chdir(tmp_path)
    assert main([command, "--help"]) == 0
    listed = capsys.readouterr().out
    flags = re.findall(r"^[│ ] +(--[a-z-]+) (?:INT|FLOAT|RPM)\b", listed, flags=re.M)
    assert flags or command == "identify"
    cases = {"compare": ["1a", "1b"], "identify": ["1a", "data.csv"], "check": ["1a", "--operating=9000-9500"]}
    cases = cases.get(command, ["1a"])
    speed = ["--speed=8500"] if command in ("simulate", "poincare") else []
    for flag in flags:
        for wrong in ("nan", "inf", "-inf"):
            needed = cases + (speed if flag != "--speed" else [])
            assert main([command, *needed, f"{flag}={wrong}"]) == 2, f"{flag}={wrong}"
            assert flag in capsys.readouterr().err


@pytest.mark.parametrize("wrong", ["nan", "1e999"])
@pytest.mark.parametrize(
    "line",
    [
        "study 1a --vary speed={}",
        "study 1a --vary speed=8500 --vary guidance_gap=0.4mm+-{} --sample 8",
        "design 1a --vary guidance_gap={}:0.6mm",
        "map 1a --points 4x4 --upper {}",
        "report 1a --operating 8500-{}",
    ],
)
def test_nan_and_infinity_are_refused_within_texts(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, line: str, wrong: str
):
    option = [word for word in line.partition("{}")[0].split() if word.startswith("--")][-1]
    assert f"Option {option}" in refused(capsys, *line.format(wrong).split(), "--out", str(tmp_path))


@pytest.mark.parametrize("below", ["", "results"])
def test_unwritable_output_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path, below: str):
    occupied = tmp_path / "occupied"
    occupied.write_text("a file, not a folder")
    for command in ("sweep 1a", "statics 1a"):
        sentence = refused(capsys, *command.split(), "--out", str(occupied / below))
        assert "must be a folder that can be written to" in sentence
    assert occupied.read_text() == "a file, not a folder"


def test_control_characters_of_a_name_are_not_printed(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    path = tmp_path / "a\u202egpj.toml"
    path.write_text("base = '1a'")
    assert main(["statics", str(path), "--out", str(tmp_path / "\u202eout")]) == 0
    out, err = capsys.readouterr()
    assert "\u202e" not in out + err and r"\u202eout" in out
    assert "\u202e" not in refused(capsys, "statics", str(path) + "x")


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
    why = "more than the 10000000 that are read" if kind == "large" else "no regular file"
    with pytest.raises(ConfigError, match=f"must be a readable TOML file, but: .*{why}"):
        load_model(path)
    assert why in refused(capsys, "statics", str(path), "--out", str(tmp_path))
    with pytest.raises(OSError):
        read_bytes(path)


@pytest.mark.wide
@pytest.mark.parametrize("sent, status", [((signal.SIGINT, signal.SIGINT), 130), ((signal.SIGTERM,), 143)])
def test_a_sweep_ends_at_once_that_is_interrupted_twice_or_told_to_end(
    tmp_path: Path, sent: tuple[signal.Signals, ...], status: int
):
    command = [sys.executable, "-m", "jaxcage", "sweep", "1a", "--out", str(tmp_path)]
    with subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None and process.stderr.readline().startswith("Warning:")
        time.sleep(2)  # the sweep itself begins right after the warning
        for each in sent:
            process.send_signal(each)
            time.sleep(0.3)
        out, err = process.communicate(timeout=8)
    assert (process.returncode, out) == (status, "")
    assert err.startswith("Interrupted: ") and err.count("Interrupted") <= len(sent) and not any(tmp_path.iterdir())


MODULES = """
import sys
from jaxcage.cli import main
status = main(sys.argv[1:])
print(status, sorted({"jax", "scipy", "matplotlib"} & set(sys.modules)))
"""


@pytest.mark.parametrize(
    "arguments, status", [("--version", 0), ("sweep --help", 0), ("sweep 1a --sped 3", 2), ("init new.toml", 0)]
)
def test_help_version_init_and_errors_of_typing_load_no_jax(tmp_path: Path, arguments: str, status: int):
    command = [sys.executable, "-c", MODULES, *arguments.split()]
    lines = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path).stdout.splitlines()
    assert lines[-1] == f"{status} []"
    if arguments == "--version":
        assert lines[0] == f"jaxcage {jaxcage.__version__}"


def test_a_balance_grade_replaces_the_usual_bounds_of_the_eccentricity(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    def design_for(model, operating, vary, *args, **more):
        raise OSError(f"varied: {', '.join(vary)}")

    monkeypatch.setattr(jaxcage, "design_for", design_for)
    for given, varied in (
        ("guidance_gap=+-0.02 mm", "guidance_gap, eccentricity"),
        ("eccentricity=G6.3", "guidance_gap"),
    ):
        assert main(["design", "1a", "--operating", "12600-17600", "--tolerance", given]) == 1
        assert capsys.readouterr().err.splitlines()[-1] == f"varied: {varied}"


def test_a_search_without_a_design_ends_with_status_1(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    model, none = jaxcage.case("1a"), dict.fromkeys(("before", "after", "short", "prices", "worst"), {})
    same: dict = dict(model=model, values={}, cost=2.0, cost_before=2.0, requirements=[], evaluations=1, checked=None)
    found = Design(**same, **none, feasible=False, conflict=(), at_bound=(), budget=[], notes=(), path=[], lost="none")
    monkeypatch.setattr(jaxcage, "design_for", lambda *_, **__: found)
    monkeypatch.setattr(jaxcage.show, "calm_figure", lambda *_: Figure())
    assert main(["design", "1a", "--operating", "12600-17600", "--out", str(tmp_path)]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == "No design was found that keeps all requirements."
