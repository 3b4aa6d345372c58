"""Models that `benchmarks.truth` examines: the six cases and random models by seed, with their sweeps."""

import dataclasses
import functools
import math
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

import jaxcage as jc
from jaxcage._bearing_data import FASTEST
from jaxcage.models import CageModel
from jaxcage.solve import AbstractMethod, native
from tests import reference


CASES = ("1a", "1b", "2a", "2b", "3a", "3b")
KINDS = ("cases", "narrow", "wide")
LOWEST, HIGHEST = 300.0, 60000.0
"""Speeds of the cases and of wide models [rpm]."""
TIMES = 3
"""Number of refinements: the tolerance is 16^-3 of the default."""
GRID = 8
"""Speeds of each model."""
FEW = 3
"""Speeds of each model with `--quick`."""


def fastest_speed(model: CageModel) -> float:
    """The speed [rad/s] at which the land of the cage runs as fast as is allowed."""
    return FASTEST / float(model.land_radius)


@dataclasses.dataclass(frozen=True, eq=False)
class Subject:
    """A model, and which speeds are its own. Each is itself and no other, so that results can be kept for it."""

    name: str
    kind: str
    seed: int
    model: CageModel

    def speeds(self, count: int) -> np.ndarray:
        """Ascending random speeds [rad/s]."""
        if self.kind == "cases":
            return random_case_speeds(self.seed, count)
        return reference.random_speeds(self.seed, count, self.kind == "wide", fastest_speed(self.model))

    def grid(self, count: int) -> np.ndarray:
        """Speeds [rad/s] with equal ratios, from end to end."""
        low, high = (rpm * math.pi / 30 for rpm in reference.SPEEDS[self.kind == "wide"])
        return np.geomspace(low, min(high, fastest_speed(self.model)), count)


def random_case_speeds(seed: int, count: int) -> np.ndarray:
    """Logarithmically spread over all speeds [rad/s]."""
    drawn = np.random.default_rng([seed, 2]).uniform(math.log(LOWEST), math.log(HIGHEST), count)
    return np.sort(np.exp(drawn)) * math.pi / 30


def described(seed: int, model: CageModel) -> str:
    """Words for the laws of a model."""
    given = reference.numbers_of(model)
    rib = ", elastic rib" if given["rib"]["kind"] == "elastic" else ""
    supply = ", supply" if given["film"]["supply_pressure"] else ""
    return f"{seed:3d} {given['film']['model']}{supply}, {given['impact']['kind']}{rib}"


def subjects(kinds: Sequence[str], seeds: Sequence[int], cases: Sequence[str] = CASES) -> Iterator[Subject]:
    """The cases, then narrow models, then wide ones."""
    if "cases" in kinds:
        yield from (Subject(f"case {name}", "cases", i, jc.case(name)) for i, name in enumerate(cases))
    for kind in KINDS[1:]:
        for seed in seeds if kind in kinds else ():
            model = reference.random_model(seed, kind == "wide")
            yield Subject(described(seed, model), kind, seed, model)


def by_kind(found: Sequence[Subject]) -> dict[str, list[Subject]]:
    """In the order of `KINDS`, those that there are."""
    groups = {kind: [s for s in found if s.kind == kind] for kind in KINDS}
    return {kind: group for kind, group in groups.items() if group}


def fine() -> AbstractMethod:
    """The method with finer steps with which the default method is compared."""
    return native().finer(TIMES)


@functools.cache
def pair(subject: Subject, quick: bool) -> tuple[xr.Dataset, xr.Dataset]:
    """A model over its grid of speeds as by default, its labels confirmed, and by the finer steps."""
    grid = subject.grid(FEW if quick else GRID)
    return jc.sweep(subject.model, grid, horizon=0), jc.sweep(
        subject.model, grid, horizon=0, confirm=False, method=fine()
    )
