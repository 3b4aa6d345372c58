"""Whose speed a number means: the cage's, as everything inside does, or the shaft's, as people know it."""

import re
from typing import Literal

from ._units import printable


Whose = Literal["cage", "shaft"]
WHOSE: tuple[Whose, Whose] = ("cage", "shaft")
_OWNER = re.compile(r"\b(cage|shaft)\b", re.IGNORECASE)


def split_owner(text: str) -> tuple[str, Whose | None]:
    """`20000 rpm shaft` -> (`20000 rpm`, `shaft`); None where a text does not say whose speed it is.

    **Raises:** `ValueError` with half a sentence if it names both.
    """
    named = {word.lower() for word in _OWNER.findall(text)}
    if len(named) > 1:
        raise ValueError(f'names both cage and shaft: "{printable(text.strip())}"')
    return _OWNER.sub("", text).strip(), next((whose for whose in WHOSE if whose in named), None)


class SpeedOf(float):
    """A speed [rpm] that says whose it is."""

    whose: Whose

    def __new__(cls, value: float, whose: Whose) -> "SpeedOf":
        found = super().__new__(cls, value)
        found.whose = whose
        return found


def cage_rpm(value: float, unsaid: Whose, cage_speed_ratio: float) -> float:
    """The cage's speed [rpm] that `value` means: the shaft's if it says so, or if `unsaid` does for it."""
    return float(value) * (cage_speed_ratio if _whose(value, unsaid) == "shaft" else 1.0)


def shaft_rpm(value: float, unsaid: Whose, cage_speed_ratio: float) -> float:
    """The shaft's speed [rpm] that `value` means: the cage's if it says so, or if `unsaid` does for it."""
    return float(value) / (cage_speed_ratio if _whose(value, unsaid) == "cage" else 1.0)


def _whose(value: float, unsaid: Whose) -> Whose:
    return value.whose if isinstance(value, SpeedOf) else unsaid
