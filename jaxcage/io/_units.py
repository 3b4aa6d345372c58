"""Units at the door: text such as "0.45 mm" becomes a number in SI. pint is loaded only when a text
is met.
"""

import functools
import re
from typing import TYPE_CHECKING


if TYPE_CHECKING:
    import pint


_NUMBER_AND_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


@functools.cache
def _registry() -> "pint.UnitRegistry":
    import pint

    return pint.UnitRegistry()


def to_si(text: str, unit: str) -> float:
    """The number in `text`, e.g. "0.45 mm" or "40 degC", expressed in `unit` ("1" for a pure
    number).

    A bare number is taken to be in `unit`. Frequencies in Hz are refused where an angular speed is
    wanted: units alone cannot tell a revolution from a radian, so write rpm or rad/s.

    **Raises:** `ValueError` with half a sentence ("is ...") for a text that is not a number with a
    unit, for a unit nobody knows, and for one of another dimension.
    """
    match = _NUMBER_AND_UNIT.fullmatch(text)
    if match is None:
        raise ValueError(f'is "{text}", which is not a number with a unit')
    number, given = float(match.group(1)), match.group(2)
    return number if not given else _convert(number, given, "" if unit == "1" else unit)


def _convert(number: float, given: str, unit: str) -> float:
    import pint

    registry = _registry()
    try:
        source = registry.parse_units(given)
    except Exception as error:  # pint's parser leaks errors of many kinds
        raise ValueError(f'has the unknown unit "{given}"') from error
    wanted = f'a unit like "{unit}"' if unit else "no unit"
    if unit == "rad/s" and any(name.endswith("hertz") for name in source._units):
        raise ValueError('is in Hz, where "rpm" or "rad/s" is wanted')
    try:
        return float(registry.Quantity(number, source).to(registry.parse_units(unit)).magnitude)
    except pint.DimensionalityError as error:
        raise ValueError(f'has the unit "{given}", where {wanted} is wanted') from error
