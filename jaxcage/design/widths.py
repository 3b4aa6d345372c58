"""Widths of zones between edges of any kind, and their change with the design."""

import dataclasses
import math
from collections.abc import Mapping
from typing import overload

from .._errors import ArgumentError
from ..orbits import Sensitivity
from ..quantities import notebook_html
from .edges import EdgeSum, FollowedEdges
from .lasting import LastingEdge


TOGETHER = ("guidance_gap", "eccentricity")
"""Parameters that are shown first, and that grow together at a fixed ratio."""
SolvedEdge = LastingEdge | Sensitivity
"""An edge with its elasticities: by survival regression, or exact."""


@dataclasses.dataclass(frozen=True)
class ZoneWidth:
    """Width of a zone, of lasting chaos or of synchronous loss, and its change with parameters.

    Each edge has an error of its own; the gradient of an exact edge has none. A zone that is cut by the range is open:
    it has no width, but its gradient is that of the other edge.
    """

    onset: SolvedEdge | None
    exit: SolvedEdge | None
    """None where the zone goes on beyond the range."""

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters by which its edges are known to change."""
        first, *others = (_names(edge) for _, edge in self._ends())
        return tuple(name for name in first if all(name in other for other in others))

    @property
    def open(self) -> bool:
        """True if the range cuts it."""
        return self.onset is None or self.exit is None

    @property
    def trusted(self) -> bool:
        """True if all edges that it has are converged."""
        return all(edge.status == "converged" for _, edge in self._ends())

    @property
    def status(self) -> str:
        """`converged`, `open: ...`, or which edge should not be used, and why."""
        ends = {"onset": self.onset, "exit": self.exit}
        bad = [f"{name}: {edge.status}" for name, edge in ends.items() if edge and edge.status != "converged"]
        missing = [f"open: no {name} within the range" for name, edge in ends.items() if edge is None]
        return "; ".join([*missing, *bad]) or "converged"

    @property
    def width_rpm(self) -> float | None:
        """Exit less onset; None for an open zone."""
        return None if self.open else sum(sign * _speed(edge) for sign, edge in self._ends())

    @property
    def standard_error_rpm(self) -> float | None:
        """Standard error of the width; for an exact edge its distance to that by half the steps counts."""
        return None if self.open else math.hypot(*(_error(edge) for _, edge in self._ends()))

    def change(self, *names: str) -> tuple[float, float]:
        """Change of the width when parameters grow together [rpm by their relative change], with its standard error;
        for an open zone that of its one edge.

        **Raises:** `ValueError` for a parameter by which an edge is not known to change.
        """
        if unknown := [name for name in names if name not in self.names]:
            raise ArgumentError("names", said=f"must be among {', '.join(self.names)}, but has '{unknown[0]}'.")
        found = [(sign * _speed(edge), *_sum_of(edge, names)) for sign, edge in self._ends()]
        return sum(by * e for by, e, _ in found), math.hypot(*(by * error for by, _, error in found))

    def _ends(self) -> list[tuple[float, SolvedEdge]]:
        return [(sign, edge) for sign, edge in ((-1.0, self.onset), (1.0, self.exit)) if edge is not None]

    def __str__(self) -> str:
        wide = "" if self.open else f"{self.width_rpm:.0f} +- {self.standard_error_rpm:.0f} rpm, "
        asked: dict[str, tuple[str, ...]] = {name: (name,) for name in TOGETHER if name in self.names}
        if len(asked) == len(TOGETHER):
            asked["both, at a fixed ratio"] = TOGETHER
        found = [(name, self.change(*of)) for name, of in asked.items()]
        rows = [f"  1 % more {name:<22} {v / 100:+.1f} +- {e / 100:.1f} rpm" for name, (v, e) in found]
        return "\n".join([f"{wide}{self.status}", *rows])

    _repr_html_ = notebook_html


def _names(edge: SolvedEdge) -> tuple[str, ...]:
    return tuple(edge.elasticity) if isinstance(edge, Sensitivity) else edge.names


def _speed(edge: SolvedEdge) -> float:
    return edge.value_rpm if isinstance(edge, Sensitivity) else edge.speed_rpm


def _error(edge: SolvedEdge) -> float:
    return edge.error_rpm if isinstance(edge, Sensitivity) else edge.standard_error_rpm


def _sum_of(edge: SolvedEdge, names: tuple[str, ...]) -> tuple[float, float]:
    return (sum(edge.elasticity[n] for n in names), 0.0) if isinstance(edge, Sensitivity) else edge.sum_of(*names)


@overload
def zone_width(edges: FollowedEdges, zone: int = 1, range_rpm: tuple[float, float] | None = None) -> EdgeSum: ...
@overload
def zone_width(edges: Mapping[str, SolvedEdge], zone: int = 1) -> ZoneWidth: ...
def zone_width(
    edges: FollowedEdges | Mapping[str, SolvedEdge], zone: int = 1, range_rpm: tuple[float, float] | None = None
) -> EdgeSum | ZoneWidth:
    """Width of a zone, exit less onset [rpm], and its change with the design.

    **Arguments:** edges by name, `zone 1 onset` and the like, or `onset` and `exit`; number of the zone; first and last
    speed of the range, for an open zone of followed edges.

    **Returns:** for edges that are solved for (`lasting_edges`, `jaxcage.sensitivities`), `ZoneWidth`: the width and
    its change by any parameters, with standard errors. For `FollowedEdges`, an objective for searches.

    A zone that is open, its onset or exit beyond the range, has the slope of its other edge alone. As an objective it
    counts to the end of the range; a `ZoneWidth` has no width then and says that it is open.

    **Raises:** `ValueError` for a zone of which no edge is known, or an open one of followed edges without a range.
    """
    known = edges.names if isinstance(edges, FollowedEdges) else tuple(edges)
    names = {end: f"zone {zone} {end}" for end in ("onset", "exit")}
    if not isinstance(edges, FollowedEdges):
        names = {end: name if name in known else end for end, name in names.items()}
    ends = {end: name for end, name in names.items() if name in known}
    if not ends:
        raise ArgumentError("zone", said=f"must be one with an edge among {', '.join(known)}, but is {zone}.")
    if not isinstance(edges, FollowedEdges):
        return ZoneWidth(*(edges.get(name) for name in names.values()))
    if len(ends) == 1 and range_rpm is None:
        raise ArgumentError(
            "range_rpm", said=f"must be given for zone {zone}, which is open: its {next(iter(ends))} alone is known."
        )
    first, last = range_rpm or (0.0, 0.0)
    signs, beyond = {"onset": -1.0, "exit": 1.0}, {"onset": -first, "exit": last}
    constant = sum((beyond[end] for end in names if end not in ends), start=0.0)
    return EdgeSum(edges, {name: signs[end] for end, name in ends.items()}, constant)
