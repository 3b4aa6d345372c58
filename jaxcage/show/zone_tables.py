"""Tables of zones, of bifurcations, and of stable ranges of orbits."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from .._errors import NoResult
from ..analysis import Stretch as Motion, Zone, Zones, failed, lives_in_words, outcomes
from ..orbits import Point, StableRange, SynchronousOrbits, UnstableRanges
from .tables import Beside, Column, Table, chosen, number, speed_columns, table
from .verdict_tables import motion_words


ENDS = ("onset", "exit")


def require_some(found: xr.Dataset, where: str = "") -> None:
    """Require a lane that did not fail. **Raises:** `NoResult` with the number of lanes, `where`, and their
    outcomes."""
    if failed(found).all():
        said = f"All {found['label'].size} simulations{where} failed ({', '.join(sorted(outcomes(found)))})"
        raise NoResult(f"{said}: try more steps (--steps).")


def zone_record(zone: Zone) -> dict[str, Any]:
    """Record of a zone for tables and documents; an end is None where the zone runs past the range."""
    found: dict[str, Any] = {"kind": zone.kind, "width_rpm": zone.width_rpm, "share": zone.share}
    for end, edge in zip(ENDS, (zone.onset, zone.exit), strict=True):
        found[f"{end}_rpm"] = None if edge is None else edge.speed_rpm
        for name in ("uncertainty_rpm", "mechanism", "basis"):
            found[f"{end}_{name}"] = None if edge is None else getattr(edge, name)
    for name in ("revolutions", "seconds", "bound"):
        found[f"mean_life_{name}"] = None if zone.life is None else [getattr(life, name) for life in zone.life]
    return found


def zone_span(zone: Zone, lowest: float = -math.inf, highest: float = math.inf) -> tuple[float, float]:
    """Onset and exit of a zone [rpm], with limits in place of a missing end."""
    low, high = zone.onset, zone.exit
    return lowest if low is None else low.speed_rpm, highest if high is None else high.speed_rpm


def zone_words(zone: Zone, beside: Beside = None) -> str:
    """The speeds of a zone in words."""
    low, high = (speed * (1.0 if beside is None else beside[1]) for speed in zone_span(zone))
    if math.isinf(low):
        return "the whole range" if math.isinf(high) else f"up to {high:.0f} rpm"
    return f"from {low:.0f} rpm on" if math.isinf(high) else f"{low:.0f} to {high:.0f} rpm"


def motion_tables(name: str, found: Zones | Sequence[Motion], beside: Beside = None) -> list[Table]:
    """Chaotic zones, and in detail their edges and the zones of chaos that dies out; or stretches of speed with the
    same labels."""
    if not isinstance(found, Zones):
        rows = [vars(each) | {"motion": motion_words(each.labels)} for each in found]
        columns = [Column("from", "low_rpm", digits=0), Column("to", "high_rpm", digits=0), "motion"]
        columns += [Column("exponent of the whole bearing", "exponent", error="exponent_error"), "speeds"]
        title = f"Zones of {name} [rpm], each edge half way between two speeds of the sweep"
        return [table(title, rows, columns, "zones")]
    lasting = f", chaos that lasts beyond {found.horizon} revolutions" if found.horizon else ""
    transient = f"Transient chaos of {name}, mean life below {found.horizon} revolutions"
    return [
        _zones(f"Chaotic zones of {name} [rpm]{lasting}", "zones", found.zones, beside),
        *_details(f"Chaotic zones of {name} in detail", found.zones, beside),
        *_details(transient, found.transient, beside, "transient"),
    ]


def unstable_table(name: str, loss: UnstableRanges, beside: Beside = None) -> Table:
    """Table of the unstable ranges of the synchronous orbit."""
    title = f"Unstable ranges of the synchronous orbit of {name} [rpm]"
    return _zones(title, "unstable_ranges", loss.zones, beside)


def _zones(title: str, key: str, zones: Sequence[Zone], beside: Beside) -> Table:
    rows = [{"zone": i, **zone_record(zone), "life": _life(zone)} for i, zone in enumerate(zones, start=1)]
    columns: list[Column | str] = ["zone"]
    for end in ENDS:
        columns += speed_columns(end, f"{end}_rpm", beside, f"{end}_uncertainty_rpm", nothing="past range")
    columns += [] if key == "unstable_ranges" else [Column("share", shown="%", digits=0)]
    columns += [Column("mean life [revolutions]", "life")] if any(zone.life for zone in zones) else []
    return table(title, rows, columns, key)


def _life(zone: Zone) -> str | None:
    """Mean life of chaos in a zone, in revolutions."""
    return None if zone.life is None else lives_in_words(zone.life, lambda life: f"{life.revolutions:.0f}")


def _details(title: str, zones: Sequence[Zone], beside: Beside, key: str = "") -> list[Table]:
    """Mechanisms of the edges, and mean life of chaos in revolutions and, each at its own speed, in seconds; nothing if
    there are no zones."""
    rows = []
    for i, zone in enumerate(zones, start=1):
        row = zone_record(zone) | {"zone": f"{i}: {zone_words(zone, beside)}"}
        if zone.life is not None:
            row["life"] = f"{_life(zone)} ({lives_in_words(zone.life, lambda life: f'{life.seconds:.1f}')} s)"
        rows.append(row)
    columns = ["zone", *(Column(f"{end} by", f"{end}_mechanism") for end in ENDS)]
    columns += [Column("mean life [revolutions]", "life")] if any(zone.life for zone in zones) else []
    return [table(title, rows, columns, key, detail=True)] if rows else []


AT_LIMIT_RPM = 1e-6
SAME = 0.03
"""Relative distance, in positions and in velocities, within which two orbits are the same."""


def point_record(point: Point, found: SynchronousOrbits, name: str | None = None) -> dict[str, Any]:
    """Record of a bifurcation for tables and documents; `name` is that of its edge."""
    mu, exact = complex(point.critical), {"period-doubling": 180.0, "fold": 0.0, "branch-point": 0.0}
    return {
        **{n: float(getattr(point, n)) for n in ("speed_rpm", "error_rpm")},
        **chosen(point, "kind steps edge state"),
        "multiplier": [mu.real, mu.imag],
        "angle_deg": exact.get(point.kind, abs(math.degrees(np.angle(mu)))),
        "branch": next((i for i, b in enumerate(found.branches) if any(p is point for p in b.special)), None),
        "name": name,
    }


def stretch_table(name: str, found: SynchronousOrbits, beside: Beside = None) -> Table:
    """Table of the speed ranges in which a synchronous orbit is stable, and what ends them [rpm]: a kind of
    bifurcation, `range` for the end of the search, or `unknown` where the branch was not followed further."""
    rows, columns = [_stretch_record(s, found) for s in found.stretches], []
    for head, end in (("from", "lower"), ("to", "upper")):
        columns += [*speed_columns(head, f"{end}_rpm", beside, digits=2), Column("by", f"{end}_kind")]
    columns += [*speed_columns("width [rpm]", "width_rpm", beside, digits=2), Column("simulations on it", "met")]
    return table(f"Stable synchronous orbits of {name} [rpm]", rows, columns, "stretches")


def _stretch_record(stretch: StableRange, found: SynchronousOrbits) -> dict[str, Any]:
    record = chosen(stretch, "lower_rpm upper_rpm width_rpm branch confirmed family met met_first")
    for end in ("lower", "upper"):
        point, at_limit = getattr(stretch, end), abs(record[f"{end}_rpm"] - getattr(found, f"{end}_rpm")) < AT_LIMIT_RPM
        record[f"{end}_kind"] = ("range" if at_limit else "unknown") if point is None else point.kind
    return record


def edge_table(found: SynchronousOrbits, loss: UnstableRanges, beside: Beside = None) -> Table:
    """Table of the bifurcations at which a stable synchronous orbit begins or ends."""
    names = {id(point): name for name, point in loss.edges.items()}
    rows = [point_record(p, found, names.get(id(p))) for p in found.edges]
    for row in rows:
        both = f" ± {row['multiplier'][1]:.4f}i" if row["kind"] == "Neimark-Sacker" else ""
        row["critical"] = f"{row['multiplier'][0]:.4f}{both}"
    speed, angle = (
        speed_columns("speed", "speed_rpm", beside, "error_rpm"),
        Column("angle [deg]", "angle_deg", digits=2),
    )
    columns = [*speed, "kind", Column("multiplier", "critical"), angle, "branch", Column("edge of", "name")]
    return table("Ends of the stable synchronous orbits [rpm]", rows, columns, "edges", detail=True)


def unsettled_notes(found: SynchronousOrbits) -> list[str]:
    """Notes on bifurcations left out, uncertain stable ranges, and changes of stability without a bifurcation."""
    count = found.unsettled
    notes = [f"Left out: {count} bifurcations that half the steps put elsewhere (not converged)"] if count else []
    for s in found.stretches:
        if not s.confirmed:
            notes.append(f"Not confirmed: the stretch from {s.lower_rpm:.2f} rpm is narrower than its error")
    for p in found.unexplained:
        place = f"{number(float(p.speed_rpm), float(p.error_rpm))} rpm on branch {point_record(p, found)['branch']}"
        notes.append(f"Unexplained: the stability changes at {place}, and no bifurcation was found there")
    return notes


def coexisting_notes(loss: UnstableRanges) -> list[str]:
    """Notes on the named edges at whose speed another synchronous orbit is stable."""
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
