"""Physical parameters as fields of modules, each with its unit, allowed range and description.

They serve the configuration reader, `replace` and `parameters` (access by name), and every table of parameters.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, PyTree

from ._allowed import SOURCES, UNKNOWN, Kind, ParameterInfo, allowed, must_be_given, within
from ._errors import ArgumentError, InputError, parameters_like, shown


M = TypeVar("M", bound=eqx.Module)


EXTRA = "extra"
"""Prefix of the parameters of user-defined laws, declared or not, e.g. `extra.MyDrag.coefficient`."""


def _as_leaf(x: Any) -> Any:
    """Convert Python numbers to float64 arrays; arrays, tracers and placeholders pass unchanged."""
    return jnp.asarray(np.asarray(x, dtype=float)) if isinstance(x, int | float) else x


_NO_NUMBERS = (str, bytes, bool, complex, list, tuple, dict, set, np.ma.MaskedArray)


def _leaf_of(info: ParameterInfo, x: Any) -> Any:
    """Convert the value of a declared parameter. **Raises:** as `require_range`."""
    if said := _wrong(x, info):
        raise InputError(f"The {info.text} {said}")
    return _as_leaf(x)


def require_range(name: str, value: Any, info: ParameterInfo) -> None:
    """Require a number or an array within the range of a parameter; traced ones pass. **Raises:** `ValueError`."""
    if said := _wrong(value, info):
        raise ArgumentError(name, said=said)


def _wrong(x: Any, info: ParameterInfo) -> str:
    """Message about a value that a parameter does not allow; empty if it does, and for placeholders."""
    if isinstance(x, _NO_NUMBERS) or (isinstance(x, np.ndarray | np.generic) and x.dtype.kind not in "iuf"):
        return f"{allowed(info)}, but {shown(x)} was given."
    if isinstance(x, Tracer) or not isinstance(x, int | float | np.ndarray | np.generic | jax.Array):
        return ""
    numbers = np.asarray(x, dtype=float)
    out = numbers[~within(numbers, info.lower, info.upper)]
    unit = "" if info.unit in ("1", UNKNOWN) else f" {info.unit}"
    return f"{allowed(info)}, but is {out.flat[0]:g}{unit}." if out.size else ""


def parameter(
    unit: str,
    lower: float,
    upper: float,
    text: str,
    *,
    kind: Kind = "fixed",
    source: str = "",
    **kwargs: Any,
) -> Any:
    """Declare a differentiable parameter of a module, with its SI `unit` and the closed range `[lower, upper]` allowed.

    `kind` is the kind of its source, as in `SOURCES`; `source` says how to measure it.

    **Raises:** `ValueError` for a unit that is not made of 1, rad, K, kg, m, s, N, Pa.
    """
    if unit != UNKNOWN:
        unit_dimensions(unit)
    info = ParameterInfo(unit, lower, upper, text, kind, source or SOURCES[kind])
    return eqx.field(converter=functools.partial(_leaf_of, info), metadata={"parameter": info}, **kwargs)


def choice(*options: str, text: str, **kwargs: Any) -> Any:
    """Declare a static field that takes one of `options`."""
    return eqx.field(static=True, metadata={"choice": options, "text": text}, **kwargs)


NOT_GIVEN: Any = None
"""Placeholder for a reading that was not chosen; `__check_init__` rejects it."""


def reading(text: str, **options: str) -> Any:
    """Declare a choice between readings of the paper without a default; `options` describes each in words. A module
    that holds one calls `require_readings` when it is created."""
    metadata = {"choice": tuple(options), "text": text, "readings": options}
    return eqx.field(static=True, default=NOT_GIVEN, metadata=metadata)


def require_readings(module: eqx.Module) -> None:
    """Require a valid choice for each reading of `module`. **Raises:** `ValueError` for one that is missing or
    unknown."""
    fields = [f for f in dataclasses.fields(module) if "readings" in f.metadata]
    missing = [f for f in fields if getattr(module, f.name) is NOT_GIVEN]
    if missing:
        first, *rest = missing
        also = "".join(f", and `{f.name}` {must_be_given(f.metadata['readings'])}" for f in rest)
        raise ArgumentError(first.name, said=f"{must_be_given(first.metadata['readings'])}{also}.")
    for field in fields:
        if (given := getattr(module, field.name)) not in field.metadata["choice"]:
            offered = ", ".join(field.metadata["choice"])
            raise ArgumentError(field.name, said=f"must be one of {offered}, but {given!r} was given.")


def readings_of(module: eqx.Module) -> dict[str, tuple[str, str]]:
    """Chosen reading and its description, by name."""
    fields = [f for f in dataclasses.fields(module) if "readings" in f.metadata]
    return {f.name: (getattr(module, f.name), f.metadata["readings"][getattr(module, f.name)]) for f in fields}


def count(lower: int, upper: int, text: str, **kwargs: Any) -> Any:
    """Declare a static integer field, e.g. a number of rollers."""
    return eqx.field(static=True, metadata={"count": (lower, upper), "text": text}, **kwargs)


def with_numbers(modules: Any) -> Any:
    """Convert plain numbers in a user's modules to differentiable leaves."""
    return jax.tree.map(lambda x: x if isinstance(x, bool) else _as_leaf(x), modules)


