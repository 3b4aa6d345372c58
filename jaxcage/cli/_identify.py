"""`jaxcage identify`: ranges of a file narrowed by what was measured."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from .. import report
from .._errors import InputError
from .._parameters import parameter_info
from ..io import Range, Unknown, read_bytes, read_measurements, with_ranges
from ..studies import Narrowed, identify
from ._job import Job
from ._options import IdentifyOptions
from ._show import Report


def identify_from(job: Job[IdentifyOptions]) -> Report:
    """Carry out `jaxcage identify`."""
    options, info = job.options, parameter_info(job.model)
    if not job.unknowns:
        raise InputError(
            f'Case {job.name} must be a TOML file with ranges, such as stiffness = "1e4 .. 1e6 N/m", but has none.'
        )
    measured = read_measurements(options.measured, job.speeds, job.ratio)
    with job.computing("draws") as say:
        found = identify(
            job.model,
            job.unknowns,
            measured,
            **job.given("draws stages seed"),
            method=job.asked,
            progress=partial(say, "draws"),
        )
    document = report.narrowed_document(found, measured)
    tables = [report.measured_table(found, measured)]
    if not found.met:
        why = f"None of {found.draws} draws does what was measured in all rows: the nearest is {_off(document)}"
        return Report(document | {"file": None}, tables, failure=why)
    units = {u.label: info[u.names[0]].unit for u in job.unknowns}
    changed = {u.label: (r, units[u.label]) for u, r in _changed(found)}
    path = job.path(".toml")
    job.text(with_ranges(read_bytes(options.case).decode(), changed), path, "file")
    notes = [
        f"{found.accepted} of {found.draws} draws of the last of {found.stages} stages do what was measured.",
        f"What it decides: jaxcage sweep {path}",
    ]
    return Report(document, [*tables, report.narrowed_table(found, units)], notes)


def _changed(found: Narrowed) -> list[tuple[Unknown, Range]]:
    return [(u, r) for u, r, worth in zip(found.unknowns, found.ranges, found.narrowed, strict=True) if worth]


def _off(document: Mapping[str, Any]) -> str:
    worst = max(document["measurements"], key=lambda m: m["off_by_tolerances"])
    return (
        f"{worst['off_by_tolerances']:.2g} tolerances off in '{worst['what']}'. Widen ranges or tolerances, or look "
        "for what the model leaves out."
    )
