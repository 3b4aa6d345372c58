"""Synchronous orbits over speed: how they lose stability, the zones without one, and how these answer to the design."""

from .. import report
from .._errors import NoResult
from ..io import branch_columns
from ..orbits import LossZones, SynchronousOrbits, loss_zones, sensitivities, synchronous_orbits, width
from ..plotting import elasticity_bars, multiplier_circle, orbit_diagram_with_branches
from ..sweeps import rpm
from ._job import Job
from ._lasting import lasting_gradient
from ._options import GradientOptions, SearchOptions
from ._show import Report


def searched(job: Job[SearchOptions]) -> tuple[SynchronousOrbits, LossZones]:
    """The synchronous orbits that the options describe, and the zones without a stable one.

    **Raises:** `NoResult` if there are none.
    """
    options = job.options
    between = rpm(options.first), rpm(options.last)
    with job.computing("synchronous orbits") as say:
        found = synchronous_orbits(job.model, *between, **job.given("count discard"), method=job.asked, progress=say)
    if not found.branches:
        report.require_some(found.sweep.outcome, _between(found))
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
    job.columns(branch_columns(found.branches))
    tables = [
        report.stretch_table(job.name, found),
        report.loss_table(job.name, found, loss, job.published),
        report.edge_table(job.name, found, loss),
    ]
    notes = [
        *report.coexisting_notes(loss),
        *report.contact_notes(job.model, loss.edges, job.asked),
        *report.unsettled_notes(found),
        f"Further bifurcations, on unstable parts: {len(found.points) - len(found.edges)} (listed by --json)",
        f"Settled orbits that are on no branch: {found.missed}",
    ]
    return Report(report.orbits_document(job.name, found, loss, job.published), tables, notes)


def _figures(job: Job[SearchOptions], found: SynchronousOrbits, loss: LossZones) -> None:
    """Orbit diagram with all branches, and the multipliers along the branch on which most simulations settled."""
    draw = lambda ax: orbit_diagram_with_branches(found.sweep, found.branches, 1, ax)
    job.draw(draw, (10.0, 6.0), f"{job.name}: synchronous orbits")
    shown = found.branches[0 if loss.principal is None else loss.principal.branch]
    span = f"{shown.speed_rpm.min():.0f} to {shown.speed_rpm.max():.0f} rpm"
    title = f"{job.name}: multipliers of the synchronous orbit, {span}"
    job.draw(lambda ax: multiplier_circle(shown, ax), (7.0, 6.0), title, "multipliers", "_multipliers")


def gradient(job: Job[GradientOptions]) -> Report:
    """`jaxcage gradient`: how the synchronous-loss edges, and the width of zone 1, answer to every parameter."""
    if job.options.lasting:
        return lasting_gradient(job)
    found, loss = searched(job)
    require_edges(found, loss, "differentiate")
    with job.computing("gradients"):
        edges = sensitivities(job.model, loss.edges, method=job.asked)
    trusted = {name: edge for name, edge in edges.items() if edge.trusted}
    if not trusted:
        said = ", ".join(f"{name}: {edge.status}" for name, edge in edges.items())
        raise NoResult(f"No edge is a function of the design here ({said}): try more --steps.")
    onset, leaves = trusted.get(report.ONSET), trusted.get(report.EXIT)
    wide = width(onset, leaves, "zone 1 width") if onset and leaves else None
    shown = [*([wide] if wide else []), *trusted.values()]
    title, size = f"{job.name}: elasticities of the synchronous-loss edges", (9.0, 2.2 + 1.2 * len(shown))
    job.draw(lambda ax: elasticity_bars(report.to_be_turned(job.model, shown), ax), size, title)
    widths = report.widths_of(edges)
    document = report.gradient_document(edges, wide) | {"widths": report.width_documents(widths, report.FIRST)}
    tables = [report.gradient_table(job.name, job.model, s) for s in shown]
    tables.append(report.width_table(f"Widths of the synchronous-loss zones of {job.name}", widths, report.FIRST))
    return Report(document, tables, [*report.missing_notes(edges), *report.homogeneity_notes(document)])
