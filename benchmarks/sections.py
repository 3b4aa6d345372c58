"""The measurements, section by section. Each returns plain numbers for the report and the JSON file."""

import dataclasses
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.analysis import closing_period

from .plain import check, ladder, pick, seconds, time_all
from .problem import Problem, our_map, reached_error
from .rivals import Rival
from .rivals_scipy import SciPy
from .worker import ask


REFERENCE, FINER = 8192, 16384
"""Steps of Rodas4 that are taken for the truth, and what they are held against."""
REPEATS = 3
SLOW = 1000.0
"""Microseconds a revolution and lane above which a rival is not timed on one core."""
LABEL_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
LAST = 16
"""Revolutions at the end by which SciPy's lanes are judged."""
EDGE_RANGE = (11500.0, 13500.0)
"""Speeds [rpm] between which the edge is searched."""
PATIENCE = 150.0
"""Seconds after which a compilation is given up."""


@dataclasses.dataclass(frozen=True)
class Setup:
    """What the sections share."""

    problem: Problem
    file: str
    """Where worker processes find the lanes."""
    quick: bool
    cores: int
    rivals: Mapping[str, Rival]
    prepared: Mapping[str, float]
    """Seconds it took to prepare each of them."""


def precision(setup: Setup) -> dict[str, Any]:
    """Every rival's ladder, its distance from the reference when tight, and the setting that reaches the target."""
    sample = setup.problem.lanes(512 if setup.quick else 1024)
    truth = our_map(sample, jc.method("rodas4", steps=REFERENCE))
    doubt = None
    if not setup.quick:
        _, doubt = reached_error(sample, our_map(sample, jc.method("rodas4", steps=FINER)), truth)
        print(f"  99 % of the reference within {doubt:.1e} of twice the steps", flush=True)
    rows = []
    for name, rival in setup.rivals.items():
        apart = check(rival, sample, truth)
        rungs = ladder(rival, sample, truth)
        chosen = pick(rungs)
        row = {"name": name, "tight": rival.tight, "apart": apart, "ladder": rungs, "setting": chosen["setting"]}
        rows.append({**row, "median": chosen["median"], "most": chosen["most"]})
    return {"states": sample.speeds.size, "doubt": doubt, "rivals": rows}


