"""Designs with fewer chaotic speeds, what that costs, and what each parameter and its tolerance does."""

import concurrent.futures
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .. import report
from .._parameters import parameters
from ..analysis import Sweep, zones
from ..design import (
    UNCONFIRMED,
    AbstractObjective,
    ChaosMeasure,
    DesignSpace,
    LandMeasure,
    Optimised,
    Robust,
    Scatter,
    chaotic_width,
    cost,
    global_sensitivity,
    judged,
    land_loads,
    negligible_load,
    surrogate_search,
    tolerance_budget,
    unchanged,
)
from ..models import CageModel
from ..orbits import LossZones, loss_zones, sensitivities, synchronous_orbits
from ..plotting import design_figure, elasticity_bars
from ..solve import DEFAULT_ERROR, native
from ..sweeps import rpm, sweep
from ._console import Say
from ._job import Job
from ._options import DesignOptions, SensitivityOptions, VaryOptions
from ._search import kept_search, no_worse_balance
from ._show import Report
from ._vary import read_bounds, read_scatter


Found = TypeVar("Found")
USUAL = {"guidance_gap": (0.7, 1.4), "eccentricity": (0.2, 2.5)}
"""What is varied if nothing is said, and between which parts of what it is."""
LOADS = {
    "wear_load_N_m_per_s": "wear load",
    "peak_land_force_N": "peak land force",
    "film_drag_power_W": "film drag power",
}
"""What the land feels, by key of the document."""
CHECKED_SPEEDS = 118
"""Every 200 rpm of the usual range."""
FINER, STARTS = 2, 3
"""How many times as many speeds judge the designs that a search saw as its best, and from how many starts."""


def _usual(model: CageModel) -> list[str]:
    """`USUAL`, as --vary would have it."""
    now = {name: float(value) for name, value in parameters(model).items() if name in USUAL and float(value) > 0}
    return [f"{name}={USUAL[name][0] * value:.6g}:{USUAL[name][1] * value:.6g}" for name, value in now.items()]


def _loss_zones(model: CageModel, options: VaryOptions, say: Say) -> LossZones:
    first, last = rpm(options.first), rpm(options.last)
    return loss_zones(synchronous_orbits(model, first, last, progress=say))


def design(job: Job[DesignOptions]) -> Report:
    """`jaxcage design`: fewer chaotic speeds by changing the design, and what that costs."""
    options = job.options
    vary = read_bounds(options.vary or _usual(job.model), job.model)
    balance = None if options.worse_balance else no_worse_balance(job.model, vary)
    scatter = read_scatter(options.scatter, list(vary))
    width = chaotic_width(options.first, options.last, options.speeds)
    kept = kept_search(job)
    with job.computing(advice="the same command goes on where the search stopped") as say:
        seen = _searched(job, vary, _objective(job, width, vary, scatter), kept, say)
        say("finer look", 0, 1)
        found, itself = judged(seen, _objective(job, _finer(options), vary, scatter))
        searched = job.seconds
        differ = [job.model] if found.best.objective >= itself else [job.model, found.best.model]
        say("fresh sweeps", 0, 1)
        swept = [_check(model, options) for model in differ]
        loads = [_loads(*each) for each in zip(differ, swept, strict=True)]
        worth = [_worth(options, *each, loads[0]) for each in zip(differ, swept, loads, strict=True)]
        if worth[-1] > worth[0] and not scatter:  # a check of nominal designs says nothing of made ones
            found, differ, swept, loads = unchanged(found, itself), differ[:1], swept[:1], loads[:1]
        models, checked = _twice(differ), _twice(swept)
        loss: dict[str, LossZones] = {}
        if not options.quick:
            search = lambda model: _loss_zones(model, options, say)
            with concurrent.futures.ThreadPoolExecutor() as pool:  # a search keeps one core busy
                loss = _twice(list(pool.map(search, differ)))
    job.figure(design_figure(found, checked["before"], checked["after"]))
    kept.unlink(missing_ok=True)
    chaotic = {name: zones(swept) for name, swept in checked.items()}
    document = {
        "vary": vary,
        **report.chosen(found.best, "objective at_bound status"),
        "objective_before": itself,
        "optimum": found.best.values,
        "optima": [report.chosen(o, "values objective at_bound") | {"starts": n} for o, n in found.distinct],
        "designs_swept": _swept(seen, options, Robust.draws if scatter else 1),
        "objective_by_fresh_sweeps": {"before": worth[0], "after": worth[-1]},
        **{key: {name: load[key] for name, load in _twice(loads).items()} for key in loads[0]},
        "balance_grade_mm_per_s": {name: _balance_grade(model, options.last) for name, model in models.items()},
        "cost": {name: float(cost().function(model)) for name, model in models.items()},
        "chaotic_rpm": {name: _chaotic_rpm(swept) for name, swept in checked.items()},
        "chaotic_zones": {name: [_ends(z) for z in z_.zones] for name, z_ in chaotic.items()},
        "synchronous_loss_zones": {name: [_ends(z) for z in z_.zones] for name, z_ in loss.items()},
        "search_seconds": round(searched, 1),
    }
    tables = [
        report.parameters_table(job.name, job.model, found, document),
        report.optima_table(found),
        *report.before_and_after_tables(document),
    ]
    return Report(document, tables, [*_notes(document, found), *([balance] if balance else [])])


