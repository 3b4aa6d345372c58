"""Searches for a better design on eight variables: `python -m benchmarks.pay [--bearing 1b]`.

The objective is that of `jaxcage design`, fixed before anything was compared: chaotic speeds [rpm], 1000 for the wear
load and 1000 for the peak force that the land has now, 1000 a unit of cost; balance may only get better. Every search
has 300 designs, each run at 8 speeds from one start, ten at a time by one compiled program. What a search does between
designs counts as processor time. Its answer is judged once more by finer steps, four times the speeds, and two starts
more. The better of the rivals, in the median of its seeds, is what there is to be reached.

Searches are kept in a ledger one by one (bearing, search, seed): the same command goes on where it stopped, `--table`
shows what there is.
"""

import argparse
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
from jaxcage.design import (
    AbstractObjective,
    Chaos,
    DesignSpace,
    LandLoad,
    SurrogateSearch,
    chaotic_width,
    cost,
    relative,
)
from jaxcage.files import read_bearing
from jaxcage.solve import DEFAULT_ERROR


HERE = pathlib.Path(__file__).parent
LEDGER = HERE / "pay.json"
BUDGET, SHORT, TOGETHER, SEEDS = 300, 60, 10, 5
"""Designs of a search, those after which its best is shown too, designs at a time, and searches of each kind."""
SPEEDS, DISCARD, REVOLUTIONS, LOADED = 8, 60, 30, 1
"""Speeds and revolutions of each design in a search; over the last revolutions wear and peak force are read."""
LANE_REVOLUTIONS = SPEEDS * (DISCARD + REVOLUTIONS + LOADED)
"""Lanes times revolutions that one design costs."""
HOPELESS = 1e6
"""Value of a design that failed [rpm]."""
PRICE = 1000.0
"""Price of wear load, peak land force and cost, as in `jaxcage design`."""
BEARINGS = ("1b", "3a", "spindle")
"""The spindle was not looked at while the searches were made."""
RIVALS = ("CMA-ES", "differential evolution")
HEAD = f"search,seeds,after {SHORT},after {BUDGET},checked,reached after,10^6 lane-rev,processor s".split(",")
RELATIVE = {
    "land_width": (0.7, 1.5),
    "cage_mass": (0.8, 1.2),
    "rib_diameter": (0.98, 1.02),
    "amplitude": (0.7, 1.3),
    "stiffness": (0.5, 2.0),
}
"""Bounds beside what the bearing has. The impact's amplitude stands for the pocket clearance, which acts through it,
the contact's stiffness for what cage and land are made of; the radial clearance does not act on this model."""
WARM, HOT = 303.15, 353.15
"""Temperature of the oil [K], which sets its viscosity."""


def bearing(name: str) -> tuple[jc.CageModel, dict[str, tuple[float, float]], tuple[float, float]]:
    """A bearing, what may be changed in it and between which bounds [SI], and its range of cage speeds [rpm]."""
    range_ = 4000.0, 27500.0
    if name == "spindle":
        model = read_bearing(HERE / "spindle.toml").model
        ratio = float(model.bearing.cage_speed_ratio)
        range_ = 4000.0 * ratio, 27500.0 * ratio
        gap = 0.15e-3, 0.35e-3
    else:
        model, gap = jc.case(name), (0.30e-3, 0.60e-3)
    now = {n: float(x) for n, x in jc.parameters(model).items()}
    vary = {"guidance_gap": gap, "eccentricity": (5e-6, now["eccentricity"]), "temperature": (WARM, HOT)}
    return model, vary | {n: (low * now[n], high * now[n]) for n, (low, high) in RELATIVE.items()}, range_


def whole(space: DesignSpace, chaos: Chaos) -> AbstractObjective:
    """Chaotic speeds, wear load and peak land force beside what the bearing itself has, and cost."""
    each = (LandLoad(chaos.runs, name, LOADED) for name in ("wear load", "peak land force"))
    loads = [relative(load, space.system, PRICE) for load in each]
    return sum(loads, start=chaos) + PRICE * cost()


