"""Designs of the whole bearing: wear, forces, friction, slip and balance, beside what they are now.

Its motion is chaotic, so a design is measured by means over drawn initial states, the same ones for every design. Load,
speed, oil and traction stay what they are: only the cage is changed.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from .._parameters import parameters
from ..analysis import STATISTIC_UNITS, BearingSweep
from ..models import BearingModel, drawn_places
from ..sweeps import Progress, sweep_bearings
from ._bearing_gradient import STATISTICS
from ._objective import AbstractObjective, DesignSpace


CAGE_PARAMETERS = (
    "guidance_gap",
    "pocket_clearance",
    "land_width",
    "eccentricity",
    "cage_mass",
    "cage_inertia",
    "pocket_stiffness",
    "inner_land_diameter",
)
"""What of a whole bearing a design of its cage may change."""
BALANCE, OBJECTIVE = "balance_grade_mm_per_s", "objective"
TERMS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "wear": (("pocket_wear_mm3_per_h", "land_wear_mm3_per_h"),),
    "force": (("pocket_force_peak_N",), ("land_force_peak_N",)),
    "impulse": (("pocket_impulse_N_s",), ("land_impulse_N_s",)),
    "power": (("friction_power_W",),),
    "slip": (("cage_slip",),),
    "balance": ((BALANCE,),),
}
"""What a design is measured by: sums of statistics, each sum relative to its present value; of two sums each counts
half."""
COMPARED = (*STATISTICS, "pocket_force_peak_N", "land_force_peak_N")
"""What is shown before and after, with the balance grade."""
LEAST_SLIP, LEAST_SHARE = 1e-3, 0.01
"""A slip below this, and wear below that of this part of the cage's weight, count as nothing to compare with."""


@dataclasses.dataclass(frozen=True, eq=False)
class BearingRuns:
    """How designs are run to be measured. All begin with the same drawn positions of the cage."""

    speeds: Float[np.ndarray, " speeds"] | float
    """Ascending shaft speeds [rad/s]; all count alike."""
    starts: int = 4
    discard: int = 10
    revolutions: int = 20
    """Of the cage observed, an even number; peaks are the largest in half of them."""
    tolerance: float = 1e-4
    seed: int = 0
    progress: Progress | None = None

    def __post_init__(self):
        if self.starts < 1 or self.discard < 0 or self.seed < 0:
            given = f"{self.starts}, {self.discard} and {self.seed}"
            raise ArgumentError("starts", "discard", "seed", said=f"must be at least 1, 0 and 0, but are {given}.")
        if self.revolutions < 2 or self.revolutions % 2:
            raise ArgumentError(
                "revolutions", said=f"must be an even number above 0, but {self.revolutions} was given."
            )

    def run(self, models: Sequence[BearingModel]) -> list[BearingSweep]:
        """The designs from the same starts, in two blocks."""
        return sweep_bearings(
            models,
            self.speeds,
            starts=drawn_places(self.starts, self.seed),
            discard=self.discard,
            revolutions=self.revolutions,
            blocks=2,
            exponents=0,
            tolerance=self.tolerance,
            progress=self.progress,
        )

    def fresh(self, starts: int = 8) -> "BearingRuns":
        """Runs for a check: other starts, a tenth of the tolerance, twice as many revolutions left out."""
        finer = {"discard": 2 * self.discard, "tolerance": self.tolerance / 10}
        return dataclasses.replace(self, starts=starts, seed=self.seed + 1, progress=None, **finer)


def balance_grade(model: BearingModel, speeds: Float[np.ndarray, " speeds"] | float) -> float:
    """Eccentricity times the highest speed of the cage in pure rolling [mm/s], the G of ISO 21940-11."""
    return float(model.eccentricity * np.max(np.abs(model.rolling_cage_speed(jnp.asarray(speeds))))) * 1e3


def _halves(found: BearingSweep, name: str) -> Float[np.ndarray, "starts 2"]:
    """A statistic of each start in both halves of the run, the mean over speeds."""
    return found.block_means[name].mean(axis=0)


