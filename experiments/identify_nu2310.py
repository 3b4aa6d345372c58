"""The constants that the paper leaves out, by chaos that lasts: `python experiments/identify_nu2310.py [--minutes M]`.

A search in stages, each dearer than the one before and begun where that one ended, from the paper's start: chaos seen
in 200 revolutions, chaos that lasts 600, and chaos that lasts 3000 on a finer grid. `--from 1` goes straight to the
second one. Every design is swept over speed in all cases at once, and its largest exponents are held against the
published zones. The score is about the mean relative error of the edges, with a price for every band too many. No edge
is needed for that, so that the search works far from the answer, where zones are missing or too many. A stage begins
with quasi-random designs and goes on with an evolution strategy (CMA-ES, of the extra `bench`).

Every design goes to a ledger, a CSV file, from which another run goes on: it skips stages that were done, and begins
others at the best design that the ledger holds. `--read clearance_reading=radial` searches by another reading of the
paper, with `cubic_ratio` in place of the cubic stiffness for `support.cubic=dimensionless`. `--check` shows what the
ledger's best set, or that of `--begin FILE.json`, does at 100 rpm from three initial states; with four times the steps
by `--steps 4`, to another horizon by `--horizon 6000`. `--quick` takes few designs and speeds.
"""

import argparse
import csv
import dataclasses
import json
import time
from collections.abc import Sequence
from pathlib import Path

import cma
import numpy as np
import xarray as xr
from reproduce import LASTING, WIDE_RPM, compare_edges, zones_in_range
from scipy.stats import qmc

import jaxcage as jc
from jaxcage.analysis import CHAOS_THRESHOLD
from jaxcage.bearing import PUBLISHED_CASES, PublishedCase


jc.enable_x64()

SOFT = 0.04
"""Half width over which calm turns into chaos, so that the score tells better from worse."""
TOGETHER = 64
"""Designs swept in one batch."""
BLOCKS, KEEP = 5, 16
"""Blocks of revolutions, which tell a chaotic lane from one of which nothing is known; strobe states, which tell where
chaos has closed on an orbit of up to 8 revolutions."""
EDGES = 3
"""Published ones of each case."""
NEEDLESS = 0.01
"""Penalty for a needless change between calm and chaos, as a relative error of the edges."""


@dataclasses.dataclass(frozen=True)
class Unknown:
    """A constant to be found, the same in all cases."""

    name: str
    lower: float
    """Smallest value [SI]."""
    upper: float
    linear: bool = False
    """True if equal steps of the search add to the value, false if they multiply it."""
    parameter: str = ""
    """Name of the parameter that takes the value, if it has another name."""

    @property
    def target(self) -> str:
        """The parameter that takes its value."""
        return self.parameter or self.name

    @property
    def span(self) -> float:
        """Distance of the bounds, or of their logarithms."""
        return self.upper - self.lower if self.linear else float(np.log(self.upper / self.lower))

    def value(self, place: float) -> float:
        """Value [SI] at a place between the bounds: 0 is the lower one, 1 the upper."""
        along = place * self.span
        return float(self.lower + along if self.linear else self.lower * np.exp(along))

    def place(self, value: float) -> float:
        """The place of `value` [SI] between the bounds, from 0 to 1; values outside are moved to the nearest bound."""
        along = value - self.lower if self.linear else np.log(value / self.lower)
        return float(np.clip(along / self.span, 0.0, 1.0))


UNKNOWNS = (
    Unknown("cage_mass", 0.20, 0.36),  # [kg] from the cage's shape
    Unknown("stiffness_x", 5e3, 4e5),  # [N/m] of the support
    Unknown("stiffness_y", 5e3, 4e5),
    Unknown("cubic_stiffness", 1e10, 1e15),  # [N/m^3]; see RELATIVE
    Unknown("damping", 0.3, 60.0),  # [N s/m]
    Unknown("cross_stiffness", -1e4, 1e4, linear=True),  # [N/m]
    Unknown("land_width", 0.5e-3, 6.5e-3),  # [m]
    Unknown("amplitude", 10.0, 500.0),  # [N] at 1000 rad/s
    Unknown("exponent", 1.0, 2.0, linear=True),
    Unknown("contact_stiffness", 1e7, 1e11, parameter="stiffness"),  # [N/m^(10/9)]
    Unknown("restitution", 0.3, 1.0, linear=True),
)
RELATIVE = Unknown("cubic_ratio", 1e-2, 1e3)
"""alpha in K_3 = alpha K_s / c^2, in place of the cubic stiffness, by the reading support.cubic=dimensionless."""

