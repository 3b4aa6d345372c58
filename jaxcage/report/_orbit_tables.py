"""Bifurcations, stable stretches and synchronous-loss zones, as documents and as tables."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._types import Scalar
from ..analysis import Edge, Zone
from ..bearing import PublishedCase
from ..orbits import LossZones, Point, Stretch, SynchronousOrbits
from ._table import Speeds, Table, chosen, number, speed
from ._zone_tables import published_document, zone_document, zones_beside_published


AT_LIMIT_RPM = 1e-6


def angle_deg(point: Point) -> float:
    """Angle [deg] of the critical multiplier: 180 at a period doubling, 0 at a fold."""
    exact = {"period-doubling": 180.0, "fold": 0.0, "branch-point": 0.0}
    return exact.get(point.kind, abs(math.degrees(np.angle(point.critical))))


def pairs(multipliers: Sequence[complex] | np.ndarray) -> list[list[float]]:
    """Complex numbers for programs: real and imaginary part."""
    return [[float(mu.real), float(mu.imag)] for mu in multipliers]


def point_document(point: Point, branch: int | None) -> dict[str, Any]:
    """A bifurcation for programs."""
    return {
        **chosen(point, "kind speed_rpm error_rpm steps"),
        "multiplier": pairs([point.critical])[0],
        "angle_deg": angle_deg(point),
        "edge": point.edge,
        "branch": branch,
        "state": point.state,
    }


def branch_of(found: SynchronousOrbits, point: Point) -> int | None:
    """Number of the branch that a point is on."""
    return next((i for i, b in enumerate(found.branches) if any(p is point for p in b.special)), None)


def end_kinds(stretch: Stretch, found: SynchronousOrbits) -> tuple[str, str]:
    """How a stretch begins and ends: a kind of bifurcation, `range` where it runs past the range, or `unknown` where
    the branch was not followed further.
    """
    at = lambda rpm, limit: "range" if abs(rpm - limit) < AT_LIMIT_RPM else "unknown"
    lower = at(stretch.lower_rpm, found.lower_rpm) if stretch.lower is None else stretch.lower.kind
    upper = at(stretch.upper_rpm, found.upper_rpm) if stretch.upper is None else stretch.upper.kind
    return lower, upper


def stretch_document(stretch: Stretch, found: SynchronousOrbits) -> dict[str, Any]:
    """A stable stretch for programs."""
    lower, upper = end_kinds(stretch, found)
    return {
        **chosen(stretch, "lower_rpm upper_rpm"),
        "lower_kind": lower,
        "upper_kind": upper,
        **chosen(stretch, "branch confirmed family met met_first"),
    }


def edge_document(name: str, found: SynchronousOrbits, loss: LossZones) -> dict[str, Any]:
    """A named edge for programs, with the orbits there are at its speed."""
    point = loss.edges[name]
    orbits = [
        {"branch": i, "stable": stable, "state": state, "multipliers": pairs(multipliers)}
        for i, stable, state, multipliers in loss.coexisting[name]
    ]
    return {"name": name, **point_document(point, branch_of(found, point)), "coexisting": orbits}


def orbits_document(
    name: str, found: SynchronousOrbits, loss: LossZones, published: PublishedCase | None
) -> dict[str, Any]:
    """All that a search found, for programs."""
    return {
        "case": name,
        "range_rpm": [found.lower_rpm, found.upper_rpm],
        "points": [point_document(p, branch_of(found, p)) for p in found.points],
        "stretches": [stretch_document(s, found) for s in found.stretches],
        "close_below_rpm": loss.close_below_rpm,
        "zones": [zone_document(zone) for zone in loss.zones],
        "edges": [edge_document(edge, found, loss) for edge in loss.edges],
        "published": published_document(published),
        "missed": found.missed,
        "unsettled": found.unsettled,
        "unexplained": [point_document(p, branch_of(found, p)) for p in found.unexplained],
    }


def stretch_table(name: str, found: SynchronousOrbits) -> Table:
    """Where a synchronous orbit is stable, and what happens to it at either end [rpm]."""
    rows = []
    for s in found.stretches:
        lower, upper = end_kinds(s, found)
        speeds = [speed(rpm, 2) for rpm in (s.lower_rpm, s.upper_rpm, s.width_rpm)]
        rows.append((speeds[0], lower, speeds[1], upper, speeds[2], str(s.met), str(s.branch)))
    columns = ("from", "by", "to", "by", "width", "settled", "branch")
    return Table(
        f"Stable synchronous orbits of {name} [rpm]", columns, rows or [("none", *6 * ("-",))], ("from", "to", "width")
    )


def loss_table(name: str, found: SynchronousOrbits, loss: LossZones, published: PublishedCase | None) -> Table:
    """Synchronous-loss zones, each published (chaotic) zone beside the one it shares most speeds with [rpm]."""
    title = f"Synchronous-loss zones of {name} [rpm], closed below {number(loss.close_below_rpm)} rpm"
    columns = ("zone", "onset", "by", "exit", "by", "width", "published chaos")
    cells, searched = [_zone_cells(zone) for zone in loss.zones], (found.lower_rpm, found.upper_rpm)
    return zones_beside_published(title, columns, cells, loss.zones, published, searched, "not searched")


def _zone_cells(zone: Zone) -> list[str]:
    cells = []
    for edge in (zone.onset, zone.exit):
        cells += ["past range", "-"] if edge is None else [edge_cell(edge), edge.mechanism]
    return [*cells, speed(zone.width_rpm, 2, nothing="open")]


def edge_cell(edge: Edge) -> str:
    """A located edge with its error, and as many digits as that has."""
    error = float(edge.uncertainty_rpm)
    digits = min(max(2, -math.floor(math.log10(error))), 6) if 0 < error < math.inf else 2
    if math.isnan(error):
        return Speeds("{:.2f} ± -", edge.speed_rpm)
    return Speeds(f"{{:.{digits}f}} ± {{:.1g}}", edge.speed_rpm, error)


def edge_table(name: str, found: SynchronousOrbits, loss: LossZones) -> Table:
    """Bifurcations at which a stable synchronous orbit begins or ends."""
    named = lambda p: next((name for name, q in loss.edges.items() if q is p), "-")
    rows = [
        (
            speed(float(p.speed_rpm), 3),
            error_cell(p.error_rpm),
            p.kind,
            multiplier_cell(p),
            number(angle_deg(p), 2),
            str(branch_of(found, p)),
            named(p),
        )
        for p in found.edges
    ]
    columns = ("speed [rpm]", "±", "kind", "multiplier", "angle [°]", "branch", "edge of")
    return Table(
        f"Ends of the stable synchronous orbits of {name}", columns, rows or [("none", *6 * ("-",))], ("speed [rpm]",)
    )


def error_cell(error_rpm: Scalar) -> str:
    """The error of a speed; `-` where the method has no number of steps that could be halved."""
    return "-" if math.isnan(error_rpm) else f"{float(error_rpm):.1g}"


def unsettled_notes(found: SynchronousOrbits) -> list[str]:
    """Bifurcations that were left out, and those that must have been missed."""
    count = found.unsettled
    notes = [f"Left out: {count} bifurcations that half the steps put elsewhere (not converged)"] if count else []
    for s in found.stretches:
        if not s.confirmed:
            notes.append(f"Not confirmed: the stretch from {number(s.lower_rpm, 2)} rpm is narrower than its error")
    for p in found.unexplained:
        place = f"{number(float(p.speed_rpm), 3)} ± {error_cell(p.error_rpm)} rpm on branch {branch_of(found, p)}"
        notes.append(f"Unexplained: the stability changes at {place}, and no bifurcation was found there")
    return notes


def multiplier_cell(point: Point) -> str:
    """The critical multiplier; of a complex pair both."""
    mu = point.critical
    return f"{mu.real:.4f} ± {mu.imag:.4f}i" if point.kind == "Neimark-Sacker" else f"{mu.real:.4f}"


def coexisting_notes(loss: LossZones) -> list[str]:
    """One line for each named edge at whose speed another synchronous orbit is stable."""
    notes = []
    for name, orbits in loss.coexisting.items():
        point = loss.edges[name]
        others: list[np.ndarray] = []
        for state in (state for _, stable, state, _ in orbits if stable):
            if not any(_same(state, known) for known in (np.asarray(point.state), *others)):
                others.append(state)
        if others:
            orbit = "another synchronous orbit is" if len(others) == 1 else f"{len(others)} other ones are"
            notes.append(f"At {name} ({point.speed_rpm:.2f} rpm) {orbit} stable: not every start sees this edge.")
    return notes


def _same(state: np.ndarray, other: np.ndarray) -> bool:
    half = state.size // 2
    parts = (slice(0, half), slice(half, None))
    return all(np.linalg.norm(state[p] - other[p]) < 0.03 * np.linalg.norm(other[p]) for p in parts)
