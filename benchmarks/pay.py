"""Designs with and without gradients: `python -m benchmarks.pay [--case 1a] [--seeds 3]`.

The problem is that of `jc.design_for`: the lowest cost of a cage that is stable over an operating range, with a margin
of 10 % at both ends, in eight variables. For the NU1014 a disturbance must also fall to 1/e within 3 revolutions, and
the film take at most 350 W. The search of `design_for` has exact derivatives. Three others have none and minimise cost
over that of the given design, plus 10 times what the worst requirement falls short: CMA-ES, the package's surrogate,
and differential evolution. A trial is the same for all: edges are followed from the nearest known design. A trial at
which an edge is lost falls short by 10.

The search with derivatives begins at the given design (seed 0) and at quasi-random designs. The others have the given
design among their first and may try 60. One of them ends as soon as it is within 1 % of the least cost in the ledger,
and is repeated if the ledger's least cost becomes lower. Processor time is that of the process and begins when the
edges of the given design are known. The first search of a process also compiles its programs. Searches are kept in a
ledger one by one: the same command goes on where it stopped, `--table` shows what there is.
"""

import argparse
import copy
import functools
import json
import pathlib
import time
from collections.abc import Callable, Sequence
from typing import Any

import cma
import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

import jaxcage as jc
from benchmarks.common import columns
from jaxcage.design import SEARCHES, DesignSpace, OperatingRange, Requirements, SurrogateSearch, cost_function
from jaxcage.design.operating import KEPT
from jaxcage.design.optimiser import Problem
from jaxcage.design.requirements import listed
from jaxcage.files import read_bearing
from jaxcage.lanes import sobol


LEDGER = pathlib.Path(__file__).parent / "pay.json"
BUDGET, SEEDS, TOGETHER = 60, 5, 10
"""Trials of a search, searches of each kind, and trials that CMA-ES and the surrogate ask for at a time."""
WITHIN, OURS = 1.01, "with gradient"
"""A cost over the least known one at which a search has reached it, and the name of the search of `design_for`."""
RANGES = {"1a": (12500, 18000), "2a": (12000, 18000), "3a": (12500, 18500)}
RANGES |= {"spindle": (1785, 6246), "nu1014": (1778, 6222)}
"""Operating ranges [rpm of the cage]. Those of 1a to 3a take the calm speeds between two unstable ranges, and less
than the margin is left at both ends of the given design. Spindle and NU1014, which nobody tuned, run at 4000 to 14000
rpm of their shafts."""
GAPS = {"spindle": (0.15e-3, 0.35e-3), "nu1014": (0.15e-3, 0.60e-3)}
"""Bounds of the guidance gap [m]; 0.3 to 0.6 mm in the other cases."""
KEEP = {"nu1014": Requirements(decay=3.0, drag=350.0)}
OIL = 303.15, 353.15  # temperatures [K], which set the viscosity
RELATIVE = {"land_width": (0.7, 1.5), "cage_mass": (0.8, 1.2), "rib_diameter": (0.98, 1.02), "amplitude": (0.7, 1.3)}
RELATIVE |= {"stiffness": (0.5, 2.0)}
"""Bounds over what the bearing has. The impact's amplitude stands for the pocket clearance, which acts through it, the
contact's stiffness for the materials of cage and land."""


class Case:
    """A bearing with its operating range, requirements and cost."""

    def __init__(self, name: str):
        path, keep = LEDGER.with_name(f"{name}.toml"), KEEP.get(name, Requirements())
        model = read_bearing(path).model if path.exists() else jc.case(name)
        now = {n: float(x) for n, x in jc.parameters(model).items()}
        gap = GAPS.get(name, (0.30e-3, 0.60e-3))
        vary = {"guidance_gap": gap, "eccentricity": (5e-6, now["eccentricity"]), "temperature": OIL}
        space = DesignSpace.of(model, vary | {n: (low * now[n], high * now[n]) for n, (low, high) in RELATIVE.items()})
        low, high = (rpm * np.pi / 30 for rpm in RANGES[name])
        self.own = space.place.clip(0, 1)
        self.range = OperatingRange(space, (low, high), keep.margin)
        self.rest = listed(keep, model), cost_function(None, model), np.ones(self.own.size, bool), {}
        self.cost = self.problem().at(self.own).cost

    def problem(self) -> Problem:
        """The problem, with the edges of the given design only."""
        return Problem(copy.deepcopy(self.range), *self.rest)


class Ended(Exception):
    """The search has spent its budget or reached what there is to be reached."""


class Asked:
    """The trials of one search, with the time spent."""

    def __init__(self, case: Case, until: float):
        self.case, self.until, self.problem, self.began = case, until, case.problem(), time.process_time()
        self.trace: list[tuple[int, float, float]] = []  # trials, seconds and cost of each cheaper feasible design
        self.lost, self.compute, self.problem.compute = 0, self.problem.compute, self.tried

    def tried(self, place: np.ndarray) -> Any:
        """One trial, which is counted."""
        if self.problem.evaluations >= BUDGET:
            raise Ended
        trial = self.compute(place)
        self.lost += bool(trial.lost)
        feasible = not trial.lost and np.min(trial.slack) >= -KEPT
        if feasible and trial.cost < min((t[2] for t in self.trace), default=np.inf):
            self.trace.append((self.problem.evaluations, round(time.process_time() - self.began, 1), trial.cost))
            if trial.cost <= self.until:
                raise Ended
        return trial

    def values(self, places: np.ndarray) -> np.ndarray:
        """The objective of searches without derivatives."""
        return np.array([self.problem.priced(self.problem.at(place), self.case.cost) for place in places])


