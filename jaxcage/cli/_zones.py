"""`jaxcage zones`: chaotic zones of a case, beside the published ones."""

from ..analysis import zones
from ._options import ZonesOptions
from ._report import Report
from ._sweep import failed_lanes, sweep_case
from ._zone_report import synchronous_table, zones_document, zones_table


def run(options: ZonesOptions) -> Report:
    """Carry out `jaxcage zones`."""
    swept = sweep_case(options)
    edges, about = zones(swept.sweep), swept.subject
    failed = failed_lanes(swept.sweep)
    document = zones_document(about.name, edges, about.published) | {
        "failed": failed,
        "data": swept.data,
    }
    tables = [
        zones_table(about.name, edges, about.published, swept.range_rpm),
        synchronous_table(about.name, edges),
    ]
    return Report(document, tables, [f"Data: {swept.data}"])
