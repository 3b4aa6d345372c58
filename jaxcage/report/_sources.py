"""Every parameter of a model with its unit, where its value comes from, and how the model reads what the paper leaves
open, which is said beside everything that rests on it.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from .._parameters import EXTRA, get, readings_of, walk
from ..io import is_range
from ..models import BearingModel, CageModel


_SHOWN = {
    "m^2/s": ("mm²/s", 1e6, 0.0),
    "K": ("°C", 1.0, -273.15),
    "Pa": ("GPa", 1e-9, 0.0),
    "1": ("", 1.0, 0.0),
}
"""Unit in which people read a quantity, the factor from SI, and what is added."""
_READY_MADE = {("bearing", "designation"): "catalogue, {}", ("lubricant", "grade"): "grade {}"}
_PUBLISHED = {
    ("bearing", "inner_raceway_diameter"): "catalogue",
    ("bearing", "palmgren_constant"): "default",
    ("bearing", "roller_material"): "default",
    ("bearing",): "paper, Table 1",
    ("guidance_gap",): "paper, Table 2",
    ("eccentricity",): "paper, Table 2",
    ("lubricant", "temperature"): "default",
    ("lubricant",): "paper, Table 2, read as a grade",
}
"""What the paper gives of a published case, the longest path first; all else it does not print."""
_READINGS = {"clearance_reading": "radial clearance", "unbalance": "unbalance"}


@dataclasses.dataclass(frozen=True)
class Row:
    """One parameter, choice or count."""

    path: tuple[str, ...]
    text: str
    value: str
    unit: str
    source: str

    @property
    def group(self) -> str:
        """The part of the model that it belongs to."""
        return self.path[0].replace("_", " ") if len(self.path) > 1 else "cage"

    @property
    def name(self) -> str:
        """Its name in a configuration, without the table."""
        return ".".join(self.path[1:] or self.path)


def parameter_rows(
    model: CageModel | BearingModel, table: Mapping[str, Any] | None, left: Sequence[str] = ()
) -> list[Row]:
    """All parameters of `model` in the units people read.

    **Arguments:** the model; the nested mapping that it was read from, None for a published case; values that are still
    those of the template, by dotted name.
    """
    rows = []
    for path, field in walk(model):
        value, text = get(model, path), field.metadata.get("text", "")
        unit = ""
        if "parameter" in field.metadata:
            info = field.metadata["parameter"]
            text, (unit, value) = info.text, shown(float(value), info.unit)
            value = f"{value:.6g}"
        rows.append(Row(path, text, str(value), unit, _source(model, path, field, table, left)))
    return rows


def shown(value: float, unit: str) -> tuple[str, float]:
    """The unit in which a value [SI] is read, and the value in it."""
    if unit == "m":
        name, factor = ("µm", 1e6) if abs(value) < 1e-4 else ("mm", 1e3)
        return name, value * factor
    name, factor, shift = _SHOWN.get(unit, (unit, 1.0, 0.0))
    if name == "GPa" and abs(value) < 1e7:
        return unit, value
    return name, value * factor + shift


def _source(
    model: CageModel | BearingModel,
    path: tuple[str, ...],
    field: dataclasses.Field,
    table: Mapping[str, Any] | None,
    left: Sequence[str],
) -> str:
    if {".".join(path), ".".join(path).removesuffix("_x").removesuffix("_y")} & set(left):
        return "the template's, not yours"
    if path[0] == EXTRA:
        return "a force of your own"
    if table is None:
        for start in (path[:n] for n in range(len(path), 0, -1)):
            if start in _PUBLISHED:
                return _PUBLISHED[start]
        own = field.default is not dataclasses.MISSING and bool(get(model, path) == field.default)
        return "default" if own else "identified, not printed"
    here: Any = table
    for name in path:
        here = here.get(name) if isinstance(here, Mapping) else None
    if here is None and path[-1] in ("stiffness_x", "stiffness_y") and isinstance(table.get(path[0]), Mapping):
        here = table[path[0]].get("stiffness")
    if here is not None:
        return "best guess in a range of this file" if isinstance(here, str) and is_range(here) else "this file"
    for (part, key), words in _READY_MADE.items():
        given = table.get(part)
        if path[0] == part and isinstance(given, Mapping) and key in given:
            return "default" if path[1:] == ("temperature",) else words.format(given[key])
    return f"case {table['base']}" if "base" in table and path[0] not in _replaced(table) else "default"


def _replaced(table: Mapping[str, Any]) -> set[str]:
    """Parts of the base that another law takes the place of."""
    return {part for part, given in table.items() if isinstance(given, Mapping) and "kind" in given}


def readings_document(model: CageModel) -> dict[str, str]:
    """The readings for programs."""
    return {name: chosen for name, (chosen, _) in readings_of(model).items()}


def readings_words(model: CageModel) -> str:
    """The readings in one line: `radial clearance c = C_r/2 ("radial"), unbalance M e omega^2 ("physical")`."""
    return ", ".join(f'{_READINGS[name]} {words} ("{chosen}")' for name, (chosen, words) in readings_of(model).items())


def short_readings(model: CageModel) -> str:
    """For titles of figures."""
    gap = {"radial": "c = C_r/2", "as_printed": "c = C_r"}[model.clearance_reading]
    return f"{gap}, {'physical' if model.unbalance == 'physical' else 'printed'} unbalance"
