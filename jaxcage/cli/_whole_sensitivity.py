"""What a cage's parameters do to a measure of a whole bearing: `jaxcage sensitivity nu2310`."""

import math
from functools import partial

import numpy as np

from .. import report
from .._errors import InputError
from .._parameters import parameters
from ..design import (
    BEARING_MEASURES,
    DIRECTIONS,
    BearingGradient,
    BearingRuns,
    bearing_budget,
    bearing_gradient,
    bearing_measure,
    bearing_sensitivity,
)
from ..models import BearingModel
from ..plotting import statistic_bars
from ._job import Job
from ._options import SensitivityOptions
from ._show import Report
from ._vary import read_cage_bounds
from ._whole import at_shaft_speed


AROUND, STARTS = 64, 2
"""Designs around the given one for the tolerance budget, and starts of each."""
NARROWEST, WIDEST = 0.05, 0.3
"""How far they are moved, relatively, where tolerances are narrower or wider: slopes over less drown in the scatter."""


def bearing_shares(job: Job[SensitivityOptions], whole: BearingModel) -> Report:
    """Carry out `jaxcage sensitivity` of a whole bearing."""
    options, filled = job.options, vars(job.options)
    at = at_shaft_speed(job, whole)
    model, of = at.model, filled["of"]
    if of not in BEARING_MEASURES:
        raise InputError(f"Option --of must be one of {', '.join(BEARING_MEASURES)}, but '{of}' was given.")
    vary = read_cage_bounds(options.vary, model)
    relative = options.tolerance / 100
    found: BearingGradient | None = None
    with job.computing() as say:
        runs = BearingRuns(
            at.speed,
            starts=filled["ensemble"],
            progress=partial(say, "Sobol designs"),
            **job.given("discard revolutions seed"),
        )
        shares, scatter = bearing_sensitivity(model, vary, runs, of, **job.given("samples seed"))
        if not options.quick:
            known = parameters(model)
            found = bearing_gradient(
                model,
                at.speed,
                directions=[d for d in DIRECTIONS if all(float(known[name]) for name in d.split("+"))],
                statistics=bearing_measure(of),
                designs=AROUND,
                starts=STARTS,
                spread=float(np.clip(relative, NARROWEST, WIDEST)),
                progress=partial(say, "tolerances"),
                **job.given("discard revolutions seed"),
            )
    title = at.title(job.name)
    budgets = [] if found is None else [bearing_budget(found, of, relative / math.sqrt(3))]
    job.files["figure"] = None
    if found is not None:
        job.figure(statistic_bars(found, f"{title}: elasticities"), detail=at.ending)
    document = {
        **at.document,
        "of": of,
        "vary": vary,
        "sobol": report.sobol_document(shares) | {"scatter": scatter},
        "tolerance_percent": options.tolerance,
        "measures": [
            {
                **report.chosen(b, "measure unit value"),
                "deviation": b.total,
                "by_parameter": b.deviation,
                "by_parameter_error": b.error,
                "elasticity": b.elasticity,
            }
            for b in budgets
        ],
    }
    tables = [
        report.sobol_table(title, shares, of.replace("_", " ")),
        *(report.bearing_budget_table(b, options.tolerance) for b in budgets),
    ]
    notes = [
        f"Means over {runs.starts} drawn starts, the same for every design; scatter of the motion itself is "
        f"{100 * scatter:.0f} % of the variance, belongs to no parameter, and is in the shares with interactions.",
        *([shares.warning] if shares.warning else []),
        *(f"Within twice the error, no effect: {', '.join(b.unclear)}" for b in budgets if b.unclear),
    ]
    return Report(document, tables, notes)
