"""Objectives of a design that is never made exactly as drawn."""

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError, InputError
from .._sobol import sobol
from ._objective import AbstractObjective, DesignSpace, Measured


Scatter = Callable[[Float[np.ndarray, " draws"]], Float[np.ndarray, " draws"]]


def uniform(half_width: float) -> Scatter:
    """Made value over nominal one, evenly within +-`half_width`, below 1, from evenly drawn numbers between 0 and 1."""
    if not 0 <= half_width < 1:
        raise ArgumentError("half_width", said=f"must be at least 0 and below 1, but {half_width:g} was given.")
    return lambda q: 1 + half_width * (2 * q - 1)


def rayleigh() -> Scatter:
    """Made value over nominal one, Rayleigh-distributed with mean 1: the size of a vector with two normal components,
    such as an eccentricity left by balancing."""
    return lambda q: np.sqrt(-2 * np.log1p(-np.clip(q, 0, 1 - 1e-9))) / np.sqrt(np.pi / 2)


@dataclasses.dataclass(frozen=True, eq=False)
class Robust(AbstractObjective):
    """The mean of an objective over what manufacture makes of a design, or the mean of the worst of it.

    The scatter is made of the same quasi-random numbers in every design. A made design counts with its own slope, times
    what the nominal value moves the made one by.
    """

    objective: AbstractObjective
    scatter: Mapping[str, Scatter]
    """By parameter name, made over nominal value."""
    draws: int = 16
    """A power of 2."""
    worst: float = 1.0
    """Share of the draws that counts, the worst ones: 1 is the mean, 0.05 the mean of the worst twentieth."""
    seed: int = 0

    def __post_init__(self):
        if self.draws < 2 or not 0 < self.worst <= 1:
            given = f"{self.draws} and {self.worst}"
            raise ArgumentError("draws", "worst", said=f"must be at least 2 and within (0, 1], but {given} were given.")

    def factors(self, space: DesignSpace) -> Float[np.ndarray, "draws n"]:
        """Made over nominal value of each parameter that varies."""
        if missing := [name for name in self.scatter if name not in space.names]:
            raise InputError(f"Scatter of `{missing[0]}` must be of one of {', '.join(space.names)}.")
        sample = sobol(len(space.names), self.draws, self.seed)
        drawn = [self.scatter[n](q) if n in self.scatter else np.ones_like(q) for n, q in zip(space.names, sample.T)]
        return np.array(drawn).T

    def made(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Float[np.ndarray, "draws n"]:
        """Places of the made designs; beyond the bounds too."""
        made = self.factors(space) * list(space.values(place).values())
        return np.array([[u.place(x) for u, x in zip(space.unknowns, row, strict=True)] for row in made])

    def measure(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> list[Measured]:
        made = [self.made(space, np.asarray(place)) for place in places]
        rows = self.objective.measure(space, np.concatenate(made))
        n = len(made[0])
        return [self._over(space, rows[i * n : (i + 1) * n]) for i in range(len(made))]

    def _over(self, space: DesignSpace, rows: list[Measured]) -> Measured:
        value, error = np.array([m.value for m in rows]), np.array([m.error for m in rows])
        counted = np.argsort(-np.nan_to_num(value, nan=np.inf))[: max(1, round(self.worst * len(rows)))]
        move = np.where([u.scale == "linear" for u in space.unknowns], self.factors(space), 1.0)
        slope = np.array([m.slope for m in rows]) * move
        doubt = np.array([m.slope_error for m in rows]) * move
        k = len(counted)
        bad = next((rows[i].status for i in counted if rows[i].status != "ok"), "ok")
        spread = lambda e: np.sqrt(np.sum(e[counted] ** 2, axis=0)) / k
        return Measured(
            float(value[counted].mean()), float(spread(error)), slope[counted].mean(axis=0), spread(doubt), bad
        )

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        made = [self.made(space, np.asarray(place)) for place in places]
        found = self.objective.values(space, np.concatenate(made)).reshape(len(made), -1)
        count = max(1, round(self.worst * found.shape[1]))
        return -np.sort(-found, axis=1)[:, :count].mean(axis=1)
