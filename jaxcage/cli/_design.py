"""`jaxcage design`: fewer chaotic speeds by changing the design, and what that costs."""

import concurrent.futures
import dataclasses
import hashlib
import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._parameters import parameter_info, parameters
from ..analysis import Sweep, Zones, zones
from ..design import AbstractObjective, Optimised, Optimum, Robust, chaotic_width, cost, optimise
from ..models import CageModel
from ..orbits import LossZones
from ..plotting import design_figure
from ..sweeps import rpm, sweep
from ._console import progress_in_stages
from ._errors import UsageError, refusing, require_at_least, require_range
from ._inputs import angular_speed, output_folder, save_figure, subject
from ._loss import loss_zones_between
from ._options import DesignOptions
from ._report import Report, Table, number
from ._vary import read_bounds, read_scatter


VARY = ("guidance_gap=0.3mm:0.6mm", "eccentricity=5um:60um")
CHECKED_SPEEDS = 118
"""Every 200 rpm of the usual range."""


def run(options: DesignOptions) -> Report:
    """Carry out `jaxcage design`."""
    require_range(options.first, options.last)
    for name, least in (
        ("starts", 1),
        ("scouts", options.starts - 1),
        ("steps", 1),
        ("speeds", 4),
        ("cloud", 4),
        ("seed", 0),
    ):
        require_at_least(f"--{name}", getattr(options, name), least)
    if not 0 <= options.cost < math.inf:
        raise UsageError(f"Option --cost must be at least 0, but {options.cost:g} was given.")
    for name, share in (("spread", options.spread), ("worst", options.worst)):
        if not 0 < share <= 1:
            raise UsageError(f"Option --{name} must be above 0 and at most 1, but {share:g} was given.")
    if options.worst != DesignOptions.worst and not options.scatter:
        raise UsageError("Option --worst goes with --scatter.")
    about = subject(options)
    vary = read_bounds(options.vary or VARY, about.model)
    scatter = read_scatter(options.scatter, list(vary))
    folder = output_folder(options)
    began = time.perf_counter()
    with refusing():
        width: AbstractObjective = chaotic_width(
            options.first, options.last, options.speeds, cloud=options.cloud, spread=options.spread, seed=options.seed
        )
        width = Robust(width, scatter, worst=options.worst, seed=options.seed) if scatter else width
    objective = width + options.cost * cost() if options.cost else width
    kept = _kept_search(folder, about.name, options)
    with progress_in_stages(f"design of {about.name}", "the same command goes on where the search stopped") as bar:
        say = bar or (lambda what, done, of: None)
        with refusing():
            found = optimise(
                about.model,
                vary,
                objective,
                starts=options.starts,
                scouts=options.scouts,
                steps=options.steps,
                seed=options.seed,
                keep=kept,
                report=lambda step, _: say("search", step, options.steps),
            )
        searched = time.perf_counter() - began
        models = {"before": about.model, "after": found.best.model}
        checked = {}
        for i, (name, model) in enumerate(models.items()):
            say("fresh sweeps", i, len(models))
            checked[name] = check(model, options)
        search = lambda model: loss_zones_between(model, options.first, options.last, say)
        with concurrent.futures.ThreadPoolExecutor() as pool:  # a search keeps one core busy
            loss = {} if options.quick else dict(zip(models, pool.map(search, models.values()), strict=True))
    figure = save_figure(design_figure(found, checked["before"], checked["after"]), folder / f"design_{about.name}.png")
    chaotic = {name: zones(s) for name, s in checked.items()}
    kept.unlink(missing_ok=True)
    document = {
        "case": about.name,
        "vary": vary,
        "objective": found.best.objective,
        "error": found.best.error,
        "optimum": found.best.values,
        "at_bound": found.best.at_bound,
        "status": found.best.status,
        "optima": [
            {"values": o.values, "objective": o.objective, "error": o.error, "starts": n, "at_bound": o.at_bound}
            for o, n in found.distinct
        ],
        "designs_swept": _swept(found, options, width),
        "cost": {name: price(model) for name, model in models.items()},
        "chaotic_rpm": {name: chaotic_rpm(s) for name, s in checked.items()},
        "chaotic_zones": {name: [_ends(z) for z in z_.zones] for name, z_ in chaotic.items()},
        "synchronous_loss_zones": {name: [_ends(z) for z in z_.zones] for name, z_ in loss.items()},
        "search_seconds": round(searched, 1),
        "seconds": round(time.perf_counter() - began, 1),
        "figure": figure,
    }
    tables = [
        _parameters_table(about.name, about.model, found.best, document),
        _optima_table(found),
        *_zone_tables(chaotic, loss),
    ]
    return Report(document, tables, _notes(document, found))


