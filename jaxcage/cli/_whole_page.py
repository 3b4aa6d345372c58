"""`jaxcage report` of a whole bearing: one page with drawing, slips, forces, wear, spectra, the sweep and gradients."""

import shlex
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__, report
from .._errors import InputError
from ..analysis import BearingSweep, BearingZone, bearing_zones
from ..bearing import design_rule_violations
from ..design import BearingGradient, bearing_gradient
from ..io import SpeedOf
from ..models import BearingModel
from ..plotting import bearing_sweep_figure, statistic_bars
from ..sweeps import rpm
from ._console import visible
from ._job import Job
from ._options import ReportOptions
from ._show import Report
from ._whole import AtShaftSpeed, Examined, examined, shaft_rpm_of, shaft_speeds
from ._whole_sweep import sweep_table, swept, zones_table


SPEEDS, QUICK_SPEEDS = 13, 5
REVOLUTIONS, DISCARD = 20, 5
"""Of the one speed that is looked at closely."""


def command_line(options: ReportOptions) -> str:
    """The command line as a shell takes it, without folders."""
    parts = ["jaxcage", "report", Path(options.case).name]
    parts += ["--operating", options.operating] if options.operating else []
    return visible(shlex.join([*parts, *(["--quick"] if options.quick else [])]))


def bearing_report(job: Job[ReportOptions], model: BearingModel) -> Report:
    """Carry out `jaxcage report` of a whole bearing."""
    options = job.options
    speeds = shaft_speeds(job, model, options.count or (QUICK_SPEEDS if options.quick else SPEEDS))
    at = _operating(job, model) or [float(np.median(speeds)) * 30 / np.pi]
    found = swept(job, model, speeds)
    with job.computing() as say:
        close = examined(job.name, AtShaftSpeed(model, at[0]), REVOLUTIONS, DISCARD, options.tolerance)
        slopes = None if options.quick else bearing_gradient(model, float(rpm(at[0])), progress=partial(say, "designs"))
    zones = bearing_zones(found)
    sections = _sections(job.name, model, found, zones, close, slopes, at)
    load = f"{float(model.load):g} N"
    subtitle = f"Cylindrical roller bearing under {load}, {found.rpm[0]:.0f} to {found.rpm[-1]:.0f} rpm of the shaft"
    subtitle += ", quick report: no gradients, a coarser sweep" if options.quick else ""
    html = report.bearing_page(
        f"{job.name}: slip, forces and wear of the whole bearing",
        subtitle,
        sections,
        __version__,
        command_line(options),
    )
    job.text(html, job.path(".html"), "report")
    document: dict[str, Any] = {
        "load_N": float(model.load),
        "quick": options.quick,
        "operating_shaft_rpm": at,
        "zones": [vars(zone) for zone in zones],
        "failed": int(found.failed.sum()),
        "bytes": len(html.encode()),
        "measures": vars(close.measures),
        "gradient": None if slopes is None else report.bearing_gradient_document(slopes),
    }
    notes = [f"Failed lanes: {document['failed']}", f"Size: {document['bytes'] / 1e6:.1f} MB"]
    return Report(document, [zones_table(job.name, zones), close.tables[0]], notes)


def _operating(job: Job[ReportOptions], model: BearingModel) -> list[float]:
    """Shaft speeds to look at [rpm], of a range its middle.

    **Raises:** `InputError` for a text without a speed.
    """
    options, ratio = job.options, float(model.rolling_cage_speed(1.0) - model.rolling_cage_speed(0.0))
    at_rest = float(model.rolling_cage_speed(0.0)) * 30 / np.pi  # where the outer ring turns
    read = report.read_operating(options.operating, ratio, job.speeds, at_rest)
    if options.operating and not read:
        raise InputError(f"Option --operating must hold a speed, but '{options.operating}' was given.")
    middle = [SpeedOf((one.low_rpm + one.high_rpm) / 2, "cage") for one in read]
    return [shaft_rpm_of(model, one, job.speeds, "--operating") for one in middle]


def _sections(
    name: str,
    model: BearingModel,
    found: BearingSweep,
    zones: tuple[BearingZone, ...],
    close: Examined,
    slopes: BearingGradient | None,
    at: list[float],
) -> list[report.Section]:
    """The page's parts."""
    m, where = close.measures, f"{at[0]:.0f} rpm"
    length = f"{found.discard} revolutions of the cage left out, {found.revolutions} observed, from several starts"
    key = [
        ("cage slip", f"{100 * m.cage_slip:.2f} %"),
        ("largest pocket force", f"{m.pocket_force_max_N:.0f} N"),
        ("power lost", f"{m.friction_power_W:.0f} W"),
        ("pocket wear", f"{m.pocket_wear_mm3_per_h:.3g} mm³/h"),
        ("state of the cage", m.state.replace("_", " ")),
    ]
    sections = [
        report.Section("result", f"In short, at {where} of the shaft", _summary(found, zones, at), key),
        report.Section(
            "speed",
            "Over the shaft's speed",
            [f"A sweep, {length}. Bars are standard errors. A zone is a stretch of speeds with one state of the cage."],
            figures={
                "sweep": (bearing_sweep_figure(found, "", zones), "Slip, forces, power, exponent over the speed.")
            },
            tables=[zones_table(name, zones), sweep_table("Means over starts", found)],
        ),
        report.Section(
            "close",
            f"At {where}",
            [
                f"One run of {close.revolutions} revolutions of the cage from one start. Its error between samples "
                f"is at most {close.run.error:.0e} of the state's scale ({close.run.outcome}).",
                "Wear is that of dry brass on steel unless the file says otherwise: compare designs by it.",
            ],
            figures={
                "bearing": (
                    close.figure,
                    "The bearing to scale when a pocket is pushed hardest; path of the cage's centre; slip and pocket "
                    "forces around the bearing; forces over time; spectra with the bearing's frequencies.",
                )
            },
            tables=close.tables,
        ),
    ]
    if slopes is not None:
        title = f"Elasticities at {where}"
        sections.append(
            report.Section(
                "gradients",
                "What moves slip, forces and wear",
                [
                    f"Relative change of each mean by that of a parameter, from {slopes.pairs} pairs of designs within "
                    f"±{100 * slopes.spread:g} %. Bars are two standard errors."
                ],
                figures={"elasticities": (statistic_bars(slopes), "Elasticities of the means with their errors.")},
                tables=[report.bearing_gradient_table(title, slopes)],
            )
        )
    warnings = [*design_rule_violations(model.bearing, model.guidance_gap), *model.lubricant.doubts()]
    return [
        *sections,
        report.Section("design", "The design", warnings, tables=[report.bearing_parameters_table(model)]),
    ]


def _summary(found: BearingSweep, zones: tuple[BearingZone, ...], at: list[float]) -> list[str]:
    """What matters, in sentences."""
    said = []
    for speed in at:
        within = [zone for zone in zones if zone.low_rpm <= speed <= zone.high_rpm]
        if not within:
            said.append(f"{speed:.0f} rpm lies outside the sweep.")
        for zone in within[:1]:
            state = " or ".join(zone.states).replace("_", " ")
            said.append(
                f"At {speed:.0f} rpm of the shaft the cage's motion is {state} "
                f"({zone.low_rpm:.0f} to {zone.high_rpm:.0f} rpm)."
            )
    chaotic = sum(zone.speeds for zone in zones if zone.chaotic)
    said.append(f"The largest exponent is positive beyond doubt at {chaotic} of {found.speed.size} speeds.")
    if found.failed.any():
        said.append(f"{int(found.failed.sum())} of {found.failed.size} simulations failed: nothing is known of them.")
    return said