POPULATION = 4 + int(3 * np.log(len(UNKNOWNS)))
"""Designs of a generation of the evolution strategy."""


def with_values(model: jc.CageModel, unknowns: Sequence[Unknown], values: dict[str, float]) -> jc.CageModel:
    """A case with these constants."""
    return jc.replace(model, **{u.target: values[u.name] for u in unknowns})


@dataclasses.dataclass(frozen=True)
class Stage:
    """Lengths, resolutions and numbers of designs."""

    name: str
    horizon: int
    """Revolutions that chaos must last; 0 counts what is seen."""
    speeds: int
    initial_states: int
    designs: int
    """Quasi-random ones, a power of 2."""
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

    def __init__(self, path: Path, unknowns: tuple[Unknown, ...]):
        self.path, self.unknowns = path, unknowns
        self.head = ("stage", "score", *PUBLISHED_CASES, *(u.name for u in unknowns))
        self.rows: list[dict[str, str]] = []
        if path.exists():
            with path.open() as file:
                self.rows = list(csv.DictReader(file))

    def add(self, stage: str, score: float, by_case: dict[str, float], values: dict[str, float]) -> None:
        """One more design."""
        cases = [f"{by_case[c]:.4f}" if c in by_case else "" for c in PUBLISHED_CASES]
        row = [stage, f"{score:.4f}", *cases, *(f"{values[u.name]:.6g}" for u in self.unknowns)]
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
        known = jc.parameters(jc.case("1a"))
        known["cubic_ratio"] = known["cubic_stiffness"] * known["guidance_gap"] ** 2 / known["stiffness_x"]
        return {u.name: float(known[u.target]) for u in self.unknowns}


class OutOfTime(Exception):
    """The search has taken its minutes."""


