"""The published cases: the search for synchronous orbits beside a finer one, and beside brute force.

The finer one has half the step lengths, twice the integration steps and more patience with unstable orbits. Brute force
is a sweep at every 10 rpm from many starts, that shares with the search no orbit, branch or Newton step: each lane that
ends on a synchronous orbit must be on a stable stretch of a branch. Results are kept by case, so that an interrupted
run goes on where it stopped.
"""

import json
import math
import pathlib
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.orbits import _search
from tests import reference

from .missed_finer import finer, twice_the_steps


FIRST, LAST, APART = 2500.0, 27500.0, 10.0
"""Speeds of the search, and between speeds of the sweep [rpm]."""
QUICK = (12000.0, 14000.0, 100.0)
RANDOM = 3
"""Starts beside the model's own."""
PATIENCE = 4
"""The finer run goes so many times as far along unstable orbits."""
NARROW = 1.0
"""Stretches below this width must be confirmed [rpm]."""
ON = _search.ON_BRANCH
RPM = math.pi / 30


def away(branch: jc.Branch, speed: float, state: np.ndarray, scale: np.ndarray, unit: float, stable: bool) -> float:
    """Distance of an orbit to a branch, or to what is stable of it, between its points along the chord."""
    u = np.column_stack([(branch.state - state) / scale, (branch.value - speed) / unit])
    step = np.diff(u, axis=0)
    share = np.clip(-np.sum(u[:-1] * step, axis=1) / np.maximum(np.sum(step**2, axis=1), 1e-300), 0.0, 1.0)
    far = np.max(np.abs(u[:-1] + share[:, None] * step), axis=1)
    kept = branch.stable[:-1] | branch.stable[1:] if stable else np.ones(far.size, dtype=bool)
    return float(np.min(far[kept], initial=np.inf))


def scale_at(model: jc.CageModel, speed: float) -> np.ndarray:
    """Of the state."""
    return np.array([float(c) for c in model.scale(speed)])


def nearest(found: Any, model: jc.CageModel, speed: float, state: np.ndarray, unit: float, stable=False) -> float:
    """Distance of an orbit to the nearest branch."""
    scale = scale_at(model, speed)
    return min((away(b, speed, state, scale, unit, stable) for b in found.branches), default=math.inf)


def twice(model: jc.CageModel, found: Any, ends: tuple[float, float]) -> Any:
    """The search with half the step lengths and twice the integration steps, from the same simulations."""
    unit = (ends[1] - ends[0]) / 20
    steps = [finer(b, unit, scale_at(model, float(b.value[0]))) for b in found.branches]
    half = jc.orbits.Steps(first=0.01, longest=float(np.median([s.longest for s in steps])), most=10000)
    patience = _search.PATIENCE
    try:
        _search.PATIENCE = PATIENCE * patience
        with twice_the_steps():
            return jc.synchronous_orbits(model, *ends, settled=found.sweep, steps=half)
    finally:
        _search.PATIENCE = patience


def beside(model: jc.CageModel, found: Any, fine: Any, unit: float) -> list[str]:
    """Special points that are not in both searches, where both followed the branch."""
    texts = []
    floor = 1e-8 * unit
    for one, other, name in ((found, fine, "not in the finer run"), (fine, found, "in the finer run only")):
        for p in one.points:
            same = [q for q in other.points if q.kind == p.kind and abs(q.value - p.value) <= p.error + q.error + floor]
            if not same and nearest(other, model, p.speed, p.state, unit) < ON:
                texts.append(f"{p.kind} at {p.speed_rpm:.6f} +- {p.error_rpm:.1g} rpm: {name}")
    return texts


