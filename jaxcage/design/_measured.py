"""Edges as a test rig or a publication gives them."""

import dataclasses
import re
from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Bool, Float

from .._errors import ArgumentError
from ..analysis import Edge, Zone


@dataclasses.dataclass(frozen=True)
class MeasuredEdge:
    """One measured end of a zone."""

    case: str
    name: str
    """`zone 1 onset`, `zone 1 exit`, `zone 2 onset`, ... as in the zones that are found."""
    rpm: float
    uncertainty_rpm: float
    """Standard deviation [rpm]."""
    kind: str = "synchronous-loss"
    """`synchronous-loss` or `chaotic`: the two are never mixed."""

    def __post_init__(self):
        if not re.fullmatch(r"zone [1-9]\d* (onset|exit)", self.name):
            raise ArgumentError("name", said=f"must be like 'zone 1 onset' or 'zone 2 exit', but is '{self.name}'.")
        if self.kind not in ("synchronous-loss", "chaotic"):
            raise ArgumentError("kind", said=f"must be synchronous-loss or chaotic, but is '{self.kind}'.")
        if not (np.isfinite([self.rpm, self.uncertainty_rpm]).all() and min(self.rpm, self.uncertainty_rpm) > 0):
            given = f"{self.rpm} and {self.uncertainty_rpm}"
            raise ValueError(f"Speed and uncertainty of an edge must be positive numbers, but {given} were given.")

    @property
    def zone(self) -> int:
        """Number of the zone."""
        return int(self.name.split()[1])

    @property
    def end(self) -> str:
        """`onset` or `exit`."""
        return self.name.split()[2]


def of_case(edges: Iterable[MeasuredEdge], case: str) -> list[MeasuredEdge]:
    """The edges of one case, by speed."""
    return sorted((e for e in edges if e.case == case), key=lambda e: e.rpm)


def inside_zones(edges: Sequence[MeasuredEdge], rpm: Float[np.ndarray, " speeds"]) -> Bool[np.ndarray, " speeds"]:
    """Which speeds lie in a measured zone of one case; a zone without an exit goes on."""
    inside = np.zeros(rpm.shape, bool)
    for zone in {e.zone for e in edges}:
        ends = {e.end: e.rpm for e in edges if e.zone == zone}
        inside |= (rpm >= ends.get("onset", 0.0)) & (rpm <= ends.get("exit", np.inf))
    return inside


def matched(edges: Sequence[MeasuredEdge], found: Sequence[Zone], last_rpm: float) -> list[Edge | None]:
    """For each edge of one case the one found: that of the zone which shares most speeds with its measured zone.

    Zones without an exit, measured or found, end at `last_rpm`, the last speed that was looked at. A found zone answers
    for one measured zone only, the lowest: one zone over two has the edges of the first.
    """
    taken: dict[int, Zone | None] = {}
    for number in sorted({e.zone for e in edges}):
        ends = {e.end: e.rpm for e in edges if e.zone == number}
        low, high = ends.get("onset", 0.0), min(ends.get("exit", np.inf), last_rpm)
        best = max(found, key=lambda z: _shared(z, low, high), default=None)
        lost = best is None or _shared(best, low, high) <= 0 or any(best is z for z in taken.values())
        taken[number] = None if lost else best
    zones = [(e, taken[e.zone]) for e in edges]
    return [None if z is None else z.onset if e.end == "onset" else z.exit for e, z in zones]


def _shared(zone: Zone, low: float, high: float) -> float:
    """How much of [low, high] a zone covers [rpm]."""
    onset = zone.onset.speed_rpm if zone.onset else 0.0
    leaves = zone.exit.speed_rpm if zone.exit else np.inf
    return min(leaves, high) - max(onset, low)
