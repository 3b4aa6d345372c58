"""Hostile files and command lines are refused in one sentence; nothing in them is run."""

import tomllib
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax
import pytest
from helpers import elastic, roller_pass

import jaxcage as jc
from jaxcage.cli import _options, _sweep, main
from jaxcage.io import ConfigError, configuration, load_model, model_from, read_columns, save_model, to_si


def leaves(table: dict[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every value of a nested mapping with its place."""
    for name, value in table.items():
        if isinstance(value, dict):
            yield from leaves(value, (*path, name))
        else:
            yield (*path, name), value


# NaN and infinity.


@pytest.mark.wide
@pytest.mark.parametrize("make", [elastic, roller_pass])
@pytest.mark.parametrize("wrong", ["nan", "inf", "-inf", '"nan mm"', '"1e999"'])
def test_nan_and_infinity_are_refused_at_every_key(
    tmp_path: Path, make: Callable[[jc.CageModel], jc.CageModel], wrong: str
):
    model = make(jc.case("2a"))
    text = save_model(tmp_path / "model.toml", model).read_text()
    keys = [path for path, value in leaves(configuration(model)) if not isinstance(value, str)]
    assert len(keys) > len(jc.parameters(model))
    for path in keys:
        table = tomllib.loads(text)
        place: Any = table
        for name in path[:-1]:
            place = place[name]
        place[path[-1]] = tomllib.loads(f"x = {wrong}")["x"]
        with pytest.raises(ConfigError, match=f"`{'.'.join(path)}` must be a"):
            model_from(table)


COMMANDS = {name: (kind, typing.get_type_hints(kind)) for name, (kind, _) in _options.COMMANDS.items()}


@pytest.mark.wide
@pytest.mark.parametrize("command", COMMANDS)
def test_nan_and_infinity_are_refused_in_every_option(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, command: str
):
    monkeypatch.chdir(tmp_path)
    kind, hints = COMMANDS[command]
    for name in kind.__dataclass_fields__:
        if hints[name] not in (int, float, int | None, float | None):
            continue
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
    assert main([*line.format(wrong).split(), "--out", str(tmp_path)]) == 2
    option = [word for word in line.partition("{}")[0].split() if word.startswith("--")][-1]
    assert f"Option {option}" in capsys.readouterr().err


# What random input has found.


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
        ("load" + ".a" * 3000 + " = 1", "`load` must be a number from 0 to 1e+07 N, but is "),
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
        ("design 1a --worst 0.5", "--worst goes with --scatter"),
        ("design 1a --vary load=1:2 --vary load=1:3", "must name each parameter once, but load was given twice"),
        ("design 1a --scatter guidance_gap=1% --scatter guidance_gap=2%", "guidance_gap was given twice"),
        ("sensitivity 1a --seed -1", "--seed must be at least 0"),
        ("report 1a --operating ,", "--operating must hold a speed, but ',' was given"),
        ("--tyro-print-completion nonsense", "must be followed by bash, zsh, tcsh, fish, but 'nonsense' was given"),
    ],
)
def test_what_was_taken_for_granted_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, line: str, said: str
):
    monkeypatch.chdir(tmp_path)
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


@pytest.mark.parametrize("text", ["__import__('os').system('true')", "=cmd|' /C calc'!A0", "!!python/none", "nan,1"])
def test_columns_are_numbers(tmp_path: Path, text: str):
    path = tmp_path / "table.csv"
    path.write_text(f"a [m]\n{text}\n")
    with pytest.raises(ValueError):
        read_columns(path)


@pytest.mark.parametrize(
    "value",
    ["!!python/object/apply:os.system ['true']", "0.4 __import__('os').system('true')", "$(true)", "{{ 7*7 }}", "%n"],
)
def test_a_configuration_cannot_run_code(tmp_path: Path, value: str):
    path = tmp_path / "design.toml"
    path.write_text(f'base = "1a"\nguidance_gap = "{value}"')
    with pytest.raises(ConfigError, match="`guidance_gap` must be a number"):
        load_model(path)
