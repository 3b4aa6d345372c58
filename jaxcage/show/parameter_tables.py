"""Tables of parameters with their units and sources, and of differences of two designs; readings of the paper."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

from .._allowed import SOURCES
from .._parameters import EXTRA, get, parameter_paths, readings_of, walk
from ..files import BearingFile, configuration, is_range
from ..models import AbstractForcedSystem
from .tables import OWN, UNIT, Column, Table, table as table_of


SHOWN = {"m^2/s": ("mm²/s", 1e6, 0.0), "K": ("°C", 1.0, -273.15), "Pa": ("GPa", 1e-9, 0.0), "1": ("", 1.0, 0.0)}
"""Display unit of a parameter, factor from SI, and offset."""
READY_MADE = {("bearing", "designation"): "catalogue, {}", ("lubricant", "grade"): "grade {}"}
BY_MATERIAL = {
    *(("cage_mass",), ("cage_inertia",), ("impact", "cage_modulus")),
    *(("pockets", "pocket_stiffness"), ("pockets", "pocket_friction"), ("wear", "hardness")),
}
"""Paths of parameters that follow from the material of the cage."""
PUBLISHED = {
    ("bearing", "inner_raceway_diameter"): "catalogue",
    ("bearing", "palmgren_constant"): "default",
    ("bearing", "roller_material"): "default",
    ("bearing",): "paper, Table 1",
    ("guidance_gap",): "paper, Table 2",
    ("eccentricity",): "paper, Table 2",
    ("lubricant", "temperature"): "default",
    ("lubricant",): "paper, Table 2, read as a grade",
}
"""Sources of a published case by path, of which the longest match counts; the paper does not print the rest."""
READINGS = {"clearance_reading": "radial clearance", "unbalance": "unbalance"}


def sources_table(model: AbstractForcedSystem, file: BearingFile | None) -> Table:
    """Table of the parameters of `model` in display units, with their ranges and sources. Constants and zeros that the
    file does not give are left out; None is the file of a published case."""
    rows, table, left = [], file and file.table, file.left if file else ()
    ranges = {name: each.range for each in (file.unknowns if file else ()) for name in each.names}
    short = {path: name for name, path in parameter_paths(model).items()}
    for path, field in walk(model):
        value, text, unit, between = get(model, path), field.metadata.get("text", ""), "", None
        info, name, first = field.metadata.get("parameter"), ".".join(path), path[0]
        given = None if table is None else _given(path, table)
        if info is not None:
            if given is None and (info.source == SOURCES["fixed"] or not float(value)):
                continue
            unit, number = shown(float(value), info.unit)
            text, value = info.text, estimate(number) if file and name in file.estimated else f"{number:.6g}"
            if (known := ranges.get(short[path])) is not None:
                between = " to ".join(f"{shown(end, info.unit, unit)[1]:.4g}" for end in (known.lower, known.upper))
        if {name, name.removesuffix("_x").removesuffix("_y")} & set(left):
            source = "not confirmed: as `jaxcage init` wrote it"
        elif file and name in file.estimated and first == "bearing":
            source = "estimated from dimensions"
        elif first == EXTRA:
            source = "a force of your own"
        else:
            source = _published(model, path, field) if table is None else _in_file(path, table, given)
        row = {"part": " ".join(path[:-1]).replace("_", " ") or "cage", "parameter": text, "value": str(value)}
        rows.append(row | {"shown": unit, "range": between, "from": source, "name": name})
    between = ["range"] if ranges else []
    columns = ["part", "parameter", "value", *between, Column("unit", "shown", nothing=""), "from"]
    return table_of("Parameters; constants, and terms that are 0, are left out", rows, columns)


def shown(value: float, unit: str, like: str = "") -> tuple[str, float]:
    """Display unit of a value [SI], and the value in it; of a length the unit `like` if one is given."""
    if unit == "m":
        name = like or ("µm" if abs(value) < 1e-4 else "mm")
        return name, value * (1e6 if name == "µm" else 1e3)
    name, times, offset = SHOWN.get(unit, (unit, 1.0, 0.0))
    if name == "GPa" and abs(value) < 1e7:
        return unit, value
    return name, value * times + offset


def estimate(value: float) -> str:
    """An estimated value with three digits."""
    return f"{float(f'{value:.3g}'):.4g}"


def _published(model: AbstractForcedSystem, path: tuple[str, ...], field: dataclasses.Field) -> str:
    for n in range(len(path), 0, -1):
        if path[:n] in PUBLISHED:
            return PUBLISHED[path[:n]]
    own = field.default is not dataclasses.MISSING and bool(get(model, path) == field.default)
    return "default" if own else "identified, not printed"


def _given(path: tuple[str, ...], table: Mapping[str, Any]) -> Any:
    """The value of a parameter in a file; None if the file does not give it."""
    here: Any = table
    for name in path:
        here = here.get(name) if isinstance(here, Mapping) else None
    part = table.get(path[0])
    if here is None and path[-1] in ("stiffness_x", "stiffness_y") and isinstance(part, Mapping):
        here = part.get("stiffness")
    return here


def _in_file(path: tuple[str, ...], table: Mapping[str, Any], given: Any) -> str:
    if given is not None:
        return "best guess in a range of this file" if isinstance(given, str) and is_range(given) else "this file"
    if "material" in table and path in BY_MATERIAL:
        return f"material {table['material']}"
    part = table.get(path[0])
    if path == ("drag", "rolling_coefficient") and "designation" in table.get("bearing", {}):
        return f"series of {table['bearing']['designation']}"
    for (made, key), words in READY_MADE.items():
        if path[0] == made and isinstance(part, Mapping) and key in part:
            return "default" if path[1:] == ("temperature",) else words.format(part[key])
    replaced = isinstance(part, Mapping) and "kind" in part  # by another law than that of the base
    return f"case {table['base']}" if "base" in table and not replaced else "default"


def readings_words(model: Any) -> str:
    """Readings in one line: `radial clearance c = C_r/2 ("radial"), unbalance M e omega^2 ("physical")`."""
    return ", ".join(f'{READINGS[name]} {words} ("{chosen}")' for name, (chosen, words) in readings_of(model).items())


def values_words(model: AbstractForcedSystem, names: Sequence[str]) -> list[str]:
    """Parameters by dotted name, each with its value: `bearing.radial_clearance = 67.5 µm`."""
    fields = {".".join(path): (get(model, path), field.metadata.get("parameter")) for path, field in walk(model)}
    words = []
    for name in names:
        value, info = fields[name]
        unit, number = ("", value) if info is None else shown(float(value), info.unit)
        words.append(f"{name} = {estimate(number)} {unit}".rstrip())
    return words


def differences(models: Sequence[Any]) -> list[dict[str, Any]]:
    """Differences of two designs: dotted name, text, both values [SI], unit and relative change of each."""
    flat = [_flat(configuration(model)) for model in models]
    about = {".".join(path): field.metadata for model in models for path, field in walk(model)}
    found = []
    for path in dict.fromkeys([*flat[0], *flat[1]]):
        before, after = values = [each.get(path) for each in flat]
        if before == after:
            continue
        info = about.get(path, {}).get("parameter")
        row = {"name": path, "text": (info.text if info else about.get(path, {}).get("text")) or path, "values": values}
        numbers = all(isinstance(v, float | int) and math.isfinite(v) for v in values)
        change = after / before - 1 if numbers and before and (info is None or info.unit != "K") else None
        found.append(row | {"unit": info.unit if info else "1", "change": change})
    return found


def differences_table(names: Sequence[str], models: Sequence[Any]) -> Table:
    """Table of every value in which two designs differ."""
    text = lambda x: x if x is None or isinstance(x, float) else str(x)
    rows = [row | dict(zip(names, map(text, row["values"]), strict=True)) for row in differences(models)]
    columns = [Column("value", "text"), *(Column(name, unit=OWN) for name in names), UNIT]
    columns.append(Column("change", shown="%", digits=1))
    return table_of(f"Differences between {' and '.join(names)}", rows, columns, "differences", empty="nothing")


def _flat(nested: Mapping[str, Any], path: tuple[str, ...] = ()) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in nested.items():
        found |= _flat(value, (*path, key)) if isinstance(value, Mapping) else {".".join((*path, key)): value}
    return found
