"""Hostile files and command lines are refused with one sentence, or mean what they say; nothing in them is run."""

import json
import pickle
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import jax
import numcodecs
import numpy as np
import pytest
import zarr
from hypothesis import HealthCheck, Phase, given, settings


jax.config.update("jax_enable_x64", True)  # the strategies hold models

import hostile

import jaxcage as jc
from jaxcage.cli import _sweep, main
from jaxcage.io import (
    ConfigError,
    _config,
    configuration,
    load_model,
    model_from,
    open_sweep,
    read_columns,
    save_model,
    to_si,
)
from jaxcage.studies import open_study


fuzzed = settings(
    max_examples=120,
    derandomize=True,
    database=None,
    deadline=None,
    phases=[Phase.generate, Phase.shrink],
    suppress_health_check=list(HealthCheck),
)


@pytest.mark.wide
@fuzzed
@given(hostile.files())
def test_files(tmp_path: Path, data: bytes):
    hostile.check_file(data, tmp_path / "design.toml")


@pytest.mark.wide
def test_command_lines(tmp_path: Path):
    with hostile.playground(tmp_path), hostile.without_computing() as understood:

        @fuzzed
        @given(hostile.lines())
        def check(line: hostile.Line):
            hostile.check_line(line, understood)

        check()


@pytest.mark.wide
def test_calls_among_all():
    """In a process of its own: the tests' check of types would come before that of the library."""
    found = subprocess.run([sys.executable, "-m", "benchmarks.fuzz", "--count", "150"], capture_output=True, text=True)
    assert found.returncode == 0, found.stdout[-3000:] + found.stderr[-3000:]


# The checks themselves can fail.


@pytest.mark.parametrize(
    "data", [b"base = '1a'\n[film]\nland_wdith = 2e-3", b"base = '1a'\n[flim]", b"base = '1a'\n[bearing]\nx = {}"]
)
def test_a_reader_that_drops_what_it_does_not_know_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, data: bytes
):
    assert not hostile.check_file(data, tmp_path / "design.toml")
    monkeypatch.setattr(_config, "_refuse_unknown", lambda *_: None)
    with pytest.raises(hostile.SilentDefault):
        hostile.check_file(data, tmp_path / "design.toml")


@pytest.mark.parametrize(
    "data",
    [b"base = '1a'\nguidance_gap = '0.5 mm'", b"base = '1a'\n[film]\nn_lands = 1", b"base = '1a'\nload = 100"],
)
def test_a_reader_that_takes_the_default_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, data: bytes):
    assert hostile.check_file(data, tmp_path / "design.toml")
    monkeypatch.setattr(hostile, "load_model", lambda _: jc.case("1a"))
    with pytest.raises(hostile.SilentDefault):
        hostile.check_file(data, tmp_path / "design.toml")


def test_a_command_that_writes_elsewhere_or_loses_an_option_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    line = hostile.Line(["sweep", "1a", "--out=out", "--first=3000"], "sweep", {"case": ["1a"], "out": ["out"]})
    right = hostile.Line(line.arguments, "sweep", {**(line.given or {}), "first": ["3000"]})
    with hostile.playground(tmp_path), hostile.without_computing() as understood:
        assert hostile.check_line(right, understood) == "would run"
        with pytest.raises(hostile.SilentDefault, match="--first"):
            hostile.check_line(line, understood)
        monkeypatch.setattr(_sweep, "rpm", lambda first, last, count: np.linspace(1.0, 2.0, count))
        with pytest.raises(hostile.SilentDefault, match="--first 3000"):
            hostile.check_line(right, understood)
        monkeypatch.setattr(_sweep, "rpm", lambda *_: Path("elsewhere").write_text("x"))
        with pytest.raises(hostile.Astray, match="elsewhere"):
            hostile.check_line(right, understood)


# NaN and infinity.


@pytest.mark.wide
@pytest.mark.parametrize("model", hostile.MODELS[-2:], ids=["elastic", "roller pass"])
@pytest.mark.parametrize("wrong", ["nan", "inf", "-inf", '"nan mm"', '"1e999"'])
def test_nan_and_infinity_are_refused_at_every_key(tmp_path: Path, model: jc.CageModel, wrong: str):
    text = save_model(tmp_path / "model.toml", model).read_text()
    keys = [path for path, value in hostile.leaves(configuration(model)) if not isinstance(value, str)]
    assert len(keys) > len(jc.parameters(model))
    for path in keys:
        table = tomllib.loads(text)
        place: Any = table
        for name in path[:-1]:
            place = place[name]
        place[path[-1]] = tomllib.loads(f"x = {wrong}")["x"]
        with pytest.raises(ConfigError, match=f"`{'.'.join(path)}` must be a"):
            model_from(table)


