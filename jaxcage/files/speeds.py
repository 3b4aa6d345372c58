"""Speeds of the cage, used inside the library, and of the shaft, as users know them."""

import math
import re
from typing import Any, Literal

from .units import printable, to_si


Whose = Literal["cage", "shaft"]
WHOSE: tuple[Whose, Whose] = ("cage", "shaft")
_OWNER = re.compile(r"\b(cage|shaft)\b", re.IGNORECASE)


def split_owner(text: str) -> tuple[str, Whose | None]:
    """`20000 rpm shaft` -> (`20000 rpm`, `shaft`); None if the text does not name the owner of the speed.

    **Raises:** `ValueError` with half a sentence if it names both.
    """
    named = {word.lower() for word in _OWNER.findall(text)}
    if len(named) > 1:
        raise ValueError(f'names both cage and shaft: "{printable(text.strip())}"')
    return _OWNER.sub("", text).strip(), next((whose for whose in WHOSE if whose in named), None)


class SpeedOf(float):
    """A speed [rpm] with its owner."""

    whose: Whose

    def __new__(cls, value: float, whose: Whose) -> "SpeedOf":
        found = super().__new__(cls, value)
        found.whose = whose
        return found


def cage_rpm(value: float, unsaid: Whose, cage_speed_ratio: float) -> float:
    """The cage's speed [rpm] that `value` means; `unsaid` owns a value that does not name its owner."""
    return float(value) * (cage_speed_ratio if _whose(value, unsaid) == "shaft" else 1.0)


def shaft_rpm(value: float, unsaid: Whose, cage_speed_ratio: float) -> float:
    """The shaft's speed [rpm] that `value` means; `unsaid` owns a value that does not name its owner."""
    return float(value) / (cage_speed_ratio if _whose(value, unsaid) == "cage" else 1.0)


def _whose(value: float, unsaid: Whose) -> Whose:
    return value.whose if isinstance(value, SpeedOf) else unsaid


def own_rpm(model: Any, value: float, unsaid: Whose | None = None) -> float:
    """The speed of a model [rpm] that `value` means, by the model's own relation of cage and shaft.

    `unsaid` owns a value that does not name its owner; None takes the model's own speed.
    """
    own = model.speed_text.split()[0]
    if _whose(value, unsaid or own) == own:
        return float(value)
    at_rest, at_one = (float(model.other_speed(speed)[1]) for speed in (0.0, 1.0))
    return (float(value) - at_rest * 30 / math.pi) / (at_one - at_rest)


def read_rpm(text: str) -> float:
    """A speed [rpm] from a text such as `900 rad/s` or `20000 rpm shaft`, with its owner if the text names one.

    **Raises:** `ValueError` with half a sentence.
    """
    speed, whose = split_owner(text)
    value = to_si(speed, "rpm")
    return value if whose is None else SpeedOf(value, whose)
