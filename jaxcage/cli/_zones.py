"""`jaxcage zones`: where the synchronous orbit is lost, with exact edges and gradients, beside where chaos is."""

import time
from typing import Any

from ..analysis import zones
from ..orbits import (
    Cascade,
    Explained,
    LossZones,
    Sensitivity,
    explain,
    loss_zones,
    synchronous_orbits,
)
from ..report import (
    contact_notes,
    edge_slopes,
    error_cell,
    loss_table,
    transient_tables,
    unsettled_notes,
    zone_document,
    zones_document,
    zones_table,
)
from ._console import progress_in_stages
from ._inputs import Subject, orbit_integration
from ._options import ZonesOptions
from ._report import Report, Table, number
from ._sweep import extent, failed_lanes, sweep_case


SHOWN = ("guidance_gap", "eccentricity")


def run(options: ZonesOptions) -> Report:
    """Carry out `jaxcage zones`."""
    swept = sweep_case(options)
    about, chosen = swept.subject, orbit_integration(options)
    began = time.perf_counter()
    with progress_in_stages(f"synchronous orbits of {about.name}") as bar:
        speeds = swept.sweep.speed
        found = synchronous_orbits(
            about.model, float(speeds[0]), float(speeds[-1]), settled=swept.sweep, method=chosen, progress=bar
        )
        loss = loss_zones(found)
        explained = explain(zones(swept.sweep), found, about.model, chosen)
        slopes = {} if options.quick else edge_slopes(about.model, loss, explained, chosen)
    document = zones_document(about.name, explained.zones, about.published)
    document["synchronous_loss"] = [_loss_document(i, loss, slopes) for i in range(len(loss.zones))]
    for i, zone in enumerate(document["zones"], start=1):
        zone |= _source_documents(i, explained, slopes)
    document |= extent(swept.sweep) | {
        "failed": failed_lanes(swept.sweep),
        "seconds": round(swept.seconds + time.perf_counter() - began, 2),
        "data": swept.data,
    }
    tables = [
        loss_table(about.name, found, loss, about.published),
        *([_gradient_table(about, slopes)] if slopes else []),
        zones_table(about.name, explained.zones, about.published, swept.range_rpm),
        *transient_tables(about.name, explained.zones),
    ]
    notes = [*_notes(explained), *contact_notes(about.model, loss.edges, chosen), *unsettled_notes(found)]
    return Report(document, tables, [*notes, f"Time: {document['seconds']:.1f} s", f"Data: {swept.data}"])


def _slopes_document(slopes: Sensitivity | None) -> dict[str, Any] | None:
    if slopes is None:
        return None
    return {
        "trusted": slopes.trusted,
        "status": slopes.status,
        "error_rpm": slopes.error_rpm,
        "steps": slopes.steps,
        "transversality": slopes.transversality,
        "derivative": slopes.derivative,
        "elasticity": slopes.elasticity,
    }


def _loss_document(i: int, loss: LossZones, slopes: dict[str, Sensitivity]) -> dict[str, Any]:
    """A synchronous-loss zone with the gradients of its edges [rpm per SI unit], null where they were left out."""
    return zone_document(loss.zones[i]) | {
        f"{end}_gradient": _slopes_document(slopes.get(f"zone {i + 1} {end}")) for end in ("onset", "exit")
    }


def _source_documents(i: int, explained: Explained, slopes: dict[str, Sensitivity]) -> dict[str, Any]:
    """What the edges of a chaotic zone were taken from; a bifurcation brings its gradient."""
    found: dict[str, Any] = {}
    zone = explained.zones.zones[i - 1]
    for end, edge in (("onset", zone.onset), ("exit", zone.exit)):
        source = explained.sources.get(f"zone {i} {end}")
        found[f"{end}_basis"] = edge and edge.basis
        found[f"{end}_cascade_rpm"] = _cascade_rpm(source) if isinstance(source, Cascade) else None
        found[f"{end}_gradient"] = _slopes_document(slopes.get(f"chaotic zone {i} {end}"))
    return found


def _cascade_rpm(cascade: Cascade) -> list[float]:
    return [float(p.speed_rpm) for p in cascade.points]


def _gradient_table(about: Subject, slopes: dict[str, Sensitivity]) -> Table:
    """Elasticities: relative change of an edge per relative change of the parameter."""
    rows = [
        (
            name,
            s.kind,
            number(s.value_rpm, 2),
            error_cell(s.error_rpm),
            *(f"{s.elasticity[n]:+.4f}" for n in SHOWN),
            s.status,
        )
        for name, s in slopes.items()
    ]
    columns = ("edge", "by", "speed [rpm]", "±", *(n.replace("_", " ") for n in SHOWN), "status")
    return Table(f"Elasticities of the exact edges of {about.name}", columns, rows)


def _notes(explained: Explained) -> list[str]:
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
