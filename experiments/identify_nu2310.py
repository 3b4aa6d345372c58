"""The constants that the paper leaves out, by chaos that lasts: `python experiments/identify_nu2310.py [--minutes M]`.

A search in stages, each dearer than the one before and begun where that one ended, from the paper's start: chaos seen
in 200 revolutions, chaos that lasts 600, and chaos that lasts 3000 on a finer grid. `--from 1` goes straight to the
second one. Candidates are scored by `jaxcage.design.screen`: about the mean relative error of the edges,
with a price for every band too many. The first begins with quasi-random designs and with the package's set.

Every design goes to a ledger, a CSV file, from which another run goes on: it skips stages that were done, and begins
others at the best design that the ledger holds. `--read clearance_reading=radial` searches by another reading of the
paper, with `cubic_ratio` in place of the cubic stiffness for `support.cubic=dimensionless`. `--check` shows what the
ledger's best set, or that of `--begin FILE.json`, does at 100 rpm from three starts; with four times the steps by
`--steps 4`, to another horizon by `--horizon 6000`. `--trade-off` runs nothing and shows
how well the cases go together: what the ledger's designs reach in some of them, and in those left out.
"""

import argparse
import csv
import dataclasses
import itertools
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.integrate import controlled, finer
from jaxcage.report import LASTING, compare_edges, wide_zones


jc.enable_x64()

UNKNOWNS = (
    jc.design.Unknown("cage_mass", 0.20, 0.36),  # [kg] from the cage's shape
    jc.design.Unknown("stiffness_x", 5e3, 4e5),  # [N/m] of the support
    jc.design.Unknown("stiffness_y", 5e3, 4e5),
    jc.design.Unknown("cubic_stiffness", 1e10, 1e15),  # [N/m^3]; see RELATIVE
    jc.design.Unknown("damping", 0.3, 60.0),  # [N s/m]
    jc.design.Unknown("cross_stiffness", -1e4, 1e4, "linear"),  # [N/m]
    jc.design.Unknown("land_width", 0.5e-3, 6.5e-3),  # [m]
    jc.design.Unknown("amplitude", 10.0, 500.0),  # [N] at 1000 rad/s
    jc.design.Unknown("exponent", 1.0, 2.0, "linear"),
    jc.design.Unknown("contact_stiffness", 1e7, 1e11, sets=("stiffness",)),  # [N/m^(10/9)]
    jc.design.Unknown("restitution", 0.3, 1.0, "linear"),
)
RELATIVE = jc.design.Unknown("cubic_ratio", 1e-2, 1e3)
"""alpha in K_3 = alpha K_s / c^2, in place of the cubic stiffness, by the reading support.cubic=dimensionless."""

POPULATION = 4 + int(3 * np.log(len(UNKNOWNS)))
"""Designs of a generation of the evolution strategy."""


@dataclasses.dataclass(frozen=True)
class Stage:
    """How long and how finely candidates are looked at, and how many."""

    name: str
    horizon: int
    """Revolutions that chaos must last; 0 counts what is seen."""
    speeds: int
    starts: int
    designs: int
    """Quasi-random ones."""
    generations: int
    spread: float
    """First step of the evolution strategy, as a part of the bounds."""


STAGES = (
    Stage("seen", 0, 32, 1, 64, 40, 0.15),
    Stage("lasts 600", 600, 32, 1, 2, 30, 0.04),
    Stage("lasts 3000", 3000, 56, 1, 2, 40, 0.03),
)
QUICK = tuple(dataclasses.replace(s, speeds=8, designs=2, generations=1, horizon=min(s.horizon, 100)) for s in STAGES)


