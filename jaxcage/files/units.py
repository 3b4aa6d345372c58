"""Text such as "0.45 mm" as a number in SI, and speeds of cage or shaft. pint is loaded with the first text."""

import functools
import math
import re
from typing import TYPE_CHECKING, Any, Literal

from .._errors import printable


if TYPE_CHECKING:
    import pint


_SIZE = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
NUMBER = rf"[-+]?{_SIZE}"
_NUMBER_AND_UNIT = re.compile(rf"\s*({NUMBER})\s*(.*?)\s*")
_UNIT = re.compile(r"(?!\d(?!\s*/))[\w°µΩ%*/^().·⁻ +-]{1,60}")
"""Characters of a unit; pint ignores a comment, a colon or a line end, and the second number in "2 1 mm"."""
_COMMA = re.compile(r"\s*[-+]?\d*,\d")
_THOUSANDS = re.compile(r"\s*([1-9]\d{0,2}\.\d{3})\s*(?:rpm)?\s*")
"""A speed whose point may separate thousands."""
_DASH = re.compile(rf"\s*{_SIZE}(?:\s+[^\s\d]+)?\s+(?:-|–|to)\s+{_SIZE}")
"""Two numbers with a dash between them."""
_TOWER = re.compile(r"[\d)]\s*(?:\^|\*\*)|\d{3}")
"""A power of a number, or a large number: pint would evaluate 9**9**9 to its last digit."""
_LIKE = {"K": "degC"}
"""Usual unit in place of the SI unit; "C" alone is a coulomb."""


@functools.cache
def _registry() -> "pint.UnitRegistry":
    import pint

    return pint.UnitRegistry()


def to_si(text: str, unit: str) -> float:
    """The number in `text`, e.g. "0.45 mm" or "40 degC", expressed in `unit` ("1" for a pure number).

    A bare number is taken to be in `unit`. Frequencies in Hz are refused where an angular speed is wanted: units alone
    cannot tell a revolution from a radian, so write rpm or rad/s.

    **Raises:** `ValueError` with half a sentence ("is ...") for a text that is not a number with a unit, for an unknown
    unit, and for one of another dimension, where the radian counts as a dimension: 3000 1/min may be revolutions.
    """
    if _COMMA.match(text):
        raise ValueError(f'is "{printable(text)}": numbers are written with a point and without commas')
    if unit == "rpm" and (match := _THOUSANDS.fullmatch(text)):
        speed = float(match[1])
        raise ValueError(f'is "{printable(text)}": write {1000 * speed:.0f} or {speed:g}, whichever is meant')
    if _DASH.match(text):
        raise ValueError(f'is "{printable(text)}": a range is written with two points, such as "1e4 .. 1e6 N/m"')
    match = _NUMBER_AND_UNIT.fullmatch(text)
    if match is None:
        raise ValueError(f'is "{printable(text)}", which is not a number with a unit')
    number, given = float(match.group(1)), match.group(2)
    return number if not given else _convert(number, given, "" if unit == "1" else unit)


def _convert(number: float, given: str, unit: str) -> float:
    import pint

    registry = _registry()
    unknown = f'has the unknown unit "{printable(given)}"'
    if _UNIT.fullmatch(given) is None or _TOWER.search(given):
        raise ValueError(unknown)
    try:
        source = registry.parse_units(given)
    except Exception as error:  # pint's parser leaks errors of many kinds
        raise ValueError(unknown) from error
    target = registry.parse_units(unit)
    wanted = f'a unit like "{_LIKE.get(unit, unit)}"' if unit else "no unit"
    speeds = '"rpm" or "rad/s"'
    if unit in ("rad/s", "rpm") and any(name.endswith("hertz") for name in source._units):
        raise ValueError(f"is in Hz, where {speeds} is wanted")
    try:
        found = float(registry.Quantity(number, source).to(target).magnitude)
        same = _base_units(source) == _base_units(target)
    except (pint.PintError, ArithmeticError, ValueError) as error:
        raise ValueError(f'has the unit "{given}", where {wanted} is wanted') from error
    if not same:
        raise ValueError(f'has the unit "{given}", where {speeds if unit in ("rad/s", "rpm") else wanted} is wanted')
    return found


def _base_units(unit: Any) -> set[str]:
    """Names of the base units of a unit, those without a dimension, such as the radian, among them."""
    return set(_registry().Quantity(1.0, unit).to_root_units().units._units)


# --- speeds ---------------------------------------------------------------------------------------------------------

Whose = Literal["cage", "shaft"]
WHOSE: tuple[Whose, Whose] = ("cage", "shaft")
_OWNER = re.compile(r"\b(cage|shaft)\b", re.IGNORECASE)


class SpeedOf(float):
    """A speed [rpm] with its owner."""

    whose: Whose

    def __new__(cls, value: float, whose: Whose) -> "SpeedOf":
        found = super().__new__(cls, value)
        found.whose = whose
        return found


def split_owner(text: str) -> tuple[str, Whose | None]:
    """`20000 rpm shaft` -> (`20000 rpm`, `shaft`); None if the text does not name the owner of the speed.

    **Raises:** `ValueError` with half a sentence if it names both.
    """
    named = {word.lower() for word in _OWNER.findall(text)}
    if len(named) > 1:
        raise ValueError(f'names both cage and shaft: "{printable(text.strip())}"')
    return _OWNER.sub("", text).strip(), next((whose for whose in WHOSE if whose in named), None)


def read_rpm(text: str) -> float:
    """A speed [rpm] from a text such as `900 rad/s` or `20000 rpm shaft`, with its owner if the text names one.

    **Raises:** `ValueError` with half a sentence.
    """
    speed, whose = split_owner(text)
    value = to_si(speed, "rpm")
    return value if whose is None else SpeedOf(value, whose)


def own_rpm(model: Any, value: float, unsaid: Whose | None = None) -> float:
    """The speed of a model [rpm] that `value` means, by the model's own relation of cage and shaft.

    `unsaid` owns a value that does not name its owner; None takes the model's own speed.
    """
    own = model.speed_text.split()[0]
    if getattr(value, "whose", unsaid or own) == own:
        return float(value)
    at_rest, at_one = (float(model.other_speed(speed)[1]) for speed in (0.0, 1.0))
    return (float(value) - at_rest * 30 / math.pi) / (at_one - at_rest)
