"""Bifurcations, stable stretches and zones without a stable synchronous orbit."""

import math
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._pytrees import compiled
from ..bearing import PublishedCase
from ..models import CageModel
from ..orbits import LossZones, Point, Stretch, SynchronousOrbits
from ..solve import AbstractMethod, method as make_method, strobe_map
from .tables import Beside, Column, Table, chosen, number, rows_table, speed_columns
from .zone_tables import beside_published


AT_LIMIT_RPM = 1e-6
SAME = 0.03
"""Relative distance in places, and in speeds, within which two orbits are the same."""
STEPS = 4096
"""Steps of a revolution in which the largest excursion of an orbit is looked for."""


def point_record(point: Point, found: SynchronousOrbits, name: str | None = None) -> dict[str, Any]:
    """A bifurcation for tables and documents; `name` is that of the edge that it makes."""
    mu, exact = complex(point.critical), {"period-doubling": 180.0, "fold": 0.0, "branch-point": 0.0}
    return {
        **{n: float(getattr(point, n)) for n in ("speed_rpm", "error_rpm")},
        **chosen(point, "kind steps edge state"),
        "multiplier": [mu.real, mu.imag],
        "angle_deg": exact.get(point.kind, abs(math.degrees(np.angle(mu)))),
        "branch": next((i for i, b in enumerate(found.branches) if any(p is point for p in b.special)), None),
        "name": name,
    }


def _stretch_record(stretch: Stretch, found: SynchronousOrbits) -> dict[str, Any]:
    """A stable stretch, which begins and ends by a kind of bifurcation, by `range` where it runs past the range, or by
    `unknown` where the branch was not followed further."""
    record = chosen(stretch, "lower_rpm upper_rpm width_rpm branch confirmed family met met_first")
    for end in ("lower", "upper"):
        point, at_limit = getattr(stretch, end), abs(record[f"{end}_rpm"] - getattr(found, f"{end}_rpm")) < AT_LIMIT_RPM
        record[f"{end}_kind"] = ("range" if at_limit else "unknown") if point is None else point.kind
    return record


def orbits_document(found: SynchronousOrbits, loss: LossZones) -> dict[str, Any]:
    """All bifurcations that a search found, and the orbits there are at the speed of each named edge."""
    pairs = lambda multipliers: [[float(mu.real), float(mu.imag)] for mu in multipliers]
    return {
        "range_rpm": [found.lower_rpm, found.upper_rpm],
        "close_below_rpm": loss.close_below_rpm,
        "points": [point_record(p, found) for p in found.points],
        "unexplained": [point_record(p, found) for p in found.unexplained],
        "coexisting": {
            name: [{"branch": i, "stable": stable, "state": y, "multipliers": pairs(mu)} for i, stable, y, mu in orbits]
            for name, orbits in loss.coexisting.items()
        },
        **chosen(found, "missed unsettled"),
    }


def stretch_table(name: str, found: SynchronousOrbits, beside: Beside = None) -> Table:
    """Stretches of speed in which a synchronous orbit is stable, and the bifurcations at their ends [rpm]."""
    rows, columns = [_stretch_record(s, found) for s in found.stretches], []
    for head, end in (("from", "lower"), ("to", "upper")):
        columns += [*speed_columns(head, f"{end}_rpm", beside, digits=2), Column("by", (), key=f"{end}_kind")]
    columns += [Column("width", (), key="width_rpm", digits=2), Column("settled", (), key="met"), Column("branch", ())]
    return rows_table(f"Stable synchronous orbits of {name} [rpm]", rows, columns, "stretches")


def loss_table(
    name: str, found: SynchronousOrbits, loss: LossZones, published: PublishedCase | None, beside: Beside = None
) -> Table:
    """Zones without a stable synchronous orbit, each published (chaotic) zone beside the one it shares most with."""
    title = f"Synchronous-loss zones of {name} [rpm], closed below {loss.close_below_rpm:.0f} rpm"
    between = found.lower_rpm, found.upper_rpm
    return beside_published(title, "synchronous_loss", loss.zones, published, between, beside)


def edge_table(found: SynchronousOrbits, loss: LossZones, beside: Beside = None, named: bool = False) -> Table:
    """Bifurcations at which a stable synchronous orbit begins or ends; with `named` those that bound a zone."""
    names = {id(point): name for name, point in loss.edges.items()}
    rows = [point_record(p, found, names.get(id(p))) for p in found.edges if not named or id(p) in names]
    for row in rows:
        both = f" ± {row['multiplier'][1]:.4f}i" if row["kind"] == "Neimark-Sacker" else ""
        row["critical"] = f"{row['multiplier'][0]:.4f}{both}"
    columns = [
        *speed_columns("speed", "speed_rpm", beside, "error_rpm"),
        Column("kind", ()),
        Column("multiplier", (), key="critical"),
        Column("angle", (), "deg", key="angle_deg", digits=2),
        Column("branch", ()),
        Column("edge of", (), key="name"),
    ]
    return rows_table("Ends of the stable synchronous orbits [rpm]", rows, columns, "edges")


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
        others: list[np.ndarray] = []
        for state in (state for _, stable, state, _ in orbits if stable):
            if not any(_same(state, known) for known in (np.asarray(loss.edges[name].state), *others)):
                others.append(state)
        if others:
            orbit = "another synchronous orbit is" if len(others) == 1 else f"{len(others)} other ones are"
            at = f"{name} ({float(loss.edges[name].speed_rpm):.2f} rpm)"
            notes.append(f"At {at} {orbit} stable: not every initial state leads to this edge.")
    return notes


def _same(state: np.ndarray, other: np.ndarray) -> bool:
    parts = zip(np.split(state, 2), np.split(other, 2), strict=True)
    return all(np.linalg.norm(a - b) < SAME * np.linalg.norm(b) for a, b in parts)


@compiled
def _largest_eps(model: CageModel, point: Point, method: AbstractMethod) -> Any:
    state = jnp.asarray(point.state)
    start = tuple(state[i] for i in range(state.size))
    return strobe_map(model, jnp.asarray(point.speed, dtype=float), method)(start).peak


def contact_notes(model: CageModel, edges: Mapping[str, Point], method: AbstractMethod | None) -> list[str]:
    """A sentence for each edge whose orbit touches the land.

    The force of the land sets in over a thousandth of the clearance, which takes ten times as many steps as the film
    alone: the error of such an edge is the one to be looked at.
    """
    by, notes, onset = make_method(steps=STEPS) if method is None else method, [], float(model.contact.onset)
    for name, p in edges.items():
        if (eps := float(_largest_eps(model, p, by))) > onset:
            notes.append(
                f"{name.capitalize()}: its orbit touches the land (eps {eps:.3f}, contact from {onset:g}); by half of "
                f"its {p.steps} steps it is {float(p.error_rpm):.1g} rpm away"
            )
    return notes
