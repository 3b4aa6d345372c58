"""`CageModel` or `BearingModel` -> nested mapping or TOML text that `load_model` reads back to the same numbers; and a
TOML file with other ranges, in which everything else, comments included, stays as it was written.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import equinox as eqx

from ..models import AbstractForcedSystem, BearingModel, CageModel
from .description import ConfigError
from .disk import replacing
from .ranges import Range
from .schema import submodules, values
from .template import TABLE


def configuration(model: AbstractForcedSystem) -> dict[str, Any]:
    """Every parameter, choice and count of `model` in SI units, nested as the tables of its TOML file.

    **Raises:** `ConfigError` for a model with laws of a user, which no table can hold.
    """
    if not isinstance(model, CageModel | BearingModel):
        raise ConfigError(
            f"Argument `model` must be a cage or a bearing to be put into a file, but is a {type(model).__name__}."
        )
    if isinstance(model, BearingModel):
        return {"model": "bearing"} | _table(model)
    if model.extra:
        names = ", ".join(type(law).__name__ for law in model.extra)
        raise ConfigError(f"Argument `model` must have no forces of your own to be put into a file, but has {names}.")
    return _table(model)


def _table(module: eqx.Module) -> dict[str, Any]:
    fields = values(type(module))
    plain = lambda f: float(getattr(module, f.name)) if "parameter" in f.metadata else getattr(module, f.name)
    table: dict[str, Any] = {f.name: plain(f) for f in fields if getattr(module, f.name) is not None}
    for name, options in submodules(type(module)).items():
        if (below := getattr(module, name, None)) is not None:
            table[name] = ({"kind": below.kind} if len(options) > 1 else {}) | _table(below)
    return table


def toml_text(table: dict[str, Any], path: tuple[str, ...] = ()) -> str:
    """A nested mapping of numbers and texts as TOML; numbers keep every digit."""
    simple = [f"{key} = {_literal(v)}" for key, v in table.items() if not isinstance(v, dict)]
    head = [f"\n[{'.'.join(path)}]"] if path else []
    nested = [toml_text(v, (*path, key)) for key, v in table.items() if isinstance(v, dict)]
    return "\n".join([*head, *simple, *nested])


def _literal(value: float | int | str) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def save_model(path: str | Path, model: CageModel | BearingModel) -> Path:
    """Write `model` as a TOML file that `load_model` reads; if that fails, an earlier file
    stays as it was.
    """
    with replacing(path) as temporary:
        temporary.write_text(toml_text(configuration(model)) + "\n", encoding="utf-8")
    return Path(path)


def with_ranges(text: str, ranges: Mapping[str, tuple[Range, str]]) -> str:
    """`text` with other ranges.

    **Arguments:** TOML text; label of each value, such as `support.stiffness`, with its new range and SI unit.

    **Raises:** `ConfigError` for a value that is not written as `key = "..."` under its table.
    """
    lines, table, left = text.splitlines(), "", dict(ranges)
    for i, line in enumerate(lines):
        if head := TABLE.fullmatch(line):
            table = head[1].strip()
            continue
        value = re.match(r'(\s*([A-Za-z0-9_]+)\s*=\s*)("[^"]*"|\'[^\']*\')(\s*)(.*)', line)
        label = "" if value is None else ".".join(filter(None, (table, value[2])))
        if value is not None and label in left:
            new = f'{value[1]}"{_range_text(*left.pop(label))}"'
            lines[i] = f"{new} {value[5]}".rstrip()
    if left:
        raise ConfigError(
            f'`{"`, `".join(left)}` must be written as key = "range" below [table] for a new range to take its place.'
        )
    return "\n".join(lines) + "\n"


def _range_text(found: Range, unit: str) -> str:
    """A range as `read_range` reads it."""
    best, low, high = (re.sub(r"e\+?(-?)0*", r"e\1", f"{x:.4g}") for x in (found.best, found.lower, found.upper))
    return f"{best} ({low} .. {high})" + ("" if unit == "1" else f" {unit}")
