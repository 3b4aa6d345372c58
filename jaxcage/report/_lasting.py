"""How edges and widths of zones answer to the design, with standard errors: lasting chaos, exact edges."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..design import LastingEdge, SolvedEdge, ZoneWidth, zone_width
from ._slopes import FIRST, FIXED_RHO
from ._table import Speeds, Table, chosen


def _elasticities(edge: LastingEdge) -> dict[str, tuple[float, float]]:
    """By parameter, and by gap and eccentricity together, each with its standard error."""
    return {name: edge.sum_of(*of) for name, of in _asked(edge.names).items()}


def _asked(names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Parameters alone, and gap and eccentricity together."""
    asked: dict[str, tuple[str, ...]] = {n: (n,) for n in names}
    if set(FIRST) <= set(names):
        asked[FIXED_RHO] = FIRST
    return asked


def lasting_table(name: str, edges: Mapping[str, LastingEdge], horizon: int) -> Table:
    """Edges of lasting chaos, and their elasticities."""
    rows = {edge: _elasticities(found) for edge, found in edges.items()}
    of = lambda n: lambda item: _with_error(*rows[item[0]][n])
    columns = {
        "edge": lambda item: item[0],
        "speed [rpm]": lambda item: Speeds("{:.0f} ± {:.0f}", item[1].speed_rpm, item[1].standard_error_rpm),
        **{n.replace("_", " "): of(n) for n in next(iter(rows.values()))},
        "escapes": lambda item: f"{item[1].fit.escapes} of {item[1].fit.lanes}",
        "status": lambda item: item[1].status,
    }
    title = f"Elasticities of the edges of {name} at which the mean life of chaos passes {horizon} revolutions"
    return Table.of(title, columns, edges.items(), ("speed [rpm]",))


def widths_of(edges: Mapping[str, SolvedEdge]) -> dict[str, ZoneWidth]:
    """Widths of all zones of which an edge is known, by `zone 1` and the like."""
    zones = dict.fromkeys(name.rpartition(" ")[0] for name in edges)
    return {zone: zone_width(edges, int(zone.rpartition(" ")[2])) for zone in zones}


def _by_1_percent(width: ZoneWidth, names: Iterable[str]) -> dict[str, tuple[float, float]]:
    """What 1 % more of each parameter adds to a width [rpm], and of gap and eccentricity together."""
    found = {name: width.change(*of) for name, of in _asked(tuple(names)).items()}
    return {name: (0.01 * value, 0.01 * error) for name, (value, error) in found.items()}


def width_table(title: str, widths: Mapping[str, ZoneWidth], names: Sequence[str]) -> Table:
    """Widths, and what 1 % more of a parameter adds; nothing where an edge is not to be used."""
    changes = {name: _by_1_percent(width, names) for name, width in widths.items()}
    of = lambda n: lambda item: _with_error(*changes[item[0]][n], 1) if item[1].trusted else "-"
    columns = {
        "zone": lambda item: item[0],
        "width [rpm]": lambda item: _width_cell(item[1]),
        **{n.replace("_", " "): of(n) for n in _asked(tuple(names))},
        "status": lambda item: item[1].status,
    }
    return Table.of(f"{title}, and what 1 % more of a parameter adds [rpm]", columns, widths.items(), ("width [rpm]",))


def _width_cell(width: ZoneWidth) -> str:
    if width.open:
        return "open"
    if not width.trusted or width.width_rpm is None or width.standard_error_rpm is None:
        return "-"
    return Speeds("{:.0f} ± {:.0f}", width.width_rpm, width.standard_error_rpm)


def width_documents(widths: Mapping[str, ZoneWidth], names: Sequence[str]) -> list[dict[str, Any]]:
    """Widths for programs; null where an edge is not to be used."""
    return [
        {
            "name": name,
            "width_rpm": width.width_rpm if width.trusted else None,
            "standard_error_rpm": width.standard_error_rpm if width.trusted else None,
            "rpm_by_1_percent": _pairs(_by_1_percent(width, names)) if width.trusted else None,
            "open": width.open,
            "status": width.status,
        }
        for name, width in widths.items()
    ]


def lasting_document(edges: Mapping[str, LastingEdge]) -> dict[str, Any]:
    """Edges and widths for programs."""
    names = next(iter(edges.values())).names
    return {
        "edges": [
            {"name": name, "elasticity": _pairs(_elasticities(edge)), "escapes": edge.fit.escapes}
            | {"lanes": edge.fit.lanes}
            | chosen(edge, "speed_rpm standard_error_rpm horizon status")
            for name, edge in edges.items()
        ],
        "widths": width_documents(widths_of(edges), names),
    }


def _pairs(found: Mapping[str, tuple[float, float]]) -> dict[str, dict[str, float]]:
    return {n: {"value": value, "error": error} for n, (value, error) in found.items()}


def _with_error(value: float, error: float, digits: int = 3) -> str:
    return f"{value:+.{digits}f} ± {error:.{digits}f}"