def _twice(found: list[Found]) -> dict[str, Found]:
    """Before and after: the same where the design stays as it is."""
    return {"before": found[0], "after": found[-1]}


def _searched(
    job: Job[DesignOptions],
    vary: dict[str, tuple[float, float]],
    objective: AbstractObjective,
    kept: Path,
    say: Say,
) -> Optimised[CageModel]:
    """What the search that was asked for saw as its best."""
    options = job.options
    steps = vars(options)["steps"]
    return surrogate_search(
        job.model,
        vary,
        objective,
        batches=steps,
        keep=kept,
        report=lambda step, _: say("search", step, steps),
        **job.given("starts scouts batch seed"),
    )


def _finer(options: DesignOptions) -> ChaosMeasure:
    """Judges what a search saw as its best: speeds between those of the search and twice as many, three starts, finer
    steps."""
    between = (options.last - options.first) / (8 * options.speeds)
    range_ = options.first + between, options.last - between, FINER * options.speeds
    return chaotic_width(*range_, starts=STARTS, method=native(error=DEFAULT_ERROR / 4))


def _objective(
    job: Job[DesignOptions], width: ChaosMeasure, vary: dict[str, tuple[float, float]], scatter: Mapping[str, Scatter]
) -> AbstractObjective:
    """Chaotic speeds, what the land feels beside what it feels now, and cost."""
    options, space = job.options, DesignSpace.of(job.model, vary)
    prices = {"wear load": options.wear, "peak land force": options.force, "film drag power": options.power}
    terms = [LandMeasure(width, what).relative(space, price) for what, price in prices.items() if price]
    objective = sum(terms, start=width)
    if scatter:
        objective = Robust(objective, scatter, **job.given("worst seed"))
    return objective + options.cost * cost() if options.cost else objective


def _loads(model: CageModel, swept: Sweep) -> dict[str, float]:
    """Means over the speeds that were checked, and the least film of all, by steps at 1/16 of the usual error."""
    found = land_loads(model, swept, native(error=DEFAULT_ERROR / 16))
    means = {key: float(np.nanmean(found[what])) for key, what in LOADS.items()}
    return means | {"least_film_um": 1e6 * float(np.nanmin(found["least film"]))}


def _worth(
    options: DesignOptions, model: CageModel, swept: Sweep, loads: Mapping[str, float], before: Mapping[str, float]
) -> float:
    """The objective by the fresh sweep, its loads beside those before."""
    total, speed = _chaotic_rpm(swept) + options.cost * float(cost().function(model)), float(np.mean(swept.speed))
    for key, price in zip(LOADS, (options.wear, options.force, options.power), strict=True):
        total += (price or 0.0) * loads[key] / max(before[key], negligible_load(model, LOADS[key], speed))
    return total


