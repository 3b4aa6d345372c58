"""The exact width of the unstable ranges of the synchronous orbit within a range of speed, as an objective."""

import dataclasses

import numpy as np
from jaxtyping import Float

from .._errors import InputError
from ..orbits import Point, follow_all, loss_zones, synchronous_orbits
from ..solve import AbstractMethod
from .operating import REACH, DesignSpace, Value, point_of


@dataclasses.dataclass
class UnstableWidth:
    """The sum of the widths of unstable ranges [rpm], cut at the ends of a range of speed, and its exact derivatives.

    The edges are those that a search finds at the first design; they are followed from the nearest design at which they
    are known. Two edges of one range that meet leave none of it.
    """

    space: DesignSpace
    operating: tuple[float, float]
    """Ends of the range of cage speed [rad/s]."""
    method: AbstractMethod | None = None

    def __post_init__(self):
        low, high = self.operating
        self.limits = REACH[0] * low, REACH[1] * high
        found = loss_zones(synchronous_orbits(self.space.system, low, high, method=self.method))
        if not found.edges:
            raise InputError("The range of speed must have an edge of an unstable range within it, but has none.")
        self._anchors: list[tuple[np.ndarray, dict[str, Point]]] = [(self.space.place, found.edges)]

    def at(self, place: Float[np.ndarray, " n"]) -> Value | str:
        """The width at a place of the design space; or why it is not known."""
        near, edges = min(self._anchors, key=lambda a: float(np.sum((a[0] - place) ** 2)))
        found = follow_all(self.space.model(near), edges, self.space.model(place), self.limits, self.method)
        low, high = (end * 30 / np.pi for end in self.operating)
        value, slope = 0.0, np.zeros(len(self.space.names))
        for zone in sorted({name.rsplit(" ", 1)[0] for name in edges}):
            ends = {end: f"{zone} {end}" for end in ("onset", "exit")}
            here = {end: found[name] for end, name in ends.items() if name in found}
            if len(here) == 2 and all(f.ended == "turned back" for f in here.values()):
                continue
            if lost := [f"{ends[end]}: {f.ended}" for end, f in here.items() if f.edge is None]:
                return "; ".join(lost)
            for end, sign, bound in (("onset", -1.0, low), ("exit", 1.0, high)):
                edge = here[end].edge if end in here else None
                if edge is None or not low < edge.value_rpm < high:
                    beyond = edge is not None and (edge.value_rpm <= low) == (sign > 0)
                    value += sign * (bound if not beyond else (low if sign > 0 else high))
                    continue
                value, slope = value + sign * edge.value_rpm, slope + sign * self.space.slope_of(edge.derivative)
        if all(f.edge is not None for f in found.values()):
            known = {name: point_of(f.edge, edges[name]) for name, f in found.items() if f.edge is not None}
            self._anchors.append((place.copy(), known))
        return Value(value, slope)