NUMBERS = [
    (command, name)
    for command, (kind, hints) in hostile.COMMANDS.items()
    for name in kind.__dataclass_fields__
    if hints[name] in (int, float, int | None, float | None)
]


@pytest.mark.wide
@pytest.mark.parametrize("command", sorted({command for command, _ in NUMBERS}))
def test_nan_and_infinity_are_refused_in_every_option(capsys: pytest.CaptureFixture[str], tmp_path: Path, command: str):
    kind, _ = hostile.COMMANDS[command]
    with hostile.playground(tmp_path), hostile.without_computing():
        for name in (name for of, name in NUMBERS if of == command):
            required = {"case": "1a", "other": "1b", "measured": "data.txt", "speed": "--speed=8500"}
            needed = [required[n] for n in required if n != name and n in kind.__dataclass_fields__]
            needed = [n for n in needed if command != "map" or n == "1a"]
            flag = "--" + name.replace("_", "-")
            for wrong in ("nan", "inf", "-inf"):
                assert main([command, *needed, f"{flag}={wrong}"]) == 2, f"{flag}={wrong}"
                assert flag in capsys.readouterr().err


@pytest.mark.parametrize("wrong", ["nan", "inf", "1e999"])
@pytest.mark.parametrize(
    "line",
    [
        "study 1a --vary speed={}",
        "study 1a --vary speed=8500 --vary guidance_gap=0.3mm:{}",
        "study 1a --vary speed=8500 --vary guidance_gap=0.4mm+-{} --sample 8",
        "study 1a --vary speed=8500 --vary oil=32,{}",
        "design 1a --vary guidance_gap={}:0.6mm",
        "design 1a --scatter guidance_gap={}%",
        "map 1a --lower {}",
        "map 1a --points 4x4 --upper {}",
        "report 1a --operating 8500-{}",
    ],
)
def test_nan_and_infinity_are_refused_within_texts(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, line: str, wrong: str
):
    with hostile.playground(tmp_path), hostile.without_computing():
        assert main(line.format(wrong).split()) == 2
    option = [word for word in line.partition("{}")[0].split() if word.startswith("--")][-1]
    assert f"Option {option}" in capsys.readouterr().err


# What was found by fuzzing.


@pytest.mark.parametrize(
    "text",
    ["9**9**9**9 mm", "0.4 mm^9^9^9^9", "0.4 m^(9^9^9^9)", "0.4 (9)^9^9^9 mm", "1 km^400/m^400 m", "1 Ym^99/m^98"],
)
def test_a_unit_is_not_a_sum_to_be_worked_out(text: str):
    with pytest.raises(ValueError, match="unit"):
        to_si(text, "m")


@pytest.mark.parametrize("unit", ["1/min", "min^-1", "1/s", "Bq", "baud", "Hz"])
def test_a_rate_is_not_taken_for_an_angular_speed(unit: str):
    with pytest.raises(ValueError, match='where "rpm" or "rad/s" is wanted'):
        to_si(f"3000 {unit}", "rad/s")


@pytest.mark.parametrize("text", ["0.4 mm # or so", "0.4 mm: m", "0.4 mm\0", "0.4 mm; mm", "0.4 mm\nmm"])
def test_nothing_beside_a_unit_is_passed_over(text: str):
    with pytest.raises(ValueError, match="unit"):
        to_si(text, "m")


@pytest.mark.parametrize(
    "given, said",
    [
        (
            "[lubricant]\nviscosity_1 = 2e-6\nviscosity_2 = 1e-6\nreference_viscosity = 1e-5",
            "`lubricant` must have a viscosity",
        ),
        ("load = 1" + "0" * 400, "`load` must be a number from 0 to 1e+07 N, but is 1000"),
        ("load = 0x" + "f" * 5000, "`load` must be a number from 0 to 1e+07 N, but is a very large int."),
        ("load = " + "9" * 5000, "must be valid TOML, but is not: Exceeds the limit"),
        ("load = " + "[" * 5000, "must be valid TOML, but is not: maximum recursion depth"),
        ("load" + ".a" * 3000 + " = 1", "`load` must be a number from 0 to 1e+07 N, but is a very large dict."),
        ('"\\u001b[31m" = 1', r"Key `\x1b[31m` at the top level"),
    ],
    ids=["viscosity", "whole", "hexadecimal", "long", "deep array", "deep key", "control"],
)
def test_monsters(tmp_path: Path, given: str, said: str):
    path = tmp_path / "design.toml"
    path.write_text(f"base = '1a'\n{given}")
    with pytest.raises(ConfigError) as refusal:
        load_model(path)
    assert said in str(refusal.value) and len(str(refusal.value)) < 600


