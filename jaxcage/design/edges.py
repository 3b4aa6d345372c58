"""Exact objectives of a search: sums of synchronous-loss edges, distances from them, margins of stability.

An edge is followed from where it was last found: Newton's method on its defining equations, along a straight line to
the new design in as many parts as it needs. Its derivatives come from the implicit function theorem.
"""

import concurrent.futures
import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp, softmax

from .._errors import ArgumentError
from ..orbits import LeadingMultiplier, Point, Sensitivity, leading_multiplier, sensitivity
from ..solve import AbstractMethod
from .objective import AbstractExact, DesignSpace, Measured


HALVINGS = 4
"""Times that the way to a new design is halved before an edge counts as lost."""


class _Anchor(NamedTuple):
    """A place at which all edges are known."""

    place: np.ndarray
    last: list[Point]
    slope: np.ndarray


class FollowedEdges:
    """Edges of one design by name, followed from the nearest design at which all are known."""

    def __init__(self, points: Mapping[str, Point], method: AbstractMethod | None = None):
        """**Arguments:** bifurcations by name (`LossZones.edges`), as found in the design a search begins with."""
        if not points:
            raise ArgumentError("points", said="must hold at least one edge, but it is empty.")
        self.points, self.method = dict(points), method
        self._space: DesignSpace | None = None
        self._anchors: list[_Anchor] = []
        self._known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the edges."""
        return tuple(self.points)

    def status(self, speeds: Float[np.ndarray, " edges"]) -> str:
        """`ok`, or the names of the edges that are lost."""
        lost = [name for name, speed in zip(self.names, speeds, strict=True) if np.isnan(speed)]
        return f"lost: {', '.join(lost)}" if lost else "ok"

    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> tuple[np.ndarray, np.ndarray]:
        """Speeds [rpm] and their slopes; NaN where an edge is lost."""
        if space is not self._space:
            rows = self.points.values()
            last = [Point(str(p.kind), float(p.speed), np.asarray(p.state), int(p.periods), int(p.steps)) for p in rows]
            self._space, self._known = space, {}
            self._anchors = [_Anchor(space.place, last, np.zeros((len(last), len(space.names))))]
        place = np.asarray(place, dtype=float)
        key = place.tobytes()
        if key in self._known:
            return self._known[key]
        near = min(self._anchors, key=lambda a: float(np.sum((a.place - place) ** 2)))
        follow = lambda last, slope: self._follow(space, last, slope, near.place, place, HALVINGS)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:  # an edge keeps one core busy
            found = list(pool.map(follow, near.last, near.slope))
        speeds = np.array([s.value_rpm for s in found])
        slopes = np.array([space.slope_of(s.derivative) for s in found])
        if np.all(np.isfinite(speeds)):
            last = [_moved(now, s) for now, s in zip(near.last, found, strict=True)]
            self._anchors.append(_Anchor(place, last, slopes))
        self._known[key] = speeds, slopes
        return speeds, slopes

    def _follow(
        self, space: DesignSpace, last: Point, slope: np.ndarray, start: np.ndarray, place: np.ndarray, halvings: int
    ) -> Sensitivity:
        """One edge at `place`, from where it was `last` found, at `start` and with that slope."""
        guess = dataclasses.replace(last, speed=last.speed + float(slope @ (place - start)) * np.pi / 30)
        found = sensitivity(space.model(place), guess, method=self.method)
        if np.isfinite(found.value_rpm) or halvings == 0:
            return found
        middle = (start + place) / 2
        half = self._follow(space, last, slope, start, middle, halvings - 1)
        if not np.isfinite(half.value_rpm):
            return found
        return self._follow(space, _moved(last, half), space.slope_of(half.derivative), middle, place, halvings - 1)


def _moved(last: Point, found: Sensitivity) -> Point:
    """The bifurcation where it was found."""
    return dataclasses.replace(last, speed=found.value_rpm * np.pi / 30, state=found.state, steps=found.steps)


@dataclasses.dataclass(frozen=True, eq=False)
class EdgeSum(AbstractExact):
    """A weighted sum of edges [rpm], such as the width between two."""

    edges: FollowedEdges
    weights: Mapping[str, float]
    constant: float = 0.0
    """Added to the sum [rpm]."""

    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Measured:
        weights = np.array([self.weights.get(name, 0.0) for name in self.edges.names])
        speeds, slopes = self.edges.at(space, place)
        here = weights != 0
        value = self.constant + float(weights[here] @ speeds[here])
        return Measured(value, weights[here] @ slopes[here], self.edges.status(np.where(here, speeds, 0.0)))


@dataclasses.dataclass(frozen=True, eq=False)
class EdgeClearance(AbstractExact):
    """Distance of operating speeds from the nearest edge [rpm], with its sign turned: small is far away.

    The nearest is taken by a soft minimum over edges and speeds, of `softness` [rpm].
    """

    edges: FollowedEdges
    operating_rpm: Sequence[float]
    """Speeds, or the two ends of a range."""
    softness: float = 100.0

    def at(self, space: DesignSpace, place: Float[np.ndarray, " n"]) -> Measured:
        speeds, slopes = self.edges.at(space, place)
        apart = speeds[None] - np.asarray(self.operating_rpm, dtype=float)[:, None]
        nearness = np.exp(-(np.abs(apart) - np.nanmin(np.abs(apart))) / self.softness)
        total = nearness.sum()
        value = self.softness * np.log(total) - np.nanmin(np.abs(apart))
        slope = np.einsum("se,en->n", -nearness / total * np.sign(apart), slopes)
        return Measured(float(value), slope, self.edges.status(speeds))


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
        found = self.multipliers(space, place)
        size = np.array([m.size for m in found])
        if not np.all(np.isfinite(size)):
            lost_rpm = self.speeds[np.isnan(size)] * (30 / np.pi)
            lost = ", ".join(f"{speed:.0f}" for speed in lost_rpm.tolist())
            return Measured(np.nan, np.full(len(space.names), np.nan), f"no orbit near the guess at {lost} rpm")
        slope = softmax(self.sharpness * size) @ np.array([space.slope_of(m.derivative) for m in found])
        largest = float(logsumexp(self.sharpness * size)) / self.sharpness  # pyright: ignore[reportArgumentType]
        return Measured(largest - 1, slope)
