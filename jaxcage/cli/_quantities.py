"""Types of options that take a number alone or with its unit: `--speed 8500`, `"8500 rpm"`, `"900 rad/s"`."""

import contextlib
from collections.abc import Callable
from typing import Annotated, Any

from tyro.constructors import PrimitiveConstructorSpec


_EXAMPLES = {"rpm": '"900 rad/s"', "N": '"4.45 kN"', "ms": '"600 us"'}


def read_quantity(text: str, unit: str) -> float:
    """The number in `text`, in `unit`; a bare one is in it already.

    **Raises:** `ValueError` with what follows the option's name.
    """
    with contextlib.suppress(ValueError):
        return float(text)  # "nan" and "inf" too: the command says what it wants instead
    from ..io import to_si  # pint and xarray are loaded only when a unit is met

    try:
        return to_si(text, unit)
    except ValueError as error:
        example = _EXAMPLES[unit]
        raise ValueError(f"must be a number in {unit}, or one with a unit such as {example}, but {error}.") from None


def _quantity(unit: str, nothing: str = "") -> Any:
    """How tyro reads a number of `unit`; `nothing` is what it says of an option that may be left out."""
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=unit.upper() if unit == "rpm" else unit,
        instance_from_str=lambda given: read_quantity(given[0], unit),
        is_instance=lambda x: isinstance(x, int | float) or (x is None and bool(nothing)),
        str_from_instance=lambda x: [nothing if x is None else f"{x:g}"],
    )


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f'must be a whole number, but is "{text}".') from None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f'must be a number, but is "{text}".') from None


def _optional(metavar: str, read: Callable[[str], Any], nothing: str) -> Any:
    """How tyro reads an option that may be left out: its own way shows `{None}|INT`, and types in its errors."""
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda given: read(given[0]),
        is_instance=lambda x: x is None or isinstance(x, str | int | float),
        str_from_instance=lambda x: [nothing if x is None else str(x)],
    )


Rpm = Annotated[float, _quantity("rpm")]
"""A speed [rpm]."""
OptionalRpm = Annotated[float | None, _quantity("rpm", "none")]
"""A speed [rpm], or None."""
Milliseconds = Annotated[float, _quantity("ms")]
"""A time [ms]."""
OptionalNewton = Annotated[float | None, _quantity("N", "own")]
"""A force [N], or None."""
OptionalText = Annotated[str | None, _optional("NAME", str, "automatic")]
OptionalCount = Annotated[int | None, _optional("INT", _whole, "automatic")]
OptionalNumber = Annotated[float | None, _optional("FLOAT", _number, "none")]
