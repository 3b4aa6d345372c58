"""Tables of derivatives by design parameters: of exact edges, of edges of lasting chaos, of means of a run."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .._parameters import EXTRA, parameter_info, parameters
from ..design import LastingEdge, MeanGradient, SolvedEdge, ZoneWidth, zone_width
from ..models import AbstractForcedSystem
from ..orbits import Explained, Sensitivity, UnstableRanges, sensitivities
from ..solve import AbstractMethod
from .tables import Beside, Column, Table, chosen, number, speed_columns, table


FIRST = ("guidance_gap", "eccentricity")
"""Parameters that are always listed first."""
FIXED_RHO = "gap at fixed rho"
"""Change of the gap and the eccentricity together, at constant rho = e/C_r.

With the printed unbalance, 2 M rho omega^2, this keeps the excitation constant and leaves the effect of the gap on
clearance, film and land. With the physical one it does not.
"""
TURNED = ("drawing", "catalogue", "oil", "operating")
"""Kinds of parameters that a designer or a user can choose."""


def to_be_turned(model: AbstractForcedSystem, slopes: Iterable[Sensitivity]) -> list[Sensitivity]:
    """Sensitivities restricted to parameters that a designer can choose and those of user-defined laws."""
    info = parameter_info(model)
    stays = lambda name: info[name].kind in TURNED or name.startswith(EXTRA)
    return [
        dataclasses.replace(s, elasticity={n: value for n, value in s.elasticity.items() if stays(n)}) for s in slopes
    ]


def edge_slopes(
    model: Any, loss: UnstableRanges, explained: Explained, method: AbstractMethod | None
) -> dict[str, Sensitivity]:
    """Sensitivities of the edges of unstable ranges, and of chaotic edges that coincide with a bifurcation."""
    chaotic = {f"chaotic {name}": point for name, point in explained.sources.items()}
    return sensitivities(model, loss.edges | chaotic, method)


def elasticities_table(name: str, slopes: Mapping[str, Sensitivity], beside: Beside = None) -> Table:
    """Table of the elasticities of each edge by the parameters that are always listed first."""
    names = "kind error_rpm steps trusted status transversality derivative elasticity homogeneity"
    rows = [
        {"name": edge, "speed_rpm": slope.value_rpm, **chosen(slope, names)}
        | {n: slope.elasticity.get(n) for n in FIRST}
        for edge, slope in slopes.items()
    ]
    columns = [Column("edge", "name"), Column("by", "kind")]
    columns += speed_columns("speed [rpm]", "speed_rpm", beside, "error_rpm")
    columns += [Column(n.replace("_", " "), n, digits=4) for n in FIRST]
    return table(f"Elasticities of the exact edges of {name}", rows, [*columns, "status"], "edges")


def gradient_table(name: str, model: AbstractForcedSystem, slope: Sensitivity) -> Table:
    """Table of the derivatives of one edge or width: gap and eccentricity on top, then the largest elasticities first.

    All values refer to the cage speed; the shaft speed also depends on the parameters in their ratio.
    """
    change, info, value = slope.elasticity, parameter_info(model), parameters(model)
    moving = [n for n in slope.derivative if slope.derivative[n] != 0.0 or n in FIRST]
    moving.sort(key=lambda n: (FIRST.index(n) if n in FIRST else len(FIRST), -abs(change[n])))
    rows: list[dict[str, Any]] = [
        {"parameter": n, "value": float(value[n]), "SI unit": "" if info[n].unit == "1" else info[n].unit}
        | {"slope": slope.derivative[n], "elasticity": change[n]}
        for n in moving
    ]
    rows.insert(len(FIRST), {"parameter": FIXED_RHO, "elasticity": sum(change.get(n, math.nan) for n in FIRST)})
    title = f"{slope.name.capitalize()} of {name}: {number(slope.value_rpm, float(slope.error_rpm))} rpm, {slope.kind}"
    if still := len(slope.derivative) - len(moving):
        title += f"; {still} other parameters do not move it"
    columns = [Column("rpm of the cage per unit", "slope"), Column("elasticity", digits=6)]
    return table(title, rows, ["parameter", "value", "SI unit", *columns])


def source_notes(explained: Explained) -> list[str]:
    """Notes on the edges of chaotic zones that coincide with a bifurcation."""
    edges = [e for zone in explained.zones.zones for e in (zone.onset, zone.exit) if e is not None]
    statistical = sum(e.basis == "statistical" for e in edges)
    notes = [f"Chaotic edges that stay statistical: {statistical} of {len(edges)}"] if edges else []
    for name, source in explained.sources.items():
        notes.append(f"Chaotic {name}: coincides with the {source.kind} at {float(source.speed_rpm):.2f} rpm")
    return notes


def _asked(names: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Parameters by name, each alone, and gap and eccentricity together."""
    asked: dict[str, tuple[str, ...]] = {n: (n,) for n in names}
    return asked | ({FIXED_RHO: FIRST} if set(FIRST) <= set(asked) else {})


