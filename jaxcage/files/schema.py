"""Tables, keys, units, ranges and options of a configuration, derived from the fields of the modules."""

import dataclasses
import math
import typing
from typing import Any

import equinox as eqx

from .._arguments import options
from .._errors import InputError
from .._parameters import ParameterInfo, allowed as must_be, within
from ..forces import LAWS
from .ranges import Range, is_range, read_range
from .units import printable, shown, to_si


class ConfigError(InputError):
    """A configuration that is refused; the message is one sentence that names the key and what it may be."""


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


def read_value(name: str, value: Any, field: dataclasses.Field) -> Any:
    """`value` as the configuration gives it, checked against the declaration of `field`.

    **Raises:** `ConfigError`.
    """
    if "choice" in field.metadata:
        if value not in field.metadata["choice"]:
            offered = ", ".join(field.metadata["choice"])
            raise ConfigError(f"`{name}` must be one of {offered}, but is {shown(value)}.")
        return value
    if "count" in field.metadata:
        lower, upper = field.metadata["count"]
        if isinstance(value, bool) or not isinstance(value, int) or not lower <= value <= upper:
            raise ConfigError(f"`{name}` must be a whole number from {lower} to {upper}, but is {shown(value)}.")
        return value
    return _read_number(name, value, field.metadata["parameter"])


class Known(float):
    """Best guess of a value that is known within a range only."""

    range: Range

    def __new__(cls, found: Range) -> "Known":
        number = super().__new__(cls, found.best)
        number.range = found
        return number


def _read_number(name: str, value: Any, info: ParameterInfo) -> float:
    unit = "" if info.unit == "1" else f" {info.unit}"
    allowed = f"`{name}` {must_be(info)}"
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ConfigError(f"{allowed}, but is {shown(value)}.")
    try:
        if isinstance(value, str) and is_range(value):
            number = Known(read_range(value, info.unit))
        else:
            number = to_si(value, info.unit) if isinstance(value, str) else float(value)
    except ValueError as error:
        raise ConfigError(f"{allowed}, but {error}.") from error
    except OverflowError as error:  # of a whole number
        raise ConfigError(f"{allowed}, but is {shown(value)}.") from error
    for each in (number.range.lower, number.range.upper) if isinstance(number, Known) else (number,):
        if not math.isfinite(each) or not within(each, info.lower, info.upper):
            given = f' (given as "{printable(value)}")' if isinstance(value, str) else ""
            raise ConfigError(f"{allowed}, but is {each:g}{unit}{given}.")
    return number
