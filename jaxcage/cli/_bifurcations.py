"""`jaxcage bifurcations`: synchronous orbits over speed, how they lose stability, and the zones without one."""

import dataclasses
import time
from pathlib import Path
from typing import Any

import numpy as np

from .._glossary import component_names, quantity
from ..integrate import OUTCOMES, AbstractMethod
from ..io import write_columns
from ..orbits import LossZones, SynchronousOrbits, loss_zones, synchronous_orbits
from ..plotting import multiplier_circle, new_figure, orbit_diagram_with_branches
from ..report import (
    coexisting_notes,
    contact_notes,
    edge_table,
    loss_table,
    orbits_document,
    stretch_table,
    unsettled_notes,
)
from ._console import progress_in_stages
from ._errors import ComputationError, require_at_least, require_range
from ._inputs import Subject, angular_speed, orbit_integration, output_folder, save_figure, subject
from ._options import BifurcationsOptions, SearchOptions
from ._report import Report


@dataclasses.dataclass(frozen=True)
class Searched:
    """A search that is done."""

    subject: Subject
    found: SynchronousOrbits
    loss: LossZones
    method: AbstractMethod | None
    folder: Path
    seconds: float


def check_search(options: SearchOptions) -> None:
    """Refuse a search that cannot be made."""
    require_range(options.first, options.last)
    require_at_least("--count", options.count, 2)
    require_at_least("--discard", options.discard, 0)


def search_case(options: SearchOptions, about: Subject | None = None) -> Searched:
    """Check everything, and search for the synchronous orbits that the options describe, of the model `about` if it
    is loaded already.
    """
    check_search(options)
    chosen = orbit_integration(options)
    about = subject(options) if about is None else about
    folder = output_folder(options)
    began = time.perf_counter()
    with progress_in_stages(f"synchronous orbits of {about.name}") as bar:
        found = synchronous_orbits(
            about.model,
            angular_speed(options.first),
            angular_speed(options.last),
            count=options.count,
            discard=options.discard,
            method=chosen,
            progress=bar,
        )
    seconds = time.perf_counter() - began
    if not found.branches:
        raise ComputationError(_nothing(found))
    return Searched(about, found, loss_zones(found), chosen, folder, seconds)


def require_edges(searched: Searched, what: str) -> None:
    """Refuse to go on where there is no edge to do anything to."""
    if not searched.loss.edges:
        between = f"{searched.found.lower_rpm:g} and {searched.found.upper_rpm:g} rpm"
        raise ComputationError(
            f"No zone without a stable synchronous orbit begins or ends between {between}: there is no edge to {what}."
        )


def _nothing(found: SynchronousOrbits) -> str:
    """Why no orbit was found, in one sentence."""
    sweep, between = found.sweep, f"between {found.lower_rpm:g} and {found.upper_rpm:g} rpm"
    if np.all(sweep.failed):
        names = ", ".join(sorted({OUTCOMES[code] for code in sweep.outcome.ravel()}))
        return f"All {sweep.outcome.size} simulations {between} failed ({names}): try more --steps."
    return f"No simulation {between} settled on a synchronous orbit: try more --discard, or a larger --count."


def run(options: BifurcationsOptions) -> Report:
    """Carry out `jaxcage bifurcations`."""
    searched = search_case(options)
    about, found, loss = searched.subject, searched.found, searched.loss
    files = _figures(searched) | {"data": _data(searched)}
    document = orbits_document(about.name, found, loss, about.published) | {
        "seconds": round(searched.seconds, 2),
        **files,
    }
    tables = [
        stretch_table(about.name, found),
        loss_table(about.name, found, loss, about.published),
        edge_table(about.name, found, loss),
    ]
    return Report(document, tables, _notes(searched, files))


def _notes(searched: Searched, files: dict[str, str]) -> list[str]:
    found = searched.found
    inner = len(found.points) - len(found.edges)
    return [
        *coexisting_notes(searched.loss),
        *contact_notes(searched.subject.model, searched.loss.edges, searched.method),
        *unsettled_notes(found),
        f"Further bifurcations, on unstable parts: {inner} (listed by --json)",
        f"Settled orbits that are on no branch: {found.missed}",
        f"Time: {searched.seconds:.1f} s",
        *(f"{name.capitalize()}: {path}" for name, path in files.items()),
    ]


def _figures(searched: Searched) -> dict[str, str]:
    """Orbit diagram with all branches, and the multipliers along the branch on which most simulations settled."""
    found, name = searched.found, searched.subject.name
    diagram = new_figure(10.0, 6.0)
    orbit_diagram_with_branches(found.sweep, found.branches, 1, diagram.subplots())
    diagram.suptitle(f"{name}: synchronous orbits", fontsize=11)
    stem = searched.folder / f"bifurcations_{name}"
    files = {"figure": save_figure(diagram, stem.with_name(stem.name + ".png"))}
    principal = searched.loss.principal
    shown = found.branches[0 if principal is None else principal.branch]
    circle = new_figure(7.0, 6.0)
    multiplier_circle(shown, circle.subplots())
    span = f"{shown.speed_rpm.min():.0f} to {shown.speed_rpm.max():.0f} rpm"
    circle.suptitle(f"{name}: multipliers of the synchronous orbit, {span}", fontsize=11)
    return files | {"multipliers": save_figure(circle, stem.with_name(stem.name + "_multipliers.png"))}


def _data(searched: Searched) -> str:
    """All orbits of all branches as CSV. **Returns:** its path."""
    branches, count = searched.found.branches, searched.subject.model.dimension
    joined = lambda rows: np.concatenate([np.asarray(row) for row in rows])
    columns: dict[str, Any] = {
        "branch": joined(np.full(b.value.size, i) for i, b in enumerate(branches)),
        "speed [rpm]": joined(b.speed_rpm for b in branches),
        "stable": joined(b.stable for b in branches),
    }
    for k, name in enumerate(component_names(count)):
        columns[f"{name} [{quantity(name).unit}]"] = joined(b.state[:, k] for b in branches)
    for k in range(count):
        columns[f"multiplier {k + 1} (real part)"] = joined(np.real(b.multipliers[:, k]) for b in branches)
        columns[f"multiplier {k + 1} (imaginary part)"] = joined(np.imag(b.multipliers[:, k]) for b in branches)
    return str(write_columns(searched.folder / f"bifurcations_{searched.subject.name}.csv", columns))