def with_gradient(asked: Asked, seed: int) -> None:
    """As `design_for`, from the given design or from one of its other first designs."""
    begins = [asked.case.own, *sobol(asked.case.own.size, SEEDS, 0)]
    SEARCHES["slsqp"](asked.problem, begins[seed], lambda done: None)


def by_cma(asked: Asked, seed: int) -> None:
    """CMA-ES from the given design."""
    options = dict(bounds=[0, 1], seed=seed + 1, popsize=TOGETHER, verbose=-9)
    search = cma.CMAEvolutionStrategy(asked.case.own.clip(0.02, 0.98), 0.3, options)
    while True:
        places = search.ask()
        search.tell(places, asked.values(np.array(places)).tolist())


def by_evolution(asked: Asked, seed: int) -> None:
    """Differential evolution of 20 designs, among them the given one."""
    first = qmc.LatinHypercube(asked.case.own.size, rng=seed).random(2 * TOGETHER)
    first[0] = asked.case.own
    value, given = lambda x: float(asked.values(x[None])[0]), dict[str, Any](init=first, polish=False, tol=0, rng=seed)
    differential_evolution(value, [(0, 1)] * asked.case.own.size, maxiter=BUDGET, **given)


def by_surrogate(asked: Asked, seed: int) -> None:
    """The package's search by a Gaussian process, from the given design."""
    search = SurrogateSearch(asked.case.own, TOGETHER, seed)
    while True:
        places = search.ask()
        search.tell(places, asked.values(places))


KINDS: dict[str, Callable[[Asked, int], None]] = {
    OURS: with_gradient,
    "CMA-ES": by_cma,
    "surrogate": by_surrogate,
    "differential evolution": by_evolution,
}
Ledger = Sequence[dict[str, Any]]


def searched(case: Case, name: str, kind: str, seed: int, least: float) -> dict[str, Any]:
    """One search, as the ledger has it."""
    asked = Asked(case, -np.inf if kind == OURS else WITHIN * least)
    try:
        KINDS[kind](asked, seed)
    except Ended:
        pass
    tried = {"evaluations": asked.problem.evaluations, "lost": asked.lost, "trace": asked.trace}
    seconds = round(time.process_time() - asked.began, 1)
    return {"case": name, "search": kind, "seed": seed, "cost0": case.cost, "seconds": seconds, **tried}


def least_cost(ledger: Ledger, case: str) -> float:
    """The lowest feasible cost that any search found."""
    return min((r["trace"][-1][2] for r in ledger if r["case"] == case and r["trace"]), default=-np.inf)


def reached(run: dict[str, Any], least: float) -> tuple[float, float]:
    """Trials and processor seconds until a search was within 1 % of a cost; infinity for never."""
    return next(((n, s) for n, s, cost in run["trace"] if cost <= WITHIN * least), (np.inf, np.inf))


def table(ledger: Ledger) -> str:
    """Medians over seeds for each case and search."""
    parts: list[str] = []
    for case in dict.fromkeys(r["case"] for r in ledger):
        of, least, (low, high) = [r for r in ledger if r["case"] == case], least_cost(ledger, case), RANGES[case]
        rows = [["search", "seeds", "reached", "trials", "processor s", "least cost"]]
        for kind in dict.fromkeys(r["search"] for r in of):
            runs = [r for r in of if r["search"] == kind]
            each = [reached(r, least) for r in runs]
            at = [float(np.sort(x)[len(x) // 2]) for x in zip(*each, strict=True)]
            costs = sorted(r["trace"][-1][2] if r["trace"] else np.inf for r in runs)
            shown = [f"{x:.0f}" if np.isfinite(x) else "never" for x in at]
            count = f"{sum(np.isfinite(x[0]) for x in each)} of {len(runs)}"
            rows.append([kind, str(len(runs)), count, *shown, f"{costs[len(costs) // 2]:.4f}"])
        known = f"cost {of[0]['cost0']:.4f} as it is, least known {least:.4f}"
        parts.append(f"{case}, {low} to {high} rpm: {known}\n{columns(rows, right=True)}\n")
    return "\n".join(parts).rstrip()


def main() -> None:
    """Read the options, run what the ledger does not have, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", nargs="*", default=list(RANGES), choices=list(RANGES))
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--table", action="store_true", help="run nothing")
    given = parser.parse_args()
    jc.enable_x64()
    jc.keep_compiled_programs()
    ledger = json.loads(LEDGER.read_text(encoding="utf-8"))
    wanted = [(c, OURS, seed) for c in given.case for seed in range(given.seeds)]
    wanted += [(c, k, seed) for seed in range(given.seeds) for k in KINDS for c in given.case if k != OURS]
    of = functools.cache(Case)
    for case, kind, seed in wanted if not given.table else ():
        least, this = least_cost(ledger, case), (case, kind, seed)
        same = [r for r in ledger if (r["case"], r["search"], r["seed"]) == this]
        if any(kind == OURS or r["evaluations"] >= BUDGET or np.isfinite(reached(r, least)[0]) for r in same):
            continue
        ledger = [r for r in ledger if r not in same] + [searched(of(case), case, kind, seed, least)]
        LEDGER.write_text("[\n" + ",\n".join(map(json.dumps, ledger)) + "\n]\n", encoding="utf-8")
        print(f"{case} {kind} {seed}: {ledger[-1]['evaluations']} trials, {ledger[-1]['trace'][-1:]}", flush=True)
    print(table(ledger))


if __name__ == "__main__":
    main()
