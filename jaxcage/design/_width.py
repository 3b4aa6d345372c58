"""Widths of zones between edges of any kind, and how they answer to the design."""

import dataclasses
import math

from .._errors import ArgumentError
from .._notebook import notebook_html
from ..orbits import Sensitivity
from ._lasting import LastingEdge


TOGETHER = ("guidance_gap", "eccentricity")
"""What is shown first, and what grows together at a fixed ratio."""
SolvedEdge = LastingEdge | Sensitivity
"""An edge that knows how it answers to parameters: by lanes, or exactly."""


@dataclasses.dataclass(frozen=True)
class ZoneWidth:
    """Width of a zone, of lasting chaos or of synchronous loss, and how it answers to parameters.

    Each edge is of any kind, and has lanes of its own, and so an error of its own; the gradient of an exact edge has
    none. A zone that is cut by the range is open: it has no width, but its gradient is that of the other edge.
    """

    onset: SolvedEdge | None
    exit: SolvedEdge | None
    """None where the zone goes on beyond the range."""

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters by which its edges are known to change."""
        (first, *others) = (_names(edge) for _, edge in self._ends())
        return tuple(name for name in first if all(name in other for other in others))

    @property
    def open(self) -> bool:
        """Whether the range cuts it."""
        return self.onset is None or self.exit is None

    @property
    def trusted(self) -> bool:
        """Whether all edges that it has are to be used."""
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
        if self.onset is None or self.exit is None:
            return None
        return _speed(self.exit) - _speed(self.onset)

    @property
    def standard_error_rpm(self) -> float | None:
        """Of the width; of an exact edge its distance to that by half the steps counts."""
        if self.onset is None or self.exit is None:
            return None
        return math.hypot(_error(self.onset), _error(self.exit))

    def change(self, *names: str) -> tuple[float, float]:
        """Change of the width when parameters grow together [rpm by their relative change], with its standard error;
        of an open zone that of its one edge.

        **Raises:** `ValueError` for a parameter that an edge was not asked about.
        """
        if unknown := [name for name in names if name not in self.names]:
            raise ArgumentError("names", said=f"must be among {', '.join(self.names)}, but has '{unknown[0]}'.")
        found = [(sign * _speed(edge), *_sum_of(edge, names)) for sign, edge in self._ends()]
        return sum(by * e for by, e, _ in found), math.hypot(*(by * error for by, _, error in found))

    def _ends(self) -> list[tuple[float, SolvedEdge]]:
        return [(sign, edge) for sign, edge in ((-1.0, self.onset), (1.0, self.exit)) if edge is not None]

    def __str__(self) -> str:
        wide = "" if self.width_rpm is None else f"{self.width_rpm:.0f} +- {self.standard_error_rpm:.0f} rpm, "
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