@pytest.mark.parametrize(
    "line, said",
    [
        ("sweep 1a --count 1000000000000", "--count must be at most 10000000"),
        ("sweep 1a --revolutions 1000000000000", "--revolutions must be at most 10000000"),
        ("sweep 1a --steps 1000000000000", "--steps must be at most 10000000"),
        (f"sweep {'x' * 300}", "is unknown: it must be one of 1a"),
        ("sweep 1a --out=", "Option --out must name a folder, but '' was given."),
        ("study 1a --vary speed=1:2:99999999999", "--vary speed must have at most 10000000 values"),
        ("study 1a --vary speed=1:2:1000 --vary load=1:2:40000", "must make at most 100000000 lanes"),
        ("study 1a --vary speed=8500 --sample 1000000000000", "--sample must be at most"),
        ("study 1a --vary speed=8500 --store=", "--store must name a folder within --out, but '' was given"),
        ("study 1a --vary speed=8500 --store=.", "--store must name a folder within --out, but '.' was given"),
        (f"study 1a --vary speed=8500 --store={'x' * 300}", "--store must name a folder within --out"),
        (f"study 1a --vary speed=8500 --shard=1/{'9' * 5000}", "--shard must be I/N"),
        (f"map 1a --points {'9' * 5000}x4", "--points must be ACROSSxUPWARDS"),
        ("map 1a --points 4x4 --rows 3", "--rows and --columns do not go with --points"),
        ("map 1a --points 4x4 --persist 300", "--persist must be 0 or above the 1000 of --discard, but 300 was given"),
        ("map 1a --persist 3000", "go with --points"),
        ("sweep 1a --horizon=-1", "--horizon must be at least 0, but -1 was given"),
        ("design 1a --seed -5", "--seed must be at least 0"),
        ("design 1a --cost inf", "--cost must be at least 0, but inf was given"),
        ("design 1a --spread inf", "--spread must be above 0 and at most 1"),
        ("design 1a --worst 0.5", "--worst goes with --scatter"),
        ("design 1a --vary load=1:2 --vary load=1:3", "must name each parameter once, but load was given twice"),
        ("design 1a --scatter guidance_gap=1% --scatter guidance_gap=2%", "guidance_gap was given twice"),
        ("sensitivity 1a --seed -1", "--seed must be at least 0"),
        ("report 1a --operating ,", "--operating must hold a speed, but ',' was given"),
        ("validate --topics ,", "--topics must be made of film, statics"),
        ("--tyro-print-completion nonsense", "must be followed by bash, zsh, tcsh, fish, but 'nonsense' was given"),
    ],
)
def test_what_was_taken_for_granted_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, line: str, said: str
):
    with hostile.playground(tmp_path), hostile.without_computing():
        assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == "" and said in err


def test_too_little_memory_is_said(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    def too_much(*_: object, **__: object) -> None:
        raise MemoryError

    for run in (too_much, lambda *_, **__: jax.numpy.ones(10**14)):
        monkeypatch.setattr(_sweep, "sweep", run)
        assert main(["sweep", "1a", "--out", str(tmp_path), "--no-cache"]) == 1
        assert "not enough memory for this: ask for fewer" in capsys.readouterr().err


# Files are data.


class Smuggled:
    """Makes the file `mark` when it is unpickled."""

    def __init__(self, mark: Path):
        self.mark = mark

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.mark,)


PICKLE = {"id": "pickle", "protocol": 5}
CODECS = {
    "behind texts": ("|O", [{"id": "vlen-utf8"}, PICKLE], None),
    "objects": ("|O", [PICKLE], None),
    "compressor": ("|O", [{"id": "vlen-utf8"}], PICKLE),
}


def smuggle(path: Path, codec: str, mark: Path) -> dict[str, Any]:
    """Make a zarr folder of version 2 whose only array unpickles. **Returns:** its metadata."""
    kind, filters, compressor = CODECS[codec]
    array = {"zarr_format": 2, "shape": [1], "chunks": [1], "order": "C", "dtype": kind, "fill_value": ""}
    array |= {"filters": filters, "compressor": compressor}
    (path / "a").mkdir(parents=True)
    (path / ".zgroup").write_text('{"zarr_format": 2}')
    (path / "a" / ".zarray").write_text(json.dumps(array))
    (path / "a" / ".zattrs").write_text('{"_ARRAY_DIMENSIONS": ["x"]}')
    (path / "a" / "0").write_bytes(pickle.dumps(Smuggled(mark)))
    return array


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("described", ["as version 2", "as version 3", "within version 3"])
def test_a_stored_result_cannot_run_code(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, codec: str, described: str):
    monkeypatch.setattr(numcodecs.pickles, "ALLOW_UNSAFE_PICKLE_DECODE", True, raising=False)  # as before 0.16.6
    mark, path = tmp_path / "mark", tmp_path / "stored.zarr"
    array = smuggle(path, codec, mark)
    if described != "as version 2":
        group: dict[str, Any] = {"zarr_format": 3, "node_type": "group", "attributes": {}}
        inside = {"a": {**array, "node_type": "array", "attributes": {"_ARRAY_DIMENSIONS": ["x"]}}}
        if described == "within version 3":
            group["consolidated_metadata"] = {"kind": "inline", "must_understand": False, "metadata": inside}
        (path / "zarr.json").write_text(json.dumps(group))
    for read in (open_sweep, open_study):
        try:
            assert not read(path).load().variables
        except (FileNotFoundError, ValueError) as error:
            assert str(path) in str(error)
    assert not mark.exists()


