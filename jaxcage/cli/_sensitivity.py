"""`jaxcage sensitivity`: shares of the chaotic width's variance, elasticities and tolerance budgets of the edges."""

import math
import time
from typing import Any

from ..design import SobolIndices, ToleranceBudget, chaotic_width, global_sensitivity, tolerance_budget
from ..orbits import sensitivities
from ..plotting import elasticity_bars, new_figure
from ._console import progress_in_stages
from ._design import VARY
from ._errors import UsageError, refusing, require_at_least, require_range
from ._inputs import output_folder, save_figure, subject
from ._loss import loss_zones_between
from ._options import SensitivityOptions
from ._report import Report, Table
from ._vary import read_bounds


MOST = 8
"""Parameters listed in a budget."""


def run(options: SensitivityOptions) -> Report:
    """Carry out `jaxcage sensitivity`."""
    require_range(options.first, options.last)
    require_at_least("--speeds", options.speeds, 4)
    if not 0 < options.tolerance < 100:
        raise UsageError(f"Option --tolerance must lie between 0 and 100 percent, but {options.tolerance:g} was given.")
    require_at_least("--seed", options.seed, 0)
    require_at_least("--samples", options.samples, 2)
    if options.samples & (options.samples - 1):
        raise UsageError(f"Option --samples must be a power of 2, but {options.samples} was given.")
    about = subject(options)
    vary = read_bounds(options.vary or VARY, about.model)
    folder = output_folder(options)
    began = time.perf_counter()
    edges, budgets, figure = {}, [], None
    with progress_in_stages(f"sensitivity of {about.name}") as bar:
        say = bar or (lambda what, done, of: None)
        say("Sobol designs", 0, 1)
        with refusing():
            width = chaotic_width(options.first, options.last, options.speeds)
            shares = global_sensitivity(about.model, vary, width, samples=options.samples, seed=options.seed)
        if not options.quick:
            loss = loss_zones_between(about.model, options.first, options.last, say)
            say("gradients", 0, 1)
            edges = {n: s for n, s in sensitivities(about.model, loss.edges).items() if s.trusted}
            relative = options.tolerance / 100 / math.sqrt(3)
            budgets = [tolerance_budget(s, dict.fromkeys(s.elasticity, relative)) for s in edges.values()]
    if edges:
        drawn = new_figure(9.0, 2.2 + 1.2 * len(edges))
        elasticity_bars(list(edges.values()), drawn.subplots())
        figure = save_figure(drawn, folder / f"sensitivity_{about.name}.png")
    document = {
        "case": about.name,
        "vary": vary,
        "sobol": {"first": shares.first, "total": shares.total, "designs": shares.evaluations}
        | {"first_interval": shares.first_interval, "total_interval": shares.total_interval},
        "tolerance_percent": options.tolerance,
        "edges": [_budget_document(b, edges[b.edge].elasticity) for b in budgets],
        "seconds": round(time.perf_counter() - began, 1),
        "figure": figure,
    }
    tables = [_sobol_table(about.name, shares), *(_budget_table(b, options.tolerance) for b in budgets)]
    notes = [f"Time: {document['seconds']:.1f} s", *([f"Figure: {figure}"] if figure else [])]
    return Report(document, tables, notes)


def _sobol_table(name: str, shares: SobolIndices) -> Table:
    cell = lambda value, pair: f"{value:+.2f} ({pair[0]:+.2f} to {pair[1]:+.2f})"
    rows = [
        (n, cell(shares.first[n], shares.first_interval[n]), cell(shares.total[n], shares.total_interval[n]))
        for n in sorted(shares.total, key=lambda n: -shares.total[n])
    ]
    title = f"Chaotic speeds of {name}: shares of the variance over {shares.evaluations} designs (95 % interval)"
    return Table(title, ("parameter", "alone", "with interactions"), rows)


def _budget_document(budget: ToleranceBudget, elasticity: dict[str, float]) -> dict[str, Any]:
    return {
        "edge": budget.edge,
        "speed_rpm": budget.speed_rpm,
        "deviation_rpm": budget.total_rpm,
        "by_parameter_rpm": budget.deviation_rpm,
        "elasticity": elasticity,
    }


def _budget_table(budget: ToleranceBudget, tolerance: float) -> Table:
    order = sorted(budget.deviation_rpm.items(), key=lambda item: -item[1])[:MOST]
    rows = [(n, f"{d:.3g}", f"{100 * (d / budget.total_rpm) ** 2:.0f} %") for n, d in order]
    title = (
        f"{budget.edge.capitalize()} at {budget.speed_rpm:.1f} rpm under +-{tolerance:g} % of everything: "
        f"standard deviation {budget.total_rpm:.3g} rpm"
    )
    return Table(title, ("parameter", "rpm", "share of variance"), rows)