def part_path(part: Any) -> tuple[str, ...]:
    """Path of a part that a model holds in a tuple: `film` by its name, a user's law as `extra.MyDrag`."""
    name = getattr(type(part), "law_name", "")
    return (name,) if name else (EXTRA, type(part).__name__)


def fields_from(kind: type, parts: Mapping[str, Any], laws: tuple[Any, ...] = ()) -> dict[str, Any]:
    """Values of the fields of `kind` from parts by name.

    Other names are laws in the tuple `forces`: each replaces the law of that name in `laws`, and `extra` replaces all
    laws without a name.
    """
    fields = {f.name for f in dataclasses.fields(kind)}
    given = {name: part for name, part in parts.items() if name not in fields}
    values = {name: part for name, part in parts.items() if name in fields}
    if given:
        kept = [law for law in values.get("forces", laws) if part_path(law)[0] not in given]
        own = given.pop(EXTRA, ())
        values["forces"] = (*kept, *given.values(), *(own if isinstance(own, tuple) else (own,)))
    return values


Declared = tuple[tuple[str, ...], dataclasses.Field]
"""Path of attribute names to a declared field, and the field."""


def walk(module: eqx.Module) -> tuple[Declared, ...]:
    """All declared fields below `module`, depth first, and the plain numbers of user-defined laws."""
    leaves, structure = jax.tree.flatten(module)
    return _declared(structure, tuple(eqx.is_inexact_array(leaf) for leaf in leaves))


@functools.lru_cache(maxsize=256)
def _declared(structure: Any, is_number: tuple[bool, ...]) -> tuple[Declared, ...]:
    """Declared fields of modules of one structure; cached, since every change of a design asks for them."""

    def below(module: eqx.Module, path: tuple[str, ...], own: bool) -> Iterator[Declared]:
        for field in dataclasses.fields(module):
            value, here = getattr(module, field.name), (*path, field.name)
            if isinstance(value, eqx.Module):
                yield from below(value, here, own)
            elif isinstance(value, tuple) and all(isinstance(each, eqx.Module) for each in value):
                for each in value:
                    yield from below(each, (*path, *part_path(each)), part_path(each)[0] == EXTRA)
            elif value is not None and {"parameter", "choice", "count"} & set(field.metadata):
                yield here, field
            elif own and value is True and not field.metadata.get("static"):
                yield here, parameter(UNKNOWN, -math.inf, math.inf, field.name.replace("_", " "))

    return tuple(below(jax.tree.unflatten(structure, is_number), (), False))


def get(module: Any, path: tuple[str, ...]) -> Any:
    for name in path:
        module = _part(module, name)
    return module


