"""Two whole bearings beside each other over the shaft's speed: `jaxcage compare nu2310 mine.toml`."""

import dataclasses
from functools import partial

import numpy as np

from .. import report
from .._errors import NoResult
from ..analysis import BearingSweep, bearing_zones
from ..models import BearingModel
from ..plotting import bearings_beside
from ..sweeps import sweep_bearing
from ._job import Job, blocks_of, whole_subject
from ._options import CompareOptions
from ._show import Report
from ._whole import require_land_speed, shaft_speeds
from ._whole_sweep import zones_table


STARTS = 3
MEASURES = {
    "cage_slip": ("slip [%]", 100.0, 2),
    "pocket_impulse_N_s": ("pocket impulse [N s]", 1.0, 3),
    "land_impulse_N_s": ("land impulse [N s]", 1.0, 3),
    "pocket_wear_mm3_per_h": ("pocket wear [mm^3/h]", 1.0, 0),
    "friction_power_W": ("power lost [W]", 1.0, 1),
    "exponent": ("exponent", 1.0, 2),
}
"""Means: their heads, factor, digits."""
SURE = 2.0
"""Standard errors by which two means must differ."""


def bearings_compared(job: Job[CompareOptions], model: BearingModel) -> Report:
    """Carry out `jaxcage compare` of whole bearings."""
    options = job.options
    second, other = whole_subject(options.other)
    names = [job.name, second if second != job.name else f"{second}_second"]
    speeds = shaft_speeds(job, model, options.count or 2)
    require_land_speed(other, float(speeds[-1]) * 30 / np.pi, "--last")
    with job.computing() as say:
        found = [
            sweep_bearing(
                each,
                speeds,
                starts=STARTS,
                **job.given("discard revolutions tolerance"),
                blocks=blocks_of(options.revolutions),
                progress=partial(say, name),
            )
            for name, each in zip(names, (model, other), strict=True)
        ]
    for name, each in zip(names, found, strict=True):
        if each.failed.all():
            raise NoResult(f"All lanes of {name} failed ({', '.join(np.unique(each.outcome))}).")
    figure = bearings_beside(names, found)
    job.figure(figure, detail=f"_{names[1]}")
    changed = report.differences([model, other])
    zones = [bearing_zones(each) for each in found]
    document = {
        "cases": names,
        "shaft_speed_rpm": found[0].rpm,
        "differences": {path: {"values": cells[:2], "unit": cells[2]} for path, (_, *cells, _) in changed.items()},
        "designs": {
            name: {measure: _mean(each, measure)[0] for measure in MEASURES}
            | {f"{measure}_error": _mean(each, measure)[1] for measure in MEASURES}
            | {"zones": [dataclasses.asdict(zone) for zone in of_it]}
            for name, each, of_it in zip(names, found, zones, strict=True)
        },
    }
    tables = [
        report.differences_table(names, [model, other]),
        *(_table(measure, names, found) for measure in MEASURES),
        *(zones_table(name, of_it) for name, of_it in zip(names, zones, strict=True)),
    ]
    return Report(document, tables, ["Means over starts, with standard errors; * where both differ by more than two."])


def _mean(found: BearingSweep, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Mean over starts and blocks at each speed, and its standard error; NaN where all lanes failed."""
    pairs = []
    for blocks in found.block_means[name]:
        known = blocks[np.isfinite(blocks)]
        pairs.append((known.mean(), known.std(ddof=1) / np.sqrt(known.size)) if known.size > 1 else (np.nan, np.nan))
    return np.array(pairs)[:, 0], np.array(pairs)[:, 1]


def _table(name: str, cases: list[str], found: list[BearingSweep]) -> report.Table:
    """One mean at every speed, side by side."""
    head, factor, digits = MEASURES[name]
    (a, a_error), (b, b_error) = (_mean(each, name) for each in found)
    cell = lambda x, e: f"{factor * x:.{digits}f} ± {factor * e:.{digits}f}"
    rows = [
        (
            f"{rpm:.0f}",
            cell(a[i], a_error[i]),
            cell(b[i], b_error[i]),
            "*" if abs(a[i] - b[i]) > SURE * np.hypot(a_error[i], b_error[i]) else "",
        )
        for i, rpm in enumerate(found[0].rpm)
    ]
    return report.Table(head[0].upper() + head[1:], ("shaft [rpm]", *cases, "differs"), rows)
