"""`jaxcage runup`: the speed raised and lowered again, as on a test bench."""

import dataclasses
from typing import Any

from ..plotting import ramp_figure
from ..report import Table, number
from ..sweeps import Ramped, RampUpDown, ramp_up_down, rpm
from ._job import Job
from ._options import RunUpOptions
from ._show import Report


ROWS = 20
"""Windows in the table; files and JSON have all."""


def runup(job: Job[RunUpOptions]) -> Report:
    """Carry out `jaxcage runup` of a cage."""
    options = job.options
    rate = rpm(options.rate * (job.ratio if job.speeds == "shaft" else 1.0))
    first, last = rpm(options.first), rpm(options.last)
    with job.computing():
        found = ramp_up_down(
            job.model,
            first,
            last,
            rate,
            windows=options.windows or 2,
            settle=options.discard or 0,
            method=job.asked,
        )
    slow, fast = found.rate_rpm_per_s
    told = (
        f"{found.revolutions} revolutions each way in {found.seconds:.3g} s, {slow:.0f} to {fast:.0f} rpm/s of the cage"
    )
    job.figure(ramp_figure(found, f"{job.name}: run-up and run-down, {told}"))
    job.columns(_columns(found, job.ratio))
    document = {
        "revolutions": found.revolutions,
        "ramp_seconds": found.seconds,
        "rate_rpm_per_s": found.rate_rpm_per_s,
        **{way: _document(getattr(found, way)) for way in ("up", "down")},
        "hysteresis_rpm": found.stretches,
    }
    return Report(document, [_table(job, found, told)], [_note(found, job.ratio)])


def _document(way: Ramped) -> dict[str, Any]:
    keys = {"rpm": "speeds_rpm", "size": "orbit_size_m", "scatter": "scatter_m", "eccentricity": "largest_eccentricity"}
    return {keys[name]: value for name, value in dataclasses.asdict(way).items()}


def _columns(found: RampUpDown, ratio: float) -> dict[str, Any]:
    columns = {"cage speed [rpm]": found.up.rpm, "shaft speed [rpm]": found.up.rpm / ratio}
    for way in ("up", "down"):
        seen = getattr(found, way)
        columns |= {f"orbit size {way} [m]": seen.size, f"scatter {way} [m]": seen.scatter}
        columns[f"largest eccentricity ratio {way}"] = seen.eccentricity
    return columns | {"differs": found.apart}


def _table(job: Job[RunUpOptions], found: RampUpDown, told: str) -> Table:
    step = -(-found.up.rpm.size // ROWS)
    mm = lambda way, i: number(1e3 * way.size[i], 3)
    rows = [
        (
            number(found.up.rpm[i]),
            mm(found.up, i),
            mm(found.down, i),
            number(found.up.eccentricity[i], 3),
            number(found.down.eccentricity[i], 3),
            "differs" if found.apart[i] else "",
        )
        for i in range(0, found.up.rpm.size, step)
    ]
    columns = ("cage speed [rpm]", "orbit up [mm]", "orbit down [mm]", "eps up", "eps down", "hysteresis")
    return Table(f"Run-up and run-down of {job.name}: {told}", columns, rows, columns[:1])


def _note(found: RampUpDown, ratio: float) -> str:
    if not found.stretches:
        return "Up and down are alike within their scatter: no hysteresis seen at this pace."
    spans = ", ".join(f"{a:.0f} to {b:.0f} rpm (shaft {a / ratio:.0f} to {b / ratio:.0f})" for a, b in found.stretches)
    return f"Up and down differ: {spans}. A slower ramp tells whether the cage only lags behind."
