"""What is required of a design over its operating range, and what the design costs."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError
from .._parameters import parameter_info, parameters
from ..models import AbstractForcedSystem
from .operating import DesignSpace, OperatingRange, Value


@dataclasses.dataclass(frozen=True)
class Requirements:
    """Limits that a design must keep over its whole operating range; None leaves a limit out.

    - `margin`: least distance of both ends of the operating range from the nearest edge of the stable range, per cent
        of the speed at that end.
    - `decay`: most revolutions in which a small disturbance falls to 1/e.
    - `film`: least distance of cage and land [m].
    - `land_force`: largest force of the land on the cage in calm motion [N]; 0: they do not touch.
    - `balance`: largest balance grade G, eccentricity times the largest cage speed [mm/s].
    - `drag`: largest mean power to shear the film [W].
    """

    margin: float = 10.0
    decay: float | None = None
    film: float | None = None
    land_force: float | None = None
    balance: float | None = None
    drag: float | None = None

    def __post_init__(self):
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            least = 0.0 if field.name in ("margin", "land_force", "film") else 1e-12
            if value is not None and not least <= value < float("inf"):
                wanted = "at least 0" if least == 0 else "above 0"
                raise ArgumentError(field.name, said=f"must be {wanted} and finite, but {value:g} was given.")
        if self.margin >= 50:
            raise ArgumentError("margin", said=f"must be below 50 per cent, but {self.margin:g} was given.")


class Requirement(NamedTuple):
    """One limit: what it is called, the value it concerns, the limit, whether values must be above (1) or below (-1)
    it, its unit, and the difference that counts as 1."""

    name: str
    of: str
    limit: float
    sign: float
    unit: str
    size: float

    def slack(self, value: Value) -> tuple[float, Float[np.ndarray, " n"]]:
        """Distance of a value from the limit, negative where it is broken, over `size`; and its derivatives."""
        return self.sign * (value.value - self.limit) / self.size, self.sign * value.slope / self.size


def listed(keep: Requirements, model: Any) -> list[Requirement]:
    """The limits one by one; those of a land need a cage in its guide."""
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
        apart = float((1 - model.contact.onset) * model.clearance)
        found.append(Requirement("no contact with the land", "film", apart, 1.0, "m", max(apart, 1e-6)))
    elif keep.land_force is not None:
        found.append(Requirement("land force", "land force", keep.land_force, -1.0, "N", keep.land_force))
    if keep.balance is not None:
        found.append(Requirement("balance grade", "balance", keep.balance, -1.0, "mm/s", keep.balance))
    if keep.drag is not None:
        found.append(Requirement("film drag", "drag", keep.drag, -1.0, "W", keep.drag))
    return found


def values_at(
    range_: OperatingRange, place: Float[np.ndarray, " n"], wanted: list[Requirement]
) -> dict[str, Value] | str:
    """All values that some limits concern, at a place of the design space; or why there are none."""
    found = range_.margins(place)
    if isinstance(found, str):
        return found
    names = {r.of for r in wanted}
    if "balance" in names:
        found["balance"] = balance_grade(range_.space, range_.operating, place)
    if through := tuple(name for name in ("multiplier", "film", "land force", "drag") if name in names):
        worst = range_.worst(place, through)
        if isinstance(worst, str):
            return worst
        found |= worst
    return found


def balance_grade(space: DesignSpace, operating: tuple[float, float], place: np.ndarray) -> Value:
    """Balance grade of a design at its largest speed [mm/s]."""
    high = operating[1]
    slope = np.array([1e3 * high * span if n == "eccentricity" else 0.0 for n, span in zip(space.names, space.span)])
    return Value(1e3 * high * float(parameters(space.model(place))["eccentricity"]), slope, high * 30 / np.pi)


# --- cost -----------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Price:
    """Cost of accuracy in one parameter: `amount` at `at`, in proportion to (value/at)^exponent."""

    amount: float
    at: float
    """[SI]."""
    exponent: float = -1.0
    """Negative where small values are dear."""


COSTS: Mapping[str, Price] = {
    "guidance_gap": Price(1.0, 0.45e-3),
    "eccentricity": Price(1.0, 23e-6),
}
"""The cage of the paper's case 1a costs 2: one part for turning cage and rib to their gap, one for balancing. Both
fall with the reciprocal of the value, a common form of tolerance costs. A default to be replaced by a shop's own."""
Cost = Callable[[Any], Any] | Mapping[str, Price]


def cost_function(cost: Cost | None, model: AbstractForcedSystem) -> Callable[[Any], Array]:
    """The cost of a design as a function of it that JAX differentiates.

    **Raises:** `ValueError` for prices of parameters that the model does not have.
    """
    if callable(cost):
        return cost
    prices = COSTS if cost is None else cost
    known = parameter_info(model)
    if unknown := [name for name in prices if name not in known]:
        raise ArgumentError("cost", said=f"must name parameters of the design, but has '{unknown[0]}'.")

    def total(system: AbstractForcedSystem) -> Array:
        value = parameters(system)
        return sum((p.amount * (value[n] / p.at) ** p.exponent for n, p in prices.items()), jnp.zeros(()))

    return total
