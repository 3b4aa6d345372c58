"""How every exact edge, and with standard errors statistics of the whole bearing, answer to the design, as documents
and as tables.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

from .._parameters import EXTRA, parameter_info, parameters
from ..design import BearingGradient, StatisticGradient
from ..models import CageModel
from ..orbits import Cascade, Explained, LossZones, Sensitivity, limit_sensitivity, sensitivities, sensitivity
from ..solve import AbstractMethod
from ._orbit_tables import error_cell
from ._table import Table, chosen, number, speed


FIRST = ("guidance_gap", "eccentricity")
"""Rows that are always on top."""
FIXED_RHO = "gap at fixed rho"


def at_fixed_rho(elasticity: Mapping[str, float]) -> float:
    """Elasticity by the gap if the eccentricity grows with it, so that rho = e/C_r stays.

    With the printed unbalance, 2 M rho omega^2, that leaves the excitation alone: what remains of the gap's effect is
    that of clearance, film and land. With the physical one it does not.
    """
    return elasticity["guidance_gap"] + elasticity["eccentricity"]


TURNED = ("drawing", "catalogue", "oil", "operating")
"""Kinds of parameters that a designer or a user chooses."""


def to_be_turned(model: CageModel, slopes: Iterable[Sensitivity]) -> list[Sensitivity]:
    """Sensitivities with the parameters that a designer can turn: neither those that nobody knows nor constants of
    nature and of the numerics; laws of one's own stay. Tables and documents keep all."""
    info = parameter_info(model)
    kept = lambda name: info[name].kind in TURNED or name.startswith(EXTRA)
    return [
        dataclasses.replace(s, elasticity={n: value for n, value in s.elasticity.items() if kept(n)}) for s in slopes
    ]


def not_fixed(model: CageModel, names: Iterable[str]) -> list[str]:
    """Parameters that have a tolerance: all but definitions, units and constants of nature and of the numerics."""
    info = parameter_info(model)
    return [n for n in names if info[n].kind != "fixed" or n.startswith(EXTRA)]


ONSET, EXIT = "zone 1 onset", "zone 1 exit"
EXPECTED = (ONSET, EXIT, "zone 2 onset")


def edge_slopes(
    model: CageModel, loss: LossZones, explained: Explained, method: AbstractMethod | None
) -> dict[str, Sensitivity]:
    """Sensitivities of the synchronous-loss edges, and of chaotic edges that coincide with something exact."""
    slopes = sensitivities(model, loss.edges, method)
    for name, source in explained.sources.items():
        of = limit_sensitivity if isinstance(source, Cascade) else sensitivity
        slopes[f"chaotic {name}"] = of(model, source, f"chaotic {name}", method)  # pyright: ignore[reportArgumentType]
    return slopes


def slopes_document(slopes: Mapping[str, Sensitivity], edge: str) -> dict[str, Any] | None:
    """The gradient of an edge [rpm per SI unit] for programs, None where it was left out."""
    names = "trusted status error_rpm steps transversality derivative elasticity"
    if edge not in slopes:
        return None
    return chosen(slopes[edge], names) | {"elasticity_gap_at_fixed_rho": at_fixed_rho(slopes[edge].elasticity)}


def elasticities_table(name: str, slopes: Mapping[str, Sensitivity]) -> Table:
    """Relative change of each edge per relative change of the parameters that are always on top."""
    columns = {
        "edge": lambda item: item[0],
        "by": "{0[1].kind}",
        "speed [rpm]": lambda item: speed(item[1].value_rpm, 2),
        "±": lambda item: error_cell(item[1].error_rpm),
        **{n.replace("_", " "): f"{{0[1].elasticity[{n}]:+.4f}}" for n in FIRST},
        FIXED_RHO: lambda item: f"{at_fixed_rho(item[1].elasticity):+.4f}",
        "status": "{0[1].status}",
    }
    return Table.of(f"Elasticities of the exact edges of {name}", columns, slopes.items(), ("speed [rpm]",))


def gradient_document(edges: Mapping[str, Sensitivity], wide: Sensitivity | None) -> dict[str, Any]:
    """Derivatives [rpm per SI unit] and elasticities for programs; null where the edge was not found again."""
    names = "name kind error_rpm steps trusted status transversality derivative elasticity"
    trusted = [edge.homogeneity for edge in edges.values() if edge.trusted]
    return {
        "edges": [
            {"speed_rpm": edge.value_rpm}
            | chosen(edge, names)
            | {"elasticity_gap_at_fixed_rho": at_fixed_rho(edge.elasticity)}
            for edge in edges.values()
        ],
        "width": wide and chosen(wide, "name kind value_rpm error_rpm derivative elasticity"),
        "homogeneity": {
            base: max((abs(h[base]) for h in trusted), default=None) for base in ("mass", "length", "time")
        },
    }