class Ledger:
    """The designs tried, in a file."""

    def __init__(self, path: Path, unknowns: tuple[jc.design.Unknown, ...]):
        self.path, self.unknowns = path, unknowns
        self.head = ("stage", "score", *PUBLISHED_CASES, *(u.name for u in unknowns))
        self.rows: list[dict[str, str]] = []
        if path.exists():
            with path.open() as file:
                self.rows = list(csv.DictReader(file))

    def add(self, stage: str, candidate: jc.design.Candidate) -> None:
        """One more design."""
        cases = [f"{candidate.by_case[c]:.4f}" if c in candidate.by_case else "" for c in PUBLISHED_CASES]
        row = [stage, f"{candidate.score:.4f}", *cases, *(f"{candidate.values[u.name]:.6g}" for u in self.unknowns)]
        self.rows.append(dict(zip(self.head, row, strict=True)))
        new = not self.path.exists()
        with self.path.open("a") as file:
            csv.writer(file, lineterminator="\n").writerows([self.head, row] if new else [row])

    def of(self, stage: str) -> list[dict[str, str]]:
        """The designs of a stage, best first."""
        return sorted((r for r in self.rows if r["stage"] == stage), key=lambda r: float(r["score"]))

    def best(self) -> dict[str, float]:
        """Values of the best design of the last stage that was reached, else of the package's set."""
        for stage in reversed(STAGES):
            if rows := self.of(stage.name):
                return {u.name: float(rows[0][u.name]) for u in self.unknowns}
        known = jc.parameters(jc.case("1a", "identified"))
        known["cubic_ratio"] = known["cubic_stiffness"] * known["guidance_gap"] ** 2 / known["stiffness_x"]
        return {u.name: float(known[u.targets[0]]) for u in self.unknowns}


def edges(cases: list[str]) -> list[jc.design.MeasuredEdge]:
    """The published ones, with the 2 % to which a diagram can be read."""
    made = []
    for name in cases:
        case = PUBLISHED_CASES[name]
        read = {"zone 1 onset": case.zone_1_onset_rpm, "zone 1 exit": case.zone_1_exit_rpm}
        read |= {"zone 2 onset": case.zone_2_onset_rpm}
        made += [jc.design.MeasuredEdge(name, edge, rpm, 0.02 * rpm, "chaotic") for edge, rpm in read.items()]
    return made


def check(models: dict[str, jc.CageModel], ledger: Ledger, values: dict[str, float], steps: int, horizon: int) -> None:
    """Edges of lasting chaos and its wide zones with these values, at 100 rpm, from three starts."""
    chosen = {target: values[u.name] for u in ledger.unknowns for target in u.targets}
    made = [jc.replace(model, **chosen) for model in models.values()]
    method = finer(controlled(), steps.bit_length() - 1) if steps > 1 else None
    errors = []
    for name, model in zip(models, made, strict=True):
        found = jc.zones(jc.sweep(model, jc.rpm(2500, 27500, 251), method=method, horizon=horizon)).zones
        rows = compare_edges(PUBLISHED_CASES[name], found, LASTING)
        errors += [30.0 if r.error_percent is None else abs(r.error_percent) for r in rows]
        said = [f"{r.edge} " + ("none" if r.ours_rpm is None else f"{r.error_percent:+.1f} %") for r in rows]
        print(f"{name}: {', '.join(said)}; {len(wide_zones(found))} wide zones", flush=True)
    print(f"{np.sum(np.array(errors) <= 10)} of {len(errors)} within 10 %, median error {np.median(errors):.1f} %")


def trade_off(ledger: Ledger) -> None:
    """How far off the ledger's designs are in each case and in all choices of cases: means of the score's parts."""
    reached = [rows for stage in STAGES if (rows := ledger.of(stage.name))]
    cases = [c for c in PUBLISHED_CASES if reached[-1][0][c]]
    off = np.array([[float(row[c]) for c in cases] for row in reached[-1]])
    mean = lambda some: off[:, list(some)].mean(axis=1)
    print(f"{len(off)} designs of the stage '{reached[-1][0]['stage']}'\n")
    print("case  the best for it alone  the best for all the others: in these  in it")
    for i, case in enumerate(cases):
        others = mean(set(range(len(cases))) - {i})
        best = np.argmin(others)
        print(f"{case:4s}{off[:, i].min():23.3f}{others[best]:39.3f}{off[best, i]:7.3f}")
    print(f"\n{'cases':5s}  {'that go together best':>22s}  mean  {'that go together worst':>22s}  mean")
    for n in range(2, len(cases) + 1):
        best = sorted((mean(some).min(), some) for some in itertools.combinations(range(len(cases)), n))
        ends = [f"{', '.join(cases[i] for i in some):>22s} {value:.3f}" for value, some in (best[0], best[-1])]
        print(f"{n:5d}  {'  '.join(ends)}")


