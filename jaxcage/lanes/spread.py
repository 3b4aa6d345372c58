"""How a parameter is sampled: evenly between two values, or within its tolerance."""

import dataclasses
import math

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError


SIGMAS = 3.0
"""Standard deviations from the nominal value to either end of a tolerance, as in a capable production."""


@dataclasses.dataclass(frozen=True)
class Between:
    """Every value between two bounds is as likely as any other."""

    lower: float
    """[SI]."""
    upper: float
    """[SI]."""

    def __post_init__(self):
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower < self.upper):
            raise ArgumentError(
                "lower", "upper", said=f"must ascend, but {self.lower:g} and {self.upper:g} were given."
            )

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value [SI]."""
        return self.lower, self.upper

    def at(self, place: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
        """Values [SI] below which the shares `place` of all values lie."""
        return self.lower + place * (self.upper - self.lower)


@dataclasses.dataclass(frozen=True)
class Tolerance:
    """A nominal value and the deviation allowed to either side.

    Values are normally distributed with a third of the deviation as their standard deviation, and what lies outside the
    tolerance is sorted out.
    """

    value: float
    """Nominal value [SI]."""
    deviation: float
    """Largest deviation [SI]."""

    def __post_init__(self):
        if not (math.isfinite(self.value) and math.isfinite(self.deviation) and self.deviation > 0):
            raise ArgumentError(
                "value",
                "deviation",
                said=f"must be a number and one above 0, but {self.value:g} and {self.deviation:g} were given.",
            )

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value [SI]."""
        return self.value - self.deviation, self.value + self.deviation

    def at(self, place: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
        """Values [SI] below which the shares `place` of all values lie."""
        from scipy.stats import truncnorm  # takes half a second to load

        return truncnorm.ppf(place, -SIGMAS, SIGMAS, loc=self.value, scale=self.deviation / SIGMAS)


Spread = Between | Tolerance
