"""A value that is known within a range only: `1e4 .. 1e6 N/m`, `139400 (1e4 .. 1e6) N/m`, `20 um +- 3 um`."""

import dataclasses
import math
import re

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError, printable
from .units import NUMBER, to_si


DECADE = 10.0
"""A range that spans more is uniform in the logarithm: 1e4 .. 1e6 does not mean that values below 1e5 are rare."""
SIGMAS = 3.0
"""Standard deviations from the best value to either end of a tolerance."""
_LEFT = re.compile(rf"\s*(?:({NUMBER})\s*\()?\s*({NUMBER})\s*(.*?)\s*")
_RIGHT = re.compile(rf"\s*({NUMBER})\s*(\))?\s*(.*?)\s*")
_TOLERANCE = re.compile(r"\+/?-|±")
_LEADING = re.compile(rf"\s*{NUMBER}\s*")


@dataclasses.dataclass(frozen=True)
class Range:
    """A value that lies between two ends."""

    lower: float
    """[SI]."""
    upper: float
    """[SI]."""
    given: float | None = None
    """Best guess [SI]."""
    is_normal: bool = False
    """True for a normal distribution around the middle, with a third of the half width as standard deviation."""

    def __post_init__(self):
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower < self.upper):
            said = f"must ascend, but {self.lower:g} and {self.upper:g} were given."
            raise ArgumentError("lower", "upper", said=said)

    @property
    def is_logarithmic(self) -> bool:
        """True if the range is positive and spans more than a decade: all orders of magnitude are equally likely."""
        return self.lower > 0 and self.upper > DECADE * self.lower

    @property
    def best(self) -> float:
        """The best guess [SI]: as given, or the middle."""
        return float(self.at(0.5)) if self.given is None else self.given

    def at(self, place: float | Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Quantiles [SI] at the probabilities `place`."""
        if self.is_normal:
            from scipy.stats import truncnorm  # takes half a second to load

            middle, sigma = (self.lower + self.upper) / 2, (self.upper - self.lower) / (2 * SIGMAS)
            return np.asarray(truncnorm.ppf(place, -SIGMAS, SIGMAS, loc=middle, scale=sigma))
        if self.is_logarithmic:
            return np.asarray(self.lower * (self.upper / self.lower) ** place)
        return np.asarray(self.lower + place * (self.upper - self.lower))


def is_range(text: str) -> bool:
    """True if a text is meant as a range."""
    return ".." in text or _TOLERANCE.search(text) is not None


def read_range(text: str, unit: str) -> Range:
    """The range in `text`, in `unit`.

    **Raises:** `ValueError` with half a sentence.
    """
    if _TOLERANCE.search(text):
        if unit == "K":
            raise ValueError(f'is "{printable(text)}": a temperature is given by its ends, such as "40 .. 60 degC"')
        parts = _TOLERANCE.split(text, 1)
        named = [_LEADING.sub("", part, count=1) for part in parts]  # a unit that only one names is that of both
        middle, half = (to_si((part if own else part + max(named)).strip(), unit) for part, own in zip(parts, named))
        ends, best, is_normal = (middle - half, middle + half), middle, True
    else:
        left, _, right = text.partition("..")
        low, high = _LEFT.fullmatch(left), _RIGHT.fullmatch(right)
        if low is None or high is None or (low[1] is None) != (high[2] is None):
            example = "" if unit == "1" else f" {unit}"
            raise ValueError(
                f'is "{printable(text)}", which is not a range such as "1 .. 2{example}" or "1.5 (1 .. 2){example}"'
            )
        size = lambda number, own: to_si(f"{number} {own or high[3]}".strip(), unit)
        ends, is_normal = (size(low[2], low[3]), size(high[1], "")), False
        best = None if low[1] is None else size(low[1], "")
    try:
        found = Range(*ends, best, is_normal)
    except ArgumentError:
        raise ValueError(f'is "{printable(text)}", whose ends do not ascend') from None
    if not found.lower <= found.best <= found.upper:
        raise ValueError(f'is "{printable(text)}", whose best guess lies outside it')
    return found
