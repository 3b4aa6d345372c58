"""Edges and widths of zones of lasting chaos by the design: `jaxcage gradient --lasting`."""

from functools import partial

from .. import report
from .._errors import ArgumentError, InputError, NoResult
from .._parameters import parameters
from ..analysis import Zone, zones
from ..design import LastingEdge, lasting_edges
from ..sweeps import rpm, sweep
from ._job import Job
from ._options import GradientOptions
from ._show import Report


def lasting_gradient(job: Job[GradientOptions]) -> Report:
    """How edges and widths of zones of lasting chaos answer to parameters, by survival regression."""
    options = job.options
    known = {name for name, value in parameters(job.model).items() if float(value)}
    if wrong := [name for name in options.by if name not in known]:
        raise InputError(f"Option --by must name parameters of {job.name} that are not 0, but has '{wrong[0]}'.")
    with job.computing("sweep") as say:
        speeds = rpm(options.first, options.last, options.count)
        swept = sweep(job.model, speeds, method=job.method, progress=partial(say, ""))
    report.require_some(swept.outcome)
    edges: dict[str, LastingEdge] = {}
    notes = []
    for i, zone in _chosen(zones(swept).zones, options.zone, swept.horizon):
        with job.computing(f"edges of zone {i}") as say:
            try:
                found = lasting_edges(
                    job.model,
                    zone,
                    names=options.by,
                    designs=options.designs,
                    seed=options.seed,
                    method=job.asked,
                    progress=partial(say, ""),
                )
            except ArgumentError as error:
                notes.append(f"Zone {i} is left out: {error}")
                continue
        edges |= {f"zone {i} {end}": edge for end, edge in found.items()}
    if not edges:
        raise NoResult(" ".join(notes) or "All zones are open at both ends: there is no edge to differentiate.")
    between = f"Widths of {job.name} between mean lives of {swept.horizon} revolutions"
    tables = [
        report.lasting_table(job.name, edges, swept.horizon),
        report.width_table(between, report.widths_of(edges), options.by),
    ]
    notes.append(
        "Errors are standard errors, from the scatter of lanes. An edge is where the mean life of chaos passes the "
        "horizon; it is not that of a synchronous orbit, which `jaxcage gradient` solves for exactly."
    )
    return Report(report.lasting_document(edges), tables, notes)


def _chosen(found: tuple[Zone, ...], number: int, horizon: int) -> list[tuple[int, Zone]]:
    """Zones with their numbers.

    **Raises:** `NoResult` if there is none, `InputError` for one that is not there.
    """
    if not found:
        raise NoResult(f"No chaos lasts beyond {horizon} revolutions: there is no zone to differentiate.")
    if number > len(found):
        raise InputError(f"Option --zone must be at most {len(found)}, the zones of lasting chaos, but is {number}.")
    numbered = list(enumerate(found, start=1))
    return numbered if number == 0 else [numbered[number - 1]]
