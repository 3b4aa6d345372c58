"""A better cage for a whole bearing: `jaxcage design nu2310`."""

import dataclasses

import numpy as np

from .. import report
from .._errors import InputError
from ..bearing import design_rule_violations
from ..design import OBJECTIVE, TERMS, BearingRuns, bearing_objective, before_and_after, surrogate_search
from ..models import BearingModel
from ..plotting import bearing_design_figure
from ._job import Job
from ._options import DesignOptions
from ._search import kept_search, no_worse_balance
from ._show import Report
from ._vary import read_cage_bounds
from ._whole import at_shaft_speed


def design_bearing(job: Job[DesignOptions], whole: BearingModel) -> Report:
    """Carry out `jaxcage design` of a whole bearing."""
    options = job.options
    at = at_shaft_speed(job, whole)
    model = at.model
    vary = read_cage_bounds(options.vary, model)
    balance = None if options.worse_balance else no_worse_balance(model, vary)
    prices = job.given(" ".join(TERMS))
    if not sum(prices.values()):
        raise InputError(f"Options {', '.join(f'--{name}' for name in TERMS)} must not all be 0.")
    filled = vars(options)
    runs = BearingRuns(at.speed, starts=filled["ensemble"], **job.given("discard revolutions seed"))
    fresh = runs.fresh()
    kept = kept_search(job)
    with job.computing(advice="the same command goes on where the search stopped") as say:
        objective = bearing_objective(model, vary, runs, prices)
        found = surrogate_search(
            model,
            vary,
            objective,
            batches=filled["steps"],
            keep=kept,
            report=lambda step, _: say("search", step, filled["steps"]),
            **job.given("starts scouts batch seed"),
        )
        searched = job.seconds
        say("check", 0, 1)
        best = found.best.model
        rows, failed = before_and_after(model, best, fresh, objective.weights)
    title = at.title(job.name)
    job.figure(bearing_design_figure(found, rows, title), detail=at.ending)
    kept.unlink(missing_ok=True)
    document = {
        **at.document,
        "vary": vary,
        "prices": prices,
        **report.chosen(found.best, "objective at_bound status"),
        "optimum": found.best.values,
        "optima": [report.chosen(o, "values objective at_bound") | {"starts": n} for o, n in found.distinct],
        "before_and_after": {row.name: dataclasses.asdict(row) | {"known": row.known} for row in rows},
        "check": report.chosen(fresh, "starts discard revolutions tolerance seed") | {"failed": failed},
        "designs_run": filled["batch"] * sum(len(o.history) for o in found.optima) + options.scouts + 1,
        "search_seconds": round(searched, 1),
    }
    tables = [
        report.changed_parameters_table(title, model, found, vary),
        report.before_and_after_table(rows, fresh.revolutions // 2),
    ]
    whole_objective = next(row for row in rows if row.name == OBJECTIVE)
    better = document["better"] = whole_objective.known and whole_objective.change < 0
    broken = design_rule_violations(best.bearing, best.guidance_gap)
    notes = [
        *(
            []
            if better
            else ["No design was found that is better by more than twice the error: keep the one you have."]
        ),
        f"Search: {found.best.status}, {len(found.best.history)} steps, objective {found.best.objective:.3f} "
        f"of what it was, {document['designs_run']} designs in {searched:.0f} s",
        f"At a bound: {', '.join(found.best.at_bound)}." if found.best.at_bound else "No parameter ended at a bound.",
        f"Before and after: {fresh.starts} other starts, the same for both, a tenth of the tolerance, "
        f"{fresh.discard} revolutions left out, {fresh.revolutions} observed; failed lanes: {failed}",
        *([] if design_rule_violations(model.bearing, model.guidance_gap) else broken),
        *([balance] if balance else []),
    ]
    unclear = [row.name for row in rows if not row.known and np.any(row.before)]
    if unclear:
        notes.append(f"Within twice the error, no change: {', '.join(unclear)}")
    return Report(document, tables, notes)
