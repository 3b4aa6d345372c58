"""Bifurcations, stable stretches and zones without a stable synchronous orbit: records for documents, and tables."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._form import compiled
from .._types import Scalar
from ..bearing import PublishedCase
from ..integrate import AbstractMethod, method as make_method, strobe_map
from ..models import CageModel
from ..orbits import LossZones, Point, Stretch, SynchronousOrbits
from .tables import Beside, Column, Table, chosen, number, rows_table, speed_columns
from .zone_tables import beside_published, zone_record


AT_LIMIT_RPM = 1e-6
SAME = 0.03
"""Relative distance in places, and in speeds, within which two orbits are the same."""
STEPS = 4096
"""Steps of a revolution in which the largest excursion of an orbit is looked for."""


def angle_deg(point: Point) -> float:
    """Angle [deg] of the critical multiplier: 180 at a period doubling, 0 at a fold."""
    exact = {"period-doubling": 180.0, "fold": 0.0, "branch-point": 0.0}
    return exact.get(point.kind, abs(math.degrees(np.angle(point.critical))))


def point_record(point: Point, found: SynchronousOrbits) -> dict[str, Any]:
    """A bifurcation for a document."""
    branch = next((i for i, b in enumerate(found.branches) if any(p is point for p in b.special)), None)
    mu = complex(point.critical)
    return {
        **{name: float(getattr(point, name)) for name in ("speed_rpm", "error_rpm")},
        **chosen(point, "kind steps edge state"),
        "multiplier": [mu.real, mu.imag],
        "angle_deg": angle_deg(point),
        "branch": branch,
    }


def stretch_record(stretch: Stretch, found: SynchronousOrbits) -> dict[str, Any]:
    """A stable stretch for a document.

    It begins and ends by a kind of bifurcation, by `range` where it runs past the range, or by `unknown` where the
    branch was not followed further.
    """
    at = lambda rpm, limit: "range" if abs(rpm - limit) < AT_LIMIT_RPM else "unknown"
    lower, upper = stretch.lower, stretch.upper
    return {
        **chosen(stretch, "lower_rpm upper_rpm width_rpm branch confirmed family met met_first"),
        "lower_kind": at(stretch.lower_rpm, found.lower_rpm) if lower is None else lower.kind,
        "upper_kind": at(stretch.upper_rpm, found.upper_rpm) if upper is None else upper.kind,
    }


def orbits_document(found: SynchronousOrbits, loss: LossZones) -> dict[str, Any]:
    """All that a search found, with the orbits there are at the speed of each named edge."""
    pairs = lambda multipliers: [[float(mu.real), float(mu.imag)] for mu in multipliers]
    edges = [
        {"name": name, **point_record(point, found)}
        | {
            "coexisting": [
                {"branch": i, "stable": stable, "state": state, "multipliers": pairs(multipliers)}
                for i, stable, state, multipliers in loss.coexisting[name]
            ]
        }
        for name, point in loss.edges.items()
    ]
    return {
        "range_rpm": [found.lower_rpm, found.upper_rpm],
        "points": [point_record(p, found) for p in found.points],
        "stretches": [stretch_record(s, found) for s in found.stretches],
        "close_below_rpm": loss.close_below_rpm,
        "zones": [zone_record(zone) for zone in loss.zones],
        "edges": edges,
        **chosen(found, "missed unsettled"),
        "unexplained": [point_record(p, found) for p in found.unexplained],
    }


def stretch_table(name: str, found: SynchronousOrbits, beside: Beside = None) -> Table:
    """Stretches of speed in which a synchronous orbit is stable, and the bifurcations at their ends [rpm]."""
    rows = [stretch_record(s, found) for s in found.stretches]
    columns = [
        *speed_columns("from", "lower_rpm", beside, digits=2),
        Column("by", (), key="lower_kind"),
        *speed_columns("to", "upper_rpm", beside, digits=2),
        Column("by", (), key="upper_kind"),
        Column("width", (), key="width_rpm", digits=2),
        Column("settled", (), key="met"),
        Column("branch", ()),
    ]
    return rows_table(f"Stable synchronous orbits of {name} [rpm]", rows, columns)


def loss_table(
    name: str, found: SynchronousOrbits, loss: LossZones, published: PublishedCase | None, beside: Beside = None
) -> Table:
    """Zones without a stable synchronous orbit, each published (chaotic) zone beside the one it shares most with."""
    title = f"Synchronous-loss zones of {name} [rpm], closed below {loss.close_below_rpm:.0f} rpm"
    return beside_published(title, loss.zones, published, (found.lower_rpm, found.upper_rpm), beside)


def edge_table(found: SynchronousOrbits, loss: LossZones, beside: Beside = None, named: bool = False) -> Table:
    """Bifurcations at which a stable synchronous orbit begins or ends; with `named` those that bound a zone."""
    names = {id(point): name for name, point in loss.edges.items()}
    rows = []
    for point in found.edges:
        record, (real, imaginary) = point_record(point, found), point_record(point, found)["multiplier"]
        both = f" ± {imaginary:.4f}i" if point.kind == "Neimark-Sacker" else ""
        rows.append(record | {"critical": f"{real:.4f}{both}", "edge": names.get(id(point))})
    columns = [
        *speed_columns("speed", "speed_rpm", beside, "error_rpm"),
        Column("kind", ()),
        Column("multiplier", (), key="critical"),
        Column("angle", (), "deg", key="angle_deg", digits=2),
        Column("branch", ()),
        Column("edge of", (), key="edge"),
    ]
    kept = [row for row in rows if row["edge"] or not named]
    return rows_table("Ends of the stable synchronous orbits [rpm]", kept, columns)


def unsettled_notes(found: SynchronousOrbits) -> list[str]:
    """Bifurcations that were left out, stretches that are not certain, and bifurcations that must have been missed."""
    count = found.unsettled
    notes = [f"Left out: {count} bifurcations that half the steps put elsewhere (not converged)"] if count else []
    for s in found.stretches:
        if not s.confirmed:
            notes.append(f"Not confirmed: the stretch from {s.lower_rpm:.2f} rpm is narrower than its error")
    for p in found.unexplained:
        place = f"{number(float(p.speed_rpm), float(p.error_rpm))} rpm on branch {point_record(p, found)['branch']}"
        notes.append(f"Unexplained: the stability changes at {place}, and no bifurcation was found there")
    return notes


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
            at = f"{name} ({float(point.speed_rpm):.2f} rpm)"
            notes.append(f"At {at} {orbit} stable: not every initial state leads to this edge.")
    return notes


def _same(state: np.ndarray, other: np.ndarray) -> bool:
    half = state.size // 2
    parts: Sequence[slice] = (slice(0, half), slice(half, None))
    return all(np.linalg.norm(state[p] - other[p]) < SAME * np.linalg.norm(other[p]) for p in parts)


@compiled
def _largest_eps(
    model: CageModel, speed: Scalar, state: Float[Array, " dim"], method: AbstractMethod
) -> Float[Array, ""]:
    return jnp.asarray(strobe_map(model, speed, method)(tuple(state[i] for i in range(state.size))).peak)


def contact_notes(model: CageModel, edges: Mapping[str, Point], method: AbstractMethod | None) -> list[str]:
    """A sentence for each edge whose orbit touches the land.

    The force of the land sets in over a thousandth of the clearance, which takes ten times as many steps as the film
    alone: the error of such an edge is the one to be looked at.
    """
    chosen_method, notes = make_method(steps=STEPS) if method is None else method, []
    for name, p in edges.items():
        speed, state = jnp.asarray(p.speed, dtype=float), jnp.asarray(p.state)
        eps, onset = float(_largest_eps(model, speed, state, chosen_method)), float(model.contact.onset)
        if eps > onset:
            notes.append(
                f"{name.capitalize()}: its orbit touches the land (eps {eps:.3f}, contact from {onset:g}); by half of "
                f"its {p.steps} steps it is {float(p.error_rpm):.1g} rpm away"
            )
    return notes
