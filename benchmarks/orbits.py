"""One branch of orbits by every program: `python -m benchmarks.orbits [--only cage,duffing-folds]`.

AUTO-07p (its Debian package), single shooting with SciPy and `jaxcage.branch` start at the same orbit and go on to the
same speed. Writes `benchmarks/orbits.md`, unless `--only` is given. Times are those of the processor:

- cold: a new process without compiled programs; for AUTO, its equations compiled and linked, then the run;
- new process: with the programs kept from an earlier one; AUTO's run;
- warm: the branch once more in the same process.
"""

import argparse
import dataclasses
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.solve import cores as available_cores

from . import auto, shooting
from .common import machine, made_with
from .orbit_tasks import TASKS, Task, prepare


INTERVALS = (200, 400, 800)
"""Mesh intervals of AUTO; the first one's time is the measure, the last one's points are."""
REPEATS = 3
COLUMNS = ("branch", "program", "points", "special points", "off", "cold [s]", "new process [s]", "warm [s]")
PAGE = pathlib.Path(__file__).with_suffix(".md")


@dataclasses.dataclass(frozen=True)
class Row:
    """Results of one program for a branch."""

    program: str
    points: int = 0
    special: tuple[tuple[str, float], ...] = ()
    """Kind and place [unit of the task]."""
    errors: tuple[float, ...] = ()
    """Error of each place, as the program states it; empty where it states none."""
    cold: float = float("nan")
    process: float = float("nan")
    warm: float = float("nan")
    absent: str = ""
    """Why there is nothing."""


def nearest(row: Row, kind: str, place: float) -> int | None:
    """The row's point of this kind next to a place."""
    same = [i for i, (k, _) in enumerate(row.special) if k == kind]
    return min(same, key=lambda i: abs(row.special[i][1] - place)) if same else None


def off(row: Row, truth: Row) -> float | None:
    """Largest distance of the row's points from those of `truth`; None if one is missing."""
    found = [(nearest(row, *point), point[1]) for point in truth.special]
    return max((abs(row.special[i][1] - at) if i is not None else np.inf for i, at in found), default=None)


def within(ours: Row, autos: list[Row]) -> float:
    """Largest share that the distance to AUTO's finest points has of both error bars together, AUTO's being its spread
    over the meshes; infinite if one is missing.
    """
    worst = 0.0
    for kind, place in autos[-1].special:
        i = nearest(ours, kind, place)
        others = [nearest(a, kind, place) for a in autos]
        if i is None or None in others:
            return float("inf")
        spread = max(abs(a.special[k][1] - place) for a, k in zip(autos, others, strict=True) if k is not None)
        worst = max(worst, abs(ours.special[i][1] - place) / (ours.errors[i] + spread))
    return worst


def by_auto(task: Task, folder: pathlib.Path, orbit: np.ndarray) -> list[Row]:
    """AUTO at every mesh."""
    if why := auto.missing():
        return [Row("AUTO-07p", absent=why)]
    built, rows = auto.build(folder, task.law), []
    for intervals in INTERVALS:
        runs = [auto.run(folder, orbit, task.end / task.begin, intervals) for _ in range(REPEATS)]
        found, seconds = runs[0][0], statistics.median(s for _, s in runs)
        special = tuple((kind, ratio * task.begin) for kind, ratio in found["special"])
        rows.append(Row(f"AUTO-07p, NTST {intervals}", found["points"], special, (), built + seconds, seconds))
    return rows


def by_shooting(task: Task, folder: pathlib.Path, state: np.ndarray) -> Row:
    """SciPy in a process of its own."""
    numbers = {"folder": str(folder), "law": task.law, "state": state.tolist(), "end": task.end / task.begin}
    began = auto.spent()
    found = ask("benchmarks.shooting", json.dumps(numbers))
    special = tuple((kind, ratio * task.begin) for kind, ratio in found["special"])
    return Row("SciPy shooting", found["points"], special, (), float("nan"), auto.spent() - began, found["warm"])


def by_us(name: str, state: np.ndarray) -> Row:
    """`jaxcage.branch` in two new processes, the first without programs."""
    found, seconds = {}, []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(2):
            began = auto.spent()
            found = ask("benchmarks.orbits", "--ours", name, "--state", json.dumps(state.tolist()), cache=cache)
            seconds.append(auto.spent() - began)
    special = tuple((kind, place) for kind, place, _ in found["special"])
    errors = tuple(error for _, _, error in found["special"])
    # What is measured again in the same process is no part of a new one.
    cold, process = (s - found["repeats"] for s in seconds)
    return Row("jaxcage.branch", found["points"], special, errors, cold, process, found["warm"])


