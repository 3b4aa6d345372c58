"""Special points and stable stretches that are missed, or are not there: `python -m benchmarks.missed`.

`--planted`: branches of oscillators whose special points are known in closed form or published. `--cases`: the search
that `jaxcage bifurcations` makes, of the six cases. Both are made again with half the step lengths and twice the
integration steps, and must have the same points to within what they state. Without either both are made; what is
missed or spurious is listed and makes the exit status 1.

`python -m benchmarks.missed [--planted] [--cases [1a 2b ...]] [--only TEXT] [--quick] [--log FOLDER]`
"""

import argparse
import pathlib
import sys
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import jaxcage as jc

from . import missed_cases
from .missed_finer import compared, finer, twice_the_steps
from .missed_models import Planted, Point, planted
from .missed_published import published
from .truth_models import CASES


FLOOR = 1e-7
"""Error that counts as none, of a parameter in units of a twentieth of its range."""
QUICK = ("two folds 2e-03", "two flips 4e-04", "branches 1e-02", "hardening Duffing")


class Row(NamedTuple):
    """What became of one branch."""

    known: int
    missed: list[str]
    spurious: list[str]
    changed: list[str]
    """Points that are not the same in the finer run."""
    left: float
    """Share of the branch's orbits that lie on another one."""
    worst: float
    """Largest error over the stated one."""
    length: int
    wrong: list[str]
    """What is said of the largest error, where it is more than the stated one."""

    @property
    def bad(self) -> int:
        """How much is not as it should be."""
        return len(self.missed) + len(self.spurious) + len(self.changed) + len(self.wrong) + (self.left > 0)


def followed(given: Planted, steps: jc.orbits.Steps) -> jc.Branch:
    """The branch, from an orbit that a simulation leads to where none is known."""
    state, value = given.state, given.value
    speed = value if given.parameter == "speed" else given.speed
    if given.spin:
        settled = jc.periodic_orbit(given.system, speed, guess=state, revolutions=given.spin)
        state = tuple(np.asarray(settled.state).tolist())
    return jc.branch(
        given.system,
        (state, value),
        given.parameter,
        lower=given.lower,
        upper=given.upper,
        speed=speed,
        periods=given.periods,
        steps=steps,
    )


def scale_of(given: Planted) -> np.ndarray:
    """Of the state."""
    return np.array([float(c) for c in given.system.scale(given.speed)])


def judged(given: Planted, branch: jc.Branch, fine: jc.Branch) -> Row:
    """A branch beside what is planted on it, and beside a finer run."""
    floor = FLOOR * (given.upper - given.lower) / 20
    lost, spurious, worst, wrong = [], [], 0.0, []
    left = list(branch.special)
    for point in given.points:
        near = [p for p in left if p.kind == point.kind and p.status != "not converged"]
        best = min(near, key=lambda p: abs(p.value - point.value), default=None)
        stated = np.inf if best is None else best.error + point.tolerance + floor
        if best is None or not abs(best.value - point.value) <= max(stated, 10 * floor):
            lost.append(said(point))
            continue
        left.remove(best)
        worst = max(worst, float(abs(best.value - point.value) / stated))
    spurious = [said(p) for p in left] if given.whole else [said(p) for p in left if p.status != "converged"]
    away = 0.0
    if given.lane is not None:
        lanes = given.lane(branch.value, branch.state)
        away = float(np.mean(lanes != lanes[np.argmin(abs(branch.value - given.value))]))
    if worst > 1:
        wrong.append(f"error {worst:.1f} times the stated one")
    changed = compared(branch.special, fine.special, floor)
    return Row(len(given.points), lost, spurious, changed, away, worst, branch.value.size, wrong)


def said(point: Point | jc.orbits.Point) -> str:
    """Kind and place."""
    return f"{point.kind} at {point.value:.9g}"


COLUMNS = ("orbits", "known", "found", "missed", "spurious", "changed", "jumped", "error", "s")
HEAD = f"{'':34s}" + "".join(f"{x:>9s}" for x in COLUMNS)


def planted_report(quick: bool, only: str) -> list[str]:
    """Every oscillator; what is wrong."""
    print(f"\nPlanted and published points; error over the stated one\n{HEAD}", flush=True)
    wrong = []
    every = [*planted(), *published()]
    chosen = [g for g in every if only in g.name and (not quick or any(g.name.startswith(q) for q in QUICK))]
    total = 0
    for given in chosen:
        begin = time.process_time()
        branch = followed(given, jc.orbits.Steps())
        with twice_the_steps():
            fine = followed(given, finer(branch, (given.upper - given.lower) / 20, scale_of(given)))
        row = judged(given, branch, fine)
        total += row.known
        cells = (row.length, row.known, len(branch.special), len(row.missed), len(row.spurious), len(row.changed))
        cells = "".join(f"{c:9d}" for c in cells)
        print(f"{given.name:34s}{cells}{row.left:9.0%}{row.worst:9.2g}{time.process_time() - begin:9.1f}", flush=True)
        for what in ("missed", "spurious", "changed", "wrong"):
            for text in getattr(row, what):
                print(f"    {what}: {text}", flush=True)
        if row.bad:
            wrong.append(given.name)
    print(f"{len(chosen)} branches, {total} points known, {len(wrong)} branches not right", flush=True)
    return wrong


def main(arguments: Sequence[str] | None = None) -> list[str]:
    """Run what was asked for; what is wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.missed", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--planted", action="store_true", help="oscillators with known special points")
    parser.add_argument(
        "--cases", nargs="*", choices=CASES, metavar="CASE", help="the published cases, or some of them"
    )
    parser.add_argument("--only", default="", help="planted oscillators with this in their name")
    parser.add_argument("--quick", action="store_true", help="few oscillators; of the cases 1a over a short range")
    parser.add_argument(
        "--log", type=pathlib.Path, default=pathlib.Path("out/missed"), help="results of cases are kept here"
    )
    given = parser.parse_args(arguments)
    jc.enable_x64()
    jc.keep_compiled_programs()
    both = not given.planted and given.cases is None
    wrong = []
    if both or given.planted:
        wrong += planted_report(given.quick, given.only)
    if both or given.cases is not None:
        wrong += missed_cases.report(given.cases or CASES, given.quick, given.log)
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main()))