def test_what_was_smuggled_there_would_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(numcodecs.pickles, "ALLOW_UNSAFE_PICKLE_DECODE", True, raising=False)
    mark, path = tmp_path / "mark", tmp_path / "stored.zarr"
    smuggle(path, "behind texts", mark)
    with pytest.raises(Exception, match="NoneType|None"):
        zarr.open_group(path, mode="r", zarr_format=2)["a"][...]  # pyright: ignore[reportIndexIssue]
    assert mark.exists()


@pytest.mark.parametrize("where", ["what", "z", "leaf_0", "whole"])
def test_a_kept_search_cannot_run_code(tmp_path: Path, where: str):
    mark, path = tmp_path / "mark", tmp_path / "search.npz"
    vary, gap = {"guidance_gap": (0.3e-3, 0.6e-3)}, jc.design.Smooth(lambda model: (1e3 * model.guidance_gap) ** 2)
    search = lambda: jc.optimise(jc.case("1a"), vary, gap, steps=1, keep=path).best
    assert search().objective == search().objective < 0.45**2
    hostile_object = np.empty(1, dtype=object)
    hostile_object[0] = Smuggled(mark)
    if where == "whole":
        path.write_bytes(pickle.dumps(Smuggled(mark)))
    else:
        with np.load(path) as own:
            stored = dict(own)
        np.savez(path, allow_pickle=True, **{**stored, where: hostile_object})
    with pytest.raises(ValueError, match="must be a file of this search"):
        search()
    assert not mark.exists()


@pytest.mark.parametrize("text", ["__import__('os').system('true')", "=cmd|' /C calc'!A0", "!!python/none", "nan,1"])
def test_columns_are_numbers(tmp_path: Path, text: str):
    path = tmp_path / "table.csv"
    path.write_text(f"a [m]\n{text}\n")
    with hostile.watching() as seen, pytest.raises(ValueError):
        read_columns(path)
    hostile.check_writes(seen, None)


@pytest.mark.parametrize(
    "value",
    ["!!python/object/apply:os.system ['true']", "0.4 __import__('os').system('true')", "$(true)", "{{ 7*7 }}", "%n"],
)
def test_a_configuration_cannot_run_code(tmp_path: Path, value: str):
    path = tmp_path / "design.toml"
    path.write_text('base = "1a"\nguidance_gap = "0.4 no_such_unit(1)"')
    with pytest.raises(ConfigError):
        load_model(path)  # what pint loads when it first reads such words
    path.write_text(f'base = "1a"\nguidance_gap = "{value}"')
    with hostile.watching() as seen, pytest.raises(ConfigError, match="`guidance_gap` must be a number"):
        load_model(path)
    hostile.check_writes(seen, None)


# Writes stay where they are asked for.


def test_out_is_honoured(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    with hostile.playground(tmp_path):
        Path("a$^$.toml").write_bytes(Path("valid.toml").read_bytes())
        assert main(["statics", "valid.toml", "--json"]) == 0  # what is compiled and loaded for the first time
        capsys.readouterr()
        before = sorted(tmp_path.rglob("*"))
        with hostile.watching() as seen:
            assert main(["statics", "a$^$.toml", "--out", "here/below", "--no-cache", "--json"]) == 0
        hostile.check_writes(seen, "here/below")
        document = json.loads(capsys.readouterr().out)
        made = set(tmp_path.rglob("*")) - set(before)
    written = {tmp_path / document["figure"], tmp_path / document["data"]}
    assert made == written | {tmp_path / "here", tmp_path / "here/below"}


def test_the_watch_sees_what_is_written(tmp_path: Path):
    with hostile.watching() as seen:
        (tmp_path / "other").write_text("x")
    with pytest.raises(hostile.Astray, match="other"):
        hostile.check_writes(seen, str(tmp_path / "out"))
