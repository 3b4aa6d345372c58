"""Commands on designs: optimisation, tolerances, and values known within ranges only."""

import math
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
import tyro

import jaxcage as jc

from .._errors import InputError
from . import options as o
from .answer import Answer
from .orbit_commands import bars
from .progress import report
from .subject import RPM, Subject
from .values import no_worse_balance, read_bounds, read_prices, read_tolerances


DESIGNED = o.Range(4000.0, 27500.0)
"""Speeds at which designs of a cage are assessed, 48 of them by default."""
Vary = Annotated[
    o.Texts,
    tyro.conf.arg(
        metavar="NAME=LOWER:UPPER", help="Parameter to change with its bounds, e.g. guidance_gap=0.3mm:0.6mm."
    ),
]
VERDICTS = {
    "calm": "Calm over {range}",
    "stable, not checked": "Stable over {range}, not checked by simulations",
    "stable, but not from every initial state": "Stable over {range}, but not from every initial state",
}


def design(
    subject: o.Case,
    *,
    vary: Vary = (),
    over: o.Range = DESIGNED,
    price: o.Prices = (),
    worse_balance: bool = False,
    search: Literal["surrogate", "slsqp", "augmented"] | None = None,
    steps: o.OptionalCount = None,
    seed: o.Seed = 0,
    calm: o.CalmOptions = o.CalmOptions(),
    means: o.MeanOptions = o.MeanOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Cheapest cage whose synchronous orbit is stable over an --operating range, with margins, by exact gradients.

    Without that range: a search on simulations for fewer chaotic speeds or, for a bearing, less wear, forces and
    losses; its best design is compared with the given one by independent runs.

    Args:
        price: For surrogate, once each: cost of a cage, 1000 rpm of chaotic speeds by default; of a bearing the weights
            of wear, force, impulse, power, slip and balance over their present values, 1 by default.
        worse_balance: Let the cage be balanced worse than it is.
        search: Search for a design: slsqp or augmented with --operating, else surrogate, on simulations.
        steps: For surrogate: steps of the search; by default 10, for a bearing 12.
    """
    d, model, bounds = jc.design, subject.model, read_bounds(vary, subject)
    notes = [] if worse_balance else no_worse_balance(model, bounds)
    search = search or ("surrogate" if calm.operating is None else "slsqp")
    if search != "surrogate":
        if subject.with_rollers:
            orbits = "goes with a cage, whose orbits repeat"
            raise InputError(f"Option --operating {orbits}, but {subject.name} is a bearing.")
        if calm.operating is None:
            raise InputError(f"Option --search {search} goes with --operating.")
        if price or steps is not None:
            raise InputError("Options --price and --steps go with a search on simulations, without --operating.")
        return _calm_design(subject, bounds, calm, notes, usual=not vary, search=search, seed=seed)
    if calm.operating is not None:
        raise InputError("Option --search surrogate goes without --operating, over --first to --last.")
    prices = read_prices(price, subject.usual({"cost": 1e3}, dict.fromkeys(d.TERMS, 1.0)))
    runs = _runs(subject, over, means, seed)
    if subject.with_rollers:
        objective, compared = d.bearing_objective(model, runs, prices), {}
    else:
        ends = runs.speed[0] * RPM, runs.speed[-1] * RPM
        objective = d.chaotic_width(*ends, price=prices["cost"])
        compared = {"chaotic speeds": d.chaotic_width(*ends)}
    names = subject.usual((d.BALANCE, *jc.analysis.LAND_LOADS), d.COMPARED)
    compared |= {name: d.statistic(model, name) for name in names} | {d.OBJECTIVE: objective}
    length = {"batches": steps or subject.usual(10, 12), "batch": subject.usual(12, 16)}
    values, finer = objective.values(runs), objective.values(runs.fresh(1, initial_states=4))
    told = {"confirm": finer, "seed": seed, "report": partial(report, "search")}
    found = d.surrogate_search(model, bounds, values, **length, **told)
    report("fresh runs", 0, 1)
    rows, failed = d.before_and_after(model, found.model, runs.fresh(2), compared)
    better = rows[-1].known and rows[-1].change < 0
    if any(row.name == "wear load" and row.change > 0 for row in rows):
        notes.append("This cage rubs more on its land than the given one, which counts nothing in the objective.")
    chosen = ", ".join(f"{name} {value:.4g}" for name, value in found.values.items())
    said = f"The search chose {chosen} (SI), but fresh runs do not tell that this is better."
    said = f"A better design was found (SI): {chosen}." if better else said
    said = said if found.changed else "No better design was found: the given one stays."
    notes += [f"Search: {len(found.history)} steps, objective {found.objective:.4g}"]
    notes += [f"At a bound: {', '.join(found.at_bound) or 'no parameter'}", f"Fresh runs that failed: {failed}"]
    notes += _broken_rule(model, found.model)
    document = {"vary": bounds, "prices": prices, "better": better, "optimum": found.values, "failed": failed}
    document |= {"objective": found.objective, "at_bound": found.at_bound}
    tables = [
        jc.show.before_and_after_table("Before and after, from the same initial states", rows),
        jc.show.changed_table(f"Design of {subject.name}", model, found, bounds),
    ]
    return Answer(said, tables, notes, document, {"figure": jc.show.optimum_figure(found, rows, subject.name)})


def _runs(subject: Subject, over: o.Range, means: o.MeanOptions, seed: int = 0, progress: Any = None) -> Any:
    """Settings of the runs of designs; for a cage, over a range of speeds."""
    if subject.with_rollers:
        length = means.length(initial_states=4, discard=10, revolutions=20)
        return jc.design.Runs.of_bearing(subject.speed(means.speed), **length, seed=seed, progress=progress)
    length: dict[str, Any] = means.length(initial_states=1, discard=150, revolutions=100)
    if (speeds := subject.range(over, 48)).size < 2:
        raise InputError("Option --count must be at least 2, but 1 was given.")
    return jc.design.Runs(speeds, **length, progress=progress)


def _calm_design(
    subject: Subject, bounds: dict[str, Any], calm: o.CalmOptions, notes: list[str], usual: bool, **searches: Any
) -> Answer:
    """Answer on the design of a cage for calm operation over a range of speed; of the usual bounds those are left out
    that a balance grade replaces."""
    model, name = subject.model, subject.name
    subject, (low, high) = subject.operating(calm.operating)
    keep = jc.Requirements(calm.margin, calm.decay, calm.least_film, calm.land_force, calm.grade, calm.drag)
    tolerance = read_tolerances(calm.tolerance or "", subject, high)
    graded = {n for n, each in tolerance.items() if each.absolute} if usual else set()
    bounds, notes = {n: ends for n, ends in bounds.items() if n not in graded}, [] if graded else notes
    given: dict[str, Any] = {"objective": calm.objective, "tolerance": tolerance}
    best = jc.design_for(model, (low, high), bounds, keep, **given, **searches, progress=report)
    tables = [jc.show.changed_table(f"Design of {name}", model, best, bounds)]
    tables.append(jc.show.requirement_table("Requirements over the operating range", best, subject.beside))
    if best.budget:
        tables.append(jc.show.budget_of_tolerances_table(model, best))
    what = {"cost": "Cost", "width": "Width of the unstable ranges [rpm]"}[calm.objective]
    notes = [*notes, f"{what}: {best.cost_before:.4g} before, {best.cost:.4g} after"]
    notes += [f"10 % stricter {name}: costs {price:.2g} more" for name, price in jc.show.stricter(best).items()]
    notes += [f"On the way: {note}" for note in best.notes] + [jc.show.BY_CAGE_MODEL]
    notes += [] if best.checked is None else [f"Checked: {best.checked} ({best.checked.method})"]
    notes += [f"Designs solved for: {best.evaluations}", *_broken_rule(model, best.model)]
    names = ("verdict", "checked", "cost", "cost_before", "prices", "conflict", "at_bound")
    document = {"optimum": best.values, "vary": bounds} | {name: getattr(best, name) for name in names}
    document["operating_rpm"] = ends = low * RPM, high * RPM
    said = _calm_sentence(best, subject.over(low, high), calm.objective)
    failure = "" if best.feasible else "No design was found that keeps all requirements."
    return Answer(said, tables, notes, document, {"figure": jc.show.calm_figure(best, ends, name)}, failure=failure)


def _broken_rule(given: Any, found: Any) -> list[str]:
    """Notes if a design breaks the design rule where the given one does not."""
    before, after = (jc.bearing.design_rule_violations(each.bearing, each.guidance_gap) for each in (given, found))
    return [] if before else [f"This design breaks the design rule T > C_r > G_r: {words}" for words in after]


def _calm_sentence(best: Any, over: str, objective: str) -> str:
    if best.lost:
        return f"The values of no design within the bounds are known over {over}: {best.lost}."
    if not best.feasible:
        against = f" In conflict: {' and '.join(best.conflict)}." if best.conflict else ""
        missed = jc.show.broken_words(best)
        return f"No design within the bounds keeps all requirements over {over}; missed are {missed}.{against}"
    if objective == "width":
        return f"Over {over} {best.cost:.0f} rpm are unstable, {best.cost_before:.0f} before."
    said = VERDICTS[best.verdict].format(range=over)
    coexists = "" if best.checked is None or best.checked.calm else f": {best.checked}"
    return f"{said}, at a cost of {best.cost:.3g} (given design {best.cost_before:.3g}){coexists}."


def sensitivity(
    subject: o.Case,
    *,
    vary: Vary = (),
    over: o.Range = DESIGNED,
    of: str = "wear",
    samples: o.OptionalCount = None,
    tolerance: Annotated[float, o.number("lie between 0 and 100 percent", lambda x: 0 < x < 100)] = 5.0,
    quick: o.Quick = False,
    means: o.MeanOptions = o.MeanOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Variance of the chaotic speeds due to each parameter over its range, and effect of tolerances on the exact edges.

    For a bearing with its rollers: the same for a measure at one speed, such as its wear.

    Args:
        of: For a bearing: measure, such as wear, power, slip or pocket_force_peak_N.
        samples: Base samples of the Sobol indices, a power of 2; by default 64, for a bearing 32.
        tolerance: Tolerance of every parameter but constants, ± per cent, uniformly distributed.
    """
    d, model, name, bounds, files = jc.design, subject.model, subject.name, read_bounds(vary, subject), {}
    if of not in d.BEARING_MEASURES:
        raise InputError(f"Option --of must be one of {', '.join(d.BEARING_MEASURES)}, but '{of}' was given.")
    runs, measured = _runs(subject, over, means, progress=partial(report, "designs")), d.BEARING_MEASURES[of]
    ends = runs.speed[0] * RPM, runs.speed[-1] * RPM
    value = d.statistic(model, measured) if subject.with_rollers else d.chaotic_width(*ends)
    blocks, seen = value.blocks(runs), list[Any]()
    keep = lambda models: seen.append(blocks(models)) or seen[-1]
    shares = d.global_sensitivity(model, bounds, keep, samples=samples or subject.usual(64, 32))
    slopes: list[tuple[Any, Any]] = []
    if subject.with_rollers and not quick:
        known = jc.parameters(model)
        directions = [x for x in d.DIRECTIONS if all(float(known[each]) for each in x.split("+"))]
        length = means.length(discard=10, revolutions=20)
        near = d.Runs(runs.speed, initial_states=2, **length, blocks=2, exponents=0, tolerance=1e-4)
        spread = float(np.clip(tolerance / 100, 0.05, 0.3))
        found = d.mean_gradient(model, near, {of: value}, directions=directions, spread=spread)
        slopes = [(found.statistics[of], directions)]
        files["figure"] = jc.show.statistic_bars(found, f"{name}: elasticities")
    elif not quick:
        loss = jc.unstable_ranges(jc.orbits.synchronous_orbits(model, *subject.ends(over), progress=report))
        edges = [s for s in jc.orbits.sensitivities(model, loss.edges).values() if s.trusted]
        slopes = [(s, _not_fixed(model, s.elasticity)) for s in edges]
        files |= {"figure": bars(subject, edges)} if edges else {}
    deviation = tolerance / 100 / math.sqrt(3)
    budgets = [d.tolerance_budget(slope, dict.fromkeys(names, deviation)) for slope, names in slopes]
    most, what = max(shares.total, key=shares.total.__getitem__), subject.usual("chaotic speeds", of.replace("_", " "))
    said = f"{most} matters most: with the other parameters it has {100 * shares.total[most]:.0f} % of the variance."
    said = "These samples do not tell which parameter matters most." if most in shares.doubtful else said
    tables = [jc.show.sobol_table(f"{what.capitalize()} of {name}", shares)]
    tables += [jc.show.budget_table(budget, tolerance) for budget in budgets]
    notes = [f"Too few samples to believe: {', '.join(shares.doubtful)}"] if shares.doubtful else []
    if not subject.with_rollers and np.max(seen) < 1e-3 * (ends[1] - ends[0]):  # a chaotic speed counts half or more
        said = f"No design is chaotic within {subject.over(*runs.speed[[0, -1]])}: there is no variance to share."
        tables, notes = tables[1:], []
    elif shares.scatter:
        scatter = f"Scatter of the motion is {100 * shares.scatter:.0f} % of the variance"
        notes.append(f"{scatter}, in no parameter's own share.")
    document = {"vary": bounds, "of": what, "tolerance_percent": tolerance, "designs": shares.evaluations}
    document |= {"doubtful": shares.doubtful, "scatter": shares.scatter, "budgets": budgets}
    return Answer(said, tables, notes, document, files)


def _not_fixed(model: Any, names: Any) -> list[str]:
    """Parameters that have a tolerance: all but constants of nature, of a law, or numerical."""
    info = jc.parameter_info(model)
    return [n for n in names if info[n].kind != "fixed" or n.startswith("extra.")]


def identify(
    subject: o.Case,
    measured: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="CSV")],
    *,
    draws: Annotated[int, o.count(16)] = 128,
    steps: o.StepOptions = o.StepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Narrow the ranges of a TOML file by measurements on the machine, and write them to a new file.

    Args:
        measured: Measurements: a file with the columns quantity, speed, value, tolerance; a quantity is
            `whirl frequency` [Hz], `orbit size` [mm], or without a value `rattles` or `calm`.
        draws: Number of draws from the ranges in each stage.
    """
    model, unknowns = subject.model, subject.unknowns
    rows = jc.files.read_measurements(measured, subject.speeds, 1 / (subject.shaft or 1.0))
    told = {"method": steps.method, "progress": partial(report, "simulations")}
    missed = lambda place: jc.design.misses(model, unknowns, rows, place, **told)
    found = jc.design.narrow(unknowns, missed, draws=draws)
    table, info = jc.show.measured_table(found, rows, subject.beside), jc.parameter_info(model)
    document = {name: getattr(found, name) for name in ("draws", "stages", "accepted")}
    if not found.accepted:
        worst = max(table.records, key=lambda row: row["off_by_tolerances"])
        off = f"{worst['off_by_tolerances']:.2g} tolerances off in '{worst['what']}'"
        why = f"None of {found.draws} draws does what was measured in all rows: the nearest is {off}."
        why += " Widen ranges or tolerances, or look for what the model leaves out."
        said = "No draw does what was measured."
        return Answer(said, [table], [], document | {"file": None}, by_ranges=True, failure=why)
    units = {u.label: info[u.names[0]].unit for u in unknowns}
    each = zip(found.unknowns, found.ranges, found.narrowed, strict=True)
    new = {u.label: (r, units[u.label]) for u, r, worth in each if worth}
    text = jc.files.with_ranges(jc.files.read_bytes(subject.path).decode(), new)
    said = f"{found.accepted} of {found.draws} draws of the last of {found.stages} stages do what was measured"
    said = f"{len(new) or 'None'} of {len(units)} ranges became narrower: {said}."
    return Answer(said, [jc.show.narrowed_table(found, units), table], [], document, {"file": text}, by_ranges=True)
