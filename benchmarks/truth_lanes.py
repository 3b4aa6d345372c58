"""One revolution by the default method of sweeps, beside the reference: is the stated error an error?"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

import jaxcage as jc
from jaxcage.analysis import failed
from tests import reference

from .truth_models import Subject, by_kind


SPEEDS = 5
"""Lanes of each model from two initial states: ten from the beginning, and those that finish once they have settled."""
SETTLING = 60
"""Revolutions before a state counts as settled."""
CERTAIN = 1e-4
"""The reference counts where its integrators agree to this [scale]."""
ROUNDING = 1e-13
"""Rounding error of a revolution [scale]: no error is below it."""
NOISE = 3.0
"""Its error is not above so many times the difference of its integrators."""
SHARPER = 100.0
"""By which tolerances of the reference are smaller where a lane seems to be off."""
INACCURATE = {"cases": 0.0, "narrow": 0.02, "wide": 0.10}
"""Largest share of the lanes that may say so."""
COVER = 100.0
"""Largest median ratio of the stated error to the true one."""


class Lane(NamedTuple):
    """One revolution by the package and by the reference."""

    of: str
    rpm: float
    label: str
    stated: float
    """Error by the package [scale]."""
    error: float
    """Distance of the whole state from the reference [scale]; NaN where one of them has none."""
    noise: float
    """Error of the reference; infinite where it does not know."""
    peak: float
    """Largest eccentricity ratio by the reference; infinite where the cage leaves for good."""

    @property
    def known(self) -> bool:
        """True if the reference is certain."""
        return self.noise <= NOISE * CERTAIN

    @property
    def success(self) -> bool:
        """Statement of the package."""
        return self.label not in ("failed", "inaccurate")

    @property
    def refused(self) -> bool:
        """Called failed, where the reference goes through."""
        return self.known and self.label == "failed" and self.peak <= reference.ESCAPE

    @property
    def off(self) -> bool:
        """Called a success, and further from the truth than it says."""
        return self.known and self.success and not self.error <= self.stated + self.noise + ROUNDING

    @property
    def cover(self) -> float:
        """Stated over true error; NaN where the true one is not known."""
        measured = self.known and self.success and self.error > self.noise
        return self.stated / self.error if measured else math.nan

    def __str__(self) -> str:
        return (
            f"{self.of:50s}{self.rpm:9.1f} rpm  {self.label:12s} error {self.error:.1e}, stated {self.stated:.1e}, "
            f"eps up to {self.peak:.3f}"
        )


def states(model: jc.CageModel, speeds: np.ndarray, seed: int) -> np.ndarray:
    """The paper's start and a random one inside the clearance at every speed, shape (speeds, 2, dimension)."""
    paper = [[float(c) for c in model.initial_states(speed)[0]] for speed in speeds]
    fields = [reference.field(model, float(speed)) for speed in speeds]
    inside = [reference.random_state(100 * seed + i, f, 0.9 * f.land["onset"]) for i, f in enumerate(fields)]
    return np.stack([np.array(paper), np.array(inside)], axis=1)


def truth(field: reference.Field, start: np.ndarray, sharper: float = 1.0) -> tuple[np.ndarray, float, float]:
    """State after a revolution, error of it, largest eccentricity ratio; by tolerances `sharper` times smaller."""
    nowhere = np.full(start.shape, np.nan)
    try:
        exact = reference.confirmed(field, start, sharper=sharper)
    except reference.Outside:
        return nowhere, 0.0, math.inf
    except reference.TooLong:
        return nowhere, math.inf, math.nan
    return exact.strobe[-1], NOISE * exact.spread, exact.peak


def compare(of: str, model: jc.CageModel, speeds: np.ndarray, initial_states: np.ndarray) -> list[Lane]:
    """One revolution of every state."""
    found = jc.sweep(
        model, speeds, initial_states=initial_states, discard=0, revolutions=1, exponents=0, blocks=1, keep=1
    )

    def beside(i: int, j: int, sharper: float = 1.0) -> Lane:
        field = reference.field(model, float(speeds[i]))
        end, noise, peak = truth(field, initial_states[i, j], sharper)
        error = float(np.max(np.abs(found["last"].values[i, j] - end) / field.scale))
        label, stated = str(found["label"].values[i, j]), float(found["error"][i, j])
        return Lane(of, float(found["rpm"][i]), label, stated, error, noise, peak)

    lanes = [beside(i, j) for i, j in np.ndindex(found["label"].shape)]
    # Two integrators may agree by chance: what seems to be off is judged by a better reference.
    return [beside(*divmod(n, initial_states.shape[1]), SHARPER) if lane.off else lane for n, lane in enumerate(lanes)]