def narrow(found: Any, fine: Any) -> tuple[int, list[str]]:
    """How many stretches are narrow, and which of them the finer search has not."""
    mine = [s for s in found.stretches if s.width_rpm < NARROW]
    near = lambda s, t: max(abs(s.lower_rpm - t.lower_rpm), abs(s.upper_rpm - t.upper_rpm)) <= s.error_rpm + t.error_rpm
    lost = [
        s
        for s in mine
        if not any(near(s, t) or abs(s.width_rpm - t.width_rpm) < 0.01 * s.width_rpm for t in fine.stretches)
    ]
    return len(mine), [f"stretch {s.lower_rpm:.4f} to {s.upper_rpm:.4f} rpm: not confirmed" for s in lost]


def brute(model: jc.CageModel, found: Any, speeds: np.ndarray, unit: float) -> tuple[int, int, list[str]]:
    """Lanes, those that end on a synchronous orbit, and where these are on no stable stretch."""
    own = [[[float(c) for c in s] for s in model.starts(w)] for w in speeds]
    fields = [reference.field(model, float(w)) for w in speeds]
    more = [
        [reference.random_state(100 * i + j, f, 0.9 * f.land["onset"]) for j in range(RANDOM)]
        for i, f in enumerate(fields)
    ]
    starts = np.concatenate([np.array(own), np.array(more)], axis=1)
    swept = jc.sweep(model, speeds, starts=starts, revolutions=8, blocks=1, keep=8, exponents=0, confirm=False)
    lanes = np.argwhere(swept.label == "periodic-1").tolist()
    texts = []
    for i, j in lanes:
        far = nearest(found, model, float(swept.speed[i]), swept.last[i, j], unit, stable=True)
        if far > ON:
            texts.append(f"orbit at {swept.rpm[i]:.0f} rpm from start {j}: {far:.2g} from the nearest stretch")
    return swept.label.size, len(lanes), texts


def examined(name: str, limits: tuple[float, float, float]) -> dict[str, Any]:
    """All about one case."""
    begin = time.process_time()
    model, ends = jc.case(name), (limits[0] * RPM, limits[1] * RPM)
    unit = (ends[1] - ends[0]) / 20
    found = jc.synchronous_orbits(model, *ends)
    fine = twice(model, found, ends)
    changed = beside(model, found, fine, unit)
    count, lost = narrow(found, fine)
    speeds = np.arange(limits[0], limits[1] + limits[2] / 2, limits[2]) * RPM
    lanes, periodic, missed = brute(model, found, speeds, unit)
    return {
        "points": len(found.points),
        "finer": len(fine.points),
        "stretches": len(found.stretches),
        "narrow": count,
        "unexplained": len(found.unexplained),
        "unsettled": found.unsettled,
        "lanes": lanes,
        "periodic": periodic,
        "seconds": time.process_time() - begin,
        "changed": changed,
        "not confirmed": lost,
        "missed": missed,
    }


COUNTS = ("points", "finer", "stretches", "narrow", "unexplained", "unsettled", "lanes", "periodic")
LISTS = ("changed", "not confirmed", "missed")


def report(cases: Sequence[str], quick: bool, log: pathlib.Path) -> list[str]:
    """The cases, those that are not in the log made; what is wrong."""
    print(f"\nSynchronous orbits\n{'':6s}" + "".join(f"{x:>14s}" for x in (*COUNTS, *LISTS, "s")), flush=True)
    wrong = []
    for name in cases[:1] if quick else cases:
        path = log / f"{name}{'-quick' * quick}.json"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(examined(name, QUICK if quick else (FIRST, LAST, APART)), indent=1))
        got = json.loads(path.read_text())
        cells = "".join(f"{got[x]:14d}" for x in COUNTS) + "".join(f"{len(got[x]):14d}" for x in LISTS)
        print(f"{name:6s}{cells}{got['seconds']:14.0f}", flush=True)
        for what in LISTS:
            print(*(f"    {what}: {text}" for text in got[what]), sep="\n", end="\n" * bool(got[what]), flush=True)
        if any(got[x] for x in LISTS):
            wrong.append(f"case {name}")
    return wrong
