"""`CageModel` or `BearingModel` -> nested mapping or TOML text that `load_model` reads back to the same numbers."""

from pathlib import Path
from typing import Any

import equinox as eqx

from ..models import BearingModel, CageModel
from ._config import kind_name
from ._files import replacing
from ._schema import ConfigError, submodules, values


def configuration(model: CageModel | BearingModel) -> dict[str, Any]:
    """Every parameter, choice and count of `model` in SI units, nested as the tables of its TOML
    file.

    **Raises:** `ConfigError` for a model with forces of its user's own, which no table can hold.
    """
    if isinstance(model, BearingModel):
        return {"model": "bearing"} | _table(model)
    if model.extra:
        names = ", ".join(type(law).__name__ for law in model.extra)
        raise ConfigError(f"Argument `model` must have no forces of your own to be put into a file, but has {names}.")
    return _table(model)


def _table(module: eqx.Module) -> dict[str, Any]:
    fields = list(values(type(module)))
    plain = lambda f: float(getattr(module, f.name)) if "parameter" in f.metadata else getattr(module, f.name)
    table: dict[str, Any] = {f.name: plain(f) for f in fields}
    for name, options in submodules(type(module)).items():
        below = getattr(module, name)
        kind = {"kind": kind_name(below)} if len(options) > 1 else {}
        table[name] = kind | _table(below)
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
    """Write `model` as a TOML file that `load_model`, or `load_whole_bearing`, reads; an earlier file stays whole if
    that fails.
    """
    with replacing(path) as temporary:
        temporary.write_text(toml_text(configuration(model)) + "\n", encoding="utf-8")
    return Path(path)
