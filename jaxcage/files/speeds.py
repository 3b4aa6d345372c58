"""Speeds of the cage, used inside the library, and of the shaft, as users know them."""

import re
from typing import Literal

from .units import printable


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