def _part(module: Any, name: str) -> Any:
    """Attribute of a module, or the member of a tuple of modules with this class name."""
    if isinstance(module, tuple):
        return next(each for each in module if type(each).__name__ == name)
    return getattr(module, name)


def parameter_paths(module: eqx.Module) -> dict[str, tuple[str, ...]]:
    """Path of each differentiable parameter by name; dotted in `extra`, and where the last word is ambiguous."""
    paths = [path for path, field in walk(module) if "parameter" in field.metadata]
    last = [path[-1] for path in paths if path[0] != EXTRA]
    return {(p[-1] if p[0] != EXTRA and last.count(p[-1]) == 1 else ".".join(p)): p for p in paths}


def parameters(module: eqx.Module) -> dict[str, Array]:
    """List the differentiable parameters of `module`, a model or a part of one.

    **Returns:** values [SI] by name, as `replace` accepts them. **Raises:** `ValueError` for anything else.
    """
    _require_module(module)
    return {name: get(module, path) for name, path in parameter_paths(module).items()}


def parameter_info(module: eqx.Module) -> dict[str, ParameterInfo]:
    """Describe the differentiable parameters of `module`, a model or a part of one.

    **Returns:** unit, range and description by name. **Raises:** `ValueError` for anything else.
    """
    _require_module(module)
    infos = {path: field.metadata["parameter"] for path, field in walk(module) if "parameter" in field.metadata}
    return {name: infos[path] for name, path in parameter_paths(module).items()}


def _require_module(module: Any) -> None:
    if not isinstance(module, eqx.Module):
        raise ArgumentError("module", said=f"must be a model or a part of one, but {shown(module)} was given.")


_BASES = {  # exponents of mass, length and time
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "K": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "N": (1, 1, -2),
    "Pa": (1, -1, -2),
}


def unit_dimensions(unit: str) -> dict[str, float]:
    """Exponents of mass, length and time in a unit such as `N s/m` or `N/m^(10/9)`. **Raises:** `ValueError` for a unit
    that is not made of 1, rad, K, kg, m, s, N, Pa."""
    above, _, below = unit.partition("/")
    wanted = f"must be made of {', '.join(_BASES)}, with powers as in `N s^2/m^2`"
    total = [0.0, 0.0, 0.0]
    for sign, factors in ((1, above), (-1, below)):
        for factor in factors.split():
            base, _, power = factor.partition("^")
            if base not in _BASES:
                raise ArgumentError("unit", said=f"{wanted}, but '{unit}' was given.")
            exponent = sign * float(Fraction(power.strip("()") or "1"))
            total = [t + exponent * b for t, b in zip(total, _BASES[base], strict=True)]
    return dict(zip(("mass", "length", "time"), total, strict=True))


def parameter_dimensions(module: eqx.Module) -> dict[str, dict[str, float]]:
    """Exponents of mass, length and time of every differentiable parameter, by name; NaN where the unit is unknown."""
    unknown = {"mass": math.nan, "length": math.nan, "time": math.nan}
    units = {name: info.unit for name, info in parameter_info(module).items()}
    return {name: unknown if unit == UNKNOWN else unit_dimensions(unit) for name, unit in units.items()}


def choice_paths(module: eqx.Module) -> dict[str, tuple[str, ...]]:
    """Path of each static choice and count by dotted name, e.g. `film.model`."""
    found = [path for path, field in walk(module) if "parameter" not in field.metadata]
    return {".".join(path): path for path in found}


