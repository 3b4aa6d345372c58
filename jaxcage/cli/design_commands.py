"""Commands about designs: better ones, tolerances, and values that are known within ranges only."""

import dataclasses
import hashlib
import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro

from . import options as o
from .answer import Answer, drawn


LOADS = {"wear": "wear load", "force": "peak land force", "power": "film drag power"}
"""Price -> load of the land of a cage."""
CHECKED_SPEEDS = 118
"""Speeds of the sweeps by which a design is checked: every 200 rpm of the usual range."""
FINER, STARTS = 2, 3
"""Multiple of the speeds of a search in the comparison of its best designs, and their initial states."""
ADVICE = "the same command goes on where the search stopped"
Vary = Annotated[o.Texts, tyro.conf.arg(metavar="NAME=LOWER:UPPER", help="Parameter to change, and its bounds.")]


def design(
    case: o.Case,
    *,
    vary: Vary = (),
    first: o.First = 4000.0,
    last: o.Last = 27500.0,
    speeds: o.FromTwo = 48,
    speed: o.OptionalSpeed = None,
    load: o.Load = None,
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
    starts: o.FromOne = 1,
    scouts: o.FromZero = 0,
    steps: o.OptionalCount = None,
    batch: o.OptionalCount = None,
    ensemble: o.FromOne = 4,
    discard: o.FromZero = 10,
    revolutions: o.FromTwo = 20,
    seed: o.Seed = 0,
    quick: o.Quick = False,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Change the design so that fewer speeds are chaotic; of a bearing so that wear, forces and losses at one speed are small.

    The best design is compared with the given one by fresh runs. Prices are in rpm of chaotic speeds for the present
    value, and of a bearing weights of relative values.

    Args:
        speeds: Speeds between first and last at which a design is assessed.
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
        starts: Searches: one from the design itself, others from the best of the scouts.
        scouts: Designs spread over the bounds that are looked at beforehand.
        steps: Steps of each search; 10 if left out, of a bearing 12.
        batch: Designs of a step; 12 if left out, of a bearing 16.
        ensemble: Of a bearing: drawn initial states of each design.
        discard: Of a bearing: revolutions left out.
        revolutions: Of a bearing: revolutions observed, an even number.
    """
    from .. import design as d, show as shown
    from .._errors import InputError
    from .subject import RPM, read_case
    from .values import no_worse_balance, read_bounds, read_each, read_scatter

    subject = read_case(case, load)
    model, bearing = subject.model, subject.reports_means
    bounds = read_bounds(vary, subject, d.CAGE_PARAMETERS if bearing else ())
    notes = [] if worse_balance else no_worse_balance(model, bounds)
    laws = read_each("--scatter", scatter, "NAME=10% or NAME=rayleigh", partial(read_scatter, tuple(bounds)))
    if 0 < scouts < starts - 1:
        raise InputError(f"Option --scouts must be 0 or at least {starts - 1}, but {scouts} was given.")
    if worst < 1 and not laws:
        raise InputError("Option --worst goes with --scatter.")
    prices = {"wear": wear, "force": force, "impulse": impulse, "power": power, "slip": slip, "balance": balance}
    prices = {name: _price(name, given, bearing) for name, given in prices.items()}
    at = None
    if bearing:
        if not sum(prices.values()):
            raise InputError(f"Options {', '.join(f'--{name}' for name in prices)} must not all be 0.")
        at = one_speed(subject, speed)
        runs = d.Runs.of_bearing(at, ensemble, discard, revolutions, seed=seed)
        fresh, objective_of = runs.fresh(), None
    else:
        low, high = subject.range(first, last, 2) * RPM
        chaos = d.chaotic_width(low, high, speeds)
        finer = d.chaotic_width(low, high, FINER * speeds, starts=STARTS)
        runs, fresh, price = chaos.runs, finer.runs, 1000.0 if cost is None else cost

        def objective_of(width: Any) -> Any:
            loads = [(LOADS[n], prices[n]) for n in LOADS if prices[n]]
            total = sum((d.relative(d.LandLoad(width.runs, n), model, p) for n, p in loads), start=width)
            total = d.Robust(total, laws, worst=worst, seed=seed) if laws else total
            return total + price * d.cost() if price else total

    about = repr(
        (subject.name, model, bounds, prices, cost, first, last, speeds, at, starts, scouts, batch, seed, laws)
    )
    stored = Path(show.out) / f".design_{subject.name}_{hashlib.sha256(about.encode()).hexdigest()[:12]}.npz"
    batches = steps or subject.usual(10, 12)
    search = {
        "starts": starts,
        "scouts": scouts,
        "batches": batches,
        "batch": batch or subject.usual(12, 16),
        "seed": seed,
    }
    with show.computing(f"design {subject.name}", ADVICE) as say:
        objective = d.bearing_objective(model, bounds, runs, prices) if objective_of is None else objective_of(chaos)
        report = lambda step, _: say("search", step, batches)
        found = d.surrogate_search(model, bounds, objective, keep=stored, report=report, **search)
        say("fresh runs", 0, 1)
        if objective_of is None:
            statistics: Any = {name: d.statistic(fresh, name) for name in (*d.COMPARED, d.BALANCE)}
            statistics |= {d.OBJECTIVE: objective.on(fresh)}
        else:
            found, itself = d.confirmed(found, objective_of(finer))
            statistics = {"chaotic speeds": finer} | {n: d.LandLoad(fresh, n) for n in (*d.LAND_LOADS, "least film")}
            statistics |= {d.BALANCE: d.statistic(fresh, d.BALANCE)}
        rows, failed = d.before_and_after(model, found.best.model, fresh, statistics)
        answer = _compared(subject, found, rows, first, last, seed, quick, show, say)
    stored.unlink(missing_ok=True)
    best = found.best
    better = found.best.objective < (itself if objective_of else 1.0)
    if bearing:
        overall = next(row for row in rows if row.name == d.OBJECTIVE)
        better = overall.known and overall.change < 0
    values = ", ".join(f"{name} {value:.4g}" for name, value in best.values.items())
    said = (
        f"A better design was found: {values} (SI units)."
        if better
        else "No better design was found: the given one stays."
    )
    notes += [
        f"Search: {best.status}, {len(best.history)} steps, objective {best.objective:.4g}",
        f"At a bound: {', '.join(best.at_bound)}." if best.at_bound else "No parameter ended at a bound.",
        f"Fresh runs that failed: {failed}",
    ]
    document = {"vary": bounds, "prices": prices, "better": better, "optimum": best.values, "objective": best.objective}
    document |= {
        "at_bound": best.at_bound,
        "status": best.status,
        "failed": failed,
        **({} if at is None else subject.both(at)),
    }
    tables = [
        shown.before_and_after_table("Before and after, from the same initial states", rows),
        shown.parameters_table(f"Design of {subject.name}", model, found, bounds),
        shown.optima_table(model, found),
        *answer.tables,
    ]
    return Answer(said, tables, [*notes, *answer.notes], document | answer.document, subject, answer.files)


def _price(name: str, given: float | None, bearing: bool) -> float:
    """A price as given, or the usual one."""
    usual = 1.0 if bearing else {"wear": 1000.0, "force": 1000.0}.get(name, 0.0)
    return usual if given is None else given


def one_speed(subject: Any, given: float | None) -> float:
    """The one speed [rad/s] that a command needs for a bearing.

    **Raises:** `InputError` if none is given.
    """
    from .._errors import InputError

    if given is None:
        raise InputError('Option --speed must be given for a bearing, e.g. --speed "10000 rpm shaft".')
    return subject.speed(given)


def _compared(
    subject: Any, found: Any, rows: Any, first: float, last: float, seed: int, quick: bool, show: Any, say: Any
) -> Answer:
    """Figure of a search; of a cage with zones of the designs before and after, by sweeps from other initial states."""
    import numpy as np

    from .. import show as shown
    from ..analysis import restless, zones
    from ..lanes import sweep
    from ..orbits import loss_zones, synchronous_orbits

    if subject.reports_means:
        return Answer("", files={"figure": (".png", shown.optimum_figure(found, rows, subject.name))})
    speeds, half = subject.range(first, last, CHECKED_SPEEDS), subject.model.dimension // 2
    size = float(subject.model.clearance) * np.array([1.0] * half + [0.3 * speeds[0]] * half)
    states = [tuple(0.6 * size * np.random.default_rng(seed + 1 + i).uniform(-1, 1, size.size)) for i in range(STARTS)]
    document: dict[str, Any] = {"chaotic_rpm": {}, "chaotic_zones": {}, "synchronous_loss_zones": {}}
    swept = []
    for when, model in (("before", subject.model), ("after", found.best.model)):
        given = {"starts": states, "discard": 300, "revolutions": 200, "progress": partial(say, f"sweep {when}")}
        swept.append(sweep(model, speeds, **given))
        document["chaotic_rpm"][when] = float(np.mean(restless(swept[-1])) * np.ptp(swept[-1]["rpm"].values))
        document["chaotic_zones"][when] = [shown.zone_record(zone) for zone in zones(swept[-1]).zones]
        if not quick:
            loss = loss_zones(synchronous_orbits(model, speeds[0], speeds[-1], progress=say))
            document["synchronous_loss_zones"][when] = [shown.zone_record(zone) for zone in loss.zones]
    columns = [shown.Column(head, ()) for head in ("design", "zone")]
    columns += [shown.Column(end, (), key=f"{end}_rpm", digits=0) for end in ("onset", "exit", "width")]
    tables = []
    for kind in ("chaotic", "synchronous_loss"):
        each = document[f"{kind}_zones"].items()
        lines = [{"design": when, "zone": i, **zone} for when, of in each for i, zone in enumerate(of, start=1)]
        tables += (
            [shown.rows_table(f"{kind.replace('_', '-').capitalize()} zones [rpm]", lines, columns)] if lines else []
        )
    note = "Chaotic speeds by sweeps from other initial states: {before:.0f} rpm before, {after:.0f} rpm after"
    notes = [note.format_map(document["chaotic_rpm"])]
    return Answer("", tables, notes, document, files={"figure": (".png", shown.design_figure(found, *swept))})


def sensitivity(
    case: o.Case,
    *,
    vary: Vary = (),
    first: o.First = 4000.0,
    last: o.Last = 27500.0,
    speeds: o.FromTwo = 48,
    speed: o.OptionalSpeed = None,
    load: o.Load = None,
    of: str = "wear",
    samples: o.OptionalCount = None,
    tolerance: Annotated[float, o.number("lie between 0 and 100 percent", lambda x: 0 < x < 100)] = 5.0,
    ensemble: o.FromOne = 4,
    discard: o.FromZero = 10,
    revolutions: o.FromTwo = 20,
    seed: o.Seed = 0,
    quick: o.Quick = False,
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """Shares of each parameter in the chaotic speeds over its range, and effect of tolerances on the exact edges.

    The same of a measure of a bearing with its rollers at one speed, such as its wear.

    Args:
        speeds: Speeds between first and last at which a design is assessed.
        of: Of a bearing: measure, such as wear, power, slip or pocket_force_peak_N.
        samples: Base samples of the Sobol indices, a power of 2; 64 if left out, of a bearing 32.
        tolerance: Tolerance of every parameter but constants, ± so many percent, uniformly distributed.
        ensemble: Of a bearing: drawn initial states of each design.
        discard: Of a bearing: revolutions left out.
        revolutions: Of a bearing: revolutions observed, an even number.
    """
    from .. import design as d, show as shown
    from .._errors import InputError
    from ..orbits import loss_zones, sensitivities, synchronous_orbits
    from .subject import RPM, read_case
    from .values import read_bounds

    subject = read_case(case, load)
    model, bearing = subject.model, subject.reports_means
    samples = samples or subject.usual(64, 32)
    require_power(samples)
    bounds = read_bounds(vary, subject, d.CAGE_PARAMETERS if bearing else ())
    deviation, document = tolerance / 100 / math.sqrt(3), {"vary": bounds, "tolerance_percent": tolerance}
    budgets, files = [], {}
    with show.computing(f"sensitivity {subject.name}") as say:
        told = {"progress": partial(say, "designs")}
        if bearing:
            if of not in d.BEARING_MEASURES:
                raise InputError(f"Option --of must be one of {', '.join(d.BEARING_MEASURES)}, but '{of}' was given.")
            at = one_speed(subject, speed)
            what, document = (
                f"{of.replace('_', ' ').capitalize()} of {subject.name}",
                document | {"of": of, **subject.both(at)},
            )
            objective = d.measure(d.Runs.of_bearing(at, ensemble, discard, revolutions, seed=seed, **told), of)
        else:
            low, high = subject.range(first, last, 2) * RPM
            what, objective = f"Chaotic speeds of {subject.name}", d.chaotic_width(low, high, speeds, **told)
        shares = d.global_sensitivity(model, bounds, objective, samples=samples, seed=seed)
        if bearing and not quick:
            runs = d.Runs(at, starts=2, discard=discard, revolutions=revolutions, blocks=2, exponents=0, tolerance=1e-4)
            spread = min(max(tolerance / 100, 0.05), 0.3)
            slopes = d.mean_gradient(model, runs, {of: d.measure(runs, of)}, spread=spread, seed=seed)
            budgets = [_budget(d, slopes.statistics[of], slopes.statistics[of].directions, deviation)]
            files["figure"] = ".png", shown.statistic_bars(slopes, f"{what}: elasticities")
        elif not quick:
            loss = loss_zones(synchronous_orbits(model, *(subject.range(first, last, 2)), progress=say))
            edges = [s for s in sensitivities(model, loss.edges).values() if s.trusted]
            budgets = [_budget(d, s, shown.not_fixed(model, s.elasticity), deviation) for s in edges]
            bars = lambda ax: shown.elasticity_bars(shown.to_be_turned(model, edges), ax)
            files |= (
                {"figure": (".png", drawn(f"{subject.name}: elasticities", bars, 9.0, 2.2 + 1.2 * len(edges)))}
                if edges
                else {}
            )
    most = max(shares.total, key=lambda n: shares.total[n])
    said = f"{most} matters most: with the other parameters it has {100 * shares.total[most]:.0f} % of the variance."
    tables = [shown.sobol_table(what, shares), *(shown.budget_table(b, tolerance) for b in budgets)]
    notes = [shares.warning] if shares.warning else []
    if shares.scatter:
        notes.append(
            f"Scatter of the motion itself is {100 * shares.scatter:.0f} % of the variance, in no parameter's own share."
        )
    notes += [f"Within twice the error, no effect: {', '.join(b.unclear)}" for b in budgets if b.unclear]
    document |= {"designs": shares.evaluations, "doubtful": shares.doubtful, "scatter": shares.scatter}
    return Answer(
        said, tables, notes, document | {"budgets": [shown.budget_record(b) for b in budgets]}, subject, files
    )


def _budget(d: Any, slope: Any, names: Any, deviation: float) -> Any:
    return d.tolerance_budget(slope, dict.fromkeys(names, deviation))


def require_power(samples: int) -> None:
    """**Raises:** `InputError` for a number of samples that is no power of 2."""
    from .._errors import InputError

    if samples < 2 or samples & (samples - 1):
        raise InputError(f"Option --samples must be a power of 2, but {samples} was given.")


def unknowns(
    case: o.Case,
    *,
    first: o.First = 2500.0,
    last: o.Last = 27500.0,
    speeds: o.FromOne = 8,
    samples: o.FromTwo = 16,
    seed: o.Seed = 0,
    steps: o.StepOptions = o.StepOptions(),
    show: o.ShowOptions = o.ShowOptions(),
) -> Answer:
    """The measurement that would decide: shares of each range of a TOML file in the chaotic speeds.

    Args:
        speeds: Speeds at which a draw is assessed.
        samples: Base samples of the Sobol indices, a power of 2.
    """
    from .. import show as shown
    from .._parameters import parameter_info
    from ..design import chaotic_shares, sobol_of
    from .subject import RPM, read_case

    subject = read_case(case)
    subject.require_ranges()
    require_power(samples)
    at, info = subject.range(first, last, speeds), parameter_info(subject.model)
    with show.computing(f"unknowns {subject.name}") as say:
        told = {"method": steps.method, "progress": partial(say, "draws")}
        share = partial(chaotic_shares, subject.model, subject.unknowns, at, **told)
        found = sobol_of(share, [u.label for u in subject.unknowns], samples=samples, seed=seed)
    sources = {u.label: info[u.names[0]].source for u in subject.unknowns}
    most = max(found.total, key=lambda name: found.total[name])
    said = f"Measure {most} first: {sources[most]}."
    if not any(found.total.values()):
        said = "Nothing to decide: every draw does the same."
    elif most in found.doubtful:
        said = "These draws do not tell what to measure first."
    document = {"designs": found.evaluations, "doubtful": found.doubtful, "speeds_rpm": at * RPM}
    table = shown.sobol_table(f"Chaotic share of {subject.name}", found, sources)
    document["measure"] = {"what": most, "how": sources[most]}
    return Answer(said, [table], [found.warning] if found.warning else [], document, subject.certain)


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
    from .. import show as shown
    from .._parameters import parameter_info
    from ..design import identify as narrow
    from ..files import read_bytes, read_measurements, with_ranges
    from .subject import read_case

    subject = read_case(case)
    subject.require_ranges()
    rows, info = read_measurements(measured, subject.speeds, 1 / subject.shaft), parameter_info(subject.model)
    with show.computing(f"identify {subject.name}") as say:
        given = {"draws": draws, "stages": stages, "seed": seed, "method": steps.method}
        found = narrow(subject.model, subject.unknowns, rows, **given, progress=partial(say, "draws"))
    tables = [shown.measured_table(found, rows, subject.beside)]
    document = {name: getattr(found, name) for name in ("draws", "stages", "accepted")}
    if not found.met:
        worst = max(tables[0].records, key=lambda row: row["off_by_tolerances"])
        why = f"None of {found.draws} draws does what was measured in all rows: the nearest is {worst['off_by_tolerances']:.2g} "
        why += (
            f"tolerances off in '{worst['what']}'. Widen ranges or tolerances, or look for what the model leaves out."
        )
        return Answer(
            "No draw does what was measured.", tables, [], document | {"file": None}, subject.certain, failure=why
        )
    units = {u.label: info[u.names[0]].unit for u in subject.unknowns}
    each = zip(found.unknowns, found.ranges, found.narrowed, strict=True)
    text = with_ranges(read_bytes(case).decode(), {u.label: (r, units[u.label]) for u, r, worth in each if worth})
    said = f"{found.accepted} of {found.draws} draws of the last of {found.stages} stages do what was measured."
    tables = [shown.narrowed_table(found, units), *tables]
    return Answer(said, tables, [], document, dataclasses.replace(subject.certain), {"file": (".toml", text)})
