"""Derivatives by the parameters of a design: of exact edges, of edges of lasting chaos, of means of a run."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .._parameters import EXTRA, parameter_info, parameters
from ..design import LastingEdge, MeanGradient, SolvedEdge, ZoneWidth, zone_width
from ..integrate import AbstractMethod
from ..models import CageModel
from ..orbits import Cascade, Explained, LossZones, Sensitivity, limit_sensitivity, sensitivities, sensitivity
from .tables import Beside, Column, Table, chosen, number, rows_table, speed_columns


FIRST = ("guidance_gap", "eccentricity")
"""Parameters whose rows are always on top."""
FIXED_RHO = "gap at fixed rho"
TURNED = ("drawing", "catalogue", "oil", "operating")
"""Kinds of parameters that a designer or a user chooses."""
ONSET, EXIT = "zone 1 onset", "zone 1 exit"
EXPECTED = (ONSET, EXIT, "zone 2 onset")


def at_fixed_rho(elasticity: Mapping[str, float]) -> float:
    """Elasticity by the gap if the eccentricity grows with it, so that rho = e/C_r stays.

    With the printed unbalance, 2 M rho omega^2, that leaves the excitation alone: what remains of the gap's effect is
    that of clearance, film and land. With the physical one it does not.
    """
    return sum(elasticity[name] for name in FIRST) if set(FIRST) <= set(elasticity) else math.nan


def to_be_turned(model: CageModel, slopes: Iterable[Sensitivity]) -> list[Sensitivity]:
    """Sensitivities with the parameters that a designer can choose; laws of one's own stay."""
    info = parameter_info(model)
    stays = lambda name: info[name].kind in TURNED or name.startswith(EXTRA)
    return [
        dataclasses.replace(s, elasticity={n: value for n, value in s.elasticity.items() if stays(n)}) for s in slopes
    ]


def not_fixed(model: CageModel, names: Iterable[str]) -> list[str]:
    """Parameters that have a tolerance: all but definitions, units and constants of nature and of the numerics."""
    info = parameter_info(model)
    return [n for n in names if info[n].kind != "fixed" or n.startswith(EXTRA)]


def edge_slopes(
    model: CageModel, loss: LossZones, explained: Explained, method: AbstractMethod | None
) -> dict[str, Sensitivity]:
    """Sensitivities of the synchronous-loss edges, and of chaotic edges that coincide with something exact."""
    slopes = sensitivities(model, loss.edges, method)
    for name, source in explained.sources.items():
        of: Any = limit_sensitivity if isinstance(source, Cascade) else sensitivity
        slopes[f"chaotic {name}"] = of(model, source, f"chaotic {name}", method)
    return slopes


def slope_record(name: str, slope: Sensitivity) -> dict[str, Any]:
    """The gradient of an edge or width [rpm per SI unit] for a document."""
    names = "kind error_rpm steps trusted status transversality derivative elasticity"
    at = {"speed_rpm": slope.value_rpm, "elasticity_gap_at_fixed_rho": at_fixed_rho(slope.elasticity)}
    return {"name": name, **at, **chosen(slope, names)}


def elasticities_table(name: str, slopes: Mapping[str, Sensitivity], beside: Beside = None) -> Table:
    """Relative change of each edge by that of the parameters that are always on top."""
    rows = [slope_record(edge, slope) | slope.elasticity for edge, slope in slopes.items()]
    columns = [
        Column("edge", (), key="name"),
        Column("by", (), key="kind"),
        *speed_columns("speed [rpm]", "speed_rpm", beside, "error_rpm"),
        *(Column(n.replace("_", " "), (), key=n, digits=4) for n in FIRST),
        Column(FIXED_RHO, (), key="elasticity_gap_at_fixed_rho", digits=4),
        Column("status", ()),
    ]
    return rows_table(f"Elasticities of the exact edges of {name}", rows, columns)


