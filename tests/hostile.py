"""Random and hostile TOML files and command lines, and what must hold of what becomes of them.

Input is refused with one sentence, or means what it says: every number in a file is found in the model, every option in
what would be computed. Shared by `test_fuzz` and `benchmarks.fuzz`.
"""

import contextlib
import copy
import dataclasses
import datetime
import inspect
import io
import json
import math
import os
import re
import shutil
import sys
import tomllib
import typing
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any
from unittest import mock

import equinox as eqx
import hypothesis.strategies as st
import numpy as np

import jaxcage as jc
from jaxcage._arguments import CHECKED
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.cli import (
    _bearing,
    _compare,
    _design,
    _identify,
    _label_map,
    _lasting,
    _main,
    _one_speed,
    _options,
    _orbits,
    _page,
    _reproduce,
    _runup,
    _study,
    _sweep,
    _unknowns,
    _validate,
    _whole,
    _whole_compare,
    _whole_gradient,
    _whole_map,
    _whole_page,
    _whole_runup,
    _whole_sweep,
    main,
)
from jaxcage.io import ConfigError, configuration, load_model, template


class SilentDefault(AssertionError):
    """Something given was left out, changed or taken for something else without a word."""


class Unclear(AssertionError):
    """A refusal that is not one sentence in its place."""


class Astray(AssertionError):
    """A file was written where none was asked for, or something was run."""


UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "m": {"m": (1, 0), "mm": (1e-3, 0), "um": (1e-6, 0), "µm": (1e-6, 0), "inch": (0.0254, 0)},
    "kg": {"kg": (1, 0), "g": (1e-3, 0)},
    "N": {"N": (1, 0), "kN": (1e3, 0)},
    "Pa": {"Pa": (1, 0), "GPa": (1e9, 0), "bar": (1e5, 0), "N/mm^2": (1e6, 0)},
    "K": {"K": (1, 0), "degC": (1, 273.15), "°C": (1, 273.15)},
    "rad/s": {"rad/s": (1, 0), "rpm": (math.pi / 30, 0)},
    "rpm": {"rpm": (1, 0), "rad/s": (30 / math.pi, 0)},
    "ms": {"ms": (1, 0), "us": (1e-3, 0), "s": (1e3, 0)},
    "kg/m^3": {"kg/m^3": (1, 0), "g/cm^3": (1e3, 0)},
    "m^2/s": {"m^2/s": (1, 0), "mm^2/s": (1e-6, 0), "cSt": (1e-6, 0)},
    "m/s": {"m/s": (1, 0), "mm/s": (1e-3, 0)},
    "m/s^2": {"m/s^2": (1, 0)},
    "N/m": {"N/m": (1, 0), "N/mm": (1e3, 0), "MN/m": (1e6, 0)},
    "N s/m": {"N s/m": (1, 0), "N s/mm": (1e3, 0)},
    "N/m^3": {"N/m^3": (1, 0), "N/mm^3": (1e9, 0)},
    "N/m^(10/9)": {"N/m^(10/9)": (1, 0), "N/mm^(10/9)": (1000 ** (10 / 9), 0)},
    "1": {"%": (1e-2, 0)},
}
"""SI unit, or that of an option -> units that may stand in its place, with factor and offset. By hand, not by pint."""


def in_unit(text: str, unit: str) -> float:
    """The number in `text`, converted to `unit` by the table above.

    **Raises:** `SilentDefault` for what the table does not have, and so nobody should have understood.
    """
    match = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*?)\s*", text)
    factor, offset = UNITS[unit].get(match[2], (math.nan, 0)) if match and match[2] else (1.0, 0.0)
    if match is None or math.isnan(factor):
        raise SilentDefault(f"{text!r} was taken for a number in {unit}")
    return float(match[1]) * factor + offset


def mostly(right: st.SearchStrategy[Any], wrong: st.SearchStrategy[Any], of: int) -> st.SearchStrategy[Any]:
    """One in `of` is wrong. (`one_of` knows no weights.)"""
    return st.integers(1, of).flatmap(lambda i: wrong if i == of else right)