def gradient_table(name: str, model: CageModel, sensitivity: Sensitivity) -> Table:
    """One edge or width: guidance gap and eccentricity on top, then by elasticity; what does not move it is counted.

    All of this is about the cage's speed: the shaft's also moves with all that enters their ratio, such as diameters.
    """
    slope, change = sensitivity.derivative, sensitivity.elasticity
    moving = [n for n in slope if slope[n] != 0.0 or n in FIRST]
    order = sorted(moving, key=lambda n: (FIRST.index(n) if n in FIRST else len(FIRST), -abs(change[n])))
    info, value = parameter_info(model), parameters(model)
    unit = lambda n: "" if info[n].unit == "1" else info[n].unit
    rows = [(n, f"{float(value[n]):.6g}", unit(n), f"{slope[n]:+.6g}", _elasticity_cell(change[n])) for n in order]
    shaft = sensitivity.value_rpm / float(model.bearing.cage_speed_ratio)
    at = f"{sensitivity.value_rpm:.3f} ± {error_cell(sensitivity.error_rpm)} rpm (shaft {shaft:.0f} rpm)"
    title = f"{sensitivity.name.capitalize()} of {name}: {at}, {sensitivity.kind}"
    if set(FIRST) <= set(change):
        rows.insert(len(FIRST), (FIXED_RHO, "", "", "", _elasticity_cell(at_fixed_rho(change))))
    still = len(slope) - len(moving)
    columns = ("parameter", "value", "unit", "rpm of the cage per unit", "elasticity")
    return Table(title + (f"; {still} other parameters do not move the cage's speed" if still else ""), columns, rows)


def _elasticity_cell(value: float) -> str:
    """An elasticity to six decimals; what they would hide as zero is shown by its size."""
    if value == 0.0:
        return "0"
    return f"{value:+.6f}" if abs(value) >= 5e-7 else f"{value:+.0e}"


def missing_notes(edges: Mapping[str, Sensitivity]) -> list[str]:
    """One line for each edge that one would expect and that is not there, or not to be trusted."""
    notes = [f"There is no {name} in the range." for name in EXPECTED if name not in edges]
    notes += [f"Left out: {n}, {e.kind} ({e.status})." for n, e in edges.items() if not e.trusted]
    if not all(name in edges and edges[name].trusted for name in (ONSET, EXIT)):
        notes.append("Without both edges zone 1 has no width.")
    return notes


def homogeneity_notes(document: Mapping[str, Any]) -> list[str]:
    """By how much the gradients break the scaling that units impose."""
    rows = ", ".join(f"{base} {residual:.1e}" for base, residual in document["homogeneity"].items())
    return [f"Homogeneity, largest relative residual: {rows}"]


def source_document(i: int, explained: Explained, slopes: Mapping[str, Sensitivity]) -> dict[str, Any]:
    """What the edges of a chaotic zone were taken from; a bifurcation brings its gradient."""
    found: dict[str, Any] = {}
    zone = explained.zones.zones[i - 1]
    for end, edge in (("onset", zone.onset), ("exit", zone.exit)):
        source = explained.sources.get(f"zone {i} {end}")
        found[f"{end}_basis"] = edge and edge.basis
        found[f"{end}_cascade_rpm"] = _cascade_rpm(source) if isinstance(source, Cascade) else None
        found[f"{end}_gradient"] = slopes_document(slopes, f"chaotic zone {i} {end}")
    return found


def _cascade_rpm(cascade: Cascade) -> list[float]:
    return [float(p.speed_rpm) for p in cascade.points]


def source_notes(explained: Explained) -> list[str]:
    edges = [e for zone in explained.zones.zones for e in (zone.onset, zone.exit) if e is not None]
    statistical = sum(e.basis == "statistical" for e in edges)
    notes = [f"Chaotic edges that stay statistical: {statistical} of {len(edges)}"]
    for name, source in explained.sources.items():
        if isinstance(source, Cascade):
            doublings = ", ".join(number(rpm, 1) for rpm in _cascade_rpm(source))
            notes.append(f"Chaotic {name}: limit of the cascade with period doublings at {doublings} rpm")
        else:
            notes.append(f"Chaotic {name}: coincides with the {source.kind} at {source.speed_rpm:.2f} rpm")
    return notes


def bearing_gradient_table(title: str, found: BearingGradient) -> Table:
    """A row for each statistic: its mean, and its elasticities."""
    first = next(iter(found.statistics.values()))
    rows = [
        (each.name, f"{each.value:.4g} ± {each.value_error:.1g}", *_cells(each), f"{number(100 * each.explained)} %")
        for each in found.statistics.values()
    ]
    names = [name.replace("_", " ").replace("+", ", ") for name in first.directions]
    return Table(title, ("statistic", "mean", *names, "explained"), rows)


def _cells(each: StatisticGradient) -> list[str]:
    if not each.value:
        return ["-"] * len(each.directions)
    return [f"{x:+.3f} ± {e:.3f}" for x, e in zip(each.elasticity, each.elasticity_error, strict=True)]


def bearing_gradient_document(found: BearingGradient) -> dict[str, Any]:
    """Everything for programs: derivatives by the logarithm of each direction, elasticities, slopes of single ones."""
    rows = {}
    for name, each in found.statistics.items():
        by = {}
        for i, direction in enumerate(each.directions):
            told = chosen(each, "elasticity elasticity_error by_relative_change by_relative_change_error")
            by[direction] = {what: values[i] for what, values in told.items()}
            if "+" not in direction:
                slope, error = found.slope(name, direction)
                by[direction] |= {"slope_per_SI_unit": slope, "slope_error_per_SI_unit": error}
        rows[name] = chosen(each, "unit value value_error drift drift_error settled explained") | {"by": by}
    length = chosen(found, "pairs failed inaccurate starts discard revolutions spread")
    return length | {"parameters": found.values, "statistics": rows}