class Case:
    """A bearing with its objectives: that of the searches, and a finer one that judges what they found."""

    def __init__(self, name: str):
        model, vary, range_ = bearing(name)
        self.space = DesignSpace.of(model, vary)
        self.objective = whole(self.space, chaotic_width(*range_, SPEEDS, discard=DISCARD, revolutions=REVOLUTIONS))
        shift = 0.25 * (range_[1] - range_[0]) / (4 * SPEEDS)
        inside = range_[0] + shift, range_[1] - shift
        length: Any = dict(starts=3, discard=150, revolutions=100, method=jc.native(error=DEFAULT_ERROR / 4))
        self.fine = whole(self.space, chaotic_width(*inside, 4 * SPEEDS, **length))


class Spent(Exception):
    """The search has had its designs."""


class Asked:
    """The designs that one search has asked for, with their values and the time spent."""

    def __init__(self, case: Case):
        self.case, self.began = case, time.process_time()
        self.places: list[np.ndarray] = []
        self.found: list[float] = []
        self.trace: list[tuple[float, float, float]] = []
        """Designs, processor seconds, and the best so far, whenever there was a better one."""

    def values(self, places: np.ndarray) -> np.ndarray:
        """The objective of some designs, ten at a time, as far as there is something left."""
        rows = []
        for first in range(0, len(places), TOGETHER):
            part = np.asarray(places[first : first + TOGETHER])
            if len(self.found) >= BUDGET:
                raise Spent
            filled = np.concatenate([part, np.repeat(part[-1:], TOGETHER - len(part), axis=0)])
            value = self.case.objective.values(self.case.space, filled)[: len(part)]
            value = np.where(np.isfinite(value), value, HOPELESS)
            better = np.min(value) < min(self.found, default=np.inf)
            self.places += list(part)
            self.found += value.tolist()
            if better:
                self.trace.append((len(self.found), time.process_time() - self.began, float(np.min(value))))
            rows.append(value)
        return np.concatenate(rows)


def by_cma(asked: Asked, start: np.ndarray, seed: int) -> None:
    """CMA-ES from the design itself."""
    options = dict(bounds=[0, 1], seed=seed + 1, popsize=TOGETHER, verbose=-9)
    search = cma.CMAEvolutionStrategy(start, 0.3, options)
    while True:
        places = search.ask()
        search.tell(places, asked.values(np.array(places)).tolist())


def by_evolution(asked: Asked, start: np.ndarray, seed: int) -> None:
    """Differential evolution of 20 designs, among them the design itself."""
    first = qmc.LatinHypercube(len(start), rng=seed).random(2 * TOGETHER)
    first[0] = asked.case.space.place.clip(0, 1)
    differential_evolution(
        lambda x: asked.values(x.T),
        [(0, 1)] * len(start),
        init=first,  # pyright: ignore[reportArgumentType]
        vectorized=True,
        updating="deferred",
        maxiter=BUDGET,
        polish=False,
        tol=0,
        rng=seed,
    )


def by_surrogate(asked: Asked, start: np.ndarray, seed: int) -> None:
    """As `jaxcage design`: a Gaussian process of what was found chooses ten designs at a time."""
    search = SurrogateSearch(start, TOGETHER, (seed, 0))
    while True:
        places = search.ask()
        search.tell(places, asked.values(places))


def as_it_is(asked: Asked, start: np.ndarray, seed: int) -> None:
    """The bearing itself."""
    asked.values(asked.case.space.place[None].clip(0, 1))


SEARCHES: dict[str, Callable[[Asked, np.ndarray, int], None]] = {
    "CMA-ES": by_cma,
    "differential evolution": by_evolution,
    "surrogate": by_surrogate,
}


def searched(case: Case, bearing: str, name: str, seed: int) -> dict[str, Any]:
    """One search and the check of what it found, as the ledger has it; `none` is the bearing as it is."""
    asked = Asked(case)
    try:
        SEARCHES.get(name, as_it_is)(asked, case.space.place.clip(0.02, 0.98), seed)
    except Spent:
        pass
    seconds = time.process_time() - asked.began
    at = asked.places[int(np.argmin(asked.found))]
    return {
        "bearing": bearing,
        "search": name,
        "seed": seed,
        "lane_revolutions": len(asked.found) * LANE_REVOLUTIONS,
        "seconds": round(seconds, 1),
        "best": round(min(asked.found), 1),
        "trace": [(count, round(when, 1), round(value, 1)) for count, when, value in asked.trace],
        "place": [round(float(x), 4) for x in at],
        "check": {"value": round(float(case.fine.values(case.space, at[None])[0]), 3)},
    }


