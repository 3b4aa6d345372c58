"""`jaxcage report`: one page about a design."""

from typing import Any

from .. import report
from .._errors import InputError
from ..sweeps import rpm
from ._chances import drawn_chances
from ._job import Job, blocks_of
from ._options import ReportOptions
from ._show import Report
from ._whole_page import command_line


SPEEDS, QUICK_SPEEDS = 251, 126
"""Quick reports take as many revolutions: shorter runs miss orbits that attract slowly, and where they are stable."""


def report_on(job: Job[ReportOptions]) -> Report:
    """Carry out `jaxcage report` about a cage."""
    options = job.options
    operating = report.read_operating(options.operating, job.ratio, job.speeds)
    if options.operating and not operating:
        raise InputError(f"Option --operating must hold a speed, but '{options.operating}' was given.")
    count = options.count or (QUICK_SPEEDS if options.quick else SPEEDS)
    with job.computing() as say:
        findings = report.examine(
            job.name,
            job.model,
            job.published,
            speeds=rpm(options.first, options.last, count),
            **job.given("discard revolutions quick"),
            blocks=blocks_of(options.revolutions),
            sweep_method=job.method,
            orbit_method=job.asked,
            progress=say,
        )
        drawn = drawn_chances(job, options.draws, say) if job.unknowns and options.draws else None
    table, left = (None, ()) if job.file is None else (job.file.table, job.file.left)
    html = report.page(findings, operating, table=table, command=command_line(options), chances=drawn, left=left)
    job.text(html, job.path(".html"), "report")
    assessed = report.assess(findings, operating)
    failed, size = int(findings.sweep.failed.sum()), len(html.encode())
    document = _document(findings, assessed) | {"failed": failed, "stages": findings.seconds, "bytes": size}
    known = [] if drawn is None else report.chances_tables(job.name, drawn)
    if drawn is not None:
        document |= report.chances_document(drawn)
        known = [*([report.operating_chances(drawn, operating, job.ratio)] if operating else []), *known]
    stages = ", ".join(f"{stage} {seconds:.0f} s" for stage, seconds in findings.seconds.items())
    notes = [f"Failed simulations: {failed}", f"Stages: {stages}", f"Size: {size / 1e6:.1f} MB"]
    return Report(document, [*known, *_tables(findings, assessed)], notes)


def _document(findings: report.Findings, assessed: list[report.Assessed]) -> dict[str, Any]:
    return report.zones_document(findings.name, findings.zones, findings.published) | {
        "quick": findings.quick,
        "synchronous_loss": [report.zone_document(zone) for zone in findings.loss.zones],
        "operating": [
            {"low_rpm": j.at.low_rpm, "high_rpm": j.at.high_rpm} | {kind: vars(v) for kind, v in j.verdicts.items()}
            for j in assessed
        ],
        "elasticities": {name: s.elasticity for name, s in findings.slopes.items() if s.trusted},
    }


def _tables(findings: report.Findings, assessed: list[report.Assessed]) -> list[report.Table]:
    swept = float(findings.sweep.rpm[0]), float(findings.sweep.rpm[-1])
    ratio = float(findings.model.bearing.cage_speed_ratio)
    rows = [
        (*((str(j.at), str(j.at.of_shaft(ratio))) if i == 0 else ("", "")), kind, v.state, str(v))
        for j in assessed
        for i, (kind, v) in enumerate(j.verdicts.items())
    ]
    verdicts = report.Table("Operating speeds", ("cage speed", "shaft speed", "kind of zone", "verdict", "where"), rows)
    return [
        *([verdicts] if rows else []),
        report.loss_table(findings.name, findings.found, findings.loss, findings.published),
        report.zones_table(findings.name, findings.zones, findings.published, swept),
        *report.transient_tables(findings.name, findings.zones),
    ]
