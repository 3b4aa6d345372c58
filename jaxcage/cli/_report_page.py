"""`jaxcage report`: one page about a design."""

import contextlib
import shlex
import time
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..bearing import PUBLISHED_CASES
from ..io import replacing
from ..report import (
    AllFailed,
    Findings,
    Judged,
    examine,
    judge,
    loss_table,
    page,
    read_operating,
    transient_tables,
    zone_document,
    zones_document,
    zones_table,
)
from ..sweeps import rpm
from ._console import progress_in_stages
from ._errors import ComputationError, UsageError, require_at_least, require_blocks, require_range
from ._inputs import orbit_integration, output_folder, subject, sweep_integration
from ._options import ReportOptions
from ._report import Report, Table


FULL = {"count": 251, "discard": 300, "revolutions": 300}
QUICK = FULL | {"count": 126}
"""As many revolutions: shorter runs miss orbits that attract slowly, and with them where they are stable."""


def run(options: ReportOptions) -> Report:
    """Carry out `jaxcage report`."""
    count, discard, revolutions = _sizes(options)
    try:
        operating = read_operating(options.operating)
    except ValueError as error:
        raise UsageError(f"Option --operating {error}") from error
    if options.operating and not operating:
        raise UsageError(f"Option --operating must hold a speed, but '{options.operating}' was given.")
    chosen, orbits = sweep_integration(options), orbit_integration(options)
    about, folder = subject(options), output_folder(options)
    began = time.perf_counter()
    with progress_in_stages(f"report on {about.name}") as bar, _failing():
        findings = examine(
            about.name,
            about.model,
            about.published,
            speeds=rpm(options.first, options.last, count),
            discard=discard,
            revolutions=revolutions,
            blocks=require_blocks("--revolutions", revolutions),
            sweep_method=chosen,
            orbit_method=orbits,
            quick=options.quick,
            progress=bar,
        )
    html = page(findings, operating, table=_table(options.case), command=_command(options))
    path = folder / f"report_{about.name}.html"
    with replacing(path) as temporary:
        temporary.write_text(html, encoding="utf-8")
    judged = judge(findings, operating)
    document = _document(findings, judged) | {
        "seconds": round(time.perf_counter() - began, 1),
        "bytes": len(html.encode()),
        "report": str(path),
    }
    return Report(document, _tables(findings, judged), _notes(document))


@contextlib.contextmanager
def _failing() -> Iterator[None]:
    try:
        yield
    except AllFailed as error:
        raise ComputationError(f"All {error.args[0]} simulations failed: try more --steps.") from error


def _sizes(options: ReportOptions) -> tuple[int, int, int]:
    """Speeds, revolutions left out and revolutions observed."""
    require_range(options.first, options.last)
    default = QUICK if options.quick else FULL
    sizes = [default[name] if (given := getattr(options, name)) is None else given for name in FULL]
    require_at_least("--count", sizes[0], 2)
    require_at_least("--discard", sizes[1], 0)
    require_blocks("--revolutions", sizes[2])
    return sizes[0], sizes[1], sizes[2]


def _table(case: str) -> Mapping[str, Any] | None:
    """What the TOML file says, None for a published case."""
    return None if case in PUBLISHED_CASES else tomllib.loads(Path(case).read_text(encoding="utf-8"))


def _command(options: ReportOptions) -> str:
    """The command line as a shell takes it, without folders."""
    parts = ["jaxcage", "report", Path(options.case).name]
    parts += ["--operating", options.operating] if options.operating else []
    return shlex.join([*parts, *(["--quick"] if options.quick else [])])


def _document(findings: Findings, judged: list[Judged]) -> dict[str, Any]:
    document = zones_document(findings.name, findings.zones, findings.published)
    return document | {
        "quick": findings.quick,
        "synchronous_loss": [zone_document(zone) for zone in findings.loss.zones],
        "operating": [
            {"low_rpm": j.at.low_rpm, "high_rpm": j.at.high_rpm} | {kind: vars(v) for kind, v in j.verdicts.items()}
            for j in judged
        ],
        "elasticities": {name: s.elasticity for name, s in findings.slopes.items() if s.trusted},
        "failed": int(findings.sweep.failed.sum()),
        "stages": findings.seconds,
    }


def _tables(findings: Findings, judged: list[Judged]) -> list[Table]:
    swept = float(findings.sweep.rpm[0]), float(findings.sweep.rpm[-1])
    rows = [
        (str(j.at) if i == 0 else "", kind, v.state, str(v))
        for j in judged
        for i, (kind, v) in enumerate(j.verdicts.items())
    ]
    verdicts = Table("Operating speeds", ("cage speed", "kind of zone", "verdict", "where"), rows)
    return [
        *([verdicts] if rows else []),
        loss_table(findings.name, findings.found, findings.loss, findings.published),
        zones_table(findings.name, findings.zones, findings.published, swept),
        *transient_tables(findings.name, findings.zones),
    ]


def _notes(document: dict[str, Any]) -> list[str]:
    stages = ", ".join(f"{stage} {seconds:.0f} s" for stage, seconds in document["stages"].items())
    return [
        f"Failed simulations: {document['failed']}",
        f"Time: {document['seconds']:.0f} s ({stages})",
        f"Report: {document['report']} ({document['bytes'] / 1e6:.1f} MB)",
    ]
