"""Designs with fewer chaotic speeds, what that costs, and what each parameter and its tolerance does."""

import concurrent.futures
import dataclasses
import hashlib
import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._parameters import parameter_info, parameters
from ..analysis import Sweep, zones
from ..design import (
    AbstractObjective,
    Optimised,
    Robust,
    SobolIndices,
    ToleranceBudget,
    chaotic_width,
    cost,
    global_sensitivity,
    optimise,
    tolerance_budget,
)
from ..models import CageModel
from ..orbits import LossZones, loss_zones, sensitivities, synchronous_orbits
from ..plotting import design_figure, elasticity_bars, new_figure
from ..report import Table, number
from ..sweeps import rpm, sweep
from ._console import Say
from ._job import Job
from ._options import SETTLED, DesignOptions, SensitivityOptions, VaryOptions
from ._show import Report, chosen
from ._vary import read_bounds, read_scatter


VARY = ("guidance_gap=0.3mm:0.6mm", "eccentricity=5um:60um")
CHECKED_SPEEDS = 118
"""Every 200 rpm of the usual range."""
MOST = 8
"""Parameters listed in a budget."""


def _loss_zones(model: CageModel, options: VaryOptions, say: Say) -> LossZones:
    first, last = rpm(options.first), rpm(options.last)
    return loss_zones(synchronous_orbits(model, first, last, discard=SETTLED, progress=say))


def design(job: Job[DesignOptions]) -> Report:
    """`jaxcage design`: fewer chaotic speeds by changing the design, and what that costs."""
    options = job.options
    vary = read_bounds(options.vary or VARY, job.model)
    scatter = read_scatter(options.scatter, list(vary))
    width: AbstractObjective = chaotic_width(
        options.first, options.last, options.speeds, cloud=options.cloud, spread=options.spread, seed=options.seed
    )
    if scatter:
        width = Robust(width, scatter, worst=options.worst, seed=options.seed)
    kept = _kept_search(job)
    with job.computing(advice="the same command goes on where the search stopped") as say:
        found = optimise(
            job.model,
            vary,
            width + options.cost * cost() if options.cost else width,
            starts=options.starts,
            scouts=options.scouts,
            steps=options.steps,
            seed=options.seed,
            keep=kept,
            report=lambda step, _: say("search", step, options.steps),
        )
        searched = job.seconds
        models = {"before": job.model, "after": found.best.model}
        say("fresh sweeps", 0, 1)
        checked = {name: _check(model, options) for name, model in models.items()}
        loss: dict[str, LossZones] = {}
        if not options.quick:
            search = lambda model: _loss_zones(model, options, say)
            with concurrent.futures.ThreadPoolExecutor() as pool:  # a search keeps one core busy
                loss = dict(zip(models, pool.map(search, models.values()), strict=True))
    job.figure(design_figure(found, checked["before"], checked["after"]))
    kept.unlink(missing_ok=True)
    chaotic = {name: zones(swept) for name, swept in checked.items()}
    document = {
        "vary": vary,
        **chosen(found.best, "objective error at_bound status"),
        "optimum": found.best.values,
        "optima": [chosen(o, "values objective error at_bound") | {"starts": n} for o, n in found.distinct],
        "designs_swept": _swept(found, options, width),
        "cost": {name: float(cost().function(model)) for name, model in models.items()},
        "chaotic_rpm": {name: _chaotic_rpm(swept) for name, swept in checked.items()},
        "chaotic_zones": {name: [_ends(z) for z in z_.zones] for name, z_ in chaotic.items()},
        "synchronous_loss_zones": {name: [_ends(z) for z in z_.zones] for name, z_ in loss.items()},
        "search_seconds": round(searched, 1),
    }
    tables = [_parameters_table(job.name, job.model, found, document), _optima_table(found), *_zone_tables(document)]
    return Report(document, tables, _notes(document, found))


def _kept_search(job: Job[DesignOptions]) -> Path:
    """File of the search until the command is through; another search has another file."""
    asked = dataclasses.replace(job.options, json=False, out="", style="light", no_cache=False, quick=False)
    return job.folder / f".design_{job.name}_{hashlib.sha256(repr(asked).encode()).hexdigest()[:12]}.npz"


def _check(model: CageModel, options: DesignOptions) -> Sweep:
    """A sweep with starts that the search did not use, its labels confirmed."""
    rng, c = np.random.default_rng(options.seed + 1), float(model.clearance)
    half = model.dimension // 2
    size = np.array([c] * half + [0.3 * c * rpm(options.first)] * half)
    starts = [tuple(float(v) for v in 0.6 * size * rng.uniform(-1, 1, size.size)) for _ in range(3)]
    speeds = rpm(options.first, options.last, CHECKED_SPEEDS)
    return sweep(model, speeds, starts=starts, discard=300, revolutions=200)


def _chaotic_rpm(found: Sweep) -> float:
    """Speeds at which any start is chaotic, for a while at least, times their spacing [rpm]."""
    return float(np.mean(found.restless) * (found.rpm[-1] - found.rpm[0]))


def _swept(found: Optimised, options: DesignOptions, width: AbstractObjective) -> int:
    """Designs whose speeds were swept in the search."""
    draws = width.draws if isinstance(width, Robust) else 1
    clouds = options.cloud * sum(len(o.history) for o in found.optima)
    return (clouds + (options.scouts if options.starts > 1 else 0)) * draws