def plain(setup: Setup, picks: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Times at the settings picked: on all cores here, on one in a process of its own with half the lanes."""
    settings = {row["name"]: row["setting"] for row in picks}
    rows = time_all(setup.problem, [(setup.rivals[n], s) for n, s in settings.items()], REPEATS)
    alone: dict[str, float] = {}
    if setup.cores > 1 and not setup.quick:
        print("  the same on one core", flush=True)
        quick = {row["name"]: settings[row["name"]] for row in rows if row["us"] < SLOW}
        found: Any = ask("plain", file=setup.file, settings=quick, cores=1, repeats=REPEATS, share=2)
        alone = {row["name"]: row["us"] for row in found}
    for row, chosen in zip(rows, picks, strict=True):
        row["compile"] += setup.prepared[row["name"]]
        row |= {"one_core": alone.get(row["name"]), "median": chosen["median"], "most": chosen["most"]}
    return {"rivals": rows}


def in_turns(runs: Mapping[str, Callable[[], Any]]) -> dict[str, dict[str, float]]:
    """For each of some runs the median seconds of three, taken in turn, and the seconds of compiling before."""
    first = {name: seconds(run) for name, run in runs.items()}
    spent = [{name: seconds(run) for name, run in runs.items()} for _ in range(REPEATS)]
    middle = {name: statistics.median(s[name] for s in spent) for name in runs}
    return {name: {"seconds": middle[name], "compile": max(first[name] - middle[name], 0.0)} for name in runs}


def exponents(setup: Setup) -> dict[str, Any]:
    """Revolutions with k Lyapunov exponents against plain ones, at the library's default method."""
    few = setup.problem.lanes(256) if setup.quick else setup.problem
    turns = 10

    def run(k: int) -> Any:
        return jc.sweep(
            few.model,
            few.speeds,
            starts=few.states[:, None],
            discard=0,
            revolutions=turns,
            blocks=1,
            exponents=k,
            keep=1,
        ).last

    found = in_turns({str(k): lambda k=k: run(k) for k in ((0, 1) if setup.quick else (0, 1, 4))})
    return {"lanes": few.speeds.size, "revolutions": turns, "runs": found}


def labels(setup: Setup) -> dict[str, Any]:
    """A confirmed label of the default sweep, against SciPy at the coarsest tolerance that has the same periods.

    SciPy's lanes are judged by whether their last strobe states close; the exponents that tell chaos from a torus, and
    confirmation, are not in its time.
    """
    few = setup.problem.lanes(32 if setup.quick else 128)
    found = jc.sweep(few.model, few.speeds, starts=few.states[:, None], horizon=0)
    spent = in_turns({"ours": lambda: jc.sweep(few.model, few.speeds, starts=few.states[:, None], horizon=0)})["ours"]
    period = closing_period(found.strobe[:, 0], few.scale)
    rival = SciPy("LSODA", LABEL_TOLERANCES, 1e-10, 0, 0)
    if rival.missing():
        return {"missing": f"SciPy: {rival.missing()}"}
    rival.prepare(setup.cores)
    rows = []
    for tolerance in LABEL_TOLERANCES:
        begin = time.perf_counter()
        states = [rival.on(few)(found.discard + found.revolutions - LAST, tolerance)]
        for _ in range(LAST):
            states.append(rival.on(dataclasses.replace(few, states=states[-1]))(1, tolerance))
        seconds = time.perf_counter() - begin
        theirs = closing_period(np.stack(states, axis=1), few.scale)
        rows.append({"tolerance": tolerance, "seconds": seconds, "same": float(np.mean(theirs == period))})
    rival.close()
    lanes = {"lanes": few.speeds.size, "closed": int(np.sum(period > 0)), "length": found.discard + found.revolutions}
    return {**lanes, **spent, "rows": rows}


def monodromy(setup: Setup) -> dict[str, Any]:
    """A batch of monodromy matrices against plain revolutions of the same lanes."""
    few = setup.problem.lanes(256) if setup.quick else setup.problem
    return {
        "lanes": few.speeds.size,
        "revolutions": 10,
        "runs": in_turns(
            {
                "plain": lambda: our_map(few, None, 10),
                "matrices": lambda: jc.sweeps.monodromy(few.model, few.speeds, few.states),
            }
        ),
    }


def edge(setup: Setup) -> dict[str, Any]:
    """An edge and its gradient, by both ways that the library has."""
    if setup.quick:
        return {"missing": "left out of a quick run"}
    found = ask("edge", lower_rpm=EDGE_RANGE[0], upper_rpm=EDGE_RANGE[1], limit=4 * PATIENCE)
    if found is None:
        return {"missing": f"not done in {4 * PATIENCE:.0f} s"}
    by_point = ask("bifurcation", state=found["state"], speed=found["speed"], limit=PATIENCE)
    return {**found, "bifurcation": by_point, "patience": PATIENCE}


def scaling(setup: Setup) -> dict[str, Any]:
    """Time and memory over lanes and over revolutions, each run in a process of its own."""
    lanes = [(1, 200), (16, 200), *((n, 50) for n in (256, 1024, 2048, 4096, 16384, 100_000))]
    turns = [(256, 20), (256, 200), (256, 1000), (256, 4000)]
    single = [(256, 50), (2048, 50)]
    if setup.quick:
        lanes, turns, single = lanes[1:3], [], single[:1]
    plans = [(n, r, setup.cores) for n, r in [*lanes, *turns]]
    plans += [(n, r, 1) for n, r in single] if setup.cores > 1 else []
    rows = []
    for n, r, cores in plans:
        found = ask("scale", file=setup.file, lanes=n, revolutions=r, cores=cores)
        rows.append({"lanes": n, "revolutions": r, "cores": cores, **(found or {})})
        if found:
            print(f"  {n:6d} lanes {r:4d} revolutions {cores} cores: {found['us']:8.2f} us {found['mb']:6.0f} MB")
        print(end="", flush=True)
    return {"runs": rows}
