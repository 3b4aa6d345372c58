"""Commands about designs: better ones, tolerances, and values that are known within ranges only."""

import hashlib
import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError
from . import options as o
from .answer import Answer
from .subject import RPM, Subject, read_case
from .values import no_worse_balance, read_bounds, read_each, read_scatter


LOADS = {"wear": "wear load", "force": "peak land force", "power": "film drag power"}
"""Price -> load of the land of a cage."""
FINER, STARTS = 2, 3
"""Multiple of the speeds of a search in the comparison of its best designs, and their initial states."""
DESIGNED = o.Range(4000.0, 27500.0)
"""Speeds at which designs of a cage are assessed; their number is 48 unless given."""
Vary = Annotated[
    o.Texts,
    tyro.conf.arg(
        metavar="NAME=LOWER:UPPER", help="Parameter to change with its bounds, e.g. guidance_gap=0.3mm:0.6mm."
    ),
]


def design(
    case: o.Case,
    *,
    vary: Vary = (),
    over: o.Range = DESIGNED,
    cost: o.Price = None,
    wear: o.Price = None,
    force: o.Price = None,
    impulse: o.Price = None,
    power: o.Price = None,
    slip: o.Price = None,
    balance: o.Price = None,
    worse_balance: bool = False,
    scatter: Annotated[o.Texts, tyro.conf.arg(metavar="NAME=LAW")] = (),
    worst: Annotated[float, o.number("be above 0 and at most 1", lambda x: 0 < x <= 1)] = 1.0,
    searches: o.FromOne = 1,
    scouts: o.FromZero = 0,
    steps: o.OptionalCount = None,
    batch: o.OptionalCount = None,
    seed: o.Seed = 0,
    means: o.MeanOptions = o.MeanOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Change the design so that fewer speeds are chaotic; of a bearing so that wear, forces and losses are small.

    The best design is compared with the given one by fresh runs. Prices are in rpm of chaotic speeds for the present
    value, and of a bearing with its rollers weights of relative values.

    Args:
        cost: Price of a unit of manufacturing cost; 1000 if left out.
        wear: Price of wear; 1000 if left out, of a bearing 1.
        force: Price of the peak force on the land, and of a bearing on pockets; 1000 if left out, of a bearing 1.
        impulse: Of a bearing: price of the impulses of pockets and land; 1 if left out.
        power: Price of the power lost; 0 if left out, of a bearing 1.
        slip: Of a bearing: price of the slip of its cage; 1 if left out.
        balance: Of a bearing: price of the balance grade of its cage; 1 if left out.
        worse_balance: Let the cage be balanced worse than it is.
        scatter: Manufacturing scatter of a parameter: guidance_gap=10% or eccentricity=rayleigh; the mean counts.
        worst: With --scatter: mean over this share of the manufactured cages, the worst ones.
        searches: One from the design itself, others from the best of the scouts.
        scouts: Designs spread over the bounds that are looked at beforehand.
        steps: Steps of each search; 10 if left out, of a bearing 12.
        batch: Designs of a step; 12 if left out, of a bearing 16.
    """
    subject, d = read_case(case, means.load), jc.design
    model, bounds = subject.model, read_bounds(vary, subject)
    notes = [] if worse_balance else no_worse_balance(model, bounds)
    laws = read_each("--scatter", scatter, "NAME=10% or NAME=rayleigh", partial(read_scatter, tuple(bounds)))
    if 0 < scouts < searches - 1:
        raise InputError(f"Option --scouts must be 0 or at least {searches - 1}, but {scouts} was given.")
    if worst < 1 and not laws:
        raise InputError("Option --worst goes with --scatter.")
    given = {"wear": wear, "force": force, "impulse": impulse, "power": power, "slip": slip, "balance": balance}
    usual = subject.usual({"wear": 1e3, "force": 1e3, "power": 0.0}, dict.fromkeys(given, 1.0))
    prices: dict[str, Any] = {name: price if given[name] is None else given[name] for name, price in usual.items()}
    if subject.with_rollers and not sum(prices.values()):
        raise InputError(f"Options {', '.join(f'--{name}' for name in prices)} must not all be 0.")
    runs, chaos, finer = _runs(subject, over, means, seed)
    count, per_step = steps or subject.usual(10, 12), batch or subject.usual(12, 16)
    asked = repr((model, bounds, prices, cost, over, means, searches, scouts, per_step, seed, scatter, worst))
    stored = Path(show.out) / f".design_{subject.name}_{hashlib.sha256(asked.encode()).hexdigest()[:12]}.npz"
    search = {"starts": searches, "scouts": scouts, "batches": count, "batch": per_step, "seed": seed, "keep": stored}

    def objective_of(width: Any) -> Any:
        loads = [(LOADS[name], price) for name, price in prices.items() if price]
        total = sum((d.relative(d.LandLoad(width.runs, n), model, p) for n, p in loads), start=width)
        total = d.Robust(total, laws, worst=worst, seed=seed) if laws else total
        return total + (1e3 if cost is None else cost) * d.cost() if cost != 0 else total

    with show.computing(f"design {subject.name}", "the same command goes on where the search stopped") as say:
        own = d.bearing_objective(model, bounds, runs, prices) if chaos is None else objective_of(chaos)
        found = d.surrogate_search(model, bounds, own, **search, report=lambda step, _: say("search", step, count))
        say("fresh runs", 0, 1)
        fresh, better = runs.fresh() if chaos is None else finer.runs, False
        if chaos is None:
            statistics = {n: d.statistic(fresh, n) for n in (*d.COMPARED, d.BALANCE)} | {d.OBJECTIVE: own.on(fresh)}
        else:
            found, itself = d.confirmed(found, objective_of(finer))
            statistics = {"chaotic speeds": finer, d.BALANCE: d.statistic(fresh, d.BALANCE)}
            statistics |= {name: d.LandLoad(fresh, name) for name in (*d.LAND_LOADS, "least film")}
            better = found.best.objective < itself
        rows, failed = d.before_and_after(model, found.best.model, fresh, statistics)
    stored.unlink(missing_ok=True)
    best, by_name = found.best, {row.name: row for row in rows}
    if d.OBJECTIVE in by_name:
        better = by_name[d.OBJECTIVE].known and by_name[d.OBJECTIVE].change < 0
    values = ", ".join(f"{name} {value:.4g}" for name, value in best.values.items())
    said = (
        f"A better design was found (SI): {values}." if better else "No better design was found: the given one stays."
    )
    notes += [f"Search: {best.status}, {len(best.history)} steps, objective {best.objective:.4g}"]
    notes += [f"At a bound: {', '.join(best.at_bound) or 'no parameter'}", f"Fresh runs that failed: {failed}"]
    document = {"vary": bounds, "prices": prices, "better": better, "optimum": best.values, "failed": failed}
    document |= {"objective": best.objective, "at_bound": best.at_bound, "status": best.status}
    tables = [
        jc.show.before_and_after_table("Before and after, from the same initial states", rows),
        jc.show.changed_table(f"Design of {subject.name}", model, found, bounds),
        jc.show.optima_table(model, found),
    ]
    files = {"figure": (".png", jc.show.optimum_figure(found, rows, subject.name))}
    return Answer(said, tables, notes, document, subject, files)


def _runs(subject: Subject, over: o.Range, means: o.MeanOptions, seed: int, **more: Any) -> tuple[Any, Any, Any]:
    """Runs of designs; of a cage the width of its chaotic speeds, and that width by more speeds from other states."""
    if subject.with_rollers:
        length = means.length(starts=4, discard=10, revolutions=20)
        return jc.design.Runs.of_bearing(subject.speed(means.speed), **length, seed=seed, **more), None, None
    (low, *_, high), model = subject.range(o.Range(over.first, over.last), 2), subject.model
    half, width = model.dimension // 2, partial(jc.design.chaotic_width, low * RPM, high * RPM)
    size = 0.6 * float(model.clearance) * np.array([1.0] * half + [0.3 * low] * half)
    states = size * np.random.default_rng(seed + 1).uniform(-1, 1, (STARTS, size.size))
    chaos = width(over.count or 48, **more)
    return chaos.runs, chaos, width(FINER * (over.count or 48), starts=[*map(tuple, states)])


def sensitivity(
    case: o.Case,
    *,
    vary: Vary = (),
    over: o.Range = DESIGNED,
    of: str = "wear",
    samples: o.OptionalCount = None,
    tolerance: Annotated[float, o.number("lie between 0 and 100 percent", lambda x: 0 < x < 100)] = 5.0,
    seed: o.Seed = 0,
    quick: o.Quick = False,
    means: o.MeanOptions = o.MeanOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Shares of each parameter in the chaotic speeds over its range, and effect of tolerances on the exact edges.

    Of a bearing with its rollers the same of a measure at one speed, such as its wear.

    Args:
        of: Of a bearing: measure, such as wear, power, slip or pocket_force_peak_N.
        samples: Base samples of the Sobol indices, a power of 2; 64 if left out, of a bearing 32.
        tolerance: Tolerance of every parameter but constants, ± so many percent, uniformly distributed.
    """
    subject, d = read_case(case, means.load), jc.design
    model, name, bounds = subject.model, subject.name, read_bounds(vary, subject)
    samples, files = _power(samples or subject.usual(64, 32)), {}
    if of not in d.BEARING_MEASURES:
        raise InputError(f"Option --of must be one of {', '.join(d.BEARING_MEASURES)}, but '{of}' was given.")
    with show.computing(f"sensitivity {name}") as say:
        runs, chaos, _ = _runs(subject, over, means, seed, progress=partial(say, "designs"))
        objective = d.measure(runs, of) if chaos is None else chaos
        shares = d.global_sensitivity(model, bounds, objective, samples=samples, seed=seed)
        slopes: list[tuple[Any, Any]] = []
        if chaos is None and not quick:
            known = jc.parameters(model)
            directions = [x for x in d.DIRECTIONS if all(float(known[each]) for each in x.split("+"))]
            length = means.length(discard=10, revolutions=20)
            near = d.Runs(runs.speeds, starts=2, **length, blocks=2, exponents=0, tolerance=1e-4)
            spread = float(np.clip(tolerance / 100, 0.05, 0.3))
            given = {"directions": directions, "spread": spread, "seed": seed}
            found = d.mean_gradient(model, near, {of: d.measure(near, of)}, **given)
            slopes = [(found.statistics[of], directions)]
            files["figure"] = ".png", jc.show.statistic_bars(found, f"{name}: elasticities")
        elif not quick:
            ends = subject.range(o.Range(over.first, over.last), 2)
            loss = jc.loss_zones(jc.orbits.synchronous_orbits(model, *ends, progress=say))
            edges = [s for s in jc.orbits.sensitivities(model, loss.edges).values() if s.trusted]
            slopes = [(s, jc.show.not_fixed(model, s.elasticity)) for s in edges]
            bars = lambda ax: jc.show.elasticity_bars(jc.show.to_be_turned(model, edges), ax)
            files |= {"figure": (".png", jc.show.drawn(bars, 9.0, 2.2 + 1.2 * len(edges), name))} if edges else {}
    deviation = tolerance / 100 / math.sqrt(3)
    budgets = [d.tolerance_budget(slope, dict.fromkeys(names, deviation)) for slope, names in slopes]
    most, what = max(shares.total, key=shares.total.__getitem__), subject.usual("chaotic speeds", of.replace("_", " "))
    said = f"{most} matters most: with the other parameters it has {100 * shares.total[most]:.0f} % of the variance."
    said = "These samples do not tell which parameter matters most." if most in shares.doubtful else said
    tables = [jc.show.sobol_table(f"{what.capitalize()} of {name}", shares)]
    tables += [jc.show.budget_table(budget, tolerance) for budget in budgets]
    notes = [shares.warning] if shares.warning else []
    if shares.scatter:
        notes.append(
            f"Scatter of the motion is {100 * shares.scatter:.0f} % of the variance, in no parameter's own share."
        )
    notes += [f"Within twice the error, no effect: {', '.join(b.unclear)}" for b in budgets if b.unclear]
    document = {"vary": bounds, "of": what, "tolerance_percent": tolerance, "designs": shares.evaluations}
    document |= {"doubtful": shares.doubtful, "scatter": shares.scatter, "budgets": budgets}
    return Answer(said, tables, notes, document, subject, files)


def _power(samples: int) -> int:
    """A number of samples. **Raises:** `InputError` for one that is no power of 2."""
    if samples < 2 or samples & (samples - 1):
        raise InputError(f"Option --samples must be a power of 2, but {samples} was given.")
    return samples


def identify(
    case: o.Case,
    measured: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="CSV")],
    *,
    draws: Annotated[int, o.count(16)] = 128,
    stages: o.FromOne = 4,
    seed: o.Seed = 0,
    steps: o.StepOptions = o.StepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Narrow the ranges of a TOML file by what was measured on the machine, and write them to a new file.

    Args:
        measured: Measurements: a file with the columns quantity, speed, value, tolerance; a quantity is
            `whirl frequency` [Hz], `orbit size` [mm], or without a value `rattles` or `calm`.
        draws: Draws from the ranges, in each stage.
        stages: Times that the ranges close around the best draws, at most.
    """
    subject = read_case(case)
    subject.require_ranges()
    rows, info = (
        jc.files.read_measurements(measured, subject.speeds, 1 / (subject.shaft or 1.0)),
        jc.parameter_info(subject.model),
    )
    with show.computing(f"identify {subject.name}") as say:
        given = {"draws": draws, "stages": stages, "seed": seed, "method": steps.method}
        found = jc.design.identify(subject.model, subject.unknowns, rows, **given, progress=partial(say, "draws"))
    tables = [jc.show.measured_table(found, rows, subject.beside)]
    document = {name: getattr(found, name) for name in ("draws", "stages", "accepted")}
    if not found.met:
        worst = max(tables[0].records, key=lambda row: row["off_by_tolerances"])
        off = f"{worst['off_by_tolerances']:.2g} tolerances off in '{worst['what']}'"
        why = f"None of {found.draws} draws does what was measured in all rows: the nearest is {off}."
        why += " Widen ranges or tolerances, or look for what the model leaves out."
        said, document = "No draw does what was measured.", document | {"file": None}
        return Answer(said, tables, [], document, subject.certain, failure=why)
    units = {u.label: info[u.names[0]].unit for u in subject.unknowns}
    each = zip(found.unknowns, found.ranges, found.narrowed, strict=True)
    new = {u.label: (r, units[u.label]) for u, r, worth in each if worth}
    text = jc.files.with_ranges(jc.files.read_bytes(case).decode(), new)
    said = f"{found.accepted} of {found.draws} draws of the last of {found.stages} stages do what was measured."
    tables.insert(0, jc.show.narrowed_table(found, units))
    return Answer(said, tables, [], document, subject.certain, {"file": (".toml", text)})