def gradient_table(name: str, model: CageModel, slope: Sensitivity) -> Table:
    """Derivatives of one edge or width: gap and eccentricity on top, then the largest elasticities first.

    All is about the speed of the cage; that of the shaft also moves with all that enters their ratio.
    """
    change = slope.elasticity
    moving = sorted(
        (n for n in slope.derivative if slope.derivative[n] != 0.0 or n in FIRST),
        key=lambda n: (FIRST.index(n) if n in FIRST else len(FIRST), -abs(change[n])),
    )
    info, value = parameter_info(model), parameters(model)
    rows: list[dict[str, Any]] = [
        {"parameter": n, "value": float(value[n]), "unit": "" if info[n].unit == "1" else info[n].unit}
        | {"slope": slope.derivative[n], "elasticity": change[n]}
        for n in moving
    ]
    if set(FIRST) <= set(change):
        rows.insert(len(FIRST), {"parameter": FIXED_RHO, "elasticity": at_fixed_rho(change)})
    columns = [Column(head, ()) for head in ("parameter", "value", "unit")]
    columns += [Column("rpm of the cage per unit", (), key="slope"), Column("elasticity", (), digits=6)]
    at = f"{number(slope.value_rpm, float(slope.error_rpm))} rpm of the cage, {slope.kind}"
    still = len(slope.derivative) - len(moving)
    rest = f"; {still} other parameters do not move it" if still else ""
    return rows_table(f"{slope.name.capitalize()} of {name}: {at}{rest}", rows, columns)


def missing_notes(edges: Mapping[str, Sensitivity]) -> list[str]:
    """One line for each edge that one would expect and that is not there, or not to be trusted."""
    notes = [f"There is no {name} in the range." for name in EXPECTED if name not in edges]
    notes += [f"Left out: {n}, {e.kind} ({e.status})." for n, e in edges.items() if not e.trusted]
    if not all(name in edges and edges[name].trusted for name in (ONSET, EXIT)):
        notes.append("Without both edges zone 1 has no width.")
    return notes


def homogeneity(edges: Mapping[str, Sensitivity]) -> dict[str, float | None]:
    """Largest relative residual by which the gradients break the scaling that units impose."""
    trusted = [edge.homogeneity for edge in edges.values() if edge.trusted]
    return {base: max((abs(h[base]) for h in trusted), default=None) for base in ("mass", "length", "time")}


def sources_document(i: int, explained: Explained, slopes: Mapping[str, Sensitivity]) -> dict[str, Any]:
    """Bifurcations or cascades that the edges of a chaotic zone coincide with, and their gradients."""
    found: dict[str, Any] = {}
    for end in ("onset", "exit"):
        source, name = explained.sources.get(f"zone {i} {end}"), f"chaotic zone {i} {end}"
        points = [float(p.speed_rpm) for p in source.points] if isinstance(source, Cascade) else None
        found[f"{end}_cascade_rpm"] = points
        found[f"{end}_gradient"] = slope_record(name, slopes[name]) if name in slopes else None
    return found


def source_notes(explained: Explained) -> list[str]:
    """Sentences about the edges of chaotic zones that coincide with something exact."""
    edges = [e for zone in explained.zones.zones for e in (zone.onset, zone.exit) if e is not None]
    statistical = sum(e.basis == "statistical" for e in edges)
    notes = [f"Chaotic edges that stay statistical: {statistical} of {len(edges)}"]
    for name, source in explained.sources.items():
        if isinstance(source, Cascade):
            doublings = ", ".join(f"{float(p.speed_rpm):.1f}" for p in source.points)
            notes.append(f"Chaotic {name}: limit of the cascade with period doublings at {doublings} rpm")
        else:
            notes.append(f"Chaotic {name}: coincides with the {source.kind} at {float(source.speed_rpm):.2f} rpm")
    return notes