def _balance_grade(model: CageModel, last_rpm: float) -> float:
    """Eccentricity times the highest cage speed [mm/s], the G of ISO 21940-11."""
    return float(model.eccentricity) * rpm(last_rpm) * 1e3


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


def _swept(found: Optimised, options: DesignOptions, draws: int) -> int:
    """Designs whose speeds were swept in the search."""
    batches = vars(options)["batch"] * sum(len(o.history) for o in found.optima)
    return (batches + (options.scouts if options.starts > 1 else 0)) * draws


def _ends(zone: Any) -> dict[str, Any]:
    edge = lambda e: None if e is None else e.speed_rpm
    return {"onset_rpm": edge(zone.onset), "exit_rpm": edge(zone.exit), "width_rpm": zone.width_rpm}


def _notes(document: Mapping[str, Any], found: Optimised) -> list[str]:
    best, before = found.best, document["objective_before"]
    verdict = (
        f"Objective, by {FINER} times the speeds, {STARTS} starts and finer steps: {before:.0f} rpm before, "
        f"{best.objective:.0f} rpm after."
    )
    fresh = "{before:.0f} rpm before, {after:.0f} after".format_map(document["objective_by_fresh_sweeps"])
    if best.status == UNCONFIRMED:
        verdict = f"The design that the search advises is no better by fresh sweeps from other starts ({fresh}): the "
        verdict += "given one stays as it is."
    elif best.objective < before:
        verdict += f" By fresh sweeps from other starts: {fresh}."
    else:
        verdict = f"No design that was looked at is better than the given one, which stays as it is. {verdict}"
    return [
        verdict,
        f"Search: {best.status}, {len(best.history)} steps, {document['designs_swept']} designs swept in "
        f"{document['search_seconds']:.0f} s",
        f"At a bound: {', '.join(best.at_bound)}." if best.at_bound else "No parameter ended at a bound.",
        "Zones: a fresh sweep with other starts and finer steps; edges by a search of the synchronous orbits",
    ]


def sensitivity(job: Job[SensitivityOptions]) -> Report:
    """`jaxcage sensitivity`: shares of the chaotic width's variance, and tolerance budgets of the edges."""
    options = job.options
    vary = read_bounds(options.vary or _usual(job.model), job.model)
    width = chaotic_width(options.first, options.last, options.speeds)
    edges, budgets = {}, []
    with job.computing() as say:
        say("Sobol designs", 0, 1)
        shares = global_sensitivity(job.model, vary, width, **job.given("samples seed"))
        if not options.quick:
            loss = _loss_zones(job.model, options, say)
            say("gradients", 0, 1)
            edges = {n: s for n, s in sensitivities(job.model, loss.edges).items() if s.trusted}
            relative = options.tolerance / 100 / math.sqrt(3)
            scatter = lambda s: dict.fromkeys(report.not_fixed(job.model, s.elasticity), relative)
            budgets = [tolerance_budget(s, scatter(s)) for s in edges.values()]
    job.files["figure"] = None
    if edges:
        title, size = f"{job.name}: elasticities of the synchronous-loss edges", (9.0, 2.2 + 1.2 * len(edges))
        turned = report.to_be_turned(job.model, edges.values())
        job.draw(lambda ax: elasticity_bars(turned, ax), size, title)
    document = {
        "vary": vary,
        "sobol": report.sobol_document(shares),
        "tolerance_percent": options.tolerance,
        "edges": [
            {
                **report.chosen(b, "edge speed_rpm"),
                "deviation_rpm": b.total_rpm,
                "by_parameter_rpm": b.deviation_rpm,
                "elasticity": edges[b.edge].elasticity,
            }
            for b in budgets
        ],
    }
    tables = [report.sobol_table(job.name, shares), *(report.budget_table(b, options.tolerance) for b in budgets)]
    return Report(document, tables, [shares.warning] if shares.warning else [])