def finite(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers between two, the ends among them."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


# Values and texts.

LETTERS = st.characters(exclude_categories=["Cs"], exclude_characters="\0/")
NOISE = st.text(LETTERS, max_size=12).filter(lambda s: ".." not in s) | st.sampled_from(
    [
        "",
        " ",
        "-",
        "--",
        "\udcff",
        "é😀",
        "a\nb",
        "\x1b[31m",
        "[/red]",
        "╭─│ ─── ╯",
        "x" * 300,
        "%s{0}${x}",
        "'\"`$(true)",
    ]
)
WRONG_TEXTS = (
    "nan, inf, -inf, nan mm, inf mm, NaN, 1e999 mm, -1e999, 3 kg, 3 furlongs, 0.5 mm mm, 0.5 mm # mm, 0.5 mm: m, "
    "1 km^99/m^99, 1 Ym^99/m^99 m, 9**9**9**9 m, 0.5 m^9^9^9^9, 0x10 mm, 1_0 mm, ١ mm, 1/2 mm, 0.5 mm\0, 3000 1/min, "
    "50 Hz, 50 Bq, 0.6 bit, 0.6 dB, 5 degC/m, 40 delta_degC, __import__('os').system('true') mm, m, 0.5 ((((m, true, "
    "!!python/object/apply:os.system [true]"
).split(", ")
WRONG: list[Any] = [
    *WRONG_TEXTS,
    *(math.nan, math.inf, -math.inf, True, False, [], [1.0], [math.nan], {}, {"a": 1}, {"value": "1 mm"}, "", 0, -1),
    *(1e308, 5e-324, -0.0, 10**400, -(10**400), datetime.date(2016, 1, 1), datetime.time(1), "x" * 1000),
]


def misspelt(word: str) -> st.SearchStrategy[str]:
    """Almost `word`."""
    ways = (word + "s", word[:-1], word.upper(), f" {word}", word.replace("_", "-"), word[::-1], f"{word}\u200b", "")
    return st.sampled_from([w for w in ways if w != word])


# TOML files.


def leaves(table: dict[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every value of a nested mapping with its place; an empty table is one."""
    for name, value in table.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, (*path, name))
        else:
            yield (*path, name), value


def declared(module: eqx.Module, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], dataclasses.Field]]:
    """Every parameter, choice and count of a module with its path of attribute names."""
    for field in dataclasses.fields(module):
        value, here = getattr(module, field.name), (*path, field.name)
        if isinstance(value, eqx.Module):
            yield from declared(value, here)
        elif {"parameter", "choice", "count"} & set(field.metadata):
            yield here, field


_ELASTIC = jc.replace(jc.case("2a"), rib=jc.forces.ElasticRib(mass=1.0, stiffness=5e7, damping=500.0))
_ROLLER_PASS = jc.replace(jc.case("3b"), impact=jc.forces.RollerPassImpact(jc.forces.PocketImpact()))
MODELS = (*map(jc.case, PUBLISHED_CASES), _ELASTIC, _ROLLER_PASS)
FIELDS = {path: field for model in MODELS for path, field in declared(model)}
"""Everything that a file may give: its place and declaration."""
KEYS = (*FIELDS, ("base",), ("lubricant", "grade"), ("bearing", "designation"), ("impact", "kind"), ("rib", "kind"))


USUAL = {path: value for model in MODELS for path, value in leaves(configuration(model))}


@st.composite
def numbers(draw: Any, path: tuple[str, ...], info: Any) -> float | str:
    """A number of the declared range, mostly close to the usual one, with a unit or without."""
    close = st.floats(0.98, 1.02).map(lambda factor: min(max(factor * USUAL[path], info.lower), info.upper))
    number = draw(mostly(close, finite(info.lower, info.upper) | st.sampled_from([info.lower, info.upper]), 5))
    if draw(st.booleans()):
        return number
    unit, (factor, offset) = draw(st.sampled_from(sorted(UNITS[info.unit].items())))
    return f"{(number - offset) / factor:.7g} {unit}"


def values(path: tuple[str, ...]) -> st.SearchStrategy[Any]:
    """What may stand at a place of a file, or is hardly wrong, or is quite wrong."""
    field = FIELDS.get(path)
    if field is None:
        right: st.SearchStrategy[Any] = st.sampled_from(
            [*PUBLISHED_CASES, "NU2310", 68, 32.5, 2, "synchronous", "roller_pass", "rigid", "elastic"]
        )
    elif "choice" in field.metadata:
        right = st.sampled_from(field.metadata["choice"])
    elif "count" in field.metadata:
        right = st.sampled_from(field.metadata["count"]) | st.integers(*field.metadata["count"])
    else:
        right = numbers(path, field.metadata["parameter"])
    wrong = st.sampled_from(WRONG) | NOISE.filter(lambda s: s.isprintable()) | st.floats() | st.integers()
    return mostly(right, wrong, 6).map(copy.deepcopy)


def plain_template() -> dict[str, Any]:
    """The template with its best guesses for values, and speeds of the cage: what its numbers are can then be asked."""
    read = lambda table: {k: read(v) if isinstance(v, dict) else _best(v) for k, v in table.items() if k != "speeds"}
    document = read(tomllib.loads(template()))
    stiffness = document["support"].pop("stiffness")
    document["support"] |= {"stiffness_x": stiffness, "stiffness_y": stiffness}
    return document


def _best(value: Any) -> Any:
    """A range without its ends: `2e4 (1e4 .. 1e6) N/m` is `2e4 N/m`."""
    return re.sub(r"\([^()]* \.\. [^()]*\) ?", "", value).strip() if isinstance(value, str) else value


def starting_documents() -> list[dict[str, Any]]:
    """Files that are right."""
    pass_by = {"kind": "roller_pass", "harmonics": 8, "oscillator": {"bar_mass": "5 g"}}
    return [
        *map(configuration, MODELS),
        *[plain_template()] * 3,
        *({"base": name} for name in PUBLISHED_CASES),
        {"base": "1a", "guidance_gap": "0.5 mm", "film": {"model": "full"}},
        {"base": "1b", "lubricant": {"grade": 68, "temperature": "70 degC"}},
        {"base": "2a", "bearing": {"designation": "NU2310", "radial_clearance": "20 um"}, "impact": pass_by},
    ]


_DOCUMENTS = starting_documents()


def _table(document: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    """The table at `path`, which is made, in the place of a value if there is one."""
    for name in path:
        if not isinstance(document.get(name), dict):
            document[name] = {}
        document = document[name]
    return document


@st.composite
def nested_documents(draw: Any) -> dict[str, Any]:
    """A right file with some keys changed, added, misspelt or left out."""
    document = copy.deepcopy(draw(st.sampled_from(_DOCUMENTS)))
    for _ in range(draw(st.integers(0, 3))):
        path = draw(st.sampled_from(KEYS))
        table, name = _table(document, path[:-1]), path[-1]
        how = draw(st.sampled_from(["set"] * 12 + ["drop", "drop table", "misspell", "add", "add table", "overwrite"]))
        if how == "set":
            table[name] = draw(values(path))
        elif how == "drop":
            table.pop(name, None)
        elif how == "drop table":
            document.pop(path[0], None)
        elif how == "misspell":
            table[draw(misspelt(name))] = table.pop(name, 1.0)
        elif how == "add":
            table[draw(NOISE.filter(lambda s: "\udcff" not in s))] = copy.deepcopy(draw(st.sampled_from(WRONG)))
        elif how == "add table":
            document[draw(misspelt(path[0]))] = {"a": {}} if draw(st.booleans()) else {}
        else:
            document[path[0]] = copy.deepcopy(draw(st.sampled_from(WRONG)))
    return document


def literal(value: Any) -> str:
    """A value as TOML has it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key(k)} = {literal(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(literal, value)) + "]"
    if isinstance(value, str | bool):
        return json.dumps(value, ensure_ascii=False)
    return value.isoformat() if isinstance(value, datetime.date | datetime.time) else repr(value)


def key(name: str) -> str:
    """A key as TOML has it."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def as_toml(document: dict[str, Any], path: tuple[str, ...] = ()) -> str:
    """A nested mapping as the text of a file."""
    lines = [f"[{'.'.join(map(key, path))}]"] if path else []
    lines += [f"{key(k)} = {literal(v)}" for k, v in document.items() if not isinstance(v, dict)]
    return "\n".join([*lines, *(as_toml(v, (*path, k)) for k, v in document.items() if isinstance(v, dict))])


def _spoilt(text: str, at: int) -> dict[str, str | bytes]:
    """What a careless or hostile hand makes of the text of a file."""
    lines = text.splitlines()
    line = lines[at % len(lines)] if lines else ""
    cut = at % (len(text) + 1)
    return {
        "line twice": f"{text}\n{line}",
        "line first": f"{line}\n{text}",
        "line lost": "\n".join(x for x in lines if x != line),
        "letter lost": text[:cut] + text[cut + 1 :],
        "letter between": f"{text[:cut]}={text[cut:]}",
        "cut off": text[:cut],
        "NUL": f"{text[:cut]}\0{text[cut:]}",
        "comment": f"# {text}",
        "windows": text.replace("\n", "\r\n"),
        "old mac": text.replace("\n", "\r"),
        "byte order mark": b"\xef\xbb\xbf" + text.encode(),
        "UTF-16": text.encode("utf-16"),
        "latin 1": text.encode("latin-1", "replace") + b"\n# \xb5",
        "array of tables": text.replace("[film]", "[[film]]"),
        "deep array": f"{text}\nx = {'[' * 5000}",
        "deep table": f"{text}\nx = {'{a=' * 5000}",
        "deep key": f"guidance_gap{'.a' * 3000} = 1\n{text}",
        "long number": f"load = {'9' * 5000}\n{text}",
        "long hexadecimal number": f"load = 0x{'f' * 5000}\n{text}",
        "empty": "",
    }


@st.composite
def files(draw: Any) -> bytes:
    """The bytes of a file: mostly TOML."""
    kind = draw(st.sampled_from(["nested"] * 10 + ["spoilt"] * 3 + ["noise", "binary"]))
    if kind == "binary":
        return draw(st.binary(max_size=60))
    if kind == "noise":
        return draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=60)).encode()
    text = as_toml(draw(nested_documents()))
    if kind == "nested":
        return text.encode()
    way = draw(st.sampled_from(sorted(_spoilt("", 0))))
    spoilt = _spoilt(text, draw(st.integers(0, 10**4)))[way]
    return spoilt if isinstance(spoilt, bytes) else spoilt.encode()


def check_sentence(said: str) -> None:
    """One sentence that is not long."""
    if not (said.endswith(".") and len(said) < 2000 and "\n" not in said and "\x1b" not in said):
        raise Unclear(said)


def check_file(data: bytes, path: Path) -> bool:
    """Read a file. **Returns:** whether it is accepted.

    **Raises:** `SilentDefault`, `Unclear`, or what the reader should not have let out.
    """
    path.write_bytes(data)
    try:
        model = load_model(path)
    except ConfigError as error:
        said = str(error)
        check_sentence(said)
        if not (said.startswith(f"File '{path}'") and ("`" in said or "TOML" in said)):
            raise Unclear(said) from error
        return False
    given, found = tomllib.loads(data.decode()), dict(leaves(configuration(model)))
    base = given.pop("base", None)
    check_given(dict(leaves(given)), found)
    check_left_out(dict(leaves(given)), found, None if base is None else dict(leaves(configuration(jc.case(base)))))
    derived = model.lubricant.dynamic_viscosity, model.land_radius, model.clearance, model.bearing.roller_mass
    if not all(0 < float(x) < math.inf for x in derived):
        raise SilentDefault(f"what follows from the file makes no sense: {derived}")
    return True


def check_given(given: dict[tuple[str, ...], Any], found: dict[tuple[str, ...], Any]) -> None:
    """Every value that was given is what the model has."""
    for path, value in given.items():
        if path == ("lubricant", "grade"):
            same = ("lubricant", "viscosity_1") in given or _same(found["lubricant", "viscosity_1"], 1e-6 * value)
        elif path == ("bearing", "designation"):
            same = value == "NU2310"
        elif value == {}:
            same = any(known[: len(path)] == path for known in found)
        elif path not in found or isinstance(value, bool):
            same = False
        elif path in FIELDS and "parameter" in FIELDS[path].metadata:
            unit = FIELDS[path].metadata["parameter"].unit
            same = _same(found[path], in_unit(value, unit) if isinstance(value, str) else float(value))
        else:
            same = type(value) is type(found[path]) and value == found[path]
        if not same:
            raise SilentDefault(f"{'.'.join(path)} = {value!r} became {found.get(path)!r}")


def _same(found: float, expected: float) -> bool:
    return math.isclose(found, expected, rel_tol=1e-12, abs_tol=0.0)


def check_left_out(
    given: dict[tuple[str, ...], Any], found: dict[tuple[str, ...], Any], base: dict[tuple[str, ...], Any] | None
) -> None:
    """What was not given is as the published case has it, or has a declared default."""
    tables = {path[:i] for path in given for i in range(1, len(path) + 1)}
    for path in found.keys() - given.keys():
        if path[0] == "lubricant" and ("lubricant", "grade") in given:
            continue
        reference = dict(leaves(configuration(MODELS[0]))) if ("bearing", "designation") in given else base
        if path[0] != "bearing":
            reference = base
        kind = (path[0], "kind")
        if reference is not None and reference.get(kind) == found.get(kind):
            right = found[path] == reference[path]
        elif path in FIELDS and FIELDS[path].default is not dataclasses.MISSING:
            right = found[path] == FIELDS[path].default
        else:  # a whole table has a default; a part of it does not
            right = path[:-1] not in tables and path[:-1] in DEFAULT_TABLES
        if not right:
            raise SilentDefault(f"{'.'.join(path)} was left out and became {found[path]!r}")


DEFAULT_TABLES = (("rib",), ("bearing", "roller_material"), ("impact", "oscillator"))


# Command lines.

COMMANDS = {name: (kind, typing.get_type_hints(kind)) for name, (kind, _) in _options.COMMANDS.items()}
"""Command -> its options and their types."""
PLACED = {"case", "other", "path", "measured"}
"""Options that go without their names."""
NAMES = (*(".".join(path[-1:]) for path in FIELDS), "speed", "oil", "support.damping", "film.smoothing")
SPEEDS = "8500, 8500 rpm, 900 rad/s, 2500, 27500, 12000, 1e-3, 1e308".split(", ")
WRONG_NUMBERS = (
    "0, -1, -0, nan, inf, -inf, 1e400, 1e999 rpm, nan rpm, 5 kg, 3000 1/min, 141 Hz, 9**9**9 rpm, 1/2, x".split(", ")
    + ["", " ", "1,5", "0x10", "9" * 5000, "2.5", "10000000000000", "9" * 30, "5 rpm rpm", "true", "[/red]", "\udcff"]
)
VARIED = (
    "speed=8500, guidance_gap=0.3mm:0.6mm, speed=4000rpm:27500rpm:100, speed=1:2:99999999999, speed=nan, speed=inf, "
    "speed=0:1, speed=8500+-100, speed=1e400:2:3, speed=5:4:3, guidance_gap=0.3mm:0.6mm:4, guidance_gap=nan:0.6mm, "
    "guidance_gap=0.6mm:0.3mm, guidance_gap=0.4mm+-0.1mm, guidance_gap=0.4mm±inf, guidance_gap=3kg:4kg, oil=32,56,78, "
    "oil=1, oil=nan, eccentricity=20um+-3um, eccentricity=5um:60um, eccentricity=5um:600um, cage_mass=0.2:0.3, "
    "cage_mass=0.2:0.3:0, cage_mass=1:2:3:4, cage_mass=, =1:2, cage_mass, nonsense=1:2, onset=50%:99%, load=0:1e7, "
    "cage_mass=0.2:0.3:x, guidance_gap=0.4mm+-0.1mm:0.5mm, guidance_gap=0.4mm+-0.01mm:, cage_mass=0.2 # :0.3, speed=,"
).split(", ")
TEXTS: dict[str, Sequence[str]] = {
    "style": ["light", "dark", "print"],
    "refine": ["chaos", "label"],
    "executor": ["local", "dask"],
    "constants": ["identified", "preliminary"],
    "solver": ["rodas3", "rodas4", "rk4", "newmark", "tsit5", "kvaerno5", "euler"],
    "out": ["out", "out/a/b", "é", "a b", "valid.toml", "valid.toml/below", "x" * 300, "\udcff"],
    "x": ["speed", "eccentricity", "load", "guidance_gap"],
    "y": ["guidance_gap", "eccentricity", "cage_mass", "cross_cubic", "speed"],
    "lower": ["0.4 mm", "0.3mm", "1e-4", "0", "1 um", "nan", "inf", "1e999", "3 kg", "-1"],
    "upper": ["0.5 mm", "0.6mm", "1e-3", "9", "nan", "inf", "1e999", "3 kg", "-1"],
    "points": ["300x300", "2x2", "4 × 4", "1x1", "99999x2", "3x", "x", "-3x3", "nanxnan", "9" * 5000 + "x4"],
    "store": ["a.zarr", "a/b.zarr", ".", "..", "../a", "a/../../b", "out", "x" * 300, "/"],
    "shard": ["1/1", "2/4", "0/1", "3/2", "1/" + "9" * 5000, "-1/2", "1/0", "a/b", "٣/٤"],
    "scheduler": ["tcp://127.0.0.1:1", "nowhere"],
    "vary": VARIED,
    "scatter": ["guidance_gap=10%", "eccentricity=rayleigh", "guidance_gap=nan%", "x=1%", "guidance_gap=0.1", "=", "x"],
    "topics": ["film", "statics, contact", "film,film", ",", "film;oil", "exponents bifurcations"],
    "table": ["t.csv", "a/t.xlsx", "t.ods", "../t.csv", "t", ".csv", "/t.csv"],
    "at": ["8500", "8500, 12000", "900 rad/s", "21000 rpm shaft", ",", "nan", "5-4", "0", "...", "1e400"],
    "operating": [
        "8500",
        "8500, 12000-15000",
        "900 rad/s",
        "1200 to 1500 rad/s",
        ",",
        "nan",
        "5-4",
        "0",
        "...",
        "1e9-1e400",
    ],
}
CASES = [
    *PUBLISHED_CASES,
    *["valid.toml"] * 4,
    "wrong.toml",
    "4z",
    "nowhere.toml",
    "pipe.toml",
    "endless.toml",
    "valid\u202elmot.toml",
    "folder",
    ".",
    "data.txt",
    "x" * 300,
]
RIGHT = {
    "revolutions": ["10", "40", "300"],
    "exponents": ["1", "2", "4"],
    "starts": ["1", "2", "3"],
    "first": ["2500", "300 rad/s", "4000rpm"],
    "last": ["27500", "9e3", "12000 rpm", "2000 rad/s"],
}
COUNTS = "1, 2, 4, 10, 20, 40, 64, 100, 128, 251, 300, 10000000".split(", ")
UNIT_OF = {"load": "N", "duration": "ms"} | dict.fromkeys(("first", "last", "speed", "shaft_speed"), "rpm")


@dataclasses.dataclass(frozen=True)
class Line:
    """A command line, and what it gives if nobody tampered with it."""

    arguments: list[str]
    command: str
    given: dict[str, list[str]] | None


def _texts(name: str, kind: Any) -> st.SearchStrategy[str]:
    if name in TEXTS:
        return mostly(st.sampled_from(TEXTS[name][:2]), st.sampled_from(TEXTS[name]) | NOISE, 5)
    if name in PLACED:
        named = (
            CASES
            if name in ("case", "other")
            else ["new.toml", "folder/new.toml", "valid.toml", "a.txt", "é.toml", "\udcff.toml"]
        )
        right = st.sampled_from(named[: 10 if name in ("case", "other") else 2])
        return mostly(right, st.sampled_from(named) | NOISE.filter(lambda s: not s.startswith("-")), 9)
    usual = (
        COUNTS if "int" in str(kind) else SPEEDS if UNIT_OF.get(name) == "rpm" else ["0.5", "1", "5", "1e-6", "4 kN"]
    )
    right = RIGHT.get(name, usual)
    return mostly(st.sampled_from(right), st.sampled_from(WRONG_NUMBERS), 8)


@st.composite
def lines(draw: Any) -> Line:
    """A command with some of its options; a third of them tampered with."""
    command = draw(st.sampled_from(sorted(COMMANDS)))
    options, hints = COMMANDS[command]
    fields = {f.name: f for f in dataclasses.fields(options)}
    required = [n for n, f in fields.items() if f.default is dataclasses.MISSING]
    some = draw(st.lists(st.sampled_from(sorted(set(fields) - PLACED)), max_size=4))
    given: dict[str, list[str]] = {}
    arguments = [command]
    for name in [*required, *some]:
        if name in PLACED:
            given[name] = [draw(_texts(name, str))]
            arguments += given[name]
            continue
        flag = "--" + str({"verify": "check"}.get(name, name.replace("_", "-")))
        if hints[name] is bool:
            given[name] = [""]
            arguments.append(flag)
            continue
        text = draw(_texts(name, hints[name]))
        given.setdefault(name, []).append(text)
        arguments += [f"{flag}={text}"] if text.startswith("-") or draw(st.booleans()) else [flag, text]
    if draw(st.integers(0, 2)) or not arguments:
        return Line(arguments, command, given)
    at = draw(st.integers(0, len(arguments) - 1))
    strange = [
        "--help",
        "-h",
        "--version",
        "--",
        "-",
        "--first",
        "--out",
        "--json=yes",
        "--sped",
        "9",
        "@valid.toml",
        "--é",
    ]
    word = draw(st.sampled_from(strange) | NOISE)
    how = draw(st.sampled_from(["insert", "replace", "drop", "append", "swap"]))
    spoilt = {
        "insert": [*arguments[:at], word, *arguments[at:]],
        "replace": [*arguments[:at], word, *arguments[at + 1 :]],
        "drop": [*arguments[:at], *arguments[at + 1 :]],
        "append": [*arguments, word],
        "swap": arguments[::-1],
    }[how]
    return Line(spoilt, command, None)


class WouldRun(Exception):
    """Raised in the place of a computation, with what it was called with."""

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__()
        self.called = args, kwargs


def _would_run(*args: Any, **kwargs: Any) -> Any:
    raise WouldRun(*args, **kwargs)


HEAVY = (
    (_sweep, "sweep"),
    (_compare, "sweep"),
    (_one_speed, "sweep"),
    (_one_speed, "simulate"),
    (_orbits, "synchronous_orbits"),
    (_label_map, "label_map"),
    (_lasting, "sweep"),
    (_design, "_objective"),
    (_design, "global_sensitivity"),
    (_unknowns, "sobol_of"),
    (_identify, "identify"),
    (_runup, "ramp_up_down"),
    (_study, "run_study"),
    (_whole, "simulate_bearing"),
    (_whole_gradient, "bearing_gradient"),
    (_whole_compare, "sweep_bearing"),
    (_whole_map, "sweep_bearings"),
    (_whole_page, "bearing_gradient"),
    (_whole_runup, "bearing_up_down"),
    (_whole_sweep, "sweep_bearing"),
    (_page.report, "examine"),
    (_reproduce, "run_all"),
    (_bearing, "impact_history"),
    (_bearing, "load_distribution"),
)
"""Where each command begins to compute."""


@contextlib.contextmanager
def without_computing() -> Iterator[list[Any]]:
    """Around commands: computations raise `WouldRun`. Yields a list of the options of all that were understood."""
    understood: list[Any] = []

    def parse(arguments: list[str], own: Callable[[list[str]], Any] = _main._parse) -> Any:
        understood.append(own(arguments))
        return understood[-1]

    with contextlib.ExitStack() as stack:
        for module, name in HEAVY:
            stack.enter_context(mock.patch.object(module, name, _would_run))
        stack.enter_context(mock.patch.object(_validate, "TOPICS", dict.fromkeys(_validate.TOPICS, _would_run)))
        stack.enter_context(mock.patch.object(_main, "_parse", parse))
        stack.enter_context(mock.patch.object(_main, "keep_compiled_programs"))
        yield understood


# What a command does beside its computation.

_seen: list[tuple[str, str]] | None = None
_hooked = False
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGES = {"os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod"}
RUNS = {"os.system", "os.exec", "os.fork", "os.posix_spawn", "subprocess.Popen", "pickle.find_class", "socket.connect"}


def _notice(event: str, args: tuple[Any, ...]) -> None:
    """Audit hook: what is written, changed or run, while somebody watches."""
    if _seen is None:
        return
    if event in RUNS:
        _seen.append(("run", f"{event} {args}"))
    elif event == "open" and isinstance(args[0], str | bytes) and args[2] and args[2] & WRITES:
        _seen.append(("write", os.fsdecode(args[0])))
    elif event in CHANGES:
        _seen.extend(("write", os.fsdecode(a)) for a in args[:2] if isinstance(a, str | bytes | os.PathLike))


@contextlib.contextmanager
def watching() -> Iterator[list[tuple[str, str]]]:
    """Around anything: what this process writes and runs."""
    global _seen, _hooked
    if not _hooked:
        sys.addaudithook(_notice)  # for good: hooks cannot be taken away
        _hooked = True
    _seen = found = []
    try:
        yield found
    finally:
        _seen = None


def check_writes(seen: list[tuple[str, str]], allowed: str | None) -> None:
    """Nothing was run, and nothing written but below `allowed`."""
    for what, where in seen:
        path = os.path.abspath(where)
        if what == "write" and (where == os.devnull or "__pycache__" in where):
            continue
        root = None if allowed is None else os.path.abspath(allowed)
        inside = root is not None and (os.path.commonpath([path, root]) in (path, root))
        if what == "run" or not inside:
            raise Astray(f"{what}: {where}, where {allowed} is allowed")


@contextlib.contextmanager
def playground(folder: Path) -> Iterator[None]:
    """Inside `folder`, with a few files for commands to meet."""
    before = os.getcwd()
    (folder / "folder").mkdir(exist_ok=True)
    (folder / "valid.toml").write_text(as_toml(plain_template()), encoding="utf-8")
    (folder / "wrong.toml").write_text("base = '1a'\nguidence_gap = 4e-4\n")
    (folder / "valid\u202elmot.toml").write_text("base = '1a'\n", encoding="utf-8")
    (folder / "data.txt").write_bytes(b"\x80\x04\x95")
    if not os.path.lexists(folder / "pipe.toml"):
        os.mkfifo(folder / "pipe.toml")
        (folder / "endless.toml").symlink_to("/dev/zero")
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


_OWN = {"folder", "valid.toml", "wrong.toml", "data.txt", "pipe.toml", "endless.toml", "valid\u202elmot.toml"}


def _tidy() -> None:
    for entry in os.scandir(b"."):
        if os.fsdecode(entry.name) not in _OWN:
            shutil.rmtree(entry.path) if entry.is_dir() else os.remove(entry.path)
    for entry in os.scandir(b"folder"):
        os.remove(entry.path)


def check_line(line: Line, understood: list[Any]) -> str:
    """Carry a command out, in a playground and without computing.

    **Returns:** `refused`, `done` or `would run`.

    **Raises:** `SilentDefault`, `Unclear`, `Astray`, or what `main` should not have let out.
    """
    understood.clear()
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace", write_through=True)
    called, status = None, 0
    with watching() as seen, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main(line.arguments)
        except WouldRun as stop:
            called = stop.called
    printed, said = (typing.cast(io.BytesIO, stream.buffer).getvalue().decode() for stream in (out, err))
    options = understood[0] if understood else None
    try:
        check_writes(seen, getattr(options, "out", getattr(options, "path", None)))
    finally:
        _tidy()
    sentences = [text for text in said.splitlines() if not text.startswith(("Warning: ", "Estimate: "))]
    if "\u202e" in printed + said:
        raise Unclear(f"the direction of writing is turned: {printed!r}, {said!r}")
    if status == 2:
        if printed or len(sentences) != 1:
            raise Unclear(f"printed {printed!r}, said {said!r}")
        check_sentence(sentences[0][-1500:])
        return "refused"
    if status or sentences or (called is None) != bool(printed):
        raise Unclear(f"status {status}, printed {printed!r}, said {said!r}")
    if options is not None and line.given is not None:
        check_options(options, line)
    if called is not None:
        check_called(options, *called)
    return "done" if called is None else "would run"


def check_options(options: Any, line: Line) -> None:
    """What was given is what was understood, and nothing else."""
    kind, hints = COMMANDS[line.command]
    assert type(options) is kind and line.given is not None
    for field in dataclasses.fields(kind):
        found, texts = getattr(options, field.name), line.given.get(field.name)
        if texts is None:
            expected = field.default
        elif hints[field.name] is bool:
            expected = True
        elif field.name in ("points", "shard"):
            expected = tuple(int(n) for n in re.split("[xX×/]", texts[-1]))
        elif isinstance(found, tuple):
            expected = tuple(texts)
        elif isinstance(found, str):
            expected = texts[-1]
        elif isinstance(found, int):
            expected = int(texts[-1])
        else:
            unit = UNIT_OF.get(field.name, "1")
            expected = in_unit(texts[-1], unit)
        same = _same(found, expected) if isinstance(found, float) else found == expected
        if not same:
            raise SilentDefault(f"--{field.name} {texts} became {found!r}")


def check_called(options: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
    """The options reach the computation: counts by their names, speeds in rad/s."""
    for name, value in kwargs.items():
        wanted = getattr(options, name, None)
        if isinstance(value, int) and wanted is not None and value != wanted:
            raise SilentDefault(f"--{name} {wanted!r} became {value!r} in the computation")
    if isinstance(
        options,
        _options.DesignOptions | _options.SensitivityOptions | _options.ImpactOptions | _options.UnknownsOptions,
    ):
        return
    numbers = [
        float(x) for a in (*args, *kwargs.values()) if isinstance(a, float | np.ndarray) for x in np.ravel(a)[[0, -1]]
    ]
    for name in ("first", "last", "speed"):
        rpm = getattr(options, name, None)
        if (
            rpm is None
            or isinstance(options, _options.StudyOptions)
            or (name == "last" and getattr(options, "count", 0) == 1)
        ):
            continue
        if not numbers or not any(math.isclose(x, rpm * math.pi / 30, rel_tol=1e-9) for x in numbers):
            if isinstance(options, _options.MapOptions) and options.points is not None:
                continue
            raise SilentDefault(f"--{name} {rpm!r} is not among {numbers[:6]}")


# Calls of the library.

LAYERS = (jc.bearing, jc.forces, jc.models, jc.integrate, jc.analysis, jc.sweeps, jc.orbits, jc.design, jc.studies)
FUNCTIONS = {
    f"{layer.__name__}.{name}": f
    for layer in LAYERS
    for name, f in sorted(vars(layer).items())
    if inspect.isfunction(f) and name in CHECKED
}
"""Public functions that look at their arguments before they do anything."""


class Stranger:
    """Nothing that any argument may be."""


NEVER: list[Any] = [
    Stranger(),
    np.ma.array([1.0, 2.0], mask=[False, True]),
    np.array(["2020-01-01"], dtype="datetime64[D]"),
    np.array([None, 1.0]),
]
"""Never right, where a declaration says anything."""
STRANGE: list[Any] = [
    *NEVER,
    *(None, True, np.nan, math.inf, -math.inf, 0, -0.0, -1, -20, 2.5, 3, 1e300, 5e-324, 10**400, -(10**400), 1j, 2**63),
    *(
        "",
        "x",
        "1a",
        "speed",
        "\0",
        b"x",
        [],
        [1.0],
        [math.nan],
        ["a"],
        [[1], [1, 2]],
        (),
        (math.nan, 1.0),
        {},
        {"a": 1},
    ),
    *({"speed": [1.0]}, {"speed": "x"}, set(), frozenset(), slice(None), Stranger, abs, lambda *x: x, iter([])),
    *(
        np.array([]),
        np.array(3.0),
        np.array([1, 2]),
        np.zeros((2, 2)),
        np.array([1j]),
        np.array(["a"]),
        np.float32(3.0),
    ),
    *(np.array([math.nan, 1.0]), np.array([1.0, math.inf]), np.array([2.0, 1.0]), np.int8(3), np.bool_(True)),
    jc.ForcedOscillator(lambda tau, q, v, speed: (-q[0],), coordinates=1),
    jc.forces.PocketImpact(),
    jc.bearing.nu2310(),
    jc.case("1a"),
]


@st.composite
def calls(draw: Any) -> tuple[str, dict[str, Any]]:
    """A function and some of its arguments, at least one of them strange."""
    name = draw(st.sampled_from(sorted(FUNCTIONS)))
    parameters = inspect.signature(FUNCTIONS[name]).parameters.values()
    named = [p.name for p in parameters if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    chosen = draw(st.lists(st.sampled_from(named), min_size=1, max_size=2, unique=True))
    return name, {argument: draw(st.sampled_from(STRANGE)) for argument in chosen}


def check_function(name: str, given: dict[str, Any]) -> str:
    """Call a function with a few arguments. **Returns:** `refused`, `incomplete` or `done`.

    **Raises:** `SilentDefault` where a value was taken that is never right, `Unclear`, or what should not have come.
    """
    f = FUNCTIONS[name]
    try:
        f(**given)
        became = "done"
    except (ValueError, FileNotFoundError) as error:  # the latter of a path with nothing there
        check_sentence(str(error))
        return "refused"
    except TypeError as error:
        if not re.search(r"missing \d+ required", str(error)):
            raise
        became = "incomplete"
    parameters = inspect.signature(f).parameters
    for argument, value in given.items():
        declared = parameters[argument].annotation
        if any(value is each for each in NEVER) and declared not in (Any, inspect.Parameter.empty):
            raise SilentDefault(f"{name}({argument}={value!r}) was taken")
    return became
