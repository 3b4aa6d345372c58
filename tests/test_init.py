"""The template that `jaxcage init` writes: complete, correct as it is, and correct with every option taken."""

import json
import re
import tomllib
from pathlib import Path

import jax
import pytest
from helpers import declared, elastic, roller_pass

import jaxcage as jc
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.cli import main
from jaxcage.io import configuration, load_model, model_from, template


jax.config.update("jax_enable_x64", True)  # read while the tests are collected
TEXT = template()
MODELS = (*map(jc.case, PUBLISHED_CASES), elastic(jc.case("2a")), roller_pass(jc.case("3b")))
FIELDS = {path: field for model in MODELS for path, field in declared(model)}
"""Everything that a file may give: its place and declaration."""
OPTION = re.compile(r"# (?=[a-z_0-9]+ = )")


def options() -> list[int]:
    """Numbers of the lines that hold an option with a `#` before it."""
    return [i for i, line in enumerate(TEXT.splitlines()) if OPTION.match(line)]


def instead() -> list[tuple[str, str]]:
    """Name and text of each table that can take the place of another, its sub-tables with it."""
    found: list[tuple[str, str]] = []
    for block in re.findall(r"(?:^#: .*\n?)+", TEXT, flags=re.M):
        text = re.sub(r"^#: ", "", block, flags=re.M)
        head = re.match(r"\[([a-z_.]+)\]", text)
        assert head is not None, text
        found.append((head.group(1), text))
    return found


def with_table(name: str, text: str) -> dict:
    """The template's nested mapping with one table exchanged."""
    table = tomllib.loads(TEXT)
    *path, last = name.split(".")
    place = table
    for key in path:
        place = place[key]
    new = tomllib.loads(text)
    for key in name.split("."):
        new = new[key]
    place[last] = new
    return table


READINGS = {"clearance_reading": "radial", "unbalance": "physical"}
"""Of a bearing of one's own: the paper's are misprints."""


def test_it_describes_case_1a_but_for_the_readings_of_the_paper():
    assert "$" not in TEXT and max(map(len, TEXT.splitlines())) <= 140
    found, expected = (
        configuration(model_from(tomllib.loads(TEXT))),
        configuration(jc.replace(jc.case("1a"), **READINGS)),
    )

    def compare(a: dict, b: dict) -> None:
        assert set(a) == set(b)
        for key in a:
            if isinstance(a[key], dict):
                compare(a[key], b[key])
            else:
                assert a[key] == (b[key] if isinstance(b[key], str | int) else pytest.approx(b[key], rel=6e-4)), key

    compare(found, expected)


@pytest.mark.wide
@pytest.mark.parametrize("number", options(), ids=lambda i: OPTION.sub("", TEXT.splitlines()[i]).split(" =")[0])
def test_every_option_is_accepted_and_shows_what_it_is_when_left_out(number: int):
    lines = TEXT.splitlines()
    lines[number] = OPTION.sub("", lines[number])
    taken = configuration(model_from(tomllib.loads("\n".join(lines))))
    left_out = configuration(model_from(tomllib.loads(TEXT)))

    def compare(a: dict, b: dict) -> None:
        for key in a:
            if isinstance(a[key], dict):
                compare(a[key], b[key])
            else:
                assert a[key] == (b[key] if isinstance(b[key], str | int) else pytest.approx(b[key], rel=1e-3)), key

    compare(taken, left_out)


@pytest.mark.parametrize(
    "name, text", instead(), ids=[text.split("\n")[1].split("#")[0].strip() for _, text in instead()]
)
def test_every_table_that_can_be_put_in_place_of_another_is_accepted(name: str, text: str):
    model = model_from(with_table(name, text))
    given = tomllib.loads(text)
    for key in name.split("."):
        given = given[key]
    found = configuration(model)
    for key in name.split("."):
        found = found[key]
    assert {k for k in given if k != "designation"} <= set(found)
    assert found.get("kind") == given.get("kind")


def test_nothing_that_can_be_given_is_missing():
    known = {path[-1] for path in FIELDS}
    written = set(re.findall(r"^(?:# |#: )?([a-z_0-9]+) = ", TEXT, flags=re.M))
    assert written == known | {"kind", "grade", "base", "designation", "speeds", "stiffness"}


def test_every_choice_names_all_that_it_offers():
    for path, field in FIELDS.items():
        assert all(f'"{option}"' in TEXT for option in field.metadata.get("choice", ())), path


def test_every_dimensional_value_is_explained_with_its_unit():
    for line in TEXT.splitlines():
        match = re.match(r'(?:# |#: )?[a-z_0-9]+ = "[-0-9.e]+ (?:\([^)]*\) )?[^"(]+" *(#.*)?$', line)
        if match:
            assert match.group(1) and "[" in match.group(1), line


def test_the_command_writes_it_once(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    path = tmp_path / "my_bearing.toml"
    assert main(["init", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": str(path)}
    assert float(load_model(path).guidance_gap) == pytest.approx(0.45e-3)
    path.write_text("mine")
    assert main(["init", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err == f"File '{path}' must be a new one, but is there already and is left as it is.\n"
    assert path.read_text() == "mine"


@pytest.mark.parametrize("name, said", [("bearing.txt", "must end in .toml"), ("no/such/b.toml", "No such file")])
def test_where_it_cannot_be_written(capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, said: str):
    assert main(["init", str(tmp_path / name)]) == 2
    assert said in capsys.readouterr().err
    assert not any(tmp_path.iterdir())