def _asked(names: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Parameters alone, and gap and eccentricity together."""
    asked: dict[str, tuple[str, ...]] = {n: (n,) for n in names}
    return asked | ({FIXED_RHO: FIRST} if set(FIRST) <= set(asked) else {})


def _with_errors(found: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    return {n: value for n, (value, _) in found.items()} | {f"{n} error": error for n, (_, error) in found.items()}


def lasting_records(edges: Mapping[str, LastingEdge]) -> list[dict[str, Any]]:
    """Edges of lasting chaos and their elasticities, with standard errors, for a document."""
    return [
        {
            "name": name,
            **chosen(edge, "speed_rpm standard_error_rpm horizon status"),
            "elasticity": {n: dict(zip(("value", "error"), edge.sum_of(*of))) for n, of in _asked(edge.names).items()},
            "escapes": edge.fit.escapes,
            "lanes": edge.fit.lanes,
        }
        for name, edge in edges.items()
    ]


def lasting_table(name: str, edges: Mapping[str, LastingEdge], horizon: int, beside: Beside = None) -> Table:
    """Edges of lasting chaos, and their elasticities."""
    asked = _asked(next(iter(edges.values())).names)
    rows = [
        {"edge": each, **chosen(edge, "speed_rpm standard_error_rpm status")}
        | {"escapes": f"{edge.fit.escapes} of {edge.fit.lanes}"}
        | _with_errors({n: edge.sum_of(*of) for n, of in asked.items()})
        for each, edge in edges.items()
    ]
    columns = [
        Column("edge", ()),
        *speed_columns("speed [rpm]", "speed_rpm", beside, "standard_error_rpm"),
        *(Column(n.replace("_", " "), (), key=n, errors=f"{n} error") for n in asked),
        Column("escapes", ()),
        Column("status", ()),
    ]
    title = f"Elasticities of the edges of {name} at which the mean life of chaos passes {horizon} revolutions"
    return rows_table(title, rows, columns)


def widths_of(edges: Mapping[str, SolvedEdge]) -> dict[str, ZoneWidth]:
    """Widths of all zones of which an edge is known, by `zone 1` and the like."""
    zones = dict.fromkeys(name.rpartition(" ")[0] for name in edges)
    return {zone: zone_width(edges, int(zone.rpartition(" ")[2])) for zone in zones}


def width_records(widths: Mapping[str, ZoneWidth], names: Sequence[str]) -> list[dict[str, Any]]:
    """Widths, and the change of each by 1 % more of a parameter [rpm]; None where an edge is not to be trusted."""
    found = []
    for name, width in widths.items():
        changes = {n: width.change(*of) for n, of in _asked(names).items()} if width.trusted else {}
        by = {n: {"value": 0.01 * value, "error": 0.01 * error} for n, (value, error) in changes.items()}
        values = chosen(width, "width_rpm standard_error_rpm") if width.trusted else {}
        found.append({"name": name, **values, "rpm_by_1_percent": by or None, **chosen(width, "open status")})
    return found


def width_table(title: str, widths: Mapping[str, ZoneWidth], names: Sequence[str]) -> Table:
    """Widths, and what 1 % more of a parameter adds."""
    rows = []
    for record in width_records(widths, names):
        by = record["rpm_by_1_percent"] or {}
        changes = _with_errors({n: (each["value"], each["error"]) for n, each in by.items()})
        rows.append(record | ({"width_rpm": "open"} if record["open"] else {}) | changes)
    columns = [
        Column("zone", (), key="name"),
        Column("width [rpm]", (), key="width_rpm", errors="standard_error_rpm"),
        *(Column(n.replace("_", " "), (), key=n, errors=f"{n} error", digits=1) for n in _asked(names)),
        Column("status", ()),
    ]
    return rows_table(f"{title}, and what 1 % more of a parameter adds [rpm]", rows, columns)


def mean_gradient_tables(title: str, found: MeanGradient) -> list[Table]:
    """Means with their errors, and a table of the elasticities of each, the largest first."""
    rows = [{"name": name, **chosen(each, "value value_error unit explained")} for name, each in found.statistics.items()]
    columns = [
        Column("statistic", (), key="name"),
        Column("mean", (), key="value", errors="value_error"),
        Column("unit", ()),
        Column("explained", (), "1", "%", digits=0),
    ]
    moved = []
    for name, each in found.statistics.items():
        order = sorted(range(len(each.directions)), key=lambda i: -abs(each.elasticity[i]))
        moved += [
            {"name": name if first == 0 else "", "by": each.directions[i].replace("_", " ").replace("+", ", ")}
            | {"elasticity": float(each.elasticity[i]), "error": float(each.elasticity_error[i])}
            for first, i in enumerate(order)
            if each.value
        ]
    by = [Column("statistic", (), key="name"), Column("by", ()), Column("elasticity", (), errors="error")]
    return [rows_table(f"{title}: elasticities", moved, by), rows_table(f"{title}: means", rows, columns)]


def mean_gradient_document(found: MeanGradient) -> dict[str, Any]:
    """Derivatives by the logarithm of each direction, elasticities, and slopes by single parameters."""
    rows = {}
    for name, each in found.statistics.items():
        by: dict[str, Any] = {}
        for i, direction in enumerate(each.directions):
            told = chosen(each, "elasticity elasticity_error by_relative_change by_relative_change_error")
            by[direction] = {what: values[i] for what, values in told.items()}
            if "+" not in direction:
                slope = zip(("slope_per_SI_unit", "slope_error_per_SI_unit"), found.slope(name, direction))
                by[direction] |= dict(slope)
        rows[name] = chosen(each, "unit value value_error drift drift_error settled explained") | {"by": by}
    length = chosen(found.runs, "starts discard revolutions")
    return chosen(found, "pairs failed inaccurate spread") | length | {"parameters": found.values, "statistics": rows}
