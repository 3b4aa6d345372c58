"""How slip, impulses, wear and power of a whole bearing answer to its parameters: `jaxcage gradient nu2310`."""

from functools import partial

import numpy as np

from .. import report
from ..design import DIRECTIONS, STATISTICS, bearing_gradient
from ..models import BearingModel
from ..plotting import statistic_bars
from ._job import Job
from ._options import GradientOptions
from ._show import Report
from ._whole import at_shaft_speed


def bearing_gradients(job: Job[GradientOptions], model: BearingModel) -> Report:
    """Carry out `jaxcage gradient` of a whole bearing."""
    options = job.options
    at = at_shaft_speed(job, model)
    given = job.given("designs spread starts discard revolutions seed tolerance")
    with job.computing("designs") as say:
        found = bearing_gradient(
            at.model,
            at.speed,
            directions=options.by or DIRECTIONS,
            statistics=(*STATISTICS, "exponent") if options.chaos else STATISTICS,
            progress=partial(say, ""),
            **given,
        )
    title = f"{at.title(job.name)}: elasticities"
    job.figure(statistic_bars(found, title), detail=at.ending)
    document = {**at.document, **report.bearing_gradient_document(found)}
    notes = [
        "Elasticity: relative change of a mean by that of a parameter, with its standard error; "
        f"{found.pairs} pairs of designs within ±{100 * found.spread:g} %, {found.starts} starts, "
        f"{found.discard} revolutions left out, {found.revolutions} observed.",
        f"Left out, as they failed: {found.failed} designs; inaccurate lanes: {found.inaccurate}",
    ]
    drifting = [name for name, each in found.statistics.items() if not each.settled]
    if drifting:
        notes.append(f"Not settled, so that more --discard may change it: {', '.join(drifting)}")
    absent = [name for name, each in found.statistics.items() if not np.any(each.value)]
    if absent:
        notes.append(f"Zero in every run: {', '.join(absent)}")
    return Report(document, [report.bearing_gradient_table(title, found)], notes)