def best_after(trace: Sequence[Sequence[float]], designs: float) -> float:
    """The lowest value that a search had seen after so many designs; NaN before its first batch."""
    return min((value for count, _, value in trace if count <= designs), default=float("nan"))


def designs_until(trace: Sequence[Sequence[float]], value: float) -> float:
    """After how many designs a search had seen a value as low; infinity for never."""
    return next((float(count) for count, _, found in trace if found <= value), float("inf"))


def to_be_reached(runs: Sequence[dict[str, Any]]) -> float:
    """The rivals' best: of each the median of its seeds, of these the lower."""
    of = lambda name: [r["best"] for r in runs if r["search"] == name]
    return min((float(np.median(of(name))) for name in RIVALS if of(name)), default=float("nan"))


def table(ledger: Sequence[dict[str, Any]]) -> str:
    """The table of results: medians over seeds for each bearing and search, with lowest and highest in brackets."""
    parts = []
    for bearing in dict.fromkeys(r["bearing"] for r in ledger):
        of = [r for r in ledger if r["bearing"] == bearing]
        runs, own = [r for r in of if r["search"] != "none"], next(r for r in of if r["search"] == "none")
        goal = to_be_reached(runs)
        head = (
            f"{bearing}: {own['best']:.0f} rpm as it is, {own['check']['value']:.0f} by the finer check; "
            f"to be reached: {goal:.0f}"
        )
        names = dict.fromkeys(r["search"] for r in runs)
        rows = [_row(name, [r for r in runs if r["search"] == name], goal) for name in names]
        parts.append(f"{head}\n{columns([HEAD, *rows], right=True)}")
    return "\n\n".join(parts)


def _row(name: str, runs: Sequence[dict[str, Any]], goal: float) -> list[str]:
    until = np.array([designs_until(r["trace"], goal) for r in runs])
    median = float(np.sort(until)[(len(until)) // 2])
    reached = f"{int(np.sum(np.isfinite(until)))} of {len(until)}" + ("" if np.isinf(median) else f": {median:.0f}")
    spread = lambda values: f"{np.median(values):.0f} ({np.min(values):.0f} to {np.max(values):.0f})"
    return [
        name,
        str(len(runs)),
        spread([best_after(r["trace"], SHORT) for r in runs]),
        spread([r["best"] for r in runs]),
        spread([r["check"]["value"] for r in runs]),
        reached,
        f"{np.median([r['lane_revolutions'] for r in runs]) / 1e6:.2f}",
        f"{np.median([r['seconds'] for r in runs]):.0f}",
    ]


def main() -> None:
    """Read the options, run what the ledger does not have, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bearing", nargs="*", default=BEARINGS, choices=BEARINGS)
    parser.add_argument("--search", nargs="*", default=list(SEARCHES), choices=list(SEARCHES))
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--ledger", type=pathlib.Path, default=LEDGER)
    parser.add_argument("--table", action="store_true", help="run nothing")
    given = parser.parse_args()
    jc.enable_x64()
    jc.keep_compiled_programs()
    ledger = json.loads(given.ledger.read_text(encoding="utf-8")) if given.ledger.exists() else []
    wanted = [(b, "none", 0) for b in given.bearing]
    wanted += [(b, s, seed) for seed in range(given.seeds) for b in given.bearing for s in given.search]
    of = functools.cache(Case)
    for bearing, name, seed in wanted if not given.table else ():
        if any((r["bearing"], r["search"], r["seed"]) == (bearing, name, seed) for r in ledger):
            continue
        case = of(bearing)
        as_it_is(Asked(case), case.space.place, 0)  # compiles
        ledger.append(searched(case, bearing, name, seed))
        lines = ",\n".join(json.dumps(r) for r in ledger)
        given.ledger.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
        print(f"{bearing}, {name}, seed {seed}: {ledger[-1]['best']:.0f}", flush=True)
    print(table(ledger))


if __name__ == "__main__":
    main()
