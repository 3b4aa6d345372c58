"""`jaxcage gradient`: how the synchronous-loss edges, and the width of zone 1, answer to every parameter."""

import time
from typing import Any

from .._parameters import parameter_info, parameters
from ..models import CageModel
from ..orbits import Sensitivity, sensitivities, width
from ..plotting import elasticity_bars, new_figure
from ..report import error_cell
from ._bifurcations import Searched, require_edges, search_case
from ._console import progress
from ._errors import ComputationError
from ._inputs import save_figure
from ._options import GradientOptions
from ._report import Report, Table


FIRST = ("guidance_gap", "eccentricity")
"""Rows that are always on top."""
ONSET, EXIT = "zone 1 onset", "zone 1 exit"
EXPECTED = (ONSET, EXIT, "zone 2 onset")
WIDTH = "zone 1 width"


def run(options: GradientOptions) -> Report:
    """Carry out `jaxcage gradient`."""
    searched = search_case(options)
    about = searched.subject
    require_edges(searched, "differentiate")
    began = time.perf_counter()
    with progress(f"gradients of {about.name}"):
        edges = sensitivities(about.model, searched.loss.edges, method=searched.method)
    seconds = searched.seconds + time.perf_counter() - began
    trusted = {name: edge for name, edge in edges.items() if edge.trusted}
    if not trusted:
        said = ", ".join(f"{name}: {edge.status}" for name, edge in edges.items())
        raise ComputationError(f"No edge is a function of the design here ({said}): try more --steps.")
    wide = width(trusted[ONSET], trusted[EXIT], WIDTH) if {ONSET, EXIT} <= set(trusted) else None
    shown = [*([] if wide is None else [wide]), *trusted.values()]
    figure = _figure(searched, shown)
    document = gradient_document(about.name, edges, wide) | {"seconds": round(seconds, 2), "figure": figure}
    tables = [gradient_table(about.name, about.model, s) for s in shown]
    notes = [*missing_notes(edges), *homogeneity_notes(document), f"Time: {seconds:.1f} s", f"Figure: {figure}"]
    return Report(document, tables, notes)


def _figure(searched: Searched, shown: list[Sensitivity]) -> str:
    figure = new_figure(9.0, 2.2 + 1.2 * len(shown))
    elasticity_bars(shown, figure.subplots())
    figure.suptitle(f"{searched.subject.name}: elasticities of the synchronous-loss edges", fontsize=11)
    return save_figure(figure, searched.folder / f"gradient_{searched.subject.name}.png")


def gradient_document(name: str, edges: dict[str, Sensitivity], wide: Sensitivity | None) -> dict[str, Any]:
    """Derivatives [rpm per SI unit] and elasticities for programs; null where the edge was not found again."""
    rows = [
        {
            "name": edge.name,
            "kind": edge.kind,
            "speed_rpm": edge.value_rpm,
            "error_rpm": edge.error_rpm,
            "steps": edge.steps,
            "trusted": edge.trusted,
            "status": edge.status,
            "transversality": edge.transversality,
            "derivative": edge.derivative,
            "elasticity": edge.elasticity,
        }
        for edge in edges.values()
    ]
    breadth = wide and {
        "name": wide.name,
        "kind": wide.kind,
        "value_rpm": wide.value_rpm,
        "error_rpm": wide.error_rpm,
        "derivative": wide.derivative,
        "elasticity": wide.elasticity,
    }
    trusted = [edge.homogeneity for edge in edges.values() if edge.trusted]
    worst = {base: max((abs(h[base]) for h in trusted), default=None) for base in ("mass", "length", "time")}
    return {"case": name, "edges": rows, "width": breadth, "homogeneity": worst}


def gradient_table(name: str, model: CageModel, sensitivity: Sensitivity) -> Table:
    """One edge or width: guidance gap and eccentricity on top, then by elasticity; what does not move it is counted."""
    slope, change = sensitivity.derivative, sensitivity.elasticity
    moving = [n for n in slope if slope[n] != 0.0 or n in FIRST]
    order = sorted(moving, key=lambda n: (FIRST.index(n) if n in FIRST else len(FIRST), -abs(change[n])))
    info, value = parameter_info(model), parameters(model)
    rows = [
        (n, f"{float(value[n]):.6g}", unit_cell(info[n].unit), f"{slope[n]:+.6g}", elasticity_cell(change[n]))
        for n in order
    ]
    at = f"{sensitivity.value_rpm:.3f} ± {error_cell(sensitivity.error_rpm)} rpm"
    title = f"{sensitivity.name.capitalize()} of {name}: {at}, {sensitivity.kind}"
    still = len(slope) - len(moving)
    columns = ("parameter", "value", "unit", "rpm per unit", "elasticity")
    return Table(title + (f"; {still} other parameters do not move it" if still else ""), columns, rows)


def elasticity_cell(value: float) -> str:
    """An elasticity to six decimals; what they would hide as zero is shown by its size."""
    if value == 0.0:
        return "0"
    return f"{value:+.6f}" if abs(value) >= 5e-7 else f"{value:+.0e}"


def unit_cell(unit: str) -> str:
    """A unit for a table: nothing for a pure number."""
    return "" if unit == "1" else unit


def missing_notes(edges: dict[str, Sensitivity]) -> list[str]:
    """One line for each edge that one would expect and that is not there, or not to be trusted."""
    notes = [f"There is no {name} in the range." for name in EXPECTED if name not in edges]
    notes += [f"Left out: {n}, {e.kind} ({e.status})." for n, e in edges.items() if not e.trusted]
    if not all(name in edges and edges[name].trusted for name in (ONSET, EXIT)):
        notes.append("Without both edges zone 1 has no width.")
    return notes


def homogeneity_notes(document: dict[str, Any]) -> list[str]:
    """By how much the gradients break the scaling that units impose."""
    worst = document["homogeneity"]
    rows = ", ".join(f"{base} {residual:.1e}" for base, residual in worst.items())
    return [f"Homogeneity, largest relative residual: {rows}"]
