"""Do gradients pay? Searches for a better design on eight variables: `python -m benchmarks.pay [--bearing 1b]`.

The objective is that of `jaxcage design`, fixed before anything was compared: chaotic speeds [rpm], 1000 for the wear
load and 1000 for the peak force that the land has now, 1000 a unit of cost; balance may only get better. Every search
has 300 designs, each run at 8 speeds from one start, ten at a time by one compiled program. A design costs the same
whoever asks for it, and what a search does between designs counts as processor time. Its answer is judged once more by
finer steps, four times the speeds, and two starts more.

Searches are kept in a ledger one by one (bearing, search, seed): the same command goes on where it stopped, `--table`
shows what there is.
"""

import argparse
import dataclasses
import functools
import json
import pathlib
import time
from collections.abc import Callable, Mapping
from typing import Any

import cma
import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

import jaxcage as jc
from benchmarks.pay_table import table
from jaxcage.design import (
    AbstractObjective,
    ChaosMeasure,
    DesignSpace,
    LandMeasure,
    Measured,
    SurrogateSearch,
    chaotic_width,
    cost,
)
from jaxcage.integrate import DEFAULT_ERROR
from jaxcage.io import read_bearing


HERE = pathlib.Path(__file__).parent
LEDGER = HERE / "pay.json"
BUDGET, TOGETHER, SCOUTS, SEEDS = 300, 10, 40, 5
SPEEDS, DISCARD, REVOLUTIONS, LOADED = 8, 60, 30, 1
"""Of each design in a search; the last is revolutions over which wear and peak force are read."""
WARM_DISCARD, WARM_REVOLUTIONS = 15, 15
"""Of the designs of a cloud that goes on where the lanes in its middle ended."""
BESIDE, HOPELESS = 100.0, 1e6
"""Added before a logarithm is taken, and what a design counts that failed [rpm]."""
PRICE = 1000.0
"""Of wear load, peak land force and cost, as `jaxcage design` has it."""
BEARINGS = ("1b", "3a", "spindle")
"""The spindle was not looked at while the searches were made."""
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


class Spent(Exception):
    """The search has had its designs."""


LOADS = ("wear load", "peak land force")
COST = cost()
FULL = DISCARD + REVOLUTIONS + LOADED
"""Revolutions of each lane of a design."""


@dataclasses.dataclass
class Counted(AbstractObjective):
    """The objective; what was asked of it, and what that took."""

    chaos: ChaosMeasure
    weights: Mapping[str, float]
    """Of wear load and peak land force."""
    spent: int = 0
    """Lane-revolutions."""
    places: list[np.ndarray] = dataclasses.field(default_factory=list)
    found: list[float] = dataclasses.field(default_factory=list)
    last: list[np.ndarray] = dataclasses.field(default_factory=list)
    """Of each design, in the order in which they were asked for; where its lanes ended."""
    trace: list[tuple[float, float, float]] = dataclasses.field(default_factory=list)
    """Designs' worth of lane-revolutions, processor seconds, and the best so far, whenever there was a better one."""
    began: float = dataclasses.field(default_factory=time.process_time)

    def rest(self, space: DesignSpace, places: np.ndarray, chaos: ChaosMeasure) -> tuple[np.ndarray, np.ndarray]:
        """All but the cost, and where the lanes ended, ten designs at a time, as far as there is something left."""
        values, last = [], []
        for first in range(0, len(places), TOGETHER):
            part = np.asarray(places[first : first + TOGETHER])
            if self.spent >= BUDGET * SPEEDS * FULL:
                raise Spent
            filled = np.concatenate([part, np.repeat(part[-1:], TOGETHER - len(part), axis=0)])
            value = noisy(chaos, self.weights).values(space, filled)[: len(part)]
            values += np.where(np.isfinite(value), value, HOPELESS).tolist()
            last += list(chaos.run(space, filled).last[: len(part)])
            self.spent += len(part) * SPEEDS * (chaos.discard + chaos.revolutions + LOADED)
        return np.array(values), np.array(last)

    def values(self, space: DesignSpace, places: np.ndarray) -> np.ndarray:
        rows = []
        for first in range(0, len(places), TOGETHER):
            part = np.asarray(places[first : first + TOGETHER])
            rest, last = self.rest(space, part, self.chaos)
            total = rest + PRICE * COST.values(space, part)
            if np.min(total) < min(self.found, default=np.inf):
                seconds = time.process_time() - self.began
                self.trace.append((self.spent / (SPEEDS * FULL), seconds, float(np.min(total))))
            self.places += list(part)
            self.found += total.tolist()
            self.last += list(last)
            rows.append(total)
        return np.concatenate(rows)

    def measure(self, space: DesignSpace, places: np.ndarray) -> list[Measured]:
        """Of the cost the slope is exact, of the rest it is that of a cloud of designs."""
        rest = lambda space, x: self.values(space, x) - PRICE * COST.values(space, x)
        cloud = self.chaos.through_cloud(space, places, rest)
        add = lambda a, b: dataclasses.replace(a, value=a.value + PRICE * b.value, slope=a.slope + PRICE * b.slope)
        return [add(a, b) for a, b in zip(cloud, COST.measure(space, places), strict=True)]

    @property
    def best(self) -> np.ndarray:
        """Place of the best design so far."""
        return self.places[int(np.argmin(self.found))]


