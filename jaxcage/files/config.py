"""TOML -> `CageModel` or `BearingModel`: tables mirror the modules, every value is checked against its declaration.
A file on a whole bearing contains `model = "bearing"`, or starts from one, `base = "nu2310"`. A file on a cage:

base = "1a"                  # optional: start from a published case and change what is listed
guidance_gap = "0.5 mm"      # numbers are SI, texts carry their unit
eccentricity = 30e-6

[lubricant]
grade = 68                   # or density, viscosity_1, temperature_1, viscosity_2, temperature_2
temperature = "70 degC"

[impact]
kind = "roller_pass"         # or "synchronous"

[impact.oscillator]
bar_mass = "4 g"
"""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx

from .._arguments import require_x64
from .._parameters import fields_from, parameter_paths
from ..bearing import CageMaterial, cage_body, listed, pocket_stiffness, vg
from ..forces import ImpactFromBearing
from ..models import case, whole_bearing
from .description import ConfigError, Description, Part, Ranges, describe, read_description
from .plausibility import check_together
from .ranges import Range
from .schema import modules


@dataclasses.dataclass(frozen=True)
class Unknown:
    """A quantity of which a file gives a range and no value."""

    label: str
    """Its name in the file."""
    names: tuple[str, ...]
    """Parameters that it sets, all to the same value."""
    range: Range


@dataclasses.dataclass(frozen=True, kw_only=True)
class BearingFile(Description):
    """Contents of a TOML file, and the model that it describes."""

    model: Any
    """A `CageModel` or a `BearingModel`."""
    unknowns: tuple[Unknown, ...]
    """Values of which the file gives a range only."""


def load_model(path: str | Path) -> Any:
    """The `CageModel` or `BearingModel` that the TOML file at `path` describes.

    **Raises:** as `read_bearing`.
    """
    return read_bearing(path).model


def read_bearing(path: str | Path) -> BearingFile:
    """The cage or the whole bearing that the TOML file at `path` describes, with speeds and unknowns.

    **Raises:** `ConfigError`, a `ValueError` whose message is one sentence that names the file, the key, the value
    given and what is allowed; `RuntimeError` without double precision.
    """
    found = read_description(path)
    try:
        return built(found)
    except ConfigError as error:
        raise ConfigError(f"File '{path}': {error}") from error


def model_from(table: Mapping[str, Any]) -> Any:
    """The `CageModel` or `BearingModel` that a nested mapping, as read from TOML, describes; a range counts with its
    best guess.

    **Raises:** `ConfigError`; `RuntimeError` without double precision.
    """
    return built(describe(table)).model


def built(found: Description) -> BearingFile:
    """A description with its model. **Raises:** as `model_from`."""
    require_x64()
    start = None if found.base is None else (case if found.subject == "cage" else whole_bearing)(found.base)
    root = found.root if found.material is None else _filled(found.root, found.material, start)
    model: Any = _build(root, start, ())
    check_together(model)
    return BearingFile(**vars(found), model=model, unknowns=_named(model, found.ranges))


def _filled(root: Part, material: CageMaterial, start: Any) -> Part:
    """A cage or bearing with the values that follow from the material of its cage, where it does not give them."""
    given, parts, values = root.parts.get("bearing"), dict(root.parts), root.values
    bearing: Any = start.bearing if given is None else _build(given, getattr(start, "bearing", None), ("bearing",))
    known: Any = lambda name: values.get(name, getattr(start, name, None))
    gap, land = known("guidance_gap"), known("inner_land_diameter") if known("guidance") == "inner" else None
    body, modulus = cage_body(bearing, gap, land), material.youngs_modulus
    own: dict[str, Any] = {"cage_mass": material.density * body.volume, **values}
    below: dict[str, dict[str, Any]] = {}
    if "pockets" in parts:
        own = {"cage_inertia": own["cage_mass"] * body.gyration, **own}
        stiffness = pocket_stiffness(bearing, gap, modulus)
        below["pockets"] = {"pocket_stiffness": stiffness, "pocket_friction": material.friction}
        below["wear"] = {"hardness": material.hardness}
    elif "impact" in parts and parts["impact"].module == ImpactFromBearing.__name__:
        below["impact"] = {"cage_modulus": modulus}
    for name, made in below.items():
        parts[name] = dataclasses.replace(parts[name], values={**made, **parts[name].values})
    return dataclasses.replace(root, values=own, parts=parts)


def _named(model: eqx.Module, ranges: Ranges) -> tuple[Unknown, ...]:
    """Ranges by the names that `jaxcage.replace` knows; a key that sets several parameters is one unknown."""
    short = {path: name for name, path in parameter_paths(model).items()}
    each = lambda path, names: tuple(short[(*path[:-1], name)] for name in names)
    return tuple(Unknown(".".join(path), each(path, names), found) for path, (found, names) in ranges.items())


def _build(part: Part, start: Any, path: tuple[str, ...]) -> eqx.Module:
    """The module of a table; values not in the table come from `start`, or from the defaults."""
    kind, values = modules()[part.module], dict(part.values)
    for key, make in _READY_MADE.items():
        if key in values:
            start = make(values.pop(key))
    start = start if isinstance(start, kind) else None
    arguments = {} if start is None else {f.name: getattr(start, f.name) for f in dataclasses.fields(kind)}
    below = {name: _build(x, getattr(start, name, None), (*path, name)) for name, x in part.parts.items()}
    arguments |= {**values, **below}
    try:
        return kind(**fields_from(kind, arguments))
    except ValueError as error:
        raise ConfigError(f"Table `{'.'.join(path)}`: {error}" if path else str(error)) from error


_READY_MADE: dict[str, Callable[[Any], eqx.Module]] = {
    "designation": lambda given: listed(given).bearing,
    "grade": vg,
}
"""Keys by which a table starts from a ready-made module."""
