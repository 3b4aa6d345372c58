"""Constants to be found: their bounds, their scales, and the models that a choice of them makes."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Literal, TypeVar

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError, InputError
from .._parameters import parameter_paths, replace
from ..models import AbstractForcedSystem, BearingModel


Design = TypeVar("Design", bound=AbstractForcedSystem | BearingModel)
"""What is designed, whose kind its changed designs have too: a forced system such as a cage, or a whole bearing."""


@dataclasses.dataclass(frozen=True)
class Unknown:
    """A constant to be found, the same in all cases that it belongs to."""

    name: str
    lower: float
    """Smallest value [SI]."""
    upper: float
    """Largest value [SI]."""
    scale: Literal["log", "linear"] = "log"
    """Whether equal steps multiply or add."""
    sets: tuple[str, ...] = ()
    """Parameters, by name, that take its value; by default the one it is named after."""
    prior: tuple[float, float] | None = None
    """Expected value [SI] and standard deviation: relative on a logarithmic scale, in SI units on a linear one."""

    def __post_init__(self):
        if self.scale not in ("log", "linear"):
            raise ArgumentError("scale", said=f"must be log or linear, but '{self.scale}' was given.")
        if not (np.isfinite([self.lower, self.upper]).all() and self.lower < self.upper):
            raise InputError(f"Bounds of `{self.name}` must ascend, but {self.lower} and {self.upper} were given.")
        if self.scale == "log" and self.lower <= 0:
            raise InputError(f"Bounds of `{self.name}` must be positive on a log scale, but {self.lower} was given.")

    @property
    def targets(self) -> tuple[str, ...]:
        """Names of the parameters that take its value."""
        return self.sets or (self.name,)

    @property
    def span(self) -> float:
        """Distance of the bounds: of their logarithms on a logarithmic scale."""
        return float(np.log(self.upper / self.lower)) if self.scale == "log" else self.upper - self.lower

    def value(self, place: float | np.floating) -> float:
        """Value [SI] at a place between the bounds: 0 is the lower one, 1 the upper."""
        if self.scale == "log":
            return float(self.lower * np.exp(place * self.span))
        return float(self.lower + place * self.span)

    def place(self, value: float) -> float:
        """Where `value` [SI] lies between the bounds."""
        return float(np.log(value / self.lower) if self.scale == "log" else value - self.lower) / self.span

    def per_place(self, value: float) -> float:
        """d value [SI] / d place."""
        return value * self.span if self.scale == "log" else self.span

    @property
    def prior_place(self) -> tuple[float, float] | None:
        """Place of the expected value, and the standard deviation as a part of the span."""
        return None if self.prior is None else (self.place(self.prior[0]), self.prior[1] / self.span)


def check_unknowns(systems: Mapping[str, AbstractForcedSystem | BearingModel], unknowns: Sequence[Unknown]) -> None:
    """**Raises:** `ValueError` for no unknowns, one named twice, or a parameter that a system does not have."""
    names = [u.name for u in unknowns]
    if not names or len(set(names)) < len(names):
        raise ArgumentError("unknowns", said=f"must name each unknown once, but names {', '.join(names) or 'none'}.")
    for case, system in systems.items():
        known = parameter_paths(system)
        for target in (t for u in unknowns for t in u.targets):
            if target not in known:
                raise InputError(f"Unknown `{target}` must be a parameter of case {case}: {', '.join(known)}.")


def values_at(unknowns: Sequence[Unknown], place: Float[np.ndarray, " n"]) -> dict[str, float]:
    """Values [SI] by the unknowns' names."""
    return {u.name: u.value(p) for u, p in zip(unknowns, place, strict=True)}


def with_values(system: Design, unknowns: Sequence[Unknown], place: Float[np.ndarray, " n"]) -> Design:
    """A design with the unknowns at `place`."""
    values = values_at(unknowns, place)
    return replace(system, **{target: values[u.name] for u in unknowns for target in u.targets})


def slope_in_place(
    unknowns: Sequence[Unknown], derivative: Mapping[str, float], place: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """d / d place of what has these derivatives with respect to the parameters [SI]."""
    values = values_at(unknowns, place)
    total = lambda u: sum(derivative[target] for target in u.targets)
    return np.array([total(u) * u.per_place(values[u.name]) for u in unknowns])
