"""Results of `simulate` and `measures` beside 8 times the steps, and beside the reference's time history.

All three begin at one settled state and go on for as long as its orbit takes to close, so that chance has no part in
it. The reference's samples go through `measures` like ours: compared is the motion, not the formulas.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

import jaxcage as jc
from jaxcage.analysis import CLOSING_TOLERANCE
from tests import reference

from .truth_exponents import settled
from .truth_models import Subject, by_kind, fine, pair


OFF = {"force": 1e-2, "whirl": 1e-3, "film": 1e-3, "closure": 1e-3}
"""Differences beyond which a measure is wrong: of the peak contact force relative to the larger of it and the film's,
of the whirl ratio, and of film and closure in clearances."""
FEWEST = 2
"""Revolutions."""
BUDGET = 1e6
"""Evaluations of the reference's field."""


class Numbers(NamedTuple):
    """Measures of one time history."""

    force: float
    """Peak of the contact force [N]."""
    whirl: float
    film: float
    """Least film thickness [clearances]."""
    closure: float
    """Distance of the ends of the history [clearances]."""


def numbers(model: jc.CageModel, run: jc.Trajectory, revolutions: int) -> Numbers:
    """Measures of a trajectory that has one revolution more than is measured."""
    end = revolutions * run.samples
    part = {name: getattr(run, name)[:end] for name in ("time", "tau", "state", "speed")}
    found = jc.measures(model, dataclasses.replace(run, **part)).value
    c = float(model.clearance)
    apart = np.linalg.norm((run.state[end] - run.state[0])[:2]) / c
    film = found("minimum_film_thickness") / c
    return Numbers(found("peak_contact_force"), found("whirl_ratio"), film, float(apart))


def by_reference(model: jc.CageModel, run: jc.Trajectory, revolutions: int) -> Numbers | None:
    """The same of the reference's history from the same state; None where it does not finish."""
    field = reference.field(model, float(run.speed[0]))
    try:
        exact = reference.sampled(field, run.state[0], revolutions + 1, run.samples, budget=BUDGET)
    except (reference.TooLong, ValueError, ArithmeticError):
        return None
    return numbers(model, dataclasses.replace(run, state=exact.state[:-1], peak=exact.peak), revolutions)


def apart(model: jc.CageModel, run: jc.Trajectory, ours: Numbers, theirs: Numbers) -> dict[str, float]:
    """Distances of two histories, by the names of `OFF`."""
    film = np.max(np.linalg.norm(jc.analysis.cage_forces(model, run)["film"], axis=1))
    size = max(theirs.force, float(film))
    whirl = abs(ours.whirl - theirs.whirl)
    return {
        "force": abs(ours.force - theirs.force) / size,
        "whirl": 0.0 if math.isnan(ours.whirl) else whirl,  # where nothing is said, nothing is wrong
        "film": abs(ours.film - theirs.film),
        "closure": abs(ours.closure - theirs.closure),
    }


def history(model: jc.CageModel, speed: float, state: np.ndarray, count: int, method: Any = None) -> jc.Trajectory:
    """From a state, one revolution longer than is measured."""
    start = tuple(float(c) for c in state)
    return jc.simulate(model, speed, revolutions=count + 1, start=start, method=method)


class Lane(NamedTuple):
    """A settled state, and the largest differences of what follows from it."""

    rpm: float
    label: str
    outcome: str
    ours: Numbers | None
    finer: dict[str, float]
    reference: dict[str, float]

    @property
    def off(self) -> bool:
        """Some measure is wrong, or an orbit that is called periodic is open."""
        wrong = any(not beside[name] <= OFF[name] for beside in (self.finer, self.reference) for name in beside)
        periodic = self.ours is not None and self.label.startswith("periodic")
        return wrong or (periodic and not self.ours.closure <= CLOSING_TOLERANCE + OFF["closure"])  # pyright: ignore


def lane(model: jc.CageModel, sweep: xr.Dataset, i: int, j: int) -> Lane:
    """The j-th start at the i-th speed."""
    label, speed, rpm = str(sweep["label"].values[i, j]), float(sweep["speed"][i]), float(sweep["rpm"][i])
    period = int(label.partition("-")[2]) if label.startswith("periodic-") else 1
    count = period * -(-FEWEST // period)
    run, beside = (history(model, speed, sweep["last"].values[i, j], count, method) for method in (None, fine()))
    if run.outcome != "successful":
        return Lane(rpm, label, run.outcome, None, {}, {})
    ours, exact = numbers(model, run, count), by_reference(model, run, count)
    finer = numbers(model, beside, count) if beside.outcome == "successful" else None
    each = [apart(model, run, ours, theirs) if theirs else {} for theirs in (finer, exact)]
    return Lane(rpm, label, run.outcome, ours, each[0], each[1])


COLUMNS = ("states", "refused", "known", "OFF", *(f"{name} {of}" for of in ("8x", "ref.") for name in OFF))
HEAD = f"{'':44s}" + "".join(f"{x:>13s}" for x in COLUMNS)


def report(found: Sequence[Subject], quick: bool) -> list[str]:
    """measures of simulated orbits beside 8 times the steps and the reference"""
    off = 0
    for kind, group in by_kind(found).items():
        print(f"\nMeasures, {kind}: largest differences\n{HEAD}", flush=True)
        for subject in group:
            ours = pair(subject, quick)[0]
            lanes = [lane(subject.model, ours, i, j) for i, j in settled(ours)]
            bad = [x for x in lanes if x.off]
            counts = (len(lanes), sum(x.ours is None for x in lanes), sum(bool(x.reference) for x in lanes), len(bad))
            beside = ([x.finer for x in lanes], [x.reference for x in lanes])
            sizes = [max((d[name] for d in each if d), default=math.nan) for each in beside for name in OFF]
            row = "".join(f"{n:13d}" for n in counts) + "".join(f"{x:13.0e}" for x in sizes)
            print(f"{subject.name:44s}{row}", flush=True)
            for x in bad:
                print(f"  {x.rpm:.1f} rpm, {x.label}: {x.ours}, 8x {x.finer}, reference {x.reference}")
            off += len(bad)
    return [f"{off} orbits have a measure that is off"] if off else []
