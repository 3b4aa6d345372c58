"""What manufacture makes of a design: tolerances, their worst corner, and how wide each may be."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from .._parameters import parameters
from .operating import DesignSpace
from .requirements import Requirement


class Tolerance(NamedTuple):
    """Smallest and largest made value [SI]: beside the nominal one or, if `absolute`, whatever that is."""

    lower: float
    upper: float
    absolute: bool = False

    @classmethod
    def balanced(cls, grade: float, speed: float) -> "Tolerance":
        """An eccentricity that balancing to a grade G [mm/s] leaves at a cage speed [rad/s]: from 0 to e = G/speed."""
        return cls(0.0, 1e-3 * grade / speed, absolute=True)

    def times(self, factor: float) -> "Tolerance":
        """A tolerance so many times as wide."""
        return self._replace(lower=factor * self.lower, upper=factor * self.upper)

    @property
    def width(self) -> float:
        """Distance of both ends [SI]."""
        return self.upper - self.lower


class Budget(NamedTuple):
    """How wide one tolerance may be while the others stay: `factor` times as wide as it is. `limit` is the requirement,
    or the edge that is lost, which does not let it be wider; empty if nothing limits it."""

    name: str
    width: float
    factor: float
    limit: str


def widened(
    model: Any, vary: Mapping[str, tuple[float, float]], tolerance: Mapping[str, Tolerance]
) -> dict[str, tuple[float, float]]:
    """Bounds of what varies, and of what does not vary but scatters: enough room around it.

    **Raises:** `ValueError` for tolerances that make no sense.
    """
    known, bounds = {n: float(x) for n, x in parameters(model).items()}, dict(vary)
    for name, each in tolerance.items():
        if name not in known:
            raise ArgumentError("tolerance", said=f"must be of a parameter of the design, but names '{name}'.")
        if not each.lower < each.upper:
            raise ArgumentError("tolerance", said=f"of {name} must have a lower end below its upper end.")
        if each.absolute and name in vary:
            raise ArgumentError("tolerance", said=f"gives the made range of {name} itself: it cannot be varied too.")
        if name not in vary:
            ends = (each.lower, each.upper) if each.absolute else (known[name] + each.lower, known[name] + each.upper)
            low, high = min(ends[0], known[name]), max(ends[1], known[name])
            bounds[name] = low - 0.5 * (high - low), high + 0.5 * (high - low)
    return bounds


def corner(
    space: DesignSpace,
    place: Float[np.ndarray, " n"],
    slope: Float[np.ndarray, " n"],
    tolerance: Mapping[str, Tolerance],
) -> Float[np.ndarray, " n"]:
    """The place within the tolerances at which something with this slope is least."""
    there, values = place.copy(), space.values(place)
    for i, name in enumerate(space.names):
        if name in tolerance:
            each = tolerance[name]
            end = each.lower if slope[i] > 0 else each.upper
            there[i] = ((end if each.absolute else values[name] + end) - space.lower[i]) / space.span[i]
    return there


def budget_of(
    space: DesignSpace,
    tolerance: Mapping[str, Tolerance],
    slack_slope: Float[np.ndarray, "m n"],
    slack: Float[np.ndarray, " m"],
    wanted: Sequence[Requirement],
) -> list[Budget]:
    """How wide each tolerance may be, from the slacks that are left at the worst corners, at first order."""
    rows = []
    for i, name in enumerate(space.names):
        if name not in tolerance:
            continue
        half = tolerance[name].width / 2 / space.span[i]
        takes = np.abs(slack_slope[:, i]) * half
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(takes > 0, np.maximum(slack, 0.0) / takes, np.inf)
        k = int(np.argmin(room))
        limiting = wanted[k].name if np.isfinite(room[k]) else ""
        rows.append(Budget(name, tolerance[name].width, 1 + float(room[k]), limiting))
    return rows
