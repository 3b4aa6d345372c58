"""Exact edges and their exact derivatives as functions of unknown constants.

An edge is followed from where it was last found: Newton's method on its defining equations, along a straight line to
the new constants in as many parts as it needs. The derivatives come from the implicit function theorem.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..orbits import Located, Point, Sensitivity, sensitivity
from ._unknowns import Unknown, values_at, with_values


HALVINGS = 4
"""How often the way to new constants is halved before an edge counts as lost."""


class Edges(NamedTuple):
    """Edges at one choice of the unknowns; NaN where one was lost."""

    rpm: Float[np.ndarray, " edges"]
    slope: Float[np.ndarray, "edges unknowns"]
    """d rpm / d place."""
    status: tuple[str, ...]


class TrackedEdges:
    """Edges as a function of the place of the unknowns."""

    def __init__(
        self,
        systems: Mapping[str, AbstractForcedSystem],
        unknowns: Sequence[Unknown],
        cases: Sequence[str],
        points: Sequence[Point],
        place: Float[np.ndarray, " unknowns"],
        method: AbstractMethod | None = None,
    ):
        """**Arguments:** the cases; what is unknown; for each edge its case and the bifurcation that it is, as found
        with the unknowns at `place`."""
        self.systems, self.unknowns, self.cases, self.method = systems, tuple(unknowns), tuple(cases), method
        self.place = np.asarray(place, dtype=float)
        self.last = [Located(str(p.kind), float(p.speed), np.asarray(p.state), int(p.periods)) for p in points]
        self.slope = np.zeros((len(points), len(self.unknowns)))
        self.solves = 0
        self._known: dict[bytes, Edges] = {}

    def __call__(self, place: Float[np.ndarray, " unknowns"]) -> Edges:
        """The edges at `place`, followed from the last place at which all were found."""
        place = np.asarray(place, dtype=float)
        key = place.tobytes()
        if key not in self._known:
            self._known[key] = self._go(self.last, self.slope, self.place, place)
        return self._known[key]

    def _go(self, last: list[Located], slope: np.ndarray, start: np.ndarray, place: np.ndarray) -> Edges:
        models = with_values(self.systems, self.unknowns, place)
        found = [
            self._follow(i, last[i], slope[i], start, place, models[c], HALVINGS) for i, c in enumerate(self.cases)
        ]
        edges = Edges(
            np.array([s.value_rpm for s in found]),
            np.array([self._slopes(s, place) for s in found]),
            tuple(s.status for s in found),
        )
        if np.all(np.isfinite(edges.rpm)):
            self.last = [
                now._replace(speed=s.value_rpm * np.pi / 30, state=s.state)
                for now, s in zip(self.last, found, strict=True)
            ]
            self.place, self.slope = place, edges.slope
        return edges

    def _follow(
        self,
        i: int,
        last: Located,
        slope: np.ndarray,
        start: np.ndarray,
        place: np.ndarray,
        model: AbstractForcedSystem,
        halvings: int,
    ) -> Sensitivity:
        self.solves += 1
        guess = last._replace(speed=last.speed + float(slope @ (place - start)) * np.pi / 30)
        found = sensitivity(model, guess, method=self.method)
        if np.isfinite(found.value_rpm) or halvings == 0:
            return found
        middle = (start + place) / 2
        there = with_values({self.cases[i]: self.systems[self.cases[i]]}, self.unknowns, middle)[self.cases[i]]
        half = self._follow(i, last, slope, start, middle, there, halvings - 1)
        if not np.isfinite(half.value_rpm):
            return found
        nearer = last._replace(speed=half.value_rpm * np.pi / 30, state=half.state)
        return self._follow(i, nearer, self._slopes(half, middle), middle, place, model, halvings - 1)

    def _slopes(self, found: Sensitivity, place: np.ndarray) -> np.ndarray:
        """d rpm / d place of one edge."""
        values = values_at(self.unknowns, place)
        total = lambda u: sum(found.derivative[target] for target in u.targets)
        return np.array([total(u) * u.per_place(values[u.name]) for u in self.unknowns])


def differentiable(edges: Callable[[np.ndarray], Edges], m: int, n: int, lost: float) -> Callable[[Array], Array]:
    """Edge speeds [rpm] as a JAX function with an exact derivative; an edge that is lost is `lost` with no slope."""

    def values(place: Any) -> np.ndarray:
        found = edges(np.asarray(place)).rpm
        return np.where(np.isfinite(found), found, lost)

    def slopes(place: Any) -> np.ndarray:
        return np.nan_to_num(edges(np.asarray(place)).slope)

    @jax.custom_jvp
    def speeds(place: Array) -> Array:
        return jax.pure_callback(values, jax.ShapeDtypeStruct((m,), float), place)

    @speeds.defjvp
    def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
        (place,), (move,) = primals, tangents
        matrix = jax.pure_callback(slopes, jax.ShapeDtypeStruct((m, n), float), place)
        return speeds(place), jnp.asarray(matrix) @ move

    return speeds