class Search:
    """One stage: designs swept in all cases at once, their scores in the ledger."""

    def __init__(self, stage: Stage, models: dict[str, jc.CageModel], ledger: Ledger, until: float):
        self.stage, self.models, self.ledger, self.until = stage, models, ledger, until
        self.speeds = np.geomspace(4000, 27500, stage.speeds) * np.pi / 30
        self.initial_states = [
            tuple(float(c) for c in y) for y in jc.case("1a").initial_states(1000.0)[: stage.initial_states]
        ]
        self.began, self.tried, self.best = time.perf_counter(), 0, np.inf

    def run(self, begin: dict[str, float], seed: int) -> None:
        """Quasi-random designs and `begin`, then generations from the best of them."""
        unknowns = self.ledger.unknowns
        first = qmc.Sobol(len(unknowns), rng=seed).random_base2(int(np.log2(self.stage.designs)))
        first = np.vstack([[u.place(begin[u.name]) for u in unknowns], first])
        start = first[int(np.argmin(self.scores(first)))]
        options = {"bounds": [0.0, 1.0], "maxiter": self.stage.generations, "seed": seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(start, self.stage.spread, options)
        while not strategy.stop():
            places = strategy.ask()
            strategy.tell(places, self.scores(np.array(places)).tolist())

    def scores(self, places: np.ndarray) -> np.ndarray:
        """Distance of designs from what was published: the mean over the cases plus half the worst."""
        parts = np.array_split(places, -(-len(places) // TOGETHER))
        return np.concatenate([self._scores_together(part) for part in parts])

    def _scores_together(self, places: np.ndarray) -> np.ndarray:
        unknowns, cases = self.ledger.unknowns, len(self.models)
        values = [{u.name: u.value(p) for u, p in zip(unknowns, place, strict=True)} for place in places]
        swept = jc.sweep(
            [with_values(model, unknowns, chosen) for chosen in values for model in self.models.values()],
            self.speeds,
            initial_states=self.initial_states,
            discard=100,
            revolutions=100,
            confirm=False,
            horizon=self.stage.horizon,
            exponents=1,
            blocks=BLOCKS,
            keep=KEEP,
        )
        scores = []
        for i, chosen in enumerate(values):
            own = enumerate(self.models, start=i * cases)
            by_case = {name: self._wrong(PUBLISHED_CASES[name], swept.isel(design=k)) for k, name in own}
            off = list(by_case.values())
            scores.append(float(np.mean(off) + 0.5 * np.max(off)))
            self._tell(scores[-1], by_case, chosen)
        return np.array(scores)

    def _wrong(self, case: PublishedCase, found: xr.Dataset) -> float:
        """Mean relative error of the edges of a case, were each wrong speed due to one that has moved; each needless
        change between calm and chaos costs `NEEDLESS` besides. Chaos counts by how much of the way to the horizon it
        lasts, and a lane that failed is wrong whatever it should do.
        """
        rpm = found.rpm.values
        should = (rpm >= case.zone_1_onset_rpm) & (rpm <= case.zone_1_exit_rpm) | (rpm >= case.zone_2_onset_rpm)
        horizon = found.horizon
        lasted = np.minimum(found.escape.values, horizon) / horizon if horizon else 1.0
        level = np.clip((found.exponents.values[..., 0] - CHAOS_THRESHOLD) / (2 * SOFT) + 0.5, 0, 1)
        chaos = (lasted * level).max(axis=1)
        chaos = np.where(np.isfinite(chaos), chaos, 1.0 - should)
        needless = np.sum(np.abs(np.diff(chaos))) - np.sum(np.abs(np.diff(should.astype(float))))
        misplaced = np.gradient(np.log(rpm)) @ np.abs(should - chaos)
        return float(misplaced / EDGES + NEEDLESS * max(needless, 0.0))

    def _tell(self, score: float, by_case: dict[str, float], values: dict[str, float]) -> None:
        self.tried += 1
        self.ledger.add(self.stage.name, score, by_case, values)
        if score < self.best:
            self.best = score
            numbers = ", ".join(f"{name} {value:.4g}" for name, value in values.items())
            seconds = time.perf_counter() - self.began
            said = f"{seconds:.0f} s, {self.tried} tried: score {score:.4f}: {numbers}"
            print(f"{self.stage.name}: {said}", flush=True)
        if time.perf_counter() > self.until:
            raise OutOfTime


def check(models: dict[str, jc.CageModel], ledger: Ledger, values: dict[str, float], steps: int, horizon: int) -> None:
    """Edges of lasting chaos and its wide zones with these values, at 100 rpm, from three initial states."""
    method = jc.native().finer(steps.bit_length() - 1) if steps > 1 else None
    errors = []
    for name, case in models.items():
        model = with_values(case, ledger.unknowns, values)
        found = jc.zones(jc.sweep(model, jc.rpm(2500, 27500, 251), method=method, horizon=horizon)).zones
        rows = compare_edges(PUBLISHED_CASES[name], found, LASTING)
        off = {row["edge"]: row["error_percent"] for row in rows}
        errors += [30.0 if error is None else abs(error) for error in off.values()]
        said = [f"{edge} " + ("none" if error is None else f"{error:+.1f} %") for edge, error in off.items()]
        print(f"{name}: {', '.join(said)}; {len(zones_in_range(found, WIDE_RPM))} wide zones", flush=True)
    print(f"{np.sum(np.array(errors) <= 10)} of {len(errors)} within 10 %, median error {np.median(errors):.1f} %")


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
    parser.add_argument(
        "--steps", type=int, default=1, choices=(1, 2, 4, 8), help="of a check: so many times the steps"
    )
    parser.add_argument("--horizon", type=int, default=3000, help="of a check [revolutions]")
    parser.add_argument("--quick", action="store_true", help="few designs, speeds and generations: for trying")
    given = parser.parse_args()
    jc.keep_compiled_programs()
    read = dict(each.split("=", 1) for each in given.read)
    models = {name: jc.replace(jc.case(name), **read) for name in given.cases}
    relative = read.get("support.cubic") == "dimensionless"
    unknowns = tuple(RELATIVE if relative and u.name == "cubic_stiffness" else u for u in UNKNOWNS)
    ledger = Ledger(given.ledger, unknowns)
    begin = json.loads(given.begin.read_text()) if given.begin else None
    if given.check:
        return check(models, ledger, begin or ledger.best(), given.steps, given.horizon)
    until = time.perf_counter() + 60 * given.minutes
    for stage in (QUICK if given.quick else STAGES)[given.first :]:
        if len(ledger.of(stage.name)) > stage.designs + stage.generations * POPULATION:
            continue  # done by a run before
        first, begin = begin or ledger.best(), None
        try:
            Search(stage, models, ledger, until).run(first, given.seed + len(ledger.of(stage.name)))
        except OutOfTime:
            print(f"time is up in the stage '{stage.name}'; another run goes on from there")
            return
    print(f"best: {ledger.best()}")


if __name__ == "__main__":
    main()