def noisy(chaos: ChaosMeasure, weights: Mapping[str, float]) -> AbstractObjective:
    """Chaotic speeds, wear load and peak land force."""
    return sum((w * LandMeasure(chaos, what, LOADED) for what, w in weights.items()), start=chaos)


def weights_in(space: DesignSpace, chaos: ChaosMeasure) -> dict[str, float]:
    """Of wear load and peak land force, as `jaxcage design` has them: beside what the bearing itself has."""
    relative = lambda what: LandMeasure(chaos, what, LOADED).relative(space, PRICE)
    return {what: relative(what).parts[0][0] for what in LOADS}  # pyright: ignore[reportAttributeAccessIssue]


Search = Callable[[DesignSpace, Counted, int], np.ndarray | None]
"""From the space, what to make small and a seed to the place that it advises; the best it saw if that is None."""


def by_cma(space: DesignSpace, asked: Counted, seed: int) -> None:
    """CMA-ES from the design itself."""
    options = dict(bounds=[0, 1], seed=seed + 1, popsize=TOGETHER, verbose=-9)
    search = cma.CMAEvolutionStrategy(space.place.clip(0.02, 0.98), 0.3, options)
    while True:
        places = search.ask()
        search.tell(places, asked.values(space, np.array(places)).tolist())


def by_evolution(space: DesignSpace, asked: Counted, seed: int) -> None:
    """Differential evolution of 20 designs, among them the design itself."""
    first = qmc.LatinHypercube(len(space.names), rng=seed).random(2 * TOGETHER)
    first[0] = space.place.clip(0, 1)
    differential_evolution(
        lambda x: asked.values(space, x.T),
        [(0, 1)] * len(space.names),
        init=first,  # pyright: ignore[reportArgumentType]
        vectorized=True,
        updating="deferred",
        maxiter=BUDGET,
        polish=False,
        tol=0,
        rng=seed,
    )


def by_gradient(space: DesignSpace, asked: Counted, seed: int) -> np.ndarray:
    """As `jaxcage design --search gradient`: scouts, then steps of Adam down the slopes of clouds, from the best."""
    first = _scouted(space, asked, seed)[None]
    steps = (BUDGET - SCOUTS) // (2 * TOGETHER) - 1
    vary = {u.name: (u.lower, u.upper) for u in space.unknowns}
    found = jc.optimise(space.system, vary, asked, starts=first, steps=steps, tolerance=0.0)
    return np.array([u.place(found.best.values[u.name]) for u in space.unknowns])


def by_surrogate(space: DesignSpace, asked: Counted, seed: int) -> None:
    """As `jaxcage design`: a Gaussian process of what was found chooses ten designs at a time."""
    search = SurrogateSearch(space.place.clip(0.02, 0.98), TOGETHER, (seed, 0))
    while True:
        places = search.ask()
        search.tell(places, asked.values(space, places))


def by_warm_gradient(space: DesignSpace, asked: Counted, seed: int) -> np.ndarray:
    """The best scout walks down slopes of clouds that go on where its own lanes ended: a third of the revolutions.

    Slopes are of the logarithm, smoothed over steps. The ten places at which least was seen on the way are then judged
    as scouts are, from rest.
    """
    place = _scouted(space, asked, seed)
    last = asked.last[int(np.argmin(asked.found))]
    step_cost = 2 * TOGETHER * SPEEDS * (WARM_DISCARD + WARM_REVOLUTIONS + LOADED)
    steps = (BUDGET * SPEEDS * FULL - asked.spent - TOGETHER * SPEEDS * FULL) // step_cost
    lengths = np.geomspace(0.15, 0.03, steps)
    seen: list[tuple[float, np.ndarray]] = []
    pull = np.zeros(len(place))
    for step, length in enumerate(lengths):
        short = dict(discard=WARM_DISCARD, revolutions=WARM_REVOLUTIONS, cloud=2 * TOGETHER - 2, seed=seed + step)
        chaos = dataclasses.replace(asked.chaos, starts=last, **short)  # pyright: ignore[reportArgumentType]
        cost_here = COST.measure(space, place[None])[0]
        ends: list[np.ndarray] = []

        def around(space: DesignSpace, cloud: np.ndarray) -> np.ndarray:
            rest, ended = asked.rest(space, np.vstack([cloud, place, place]), chaos)
            seen.append((float(rest[-1]) + PRICE * cost_here.value, place))
            ends.append(ended[-1])
            return np.log(rest[:-2] + BESIDE)

        cloud = chaos.through_cloud(space, place[None], around)[0]
        if np.all(np.isfinite(ends[0])):
            last = ends[0]
        slope = np.exp(cloud.value) * cloud.slope + PRICE * cost_here.slope
        pull = 0.5 * pull + slope / max(float(np.linalg.norm(slope)), 1e-300)
        place = np.clip(place - length * pull / max(float(np.linalg.norm(pull)), 1e-300), 0, 1)
    chosen = np.array([p for _, p in sorted(seen, key=lambda s: s[0])[:TOGETHER]])
    asked.values(space, chosen)
    return asked.best


