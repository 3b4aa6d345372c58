"""Types of options: how a text of the command line is read, and what it may be. What is raised is what follows the
option's name in a sentence.
"""

import contextlib
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tyro.constructors import PrimitiveConstructorSpec


MOST = 10_000_000
"""Of anything that is counted: more ends in no memory, or in no lifetime."""
LARGEST = {"rpm": 1e6, "N": 1e7}
"""Of quantities: beyond, nothing that is computed means anything."""
LONGEST = 200
"""Bytes in the name of a store: file systems have room for 255, and what is written aside has a longer name."""
_EXAMPLES = {"rpm": '"900 rad/s" or "20000 rpm shaft"', "N": '"4.45 kN"', "ms": '"600 us"'}


def flag(name: str) -> str:
    """An option as it is written."""
    return "--" + name.replace("_", "-")


def _option(metavar: str, read: Callable[[str], Any], nothing: str = "none") -> Any:
    """How tyro reads an option; `nothing` is what it shows of one that may be left out."""
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda given: read(given[0]),
        is_instance=lambda _: True,
        str_from_instance=lambda x: [nothing if x is None else f"{x:g}" if isinstance(x, float) else str(x)],
    )


def read_quantity(text: str, unit: str) -> float:
    """The number in `text`, in `unit`; a bare one is in it already.

    **Raises:** `ValueError` with what follows the option's name.
    """
    with contextlib.suppress(ValueError):
        return float(text)  # "nan" and "inf" too: who reads it says what it wants instead
    from ..io import SpeedOf, split_owner, to_si  # pint and xarray are loaded only when a unit is met

    try:
        if unit != "rpm":
            return to_si(text, unit)
        speed, whose = split_owner(text)
        return to_si(speed, unit) if whose is None else SpeedOf(to_si(speed, unit), whose)
    except ValueError as error:
        example = _EXAMPLES[unit]
        raise ValueError(f"must be a number in {unit}, or one with a unit such as {example}, but {error}.") from None


def number(
    must: str = "", holds: Callable[[float], bool] = math.isfinite, unit: str = "", nothing: str = "none"
) -> Any:
    """A number, in `unit` or with a unit of its own, that `must` be something for which `holds` is true."""

    def read(text: str) -> float:
        value = read_quantity(text, unit) if unit else _plain(text)
        if must and not (math.isfinite(value) and holds(value)):
            raise ValueError(f"must {must}, but {value:g} was given.")
        if value > LARGEST.get(unit, math.inf):
            raise ValueError(f"must be at most {LARGEST[unit]:g} {unit}, but {value:g} was given.")
        return value

    return _option({"": "FLOAT", "rpm": "RPM"}.get(unit, unit), read, nothing)


def _plain(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f'must be a number, but is "{text}".') from None


def whole(least: int, of: int = 1) -> Any:
    """A count that is not too small, a multiple `of` something, nor beyond all use."""
    allowed = f"at least {least}" if of == 1 else f"a multiple of {of} above 0"

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise ValueError(f'must be a whole number, but is "{text}".') from None
        if value < least or value % of or value > MOST:
            right = f"at most {MOST}" if value > MOST else allowed
            raise ValueError(f"must be {right}, but {value} was given.")
        return value

    return _option("INT", read, "automatic")


def two(sign: str, what: str, right: Callable[[int, int], bool]) -> Any:
    """Two counts with a sign between them."""

    def read(text: str) -> tuple[int, int]:
        with contextlib.suppress(ValueError):
            first, second = map(int, text.lower().replace("×", "x").split(sign))
            if right(first, second):
                return first, second
        raise ValueError(f"must be {what}, but '{text}' was given.")

    return _option("NAME", read)


def text(must: str = "", holds: Callable[[str], bool] = bool) -> Any:
    """A text that `must` be something for which `holds` is true."""

    def read(given: str) -> str:
        if must and not holds(given):
            raise ValueError(f"must {must}, but '{given}' was given.")
        return given

    return _option("NAME", read, "automatic")


def is_within(path: str) -> bool:
    """Whether a path leads to something within the folder it starts from, by names that a disk takes."""
    parts = Path(path).parts
    short = all(len(os.fsencode(part)) <= LONGEST for part in parts)
    return bool(parts) and short and not Path(path).is_absolute() and ".." not in parts
