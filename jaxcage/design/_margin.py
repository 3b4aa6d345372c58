"""How far the synchronous orbit is from losing its stability over a speed range."""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp, softmax

from .._errors import ArgumentError
from ..integrate import AbstractMethod
from ..orbits import LeadingMultiplier, leading_multiplier
from ._objective import AbstractExact, DesignSpace, Measured


@dataclasses.dataclass(eq=False)
class StabilityMargin(AbstractExact):
    """The largest |multiplier| of the synchronous orbit over a speed range, less 1: below 0 it is stable throughout.

    It is defined, and has a slope, whether the orbit is stable or not, and so guides a design also where a zone is
    about to be born or has just vanished. The largest over the speeds is a soft maximum, above the true one by at most
    log(speeds)/sharpness. Orbits are followed from design to design, each from the nearest at which it is known.
    """

    speeds: Float[np.ndarray, " speeds"]
    """[rad/s]."""
    guesses: Float[np.ndarray, "states dim"]
    """At each speed a state [SI] near the orbit that is meant, in the design that the search begins with."""
    sharpness: float = 20.0
    method: AbstractMethod | None = None

    def __post_init__(self):
        if len(self.speeds) != len(self.guesses) or not len(self.speeds):
            given = f"{len(self.guesses)} for {len(self.speeds)} speeds"
            raise ArgumentError("guesses", said=f"must hold a state for each speed, but there are {given}.")
        self._known: dict[bytes, tuple[np.ndarray, list[LeadingMultiplier]]] = {}

    def multipliers(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> list[LeadingMultiplier]:
        """At each speed."""
        key = place.tobytes()
        if key not in self._known:
            guesses = self.guesses
            if self._known:
                guesses = [m.state for m in min(self._known.values(), key=lambda k: np.sum((k[0] - place) ** 2))[1]]
            model = space.model(place)
            found = [
                leading_multiplier(model, float(s), g, method=self.method)
                for s, g in zip(self.speeds, guesses, strict=True)
            ]
            if not np.all(np.isfinite([m.size for m in found])):
                return found
            self._known[key] = (place.copy(), found)
        return self._known[key][1]

    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Measured:
        found, zero = self.multipliers(space, place), np.zeros(len(space.unknowns))
        size = np.array([m.size for m in found])
        if not np.all(np.isfinite(size)):
            lost_rpm = self.speeds[np.isnan(size)] * (30 / np.pi)
            lost = ", ".join(f"{speed:.0f}" for speed in lost_rpm.tolist())
            return Measured(
                float("nan"), 0.0, np.full(zero.shape, np.nan), zero, f"no orbit near the guess at {lost} rpm"
            )
        share = softmax(self.sharpness * size)
        slope = share @ np.array([space.slope_of(m.derivative, place) for m in found])
        largest = float(logsumexp(self.sharpness * size)) / self.sharpness  # pyright: ignore[reportArgumentType]
        return Measured(largest - 1, 0.0, slope, zero)