def _scouted(space: DesignSpace, asked: Counted, seed: int) -> np.ndarray:
    """The best of some designs all over the bounds, one of them the design itself."""
    scouts = qmc.Sobol(len(space.names), rng=seed).random_base2(6)[:SCOUTS]
    scouts[0] = space.place.clip(0.02, 0.98)
    return scouts[int(np.argmin(asked.values(space, scouts)))]


SEARCHES: Mapping[str, Search] = {
    "CMA-ES": by_cma,
    "differential evolution": by_evolution,
    "gradient, Adam": by_gradient,
    "gradient, warm": by_warm_gradient,
    "surrogate": by_surrogate,
}


class Case:
    """A bearing with its objectives: that of the searches, and a finer one that judges what they found."""

    def __init__(self, name: str):
        model, vary, range_ = bearing(name)
        self.space = DesignSpace.of(model, vary)
        self.chaos = chaotic_width(
            *range_, SPEEDS, discard=DISCARD, revolutions=REVOLUTIONS, cloud=2 * TOGETHER, spread=0.1
        )
        shift = 0.25 * (range_[1] - range_[0]) / (4 * SPEEDS)
        inside = range_[0] + shift, range_[1] - shift
        steps = jc.controlled(DEFAULT_ERROR / 4)
        self.fine = chaotic_width(*inside, 4 * SPEEDS, starts=3, discard=150, revolutions=100, method=steps)
        self.weights = weights_in(self.space, self.chaos)
        self.fine_weights = weights_in(self.space, self.fine)

    def asked(self) -> Counted:
        """The objective, with nothing asked of it yet."""
        return Counted(self.chaos, self.weights)

    def warm_up(self) -> None:
        """Compile what the searches run."""
        asked, places = self.asked(), self.space.place[None].clip(0, 1)
        asked.values(self.space, places)
        warm = dict(starts=asked.last[0], discard=WARM_DISCARD, revolutions=WARM_REVOLUTIONS)
        asked.rest(self.space, places, dataclasses.replace(self.chaos, **warm))

    def check(self, place: np.ndarray) -> dict[str, float]:
        """The objective of one design by the finer measure, and its terms."""
        one = place[None]
        terms = {
            "chaos": float(self.fine.values(self.space, one)[0]),
            **{what: float(LandMeasure(self.fine, what, LOADED).values(self.space, one)[0]) for what in LOADS},
            "cost": float(COST.values(self.space, one)[0]),
        }
        loads = sum(w * terms[what] for what, w in self.fine_weights.items())
        return {"value": terms["chaos"] + loads + PRICE * terms["cost"]} | terms


def searched(case: Case, bearing: str, name: str, seed: int) -> dict[str, Any]:
    """One search and the check of what it found, as the ledger has it; `none` is the bearing as it is."""
    asked = case.asked()
    place: np.ndarray | None = case.space.place.clip(0, 1)
    if name == "none":
        asked.values(case.space, case.space.place[None].clip(0, 1))
    else:
        try:
            place = SEARCHES[name](case.space, asked, seed)
        except Spent:
            place = None
    seconds = time.process_time() - asked.began
    at = asked.best if place is None else place
    return {
        "bearing": bearing,
        "search": name,
        "seed": seed,
        "lane_revolutions": asked.spent,
        "seconds": round(seconds, 1),
        "best": round(min(asked.found), 1),
        "trace": [(round(count, 1), round(when, 1), round(value, 1)) for count, when, value in asked.trace],
        "place": [round(float(x), 4) for x in at],
        "check": {n: round(x, 3) for n, x in case.check(at).items()},
    }


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
        case.warm_up()
        ledger.append(searched(case, bearing, name, seed))
        lines = ",\n".join(json.dumps(r) for r in ledger)
        given.ledger.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
        print(f"{bearing}, {name}, seed {seed}: {ledger[-1]['best']:.0f}", flush=True)
    print(table(ledger))


if __name__ == "__main__":
    main()