def _error_columns(names: Iterable[str], digits: int | None = None) -> list[Column]:
    return [Column(n.replace("_", " "), n, error=f"{n}_error", digits=digits) for n in _asked(names)]


def _with_errors(found: Mapping[str, tuple[float, float]], factor: float = 1.0) -> dict[str, float]:
    return {f"{n}{end}": factor * x for n, pair in found.items() for end, x in zip(("", "_error"), pair, strict=True)}


def lasting_table(name: str, edges: Mapping[str, LastingEdge], horizon: int, beside: Beside = None) -> Table:
    """Table of edges of lasting chaos, and their elasticities; without numbers where they should not be used."""
    names = next(iter(edges.values())).directions
    rows = []
    for each, edge in edges.items():
        row = {"name": each, **chosen(edge, "horizon status"), "escapes": f"{edge.fit.escapes} of {edge.fit.lanes}"}
        if edge.status == "converged":
            row |= {"speed_rpm": edge.value, "standard_error_rpm": edge.value_error}
            row |= _with_errors({n: edge.elasticity_of(*of) for n, of in _asked(names).items()})
        rows.append(row)
    speed = speed_columns("speed [rpm]", "speed_rpm", beside, "standard_error_rpm")
    columns = [Column("edge", "name"), *speed, *_error_columns(names), "escapes", "status"]
    title = f"Elasticities of the edges of {name} at which the mean life of chaos passes {horizon} revolutions"
    return table(title, rows, columns, "edges")


def width_table(title: str, edges: Mapping[str, SolvedEdge], names: Sequence[str]) -> Table:
    """Table of the widths of all zones with a known edge, and of the effect of 1 % more of each parameter."""
    rows = []
    for zone in dict.fromkeys(name.rpartition(" ")[0] for name in edges):
        width: ZoneWidth = zone_width(edges, int(zone.rpartition(" ")[2]))
        row = {"name": zone, **chosen(width, "open status")}
        if width.trusted:
            known = (None, None) if width.open else (width.value, width.value_error)
            row |= dict(zip(("width_rpm", "standard_error_rpm"), known, strict=True))
            row |= _with_errors({n: width.change(*of) for n, of in _asked(names).items()}, 0.01)
        rows.append(row)
    width_column = Column("width", "width_rpm", error="standard_error_rpm")
    columns = [Column("zone", "name"), width_column, *_error_columns(names, 1), "status"]
    return table(f"{title}, and what 1 % more of a parameter adds [rpm]", rows, columns, "widths")


def direction_words(name: str) -> str:
    """Parameters that change by the same share, in words; a share of a temperature counts from absolute zero."""
    return name.replace("_", " ").replace("+", ", ").replace("temperature", "absolute temperature")


def mean_gradient_tables(title: str, found: MeanGradient) -> list[Table]:
    """Tables of the elasticities of means with their errors, the largest first, and of the means."""
    rows, moved = [], []
    for name, each in found.statistics.items():
        by: dict[str, dict[str, Any]] = {
            direction: dict(zip(("elasticity", "error"), pair, strict=True))
            for direction, *pair in zip(each.directions, each.elasticity, each.elasticity_error, strict=True)
        }
        for direction in by:
            if "+" not in direction:
                by[direction] |= dict(zip(("slope", "slope_error"), found.slope(name, direction), strict=True))
        rows.append({"name": name, **chosen(each, "unit value value_error drift drift_error settled"), "by": by})
        order = sorted(by, key=lambda n: -abs(by[n]["elasticity"])) if each.value else []
        moved += [{"statistic": name, "by": direction_words(n)} | by[n] for n in order]
    elasticities = ["statistic", "by", Column("elasticity", error="error")]
    means = [Column("statistic", "name"), Column("mean", "value", error="value_error"), Column("SI unit", "unit")]
    means.append(Column("settled"))
    return [
        table(f"Elasticities, {title}", moved, elasticities),
        table(f"Means, {title}", rows, means, "statistics"),
    ]