def replace(module: M, **values: PyTree) -> M:
    """Copy a model with named parameters or parts replaced; `module` itself does not change.

    **Arguments:** a model or a part of one; parameters by name [SI], `replace(model, guidance_gap=0.5e-3)`; choices and
    counts by dotted name through a dictionary, `replace(model, **{"film.model": "positive_pressure"})`; and whole parts
    of the model, `replace(model, rib=ElasticRib(...))`, `replace(model, extra=(MyDrag(3.0),))`.

    **Returns:** the copy. **Raises:** `ValueError` for an unknown name, a value out of its range, or an option that a
    choice does not offer.
    """
    _require_module(module)
    paths, fields = parameter_paths(module) | choice_paths(module), dict(walk(module))
    parts = {f.name for f in dataclasses.fields(module) if isinstance(getattr(module, f.name), eqx.Module)}
    if laws := getattr(module, "forces", ()):
        parts |= {"forces", EXTRA, *(part_path(law)[0] for law in (*laws, *values.values()))}
    for name, value in values.items():
        if name in parts:
            continue
        if name not in paths:
            known = parameters_like(name, [*paths, *sorted(parts)])
            raise ArgumentError(name, said=f"must name a part of the model: {known}.")
        metadata = fields[paths[name]].metadata
        if (offered := metadata.get("choice")) and value not in offered:
            raise ArgumentError(name, said=f"must be one of {', '.join(offered)}, but {value!r} was given.")
        if info := metadata.get("parameter"):
            require_range(name, value, info)
    return _changed(module, {(name,) if name in parts else paths[name]: value for name, value in values.items()})


def _changed(module: Any, changes: Mapping[tuple[str, ...], Any]) -> Any:
    """Copy of `module` with the values at these paths replaced; each part is checked once, after all its changes."""
    parts: dict[str, Any] = {}
    for name in dict.fromkeys(path[0] for path in changes):
        whole = changes[(name,)] if (name,) in changes else _part(module, name)
        inside = {path[1:]: value for path, value in changes.items() if path[0] == name and len(path) > 1}
        parts[name] = _changed(whole, inside) if inside else whole
    if isinstance(module, tuple):
        return tuple(parts.get(type(each).__name__, each) for each in module)
    given, copy = fields_from(type(module), parts, getattr(module, "forces", ())), object.__new__(type(module))
    for field in dataclasses.fields(module):
        value = getattr(module, field.name)
        if field.name in given:
            value = field.metadata.get("converter", lambda x: x)(given[field.name])
        object.__setattr__(copy, field.name, value)
    for kind in type(module).__mro__:
        if check := vars(kind).get("__check_init__"):
            check(copy)
    return copy


Parameter = str | Callable[[Any], Any]
"""Name of a parameter, or a function that picks it from a model."""


def pick(model: Any, parameter: Parameter, name: str = "parameter") -> Callable[[Any], Any]:
    """Function that picks a parameter, given as the argument `name`, from a model.

    **Raises:** `ValueError` for an unknown name, or a function that returns none of the model's numbers.
    """
    if callable(parameter):
        picked = parameter(model)
        if not any(picked is leaf for leaf in jax.tree.leaves(model)) or jnp.ndim(picked):
            said = "must pick a number that the system holds as it is, such as `lambda s: s.acceleration.force`"
            raise ArgumentError(name, said=f"{said}, but picks something else.")
        return parameter
    paths = parameter_paths(model) or _by_field_name(model)
    if parameter not in paths:
        known = parameters_like(parameter, ["speed", *paths])
        raise ArgumentError(name, said=f"must be {known}, but '{parameter}' was given.")
    path = paths[parameter]
    return lambda m: get(m, path)


def _by_field_name(model: Any) -> dict[str, tuple[str, ...]]:
    """Paths of the numbers of a user's module by the last word, or by dotted name where that is ambiguous."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(model)
    paths: list[tuple[str, ...]] = []
    for path, leaf in leaves:
        names = tuple(key.name for key in path if isinstance(key, jax.tree_util.GetAttrKey))
        public = len(names) == len(path) and not any(name.startswith("_") for name in names)
        if public and (isinstance(leaf, float) or eqx.is_inexact_array(leaf)) and jnp.ndim(leaf) == 0:
            paths.append(names)
    last = [path[-1] for path in paths]
    return {(path[-1] if last.count(path[-1]) == 1 else ".".join(path)): path for path in paths}
