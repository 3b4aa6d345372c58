"""One revolution of random models by the default method of sweeps, beside the reference."""

import math
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import jaxcage as jc
from tests import reference


SPEEDS = 5
"""Of each model, with two starts each: ten lanes."""
SETTLING = 60
"""Revolutions before a state counts as settled."""
OFF = 1e-2
"""Error [clearances] beyond which a lane that is called a success is wrong."""
CLOSE = 1e-4
CERTAIN = 1e-4
"""The reference counts where its two integrators agree to this [clearances]."""


class Lane(NamedTuple):
    """One revolution by the package and by the reference."""

    rpm: float
    failed: bool
    """Whether the package says that it failed or is inaccurate."""
    error: float
    """Distance of the coordinates from the reference [clearances]; NaN where one of them has none."""
    known: bool
    """Whether two integrators of the reference agree."""
    peak: float
    """Largest eccentricity ratio by the reference; infinite where the cage leaves for good."""

    @property
    def off(self) -> bool:
        """Called a success, and wrong."""
        return self.known and not self.failed and not self.error <= OFF


def states(model: jc.CageModel, speeds: np.ndarray, seed: int) -> np.ndarray:
    """The paper's start and a random one inside the clearance at every speed, shape (speeds, 2, dimension)."""
    paper = [[float(c) for c in model.starts(speed)[0]] for speed in speeds]
    fields = [reference.field(model, float(speed)) for speed in speeds]
    inside = [reference.random_state(100 * seed + i, f, 0.9 * f.land["onset"]) for i, f in enumerate(fields)]
    return np.stack([np.array(paper), np.array(inside)], axis=1)


def compare(model: jc.CageModel, speeds: np.ndarray, starts: np.ndarray) -> list[Lane]:
    """One revolution of every state."""
    found = jc.sweep(model, speeds, starts=starts, discard=0, revolutions=1, exponents=0, blocks=1, keep=1)
    bad = np.isin(found.label, ["failed", "inaccurate"])
    lanes = []
    for (i, j), failed in np.ndenumerate(bad):
        field = reference.field(model, float(speeds[i]))
        error, known, peak = math.nan, False, math.nan
        try:
            exact = reference.confirmed(field, starts[i, j])
        except reference.Outside:
            error, known, peak = math.inf, True, math.inf
        except reference.TooLong:
            pass
        else:
            known, peak = exact.spread <= CERTAIN, exact.peak
            apart = np.abs(found.last[i, j] - exact.strobe[-1])[: field.coordinates] / field.clearance
            error = float(np.max(apart))
        lanes.append(Lane(float(speeds[i]) * 30 / math.pi, bool(failed), error, known, peak))
    return lanes


def row(name: str, lanes: Sequence[Lane]) -> str:
    """A line of the table."""
    known = [lane for lane in lanes if lane.known]
    failed = [lane for lane in known if lane.failed]
    error = np.array([lane.error for lane in known if not lane.failed])
    within = [lane for lane in failed if lane.peak <= 1]
    median, most = (f"{f(error):.0e}" if error.size else "-" for f in (np.median, np.max))
    counts = (len(lanes), len(known), len(failed), len(within), np.sum(error > CLOSE), sum(x.off for x in lanes))
    return f"{name:44s}" + "".join(f"{count:7d}" for count in counts) + f"{median:>9s}{most:>9s}"


HEAD = f"{'':44s}" + "".join(f"{x:>7s}" for x in ("lanes", "known", "failed", "inside", ">1e-4", "OFF"))
HEAD += f"{'median':>9s}{'largest':>9s}"


def title(seed: int, model: jc.CageModel) -> str:
    """What a model is made of."""
    given = reference.numbers_of(model)
    rib = ", elastic rib" if given["rib"]["kind"] == "elastic" else ""
    supply = ", supply" if given["film"]["supply_pressure"] else ""
    return f"{seed:3d} {given['film']['model']}{supply}, {given['impact']['kind']}{rib}"


def report(seeds: Sequence[int]) -> None:
    """errors of single revolutions, from starts and from settled states"""
    for wide in (False, True):
        begin = time.perf_counter()
        groups: dict[str, list[Lane]] = {"from a start": [], "settled": []}
        worst = []
        print(f"\nOne revolution, {'wide' if wide else 'narrow'} models\n{HEAD}", flush=True)
        for seed in seeds:
            model, speeds = reference.random_model(seed, wide), reference.random_speeds(seed, SPEEDS, wide)
            first = states(model, speeds, seed)
            settled = jc.sweep(model, speeds, starts=first, discard=0, revolutions=SETTLING, exponents=0, blocks=1)
            later = np.where(settled.failed[..., None], first, settled.last)
            of_model = []
            for name, y, there in (
                ("from a start", first, np.ones_like(settled.failed)),
                ("settled", later, ~settled.failed),
            ):
                lanes = [lane for lane, ran in zip(compare(model, speeds, y), there.ravel(), strict=True) if ran]
                groups[name] += lanes
                of_model += lanes
                worst += [(seed, name, lane) for lane in lanes if lane.off]
            print(row(title(seed, model), of_model), flush=True)
        for name, lanes in groups.items():
            print(row(name, lanes))
        print(f"{time.perf_counter() - begin:.0f} s. Success, but off by more than {OFF:g} of the clearance:")
        for seed, name, lane in worst:
            print(f"  {seed:3d} {name:13s}{lane.rpm:9.1f} rpm  error {lane.error:.1e}, eps up to {lane.peak:.3f}")
