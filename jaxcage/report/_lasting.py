"""How edges and widths of zones of lasting chaos answer to the design, with standard errors."""

from collections.abc import Mapping
from typing import Any

from ..design import LastingEdge, LastingWidth
from ._slopes import FIRST, FIXED_RHO
from ._table import Table, chosen


def _lasting_rows(edges: Mapping[str, LastingEdge]) -> dict[str, dict[str, tuple[float, float]]]:
    """Elasticities of each edge by parameter, and by gap and eccentricity together, each with its standard error."""
    found = {}
    for name, edge in edges.items():
        pairs = dict(zip(edge.names, zip(edge.elasticity, edge.elasticity_error, strict=True), strict=True))
        if set(FIRST) <= set(edge.names):
            pairs[FIXED_RHO] = edge.sum_of(*FIRST)
        found[name] = {n: (float(value), float(error)) for n, (value, error) in pairs.items()}
    return found


def lasting_table(name: str, edges: Mapping[str, LastingEdge], horizon: int) -> Table:
    """Edges of lasting chaos, and their elasticities."""
    rows = _lasting_rows(edges)
    columns = {
        "edge": lambda item: item[0],
        "speed [rpm]": lambda item: f"{item[1].speed_rpm:.0f} ± {item[1].standard_error_rpm:.0f}",
        **{n.replace("_", " "): lambda item, n=n: _with_error(*rows[item[0]][n]) for n in next(iter(rows.values()))},
        "escapes": lambda item: f"{item[1].fit.escapes} of {item[1].fit.lanes}",
        "status": lambda item: item[1].status,
    }
    title = f"Elasticities of the edges of {name} at which the mean life of chaos passes {horizon} revolutions"
    return Table.of(title, columns, edges.items(), ("speed [rpm]",))


def _lasting_widths(edges: Mapping[str, LastingEdge]) -> dict[str, LastingWidth]:
    """Widths of the zones that have both edges."""
    zones = dict.fromkeys(name.rpartition(" ")[0] for name in edges)
    ends = {zone: [edges.get(f"{zone} {end}") for end in ("onset", "exit")] for zone in zones}
    return {zone: LastingWidth(a, b) for zone, (a, b) in ends.items() if a is not None and b is not None}


def _by_1_percent(width: LastingWidth) -> dict[str, tuple[float, float]]:
    """What 1 % more of each parameter adds to a width [rpm], and of gap and eccentricity together."""
    together: dict[str, tuple[str, ...]] = {n: (n,) for n in width.onset.names}
    if set(FIRST) <= set(together):
        together[FIXED_RHO] = FIRST
    return {n: tuple(0.01 * x for x in width.change(*of)) for n, of in together.items()}  # pyright: ignore


def lasting_width_table(name: str, edges: Mapping[str, LastingEdge]) -> Table | None:
    """Widths of the zones that have both edges; None if there are none."""
    widths = _lasting_widths(edges)
    if not widths:
        return None
    changes = {zone: _by_1_percent(width) for zone, width in widths.items()}
    columns = {
        "zone": lambda item: item[0],
        "width [rpm]": lambda item: f"{item[1].width_rpm:.0f} ± {item[1].standard_error_rpm:.0f}",
        **{
            n.replace("_", " "): lambda item, n=n: _with_error(*changes[item[0]][n], 1)
            for n in next(iter(changes.values()))
        },
    }
    return Table.of(f"Widths of {name}, and what 1 % more of a parameter adds [rpm]", columns, widths.items())


def lasting_document(edges: Mapping[str, LastingEdge]) -> dict[str, Any]:
    """Edges and widths for programs."""
    rows = _lasting_rows(edges)
    pairs = lambda found: {n: {"value": v, "error": e} for n, (v, e) in found.items()}
    return {
        "edges": [
            {"name": name, "elasticity": pairs(rows[name]), "escapes": edge.fit.escapes, "lanes": edge.fit.lanes}
            | chosen(edge, "speed_rpm standard_error_rpm horizon status")
            for name, edge in edges.items()
        ],
        "widths": [
            {"name": name, "rpm_by_1_percent": pairs(_by_1_percent(width))}
            | chosen(width, "width_rpm standard_error_rpm")
            for name, width in _lasting_widths(edges).items()
        ],
    }


def _with_error(value: float, error: float, digits: int = 3) -> str:
    return f"{value:+.{digits}f} ± {error:.{digits}f}"