def _ends(zone: Any) -> dict[str, Any]:
    edge = lambda e: None if e is None else e.speed_rpm
    return {"onset_rpm": edge(zone.onset), "exit_rpm": edge(zone.exit), "width_rpm": zone.width_rpm}


def _parameters_table(name: str, model: CageModel, found: Optimised, document: Mapping[str, Any]) -> Table:
    info, bounds, before = parameter_info(model), document["vary"], parameters(model)
    rows = [
        (n, info[n].unit, f"{float(before[n]):.4g}", f"{value:.4g}", " to ".join(f"{b:.4g}" for b in bounds[n]))
        for n, value in found.best.values.items()
    ]
    for what, unit, form in (("cost", "", ".3f"), ("chaotic_rpm", "rpm", ".0f")):
        then, now = (format(value, form) for value in document[what].values())
        rows.append((what.removesuffix("_rpm"), unit, then, now, ""))
    return Table(f"Design of {name}", ("parameter", "unit", "before", "after", "bounds"), rows)


def _optima_table(found: Optimised) -> Table:
    names = list(found.best.values)
    rows = [
        (
            *(f"{o.values[n]:.4g}" for n in names),
            f"{o.objective:.0f} ± {o.error:.0f}",
            str(count),
            ", ".join(o.at_bound) or "none",
        )
        for o, count in found.distinct
    ]
    return Table("Optima", (*names, "objective [rpm]", "starts", "at a bound"), rows)


def _zone_tables(document: Mapping[str, Any]) -> list[Table]:
    tables = []
    for kind in ("chaotic", "synchronous_loss"):
        found = document[f"{kind}_zones"]
        rows = [
            (when, str(i), *map(number, zone.values()))
            for when, listed in found.items()
            for i, zone in enumerate(listed, start=1)
        ]
        if found:
            title = f"{kind.replace('_', '-').capitalize()} zones before and after [rpm]"
            tables.append(Table(title, ("design", "zone", "onset", "exit", "width"), rows))
    return tables


def _notes(document: Mapping[str, Any], found: Optimised) -> list[str]:
    best = found.best
    return [
        f"Search: {best.status}, {len(best.history)} steps, {document['designs_swept']} designs swept in "
        f"{document['search_seconds']:.0f} s",
        f"At a bound: {', '.join(best.at_bound)}." if best.at_bound else "No parameter ended at a bound.",
        "Zones: a fresh sweep with other starts and finer steps; edges by a search of the synchronous orbits",
    ]


def sensitivity(job: Job[SensitivityOptions]) -> Report:
    """`jaxcage sensitivity`: shares of the chaotic width's variance, and tolerance budgets of the edges."""
    options = job.options
    vary = read_bounds(options.vary or VARY, job.model)
    width = chaotic_width(options.first, options.last, options.speeds)
    edges, budgets = {}, []
    with job.computing() as say:
        say("Sobol designs", 0, 1)
        shares = global_sensitivity(job.model, vary, width, samples=options.samples, seed=options.seed)
        if not options.quick:
            loss = _loss_zones(job.model, options, say)
            say("gradients", 0, 1)
            edges = {n: s for n, s in sensitivities(job.model, loss.edges).items() if s.trusted}
            relative = options.tolerance / 100 / math.sqrt(3)
            budgets = [tolerance_budget(s, dict.fromkeys(s.elasticity, relative)) for s in edges.values()]
    job.files["figure"] = None
    if edges:
        drawn = new_figure(9.0, 2.2 + 1.2 * len(edges))
        elasticity_bars(list(edges.values()), drawn.subplots())
        job.figure(drawn)
    document = {
        "vary": vary,
        "sobol": chosen(shares, "first total first_interval total_interval") | {"designs": shares.evaluations},
        "tolerance_percent": options.tolerance,
        "edges": [
            {
                **chosen(b, "edge speed_rpm"),
                "deviation_rpm": b.total_rpm,
                "by_parameter_rpm": b.deviation_rpm,
                "elasticity": edges[b.edge].elasticity,
            }
            for b in budgets
        ],
    }
    return Report(document, [_sobol_table(job.name, shares), *(_budget_table(b, options.tolerance) for b in budgets)])


def _sobol_table(name: str, shares: SobolIndices) -> Table:
    cell = lambda value, pair: f"{value:+.2f} ({pair[0]:+.2f} to {pair[1]:+.2f})"
    rows = [
        (n, cell(shares.first[n], shares.first_interval[n]), cell(shares.total[n], shares.total_interval[n]))
        for n in sorted(shares.total, key=lambda n: -shares.total[n])
    ]
    title = f"Chaotic speeds of {name}: shares of the variance over {shares.evaluations} designs (95 % interval)"
    return Table(title, ("parameter", "alone", "with interactions"), rows)


def _budget_table(budget: ToleranceBudget, tolerance: float) -> Table:
    order = sorted(budget.deviation_rpm.items(), key=lambda item: -item[1])
    share = lambda d: f"{100 * (d / budget.total_rpm) ** 2:.0f} %"
    rows = [(n, f"{d:.3g}", share(d)) for n, d in itertools.islice(order, MOST)]
    title = (
        f"{budget.edge.capitalize()} at {budget.speed_rpm:.1f} rpm under +-{tolerance:g} % of everything: "
        f"standard deviation {budget.total_rpm:.3g} rpm"
    )
    return Table(title, ("parameter", "rpm", "share of variance"), rows)