def _kept_search(folder: Path, name: str, options: DesignOptions) -> Path:
    """File of the search until the command is through; another search has another file."""
    asked = dataclasses.replace(options, json=False, out="", style="light", no_cache=False, quick=False)
    return folder / f".design_{name}_{hashlib.sha256(repr(asked).encode()).hexdigest()[:12]}.npz"


def check(model: CageModel, options: DesignOptions, count: int = CHECKED_SPEEDS) -> Sweep:
    """A sweep with starts that the search did not use, its labels confirmed."""
    rng, c = np.random.default_rng(options.seed + 1), float(model.clearance)
    half = model.dimension // 2
    size = np.array([c] * half + [0.3 * c * angular_speed(options.first)] * half)
    starts = [tuple(float(v) for v in 0.6 * size * rng.uniform(-1, 1, size.size)) for _ in range(3)]
    speeds = rpm(options.first, options.last, count)
    return sweep(model, speeds, starts=starts, discard=300, revolutions=200)


def chaotic_rpm(found: Sweep) -> float:
    """Speeds at which any start is chaotic, for a while at least, times their spacing [rpm]."""
    return float(np.mean(found.restless) * (found.rpm[-1] - found.rpm[0]))


def price(model: CageModel) -> float:
    """Manufacturing cost, in units of `jaxcage.design.cost`."""
    return float(cost().function(model))


def _swept(found: Optimised, options: DesignOptions, width: AbstractObjective) -> int:
    """Designs whose speeds were swept in the search."""
    draws = width.draws if isinstance(width, Robust) else 1
    clouds = options.cloud * sum(len(o.history) for o in found.optima)
    return (clouds + (options.scouts if options.starts > 1 else 0)) * draws


def _ends(zone: Any) -> dict[str, Any]:
    edge = lambda e: None if e is None else e.speed_rpm
    return {"onset_rpm": edge(zone.onset), "exit_rpm": edge(zone.exit), "width_rpm": zone.width_rpm}


def _parameters_table(name: str, model: CageModel, best: Optimum, document: Mapping[str, Any]) -> Table:
    info, bounds = parameter_info(model), document["vary"]
    before = parameters(model)
    rows = [
        (n, info[n].unit, f"{float(before[n]):.4g}", f"{value:.4g}", " to ".join(f"{b:.4g}" for b in bounds[n]))
        for n, value in best.values.items()
    ]
    for what, unit, form in (("cost", "", ".3f"), ("chaotic_rpm", "rpm", ".0f")):
        before_after = [format(document[what][k], form) for k in ("before", "after")]
        rows.append((what.removesuffix("_rpm"), unit, before_after[0], before_after[1], ""))
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


def _zone_tables(chaotic: Mapping[str, Zones], loss: Mapping[str, LossZones]) -> list[Table]:
    tables = []
    kinds: list[tuple[str, Mapping[str, Any]]] = [("Chaotic", chaotic), ("Synchronous-loss", loss)]
    for kind, found in kinds:
        rows = [
            (
                when,
                str(i),
                *(number(None if e is None else e.speed_rpm) for e in (z.onset, z.exit)),
                number(z.width_rpm),
            )
            for when, z_ in found.items()
            for i, z in enumerate(z_.zones, start=1)
        ]
        if found:
            tables.append(
                Table(f"{kind} zones before and after [rpm]", ("design", "zone", "onset", "exit", "width"), rows)
            )
    return tables


def _notes(document: Mapping[str, Any], found: Optimised) -> list[str]:
    best = found.best
    bound = f"At a bound: {', '.join(best.at_bound)}." if best.at_bound else "No parameter ended at a bound."
    return [
        f"Search: {best.status}, {len(best.history)} steps, {document['designs_swept']} designs swept in "
        f"{document['search_seconds']:.0f} s",
        bound,
        "Zones: a fresh sweep with other starts and finer steps; edges by a search of the synchronous orbits",
        f"Figure: {document['figure']}",
        f"Time: {document['seconds']:.1f} s",
    ]
