"""Requirements on a design over its operating range, its cost, and manufacturing tolerances."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError
from .._parameters import parameter_info, parameters
from .design_space import Bounds, DesignSpace, Value


@dataclasses.dataclass(frozen=True)
class Requirements:
    """Limits that a design must keep over its whole operating range; None leaves a limit out.

    - `margin`: least distance of both ends of the operating range from the nearest edge of the stable range, per cent
        of the speed at that end.
    - `decay`: largest number of revolutions in which a small disturbance decays to 1/e.
    - `film`: least distance of cage and land [m].
    - `land_force`: largest force of the land on the cage in calm motion [N]; 0 forbids contact.
    - `balance`: largest balance grade G, eccentricity times the largest cage speed [mm/s].
    - `drag`: largest mean power lost by shear of the film [W].
    """

    margin: float = 10.0
    decay: float | None = None
    film: float | None = None
    land_force: float | None = None
    balance: float | None = None
    drag: float | None = None

    def __post_init__(self):
        for name, value in vars(self).items():
            least = 0.0 if name in ("margin", "land_force", "film") else 1e-12
            if value is not None and not least <= value < float("inf"):
                wanted = "at least 0" if least == 0 else "above 0"
                raise ArgumentError(name, said=f"must be {wanted} and finite, but {value:g} was given.")
        if self.margin >= 50:
            raise ArgumentError("margin", said=f"must be below 50 per cent, but {self.margin:g} was given.")


class Requirement(NamedTuple):
    """One limit: its name, the quantity it concerns, the limit, 1 for a lower or -1 for an upper one, its unit, and the
    difference that gives a slack of 1."""

    name: str
    of: str
    limit: float
    sign: float
    unit: str
    size: float

    def slack(self, value: Value) -> tuple[float, Float[np.ndarray, " n"]]:
        """Slack of a value, its distance from the limit over `size`, negative if violated; and its gradient."""
        return self.sign * (value.value - self.limit) / self.size, self.sign * value.slope / self.size


def listed(keep: Requirements, model: Any) -> list[Requirement]:
    """List of the limits; those on the land need a cage in its guide."""
    found = [
        Requirement("margin at the lower end", "lower margin", keep.margin, 1.0, "%", 10.0),
        Requirement("margin at the upper end", "upper margin", keep.margin, 1.0, "%", 10.0),
        Requirement("no unstable speeds between", "peak", 1.0, -1.0, "1", 0.05),
    ]
    if keep.decay is not None:
        limit = float(np.exp(-1 / keep.decay))
        found.append(Requirement("decay of a disturbance", "multiplier", limit, -1.0, "1", 1 - limit))
    if keep.film is not None:
        found.append(Requirement("least film", "film", keep.film, 1.0, "m", max(keep.film, 1e-6)))
    if keep.land_force == 0:
        size = max(float((1 - model.contact.onset) * model.clearance), 1e-6)
        found.append(Requirement("no contact with the land", "contact", 0.0, 1.0, "m", size))
    for name, of, unit, most in (
        ("land force", "land force", "N", keep.land_force or None),
        ("balance grade", "balance", "mm/s", keep.balance),
        ("film drag", "drag", "W", keep.drag),
    ):
        if most is not None:
            found.append(Requirement(name, of, most, -1.0, unit, most))
    return found


def balance_grade(space: DesignSpace, operating: tuple[float, float], place: np.ndarray) -> Value:
    """Balance grade [mm/s] of a design at the highest operating speed."""
    high = operating[1]
    slope = 1e3 * high * space.span * (np.array(space.names) == "eccentricity")
    return Value(1e3 * high * float(parameters(space.model(place))["eccentricity"]), slope, high * 30 / np.pi)


# --- cost -----------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Price:
    """Cost of accuracy in one parameter: `amount` at the value `at` [SI], in proportion to (value/at)^exponent; a
    negative exponent makes small values expensive."""

    amount: float
    at: float
    exponent: float = -1.0


COSTS: Mapping[str, Price] = {"guidance_gap": Price(1.0, 0.45e-3), "eccentricity": Price(1.0, 23e-6)}
"""Default prices, to be replaced by one's own: the cage of the paper's case 1a costs 2, one part for turning cage and
rib to their gap, one for balancing. Both are proportional to 1/value, a common form of tolerance costs."""
Cost = Callable[[Any], Any] | Mapping[str, Price]


def cost_function(cost: Cost | None, model: Any) -> Callable[[Any], Array]:
    """Cost of a design as a differentiable function of it.

    **Raises:** `ValueError` for prices of parameters that the model does not have.
    """
    if callable(cost):
        return cost
    prices, known = COSTS if cost is None else cost, parameter_info(model)
    if unknown := [name for name in prices if name not in known]:
        raise ArgumentError("cost", said=f"must name parameters of the design, but has '{unknown[0]}'.")

    def total(system: Any) -> Array:
        value = parameters(system)
        return sum((p.amount * (value[n] / p.at) ** p.exponent for n, p in prices.items()), jnp.zeros(()))

    return total


# --- tolerances -----------------------------------------------------------------------------------------------------


class Tolerance(NamedTuple):
    """Smallest and largest manufactured value [SI], as deviations from the nominal value unless `absolute`."""

    lower: float
    upper: float
    absolute: bool = False

    @classmethod
    def balanced(cls, grade: float, speed: float) -> "Tolerance":
        """Eccentricity left by balancing to a grade G [mm/s] at a cage speed [rad/s]: from 0 to e = G/speed."""
        return cls(0.0, 1e-3 * grade / speed, absolute=True)

    @property
    def fixed(self) -> float:
        """Return the deviation that stays when the tolerance is widened: 0, or the end nearest to it if 0 is not within
        the tolerance; if `absolute`, the lower end."""
        return self.lower if self.absolute else min(max(0.0, self.lower), self.upper)

    def times(self, factor: float) -> "Tolerance":
        """Tolerance wider by a factor on both sides of `fixed`."""
        wider = lambda end: self.fixed + factor * (end - self.fixed)
        return self._replace(lower=wider(self.lower), upper=wider(self.upper))

    def ends(self, value: float) -> tuple[float, float]:
        """Smallest and largest manufactured value [SI] for a nominal one."""
        return (self.lower, self.upper) if self.absolute else (value + self.lower, value + self.upper)


class Budget(NamedTuple):
    """Admissible width of one tolerance with the others fixed: `factor` times its `width` [SI]. `limit` names the
    requirement, or the lost edge, that prevents more; empty if there is none."""

    name: str
    width: float
    factor: float
    limit: str


def widened(model: Any, vary: Bounds, tolerance: Mapping[str, Tolerance]) -> dict[str, tuple[float, float]]:
    """Bounds of the varied parameters, and room around those that only have a tolerance. **Raises:** `ValueError` for
    inconsistent tolerances."""
    known, bounds = {n: float(x) for n, x in parameters(model).items()}, dict(vary)
    for name, each in tolerance.items():
        if name not in known:
            raise ArgumentError("tolerance", said=f"must be of a parameter of the design, but names '{name}'.")
        if not each.lower < each.upper:
            raise ArgumentError("tolerance", said=f"of {name} must have a lower end below its upper end.")
        if each.absolute and name in vary:
            raise ArgumentError("tolerance", said=f"of {name} is its whole range: {name} cannot be varied too.")
        if name not in vary:
            low, *_, high = sorted([*each.ends(known[name]), known[name]])
            bounds[name] = low - 0.5 * (high - low), high + 0.5 * (high - low)
    return bounds