def ask(module: str, *words: str, cache: str = "off") -> dict[str, Any]:
    """Return what a process of its own prints last."""
    command = [sys.executable, "-m", module, *words]
    environment = {**os.environ, "JAXCAGE_CACHE": cache}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        raise RuntimeError(f"`{' '.join(command)}` failed:\n{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def ours(task: Task, state: list[float]) -> dict[str, Any]:
    """The branch as `jaxcage.branch` finds it, and the processor seconds of doing so once more."""
    jc.keep_compiled_programs()
    model, at = task.make(), sorted((task.speed, task.end * task.per_unit))
    # The start lies inside the range: the branch goes a thousandth further back than the others'.
    margin = 1e-3 * (at[1] - at[0])
    lower, upper = (at[0] - margin, at[1]) if task.end > task.begin else (at[0], at[1] + margin)
    run = lambda: jc.branch(model, (np.array(state), task.speed), lower=lower, upper=upper)
    found, spent = run(), []
    for _ in range(REPEATS):
        began = time.process_time()
        run()
        spent.append(time.process_time() - began)
    special = [[p.kind, p.value / task.per_unit, p.error / task.per_unit] for p in found.special]
    return {"points": found.value.size, "special": special, "warm": statistics.median(spent), "repeats": sum(spent)}


def compare(name: str) -> tuple[list[list[str]], list[str]]:
    """Lines of the table and what to say below it, of one task."""
    task = TASKS[name]
    orbit = jc.periodic_orbit(task.make(), task.speed, guess=task.guess, revolutions=200)
    state = np.asarray(orbit.state)
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        prepare(task, folder)
        rates = shooting.compiled(folder, task.law)
        orbits = shooting.history(rates, state / task.scale())
        autos = by_auto(task, folder, orbits)
        rows = [*autos, by_shooting(task, folder, state / task.scale()), by_us(name, state)]
    return [line(task, row, autos[-1]) for row in rows], [verdict(task, rows[-1], autos)]


def line(task: Task, row: Row, truth: Row) -> list[str]:
    """A row of the table."""
    if row.absent:
        return [task.name, row.program, row.absent, *["-"] * 5]
    number = lambda x: "-" if np.isnan(x) else f"{x:.2f}"
    apart = off(row, truth)
    bars = [f" ± {error:.1g}" for error in row.errors] or [""] * len(row.special)
    special = ", ".join(f"{kind} {place:.9g}{bar}" for (kind, place), bar in zip(row.special, bars, strict=True))
    shown = "-" if apart is None or row is truth else "missing" if np.isinf(apart) else f"{apart:.1e}"
    return [task.name, row.program, str(row.points), special, shown, *map(number, (row.cold, row.process, row.warm))]


def verdict(task: Task, ours: Row, autos: list[Row]) -> str:
    """Ours against AUTO's first mesh, and known points, in a line."""
    said = [f"{task.name} [{task.unit}]:"]
    if not autos[0].absent:
        said += [
            f"jaxcage's points differ from AUTO's by at most {within(ours, autos):.2g} of the sum of both error bars.",
            f"jaxcage takes {ours.warm / autos[0].process:.1f} times as long as AUTO when warm",
            f"and {ours.process / autos[0].process:.1f} times in a new process.",
        ]
    for place in task.known:
        nearby = min((abs(at - place), error) for (_, at), error in zip(ours.special, ours.errors, strict=True))
        said.append(f"Validation has {place:.9g}: off by {nearby[0]:.1e}, error bar {nearby[1]:.1e}.")
    return " ".join(said)


def page(lines: list[list[str]], notes: list[str]) -> str:
    """The tables as Markdown."""
    table = [list(COLUMNS), ["---"] * 2 + ["---:"] + ["---"] + ["---:"] * 4, *lines]
    return "\n".join(
        [
            "# Orbits: one branch by every program",
            "",
            f"Made by `python -m benchmarks.orbits`: {machine(available_cores())}.",
            "Processor seconds; `off` is the largest distance of the special points from AUTO's at its finest mesh.",
            f"SciPy's derivatives are central difference quotients over {shooting.DISTANCE:g}.",
            "AUTO does not report the period doubling of the cage: within one of its steps a complex pair of",
            "multipliers becomes real and one of them passes -1, while its test function, the distance of the nearest",
            "multiplier from the unit circle, keeps its sign. `off` leaves that point out.",
            "",
            *("| " + " | ".join(cells) + " |" for cells in table),
            "",
            *(f"- {note}" for note in notes),
            "",
            made_with(),
            "",
        ]
    )


def main() -> None:
    """Follow the branches and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.orbits", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--only", metavar="A,B", help=f"branches: {', '.join(TASKS)}")
    parser.add_argument("--ours", help=argparse.SUPPRESS)
    parser.add_argument("--state", help=argparse.SUPPRESS)
    given = parser.parse_args()
    jc.enable_x64()
    if given.ours:
        print(json.dumps(ours(TASKS[given.ours], json.loads(given.state))))
        return
    names = given.only.split(",") if given.only else list(TASKS)
    if unknown := set(names) - set(TASKS):
        parser.error(f"--only takes {', '.join(TASKS)}, but not {', '.join(sorted(unknown))}")
    lines, notes = [], []
    for name in names:
        found = compare(name)
        lines += found[0]
        notes += found[1]
    report = page(lines, notes)
    print(report)
    if not given.only:
        PAGE.write_text(report)


if __name__ == "__main__":
    main()