def of_model(subject: Subject, count: int) -> Iterator[list[Lane]]:
    """Lanes from initial states, then those that have settled."""
    model, speeds = subject.model, subject.speeds(count)
    first = states(model, speeds, subject.seed)
    yield compare(f"{subject.kind} {subject.name}, start", model, speeds, first)
    settled = jc.sweep(model, speeds, initial_states=first, discard=0, revolutions=SETTLING, exponents=0, blocks=1)
    lost = failed(settled)
    later = np.where(lost[..., None], first, settled["last"].values)
    lanes = compare(f"{subject.kind} {subject.name}, settled", model, speeds, later)
    inside = [bool(model.excursion(tuple(y)) <= 1) for y in later.reshape(len(lanes), -1)]  # others may not start
    yield [
        lane
        for lane, gone, initial_states in zip(lanes, lost.ravel(), inside, strict=True)
        if initial_states and not gone
    ]


COLUMNS = ("lanes", "known", "failed", "refused", "inacc.", "sure", "OFF", "stated", "largest", "error", "largest")
HEAD = f"{'':44s}" + "".join(f"{x:>8s}" for x in (*COLUMNS, "cover"))


def row(name: str, lanes: Sequence[Lane]) -> str:
    """A line of the table; `sure` are the inaccurate lanes of which the reference is certain."""
    label = [lane.label for lane in lanes]
    good = [lane for lane in lanes if lane.success]
    errors = [np.array([x.stated for x in good]), np.array([x.error for x in good if x.known])]
    sure = sum(x.label == "inaccurate" and x.known for x in lanes)
    counts = (len(lanes), sum(x.known for x in lanes), label.count("failed"), sum(x.refused for x in lanes))
    counts = (*counts, label.count("inaccurate"), sure, sum(x.off for x in lanes))
    sizes = "".join(f"{f(e) if e.size else math.nan:8.0e}" for e in errors for f in (np.median, np.max))
    return f"{name:44s}" + "".join(f"{count:8d}" for count in counts) + f"{sizes}{cover(lanes):8.3g}"


def cover(lanes: Sequence[Lane]) -> float:
    """Median ratio of stated to true error; NaN where no true one is known."""
    ratios = [lane.cover for lane in lanes if not math.isnan(lane.cover)]
    return float(np.median(ratios)) if ratios else math.nan


def report(found: Sequence[Subject], quick: bool) -> list[str]:
    """errors of single revolutions, from initial states and from settled states, beside the reference"""
    wrong, every = [], []
    for kind, group in by_kind(found).items():
        print(f"\nOne revolution, {kind}\n{HEAD}", flush=True)
        lanes: list[Lane] = []
        for subject in group:
            new = [lane for part in of_model(subject, 2 if quick else SPEEDS) for lane in part]
            print(row(subject.name, new), *[f"  {lane}" for lane in new if lane.off], sep="\n", flush=True)
            lanes += new
        print(row("all", lanes))
        share = sum(lane.label == "inaccurate" for lane in lanes) / len(lanes)
        if share > INACCURATE[kind]:
            wrong.append(f"{share:.1%} of {kind} lanes are inaccurate")
        every += lanes
    for text, these in (
        ("off by more than they say", [x for x in every if x.off]),
        ("failed where the reference goes through", [x for x in every if x.refused]),
    ):
        if these:
            wrong.append(f"{len(these)} lanes {text}")
            print(f"{text}:", *these, sep="\n  ")
    if not cover(every) <= COVER:
        wrong.append(f"the stated error is {cover(every):.3g} times the true one in the median")
    print("inaccurate:", *[x for x in every if x.label == "inaccurate"], sep="\n  ")
    return wrong