def search(
    stage: Stage, models: dict[str, jc.CageModel], ledger: Ledger, begin: dict[str, float], until: float, seed: int
) -> bool:
    """One stage, and whether it came to its end before the time was up."""
    grid = np.geomspace(4000, 27500, stage.speeds) * np.pi / 30
    starts = [tuple(float(c) for c in y) for y in jc.case("1a").starts(1000.0)[: stage.starts]]
    began, best = time.perf_counter(), np.inf

    class OutOfTime(Exception):
        pass

    def tried(count: int, candidate: jc.design.Candidate) -> None:
        nonlocal best
        ledger.add(stage.name, candidate)
        if candidate.score < best:
            best = candidate.score
            print(f"{stage.name}: {time.perf_counter() - began:.0f} s, {count} tried: {candidate}", flush=True)
        if time.perf_counter() > until:
            raise OutOfTime

    options: dict[str, Any] = dict(designs=stage.designs, generations=stage.generations, spread=stage.spread)
    options |= dict(discard=100, revolutions=100, horizon=stage.horizon, seed=seed, starts=starts, report=tried)
    try:
        jc.design.screen(models, ledger.unknowns, edges(list(models)), grid, begin=begin, **options)
    except OutOfTime:
        return False
    return True


def main() -> None:
    """Search stage by stage until the time is up."""
    parser = argparse.ArgumentParser(description="Identify the constants that the paper leaves out.")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--cases", nargs="+", default=list(PUBLISHED_CASES), choices=list(PUBLISHED_CASES))
    parser.add_argument("--read", nargs="*", default=[], help="readings, each as name=value")
    parser.add_argument("--ledger", type=Path, default=Path("lasting_search.csv"), help="file of the designs tried")
    parser.add_argument("--from", type=int, default=0, dest="first", choices=range(len(STAGES)), help="first stage")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--begin", type=Path, help="JSON file of values, instead of the ledger's best")
    parser.add_argument("--check", action="store_true", help="no search: the edges with the values to begin with")
    parser.add_argument("--trade-off", action="store_true", help="no search: how well the cases go together")
    parser.add_argument(
        "--steps", type=int, default=1, choices=(1, 2, 4, 8), help="of a check: so many times the steps"
    )
    parser.add_argument("--horizon", type=int, default=3000, help="of a check [revolutions]")
    parser.add_argument("--quick", action="store_true", help="few designs, speeds and generations: for trying")
    given = parser.parse_args()
    jc.keep_compiled_programs()
    read = dict(each.split("=", 1) for each in given.read)
    models = {name: jc.replace(jc.case(name, "identified"), **read) for name in given.cases}
    relative = read.get("support.cubic") == "dimensionless"
    unknowns = tuple(RELATIVE if relative and u.name == "cubic_stiffness" else u for u in UNKNOWNS)
    ledger = Ledger(given.ledger, unknowns)
    if given.trade_off:
        return trade_off(ledger)
    begin = json.loads(given.begin.read_text()) if given.begin else None
    if given.check:
        return check(models, ledger, begin or ledger.best(), given.steps, given.horizon)
    until = time.perf_counter() + 60 * given.minutes
    for stage in (QUICK if given.quick else STAGES)[given.first :]:
        if len(ledger.of(stage.name)) > stage.designs + stage.generations * POPULATION:
            continue  # done by a run before
        first, begin = begin or ledger.best(), None
        if not search(stage, models, ledger, first, until, given.seed + len(ledger.of(stage.name))):
            print(f"time is up in the stage '{stage.name}'; another run goes on from there")
            return
    print(f"best: {ledger.best()}")


if __name__ == "__main__":
    main()