@dataclasses.dataclass(frozen=True, eq=False)
class BearingObjective(AbstractObjective):
    """A weighted sum of statistics of the whole bearing."""

    runs: BearingRuns
    weights: Mapping[str, float]
    """Per unit of each statistic."""

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return self.halves(space, np.asarray(places)).mean(axis=-1)

    def halves(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k 2"]:
        """The sum of each design in both halves of the run; NaN where one of its lanes failed."""
        models = [space.model(place) for place in places]
        rows = []
        for model, found in zip(models, self.runs.run(models), strict=True):
            exact = self.weights.get(BALANCE, 0.0) * balance_grade(model, self.runs.speeds)
            parts = [w * _halves(found, name).mean(axis=0) for name, w in self.weights.items() if name != BALANCE]
            rows.append(exact + np.sum(parts, axis=0) if parts else np.full(2, exact))
        return np.array(rows)


def bearing_objective(
    model: BearingModel, vary: Mapping[str, tuple[float, float]], runs: BearingRuns, prices: Mapping[str, float]
) -> BearingObjective:
    """Wear, forces, impulses, friction power, slip and balance of a whole bearing, each beside what it is now.

    **Arguments:** the bearing as it is; what will vary, of `CAGE_PARAMETERS`; how designs are run; what the
    `TERMS` count, by name: a term that is left out counts nothing.

    **Returns:** an objective that is 1 for the bearing as it is, the mean of all terms by their prices. Of one that is
    next to nothing now, what the cage's weight would do counts as 1.

    **Raises:** `ValueError` for parameters that are not the cage's, unknown terms, prices that are negative or all 0.
    """
    if wrong := [name for name in vary if name not in CAGE_PARAMETERS]:
        raise ArgumentError(
            "vary", said=f"must name parameters of the cage: {', '.join(CAGE_PARAMETERS)}; but has '{wrong[0]}'."
        )
    if wrong := [name for name in prices if name not in TERMS]:
        raise ArgumentError("prices", said=f"must name some of {', '.join(TERMS)}, but has '{wrong[0]}'.")
    if not all(price >= 0 for price in prices.values()) or not sum(prices.values()) > 0:
        raise ArgumentError("prices", said=f"must be at least 0 and not all 0, but are {dict(prices)}.")
    found = runs.run([model])[0]
    now = {name: float(np.nanmean(_halves(found, name))) for name in COMPARED}
    now[BALANCE] = balance_grade(model, runs.speeds)
    if not np.all(np.isfinite(list(now.values()))):
        raise ArgumentError("model", said="must run through from one of the starts at least, but fails from all.")
    weights: dict[str, float] = {}
    for term, price in prices.items():
        for names in TERMS[term]:
            beside = max(sum(now[name] for name in names), _least(names[-1], model, runs.speeds))
            share = price / sum(prices.values()) / len(TERMS[term])
            weights |= {name: share / beside for name in names if share and beside}
    return BearingObjective(runs, weights)


def _least(name: str, model: BearingModel, speeds: Float[np.ndarray, " speeds"] | float) -> float:
    """What the cage's weight would do: as a force, over a revolution, rubbing with a hundredth of it."""
    weight = float(model.cage_mass * model.gravity)
    turning = float(np.mean(np.abs(model.rolling_cage_speed(jnp.asarray(speeds)))))
    if "force" in name:
        return weight
    if "impulse" in name:
        return weight * 2 * np.pi / turning
    if "wear" in name:
        return float(1e9 * 3600 * model.wear.volume(LEAST_SHARE * weight * turning * float(model.land_radius)))
    return LEAST_SLIP if name == "cage_slip" else 0.0


@dataclasses.dataclass(frozen=True)
class BeforeAfter:
    """A statistic of two designs that began alike, with standard errors from the scatter of their starts."""

    name: str
    unit: str
    before: float
    before_error: float
    after: float
    after_error: float
    change: float
    """After less before, [unit]."""
    change_error: float
    """Of the differences from the same starts."""

    @property
    def known(self) -> bool:
        """Whether the change is more than twice its error."""
        return abs(self.change) > 2 * self.change_error


def before_and_after(
    before: BearingModel, after: BearingModel, runs: BearingRuns, weights: Mapping[str, float] | None = None
) -> tuple[list[BeforeAfter], int]:
    """Every statistic of two designs, from the same starts.

    **Arguments:** designs; how to run them, best `BearingRuns.fresh` of those that the search had; the weights of the
    `BearingObjective`, if there is one.

    **Returns:** a row for each of `COMPARED`, the balance grade and the objective; the number of lanes that failed,
    which are left out with those that began alike.
    """
    old, new = runs.run([before, after])
    whole = ~(old.failed | new.failed).any(axis=0)
    mean = lambda x: float(x.mean()) if x.size else math.nan
    error = lambda x: float(x.std(ddof=1) / math.sqrt(x.size)) if x.size > 1 else math.nan

    def row(name: str, unit: str, a: np.ndarray, b: np.ndarray) -> BeforeAfter:
        return BeforeAfter(name, unit, mean(a), error(a), mean(b), error(b), mean(b - a), error(b - a))

    found = {name: [_halves(each, name)[whole].mean(axis=-1) for each in (old, new)] for name in COMPARED}
    rows = [row(name, STATISTIC_UNITS[name], *pair) for name, pair in found.items()]
    then, now = (balance_grade(model, runs.speeds) for model in (before, after))
    rows.append(BeforeAfter(BALANCE, "mm/s", then, 0.0, now, 0.0, now - then, 0.0))
    if weights is not None:
        found[BALANCE] = [np.full(int(whole.sum()), grade) for grade in (then, now)]
        total = lambda i: np.sum([w * found[name][i] for name, w in weights.items()], axis=0)
        rows.append(row(OBJECTIVE, "1", total(0), total(1)))
    return rows, int(old.failed.sum() + new.failed.sum())


def usual_bounds(model: BearingModel) -> dict[str, tuple[float, float]]:
    """What a designer turns first [SI]: gap, pocket clearance and land width from 0.7 to 1.4 of what they are, and the
    eccentricity from a fifth."""
    now = {name: float(value) for name, value in parameters(model).items() if name in CAGE_PARAMETERS}
    within: Callable[[str], tuple[float, float]] = lambda name: (0.2, 1.0) if name == "eccentricity" else (0.7, 1.4)
    names = [name for name in ("guidance_gap", "pocket_clearance", "land_width", "eccentricity") if now[name] > 0]
    return {name: (within(name)[0] * now[name], within(name)[1] * now[name]) for name in names}
