"""Synchronous orbits over speed: how they lose stability, the zones without one, and how these answer to the design."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._errors import NoResult
from .._glossary import component_names, quantity
from .._parameters import parameter_info, parameters
from ..models import CageModel
from ..orbits import LossZones, Sensitivity, SynchronousOrbits, loss_zones, sensitivities, synchronous_orbits, width
from ..plotting import elasticity_bars, multiplier_circle, new_figure, orbit_diagram_with_branches
from ..report import (
    Table,
    coexisting_notes,
    contact_notes,
    edge_table,
    error_cell,
    loss_table,
    orbits_document,
    require_some,
    stretch_table,
    unsettled_notes,
)
from ..sweeps import rpm
from ._job import Job
from ._options import SearchOptions
from ._show import Report, chosen


FIRST = ("guidance_gap", "eccentricity")
"""Rows that are always on top."""
ONSET, EXIT = "zone 1 onset", "zone 1 exit"
EXPECTED = (ONSET, EXIT, "zone 2 onset")


def searched(job: Job[SearchOptions]) -> tuple[SynchronousOrbits, LossZones]:
    """The synchronous orbits that the options describe, and the zones without a stable one.

    **Raises:** `NoResult` if there are none.
    """
    options = job.options
    with job.computing("synchronous orbits") as say:
        found = synchronous_orbits(
            job.model,
            rpm(options.first),
            rpm(options.last),
            count=options.count,
            discard=options.discard,
            method=job.asked,
            progress=say,
        )
    if not found.branches:
        require_some(found.sweep.outcome, _between(found))
        what = f"No simulation{_between(found)} settled on a synchronous orbit"
        raise NoResult(f"{what}: try more --discard, or a larger --count.")
    return found, loss_zones(found)


def require_edges(found: SynchronousOrbits, loss: LossZones, what: str) -> None:
    """Refuse to go on where there is no edge to do anything to."""
    if not loss.edges:
        where = f"begins or ends{_between(found)}"
        raise NoResult(f"No zone without a stable synchronous orbit {where}: there is no edge to {what}.")


def _between(found: SynchronousOrbits) -> str:
    return f" between {found.lower_rpm:g} and {found.upper_rpm:g} rpm"


def bifurcations(job: Job[SearchOptions]) -> Report:
    """`jaxcage bifurcations`: synchronous orbits over speed, and the zones without a stable one."""
    found, loss = searched(job)
    _figures(job, found, loss)
    job.columns(_columns(found, job.model.dimension))
    tables = [
        stretch_table(job.name, found),
        loss_table(job.name, found, loss, job.published),
        edge_table(job.name, found, loss),
    ]
    notes = [
        *coexisting_notes(loss),
        *contact_notes(job.model, loss.edges, job.asked),
        *unsettled_notes(found),
        f"Further bifurcations, on unstable parts: {len(found.points) - len(found.edges)} (listed by --json)",
        f"Settled orbits that are on no branch: {found.missed}",
    ]
    return Report(orbits_document(job.name, found, loss, job.published), tables, notes)


def _figures(job: Job[SearchOptions], found: SynchronousOrbits, loss: LossZones) -> None:
    """Orbit diagram with all branches, and the multipliers along the branch on which most simulations settled."""
    diagram = new_figure(10.0, 6.0)
    orbit_diagram_with_branches(found.sweep, found.branches, 1, diagram.subplots())
    diagram.suptitle(f"{job.name}: synchronous orbits", fontsize=11)
    job.figure(diagram)
    shown = found.branches[0 if loss.principal is None else loss.principal.branch]
    circle = new_figure(7.0, 6.0)
    multiplier_circle(shown, circle.subplots())
    span = f"{shown.speed_rpm.min():.0f} to {shown.speed_rpm.max():.0f} rpm"
    circle.suptitle(f"{job.name}: multipliers of the synchronous orbit, {span}", fontsize=11)
    job.figure(circle, "multipliers", "_multipliers")


def _columns(found: SynchronousOrbits, count: int) -> dict[str, np.ndarray]:
    """All orbits of all branches."""
    branches = found.branches
    joined = lambda rows: np.concatenate([np.asarray(row) for row in rows])
    columns = {
        "branch": joined(np.full(b.value.size, i) for i, b in enumerate(branches)),
        "speed [rpm]": joined(b.speed_rpm for b in branches),
        "stable": joined(b.stable for b in branches),
    }
    for k, name in enumerate(component_names(count)):
        columns[f"{name} [{quantity(name).unit}]"] = joined(b.state[:, k] for b in branches)
    for k in range(count):
        columns[f"multiplier {k + 1} (real part)"] = joined(np.real(b.multipliers[:, k]) for b in branches)
        columns[f"multiplier {k + 1} (imaginary part)"] = joined(np.imag(b.multipliers[:, k]) for b in branches)
    return columns


def gradient(job: Job[SearchOptions]) -> Report:
    """`jaxcage gradient`: how the synchronous-loss edges, and the width of zone 1, answer to every parameter."""
    found, loss = searched(job)
    require_edges(found, loss, "differentiate")
    with job.computing("gradients"):
        edges = sensitivities(job.model, loss.edges, method=job.asked)
    trusted = {name: edge for name, edge in edges.items() if edge.trusted}
    if not trusted:
        said = ", ".join(f"{name}: {edge.status}" for name, edge in edges.items())
        raise NoResult(f"No edge is a function of the design here ({said}): try more --steps.")
    wide = width(trusted[ONSET], trusted[EXIT], "zone 1 width") if {ONSET, EXIT} <= set(trusted) else None
    shown = [*([] if wide is None else [wide]), *trusted.values()]
    figure = new_figure(9.0, 2.2 + 1.2 * len(shown))
    elasticity_bars(shown, figure.subplots())
    figure.suptitle(f"{job.name}: elasticities of the synchronous-loss edges", fontsize=11)
    job.figure(figure)
    document = gradient_document(edges, wide)
    tables = [gradient_table(job.name, job.model, s) for s in shown]
    return Report(document, tables, [*missing_notes(edges), *homogeneity_notes(document)])


def gradient_document(edges: Mapping[str, Sensitivity], wide: Sensitivity | None) -> dict[str, Any]:
    """Derivatives [rpm per SI unit] and elasticities for programs; null where the edge was not found again."""
    names = "name kind error_rpm steps trusted status transversality derivative elasticity"
    trusted = [edge.homogeneity for edge in edges.values() if edge.trusted]
    return {
        "edges": [{"speed_rpm": edge.value_rpm} | chosen(edge, names) for edge in edges.values()],
        "width": wide and chosen(wide, "name kind value_rpm error_rpm derivative elasticity"),
        "homogeneity": {
            base: max((abs(h[base]) for h in trusted), default=None) for base in ("mass", "length", "time")
        },
    }


def gradient_table(name: str, model: CageModel, sensitivity: Sensitivity) -> Table:
    """One edge or width: guidance gap and eccentricity on top, then by elasticity; what does not move it is counted."""
    slope, change = sensitivity.derivative, sensitivity.elasticity
    moving = [n for n in slope if slope[n] != 0.0 or n in FIRST]
    order = sorted(moving, key=lambda n: (FIRST.index(n) if n in FIRST else len(FIRST), -abs(change[n])))
    info, value = parameter_info(model), parameters(model)
    unit = lambda n: "" if info[n].unit == "1" else info[n].unit
    rows = [(n, f"{float(value[n]):.6g}", unit(n), f"{slope[n]:+.6g}", elasticity_cell(change[n])) for n in order]
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
