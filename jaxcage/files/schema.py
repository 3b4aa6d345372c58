"""Tables, keys, units, ranges and options of a configuration, derived from the fields of the modules. Whoever changes a
declaration runs `python -m jaxcage.files.schema`, which writes them to `schema.json`, where `description` reads them.
"""

import dataclasses
import json
import typing
from collections.abc import Callable
from typing import Any

import equinox as eqx

from .._arguments import enable_x64, options
from .._parameters import parameters
from ..bearing import PUBLISHED_CASES, catalogue
from ..forces import LAWS
from ..models import NEEDED, WHOLE_BEARINGS, BearingModel, CageModel, case, whole_bearing
from .description import SCHEMA


SUBJECTS: dict[str, tuple[type[eqx.Module], Callable[[str], Any], list[str]]] = {
    "cage": (CageModel, case, [*PUBLISHED_CASES]),
    "bearing": (BearingModel, whole_bearing, [*WHOLE_BEARINGS]),
}
"""Subject of a file -> its model, and those to start from."""
GUIDE = ("guidance_gap", "eccentricity", "cage_mass", "cage_inertia", "land_width")
"""Numbers of the ready-made models, besides those of their bearings, that are checked before a model is built."""


def submodules(kind: type[eqx.Module]) -> dict[str, tuple[type[eqx.Module], ...]]:
    """Table name -> the modules it admits, for the fields of `kind` that are tables, and for its laws."""
    hints, found = typing.get_type_hints(kind), {}
    for field in dataclasses.fields(kind):
        if field.name == "forces":
            for law in LAWS:
                found[law.law_name] = (*found.get(law.law_name, ()), law)
            continue
        admitted = tuple(m for m in options(hints[field.name]) if isinstance(m, type) and issubclass(m, eqx.Module))
        if admitted:  # a choice of laws admits several, and a number none
            found[field.name] = admitted
    return found


def values(kind: type[eqx.Module]) -> list[dataclasses.Field]:
    """The fields of `kind` that are parameters, choices or counts."""
    return [f for f in dataclasses.fields(kind) if {"parameter", "choice", "count"} & set(f.metadata)]


def modules() -> dict[str, type[eqx.Module]]:
    """Every module that a configuration can build, by name."""
    found: dict[str, type[eqx.Module]] = {}
    left = [model for model, *_ in SUBJECTS.values()]
    while left:
        kind = left.pop(0)
        found[kind.__name__] = kind
        left += [below for several in submodules(kind).values() for below in several]
    return found


def schema() -> dict[str, Any]:
    """The declarations of all modules, as JSON can hold them."""

    def sizes(bearing: Any) -> dict[str, float]:
        plain = {f.name: getattr(bearing, f.name) for f in values(type(bearing))}
        return {name: x if name == "n_rollers" else float(x) for name, x in plain.items() if x is not None}

    def guide(model: Any) -> dict[str, float]:
        known = parameters(model)
        return {name: float(known[name]) for name in GUIDE if name in known} | sizes(model.bearing)

    subjects = {
        name: {"module": model.__name__, "bases": {base: guide(make(base)) for base in bases}}
        for name, (model, make, bases) in SUBJECTS.items()
    }
    bearings = {name: sizes(each.bearing) for name, each in catalogue().items()}
    return {
        "subjects": subjects,
        "catalogue": bearings,
        "modules": {name: _declared(kind) for name, kind in modules().items()},
    }


def _declared(kind: type[eqx.Module]) -> dict[str, Any]:
    without = [f.name for f in dataclasses.fields(kind) if f.default is f.default_factory is dataclasses.MISSING]
    needed = [name for field in without for name in (NEEDED if field == "forces" else (field,))]
    found: dict[str, Any] = {"kind": name} if (name := getattr(kind, "kind", "")) else {}
    found["values"] = {f.name: _value(f) for f in values(kind)}
    found["tables"] = {name: [each.__name__ for each in several] for name, several in submodules(kind).items()}
    return found | {"needed": needed}


def _value(field: dataclasses.Field) -> dict[str, Any]:
    if info := field.metadata.get("parameter"):
        return {name: getattr(info, name) for name in ("unit", "lower", "upper")}
    return {key: field.metadata[key] for key in ("choice", "count", "readings") if key in field.metadata}


if __name__ == "__main__":
    enable_x64()
    found = schema()
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(each)}" for name, each in found["modules"].items())
    known = ",\n".join(f'"{name}": {json.dumps(found[name])}' for name in ("subjects", "catalogue"))
    text = f'{{{known},\n"modules": {{\n{lines}\n}}}}\n'
    SCHEMA.write_text(text, encoding="utf-8")
