"""A whole bearing run up and down again: slip, eccentricity, whirl and power both ways."""

import dataclasses

from .._errors import NoResult
from ..models import BearingModel
from ..plotting import bearing_ramp_figure
from ..report import Table, number
from ..sweeps import BearingUpDown, bearing_up_down, rpm
from ._job import Job
from ._options import RunUpOptions
from ._show import Report
from ._whole import loaded, shaft_speeds


STARTS = 3


def bearing_runup(job: Job[RunUpOptions], model: BearingModel) -> Report:
    """Carry out `jaxcage runup` of a whole bearing."""
    options = job.options
    model = loaded(model, options.load)
    speeds = shaft_speeds(job, model, 2)
    rate = float(rpm(options.rate))
    with job.computing():
        found = bearing_up_down(
            model,
            float(speeds[0]),
            float(speeds[-1]),
            rate,
            steps=options.windows or 2,
            settle=options.discard or 0,
            starts=STARTS,
            **job.given("tolerance"),
        )
    if found.up.failed.all() and found.down.failed.all():
        raise NoResult("All steps of the ramp failed.")
    title = f"{job.name}: run-up and run-down, {options.rate:g} rpm/s of the shaft, {float(model.load):g} N"
    job.figure(bearing_ramp_figure(found, title))
    ways = {way: dataclasses.asdict(getattr(found, way)) for way in ("up", "down")}
    columns = {f"{name} {way}": x for way, fields in ways.items() for name, x in fields.items()}
    job.columns({"shaft speed [rpm]": found.rpm, **columns, "differs": found.apart})
    document = {
        "load_N": float(model.load),
        "rate_rpm_per_s": options.rate,
        "starts": STARTS,
        "shaft_speed_rpm": found.rpm,
        **ways,
        "hysteresis_rpm": found.stretches,
    }
    return Report(document, [_table(title, found)], [_note(found)])


def _table(title: str, found: BearingUpDown) -> Table:
    slip = lambda way, i: f"{100 * way.cage_slip[i]:.2f} ± {100 * way.cage_slip_error[i]:.2f}"
    ways = found.up, found.down
    rows = [
        (
            f"{found.rpm[i]:.0f}",
            *(slip(way, i) for way in ways),
            *(number(way.eccentricity[i], 3) for way in ways),
            *(number(way.friction_power_W[i], 1) for way in ways),
            "differs" if found.apart[i] else "",
        )
        for i in range(found.rpm.size)
    ]
    heads = ("slip up [%]", "slip down [%]", "eps up", "eps down", "lost up [W]", "lost down [W]", "hysteresis")
    return Table(title, ("shaft [rpm]", *heads), rows)


def _note(found: BearingUpDown) -> str:
    if not found.stretches:
        return "Up and down slip alike within three standard errors: no hysteresis seen at this pace."
    spans = ", ".join(f"{a:.0f} to {b:.0f} rpm" for a, b in found.stretches)
    return f"Up and down slip differently: {spans} of the shaft. A slower ramp tells whether the cage only lags behind."
