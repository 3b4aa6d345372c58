"""Exact edges and their exact derivatives as functions of unknown constants.

An edge is followed from where it was last found: Newton's method on its defining equations, along a straight line to
the new constants in as many parts as it needs. The derivatives come from the implicit function theorem.
"""

import concurrent.futures
import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..orbits import Point, Sensitivity, sensitivity
from ._unknowns import Unknown, slope_in_place, with_values


HALVINGS = 4
"""How often the way to new constants is halved before an edge counts as lost."""


class Edges(NamedTuple):
    """Edges at one choice of the unknowns; NaN where one was lost."""

    rpm: Float[np.ndarray, " edges"]
    slope: Float[np.ndarray, "edges unknowns"]
    """d rpm / d place."""
    status: tuple[str, ...]


class _Anchor(NamedTuple):
    """A place at which all edges are known."""

    place: np.ndarray
    last: list[Point]
    slope: np.ndarray


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
        last = [Point(str(p.kind), float(p.speed), np.asarray(p.state), int(p.periods), int(p.steps)) for p in points]
        self._anchors = [_Anchor(np.asarray(place, dtype=float), last, np.zeros((len(points), len(self.unknowns))))]
        self._solved: list[str] = []
        self._known: dict[bytes, Edges] = {}

    @property
    def solves(self) -> int:
        """Edges that were solved for so far."""
        return len(self._solved)

    def __call__(self, place: Float[np.ndarray, " unknowns"]) -> Edges:
        """The edges at `place`, followed from the nearest place at which all were found."""
        place = np.asarray(place, dtype=float)
        key = place.tobytes()
        if key in self._known:
            return self._known[key]
        near = min(self._anchors, key=lambda a: float(np.sum((a.place - place) ** 2)))
        follow = lambda case, last, slope: self._follow(case, last, slope, near.place, place, HALVINGS)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:  # an edge keeps one core busy
            found = list(pool.map(follow, self.cases, near.last, near.slope))
        edges = Edges(
            np.array([s.value_rpm for s in found]),
            np.array([slope_in_place(self.unknowns, s.derivative, place) for s in found]),
            tuple(s.status for s in found),
        )
        if np.all(np.isfinite(edges.rpm)):
            last = [
                dataclasses.replace(now, speed=s.value_rpm * np.pi / 30, state=s.state, steps=s.steps)
                for now, s in zip(near.last, found, strict=True)
            ]
            self._anchors.append(_Anchor(place, last, edges.slope))
        self._known[key] = edges
        return edges

    def _follow(
        self,
        case: str,
        last: Point,
        slope: np.ndarray,
        start: np.ndarray,
        place: np.ndarray,
        halvings: int,
    ) -> Sensitivity:
        """One edge at `place`, from where it was `last` found, with the unknowns at `start` and with that slope."""
        self._solved.append(case)
        guess = dataclasses.replace(last, speed=last.speed + float(slope @ (place - start)) * np.pi / 30)
        model = with_values(self.systems[case], self.unknowns, place)
        found = sensitivity(model, guess, method=self.method)
        if np.isfinite(found.value_rpm) or halvings == 0:
            return found
        middle = (start + place) / 2
        half = self._follow(case, last, slope, start, middle, halvings - 1)
        if not np.isfinite(half.value_rpm):
            return found
        nearer = dataclasses.replace(last, speed=half.value_rpm * np.pi / 30, state=half.state, steps=half.steps)
        return self._follow(
            case, nearer, slope_in_place(self.unknowns, half.derivative, middle), middle, place, halvings - 1
        )
