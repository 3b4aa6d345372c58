"""Statistics of designs, each read off one sweep of all designs: chaotic speeds, quantities of the model, land loads.

Every design is run at the same speeds, from the same initial states and with the same settings. Chaotic motion is not
differentiated: the derivative of a trajectory grows like e^(lambda n), whatever its means do.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.special import expit

from .._arguments import require_at_least
from .._errors import ArgumentError
from .._pytrees import compiled
from ..analysis import CHAOS_THRESHOLD, failed
from ..lanes import Plan, Progress, Run, Speeds, rpm, run_lanes
from ..models import AbstractForcedSystem, BearingModel, drawn_places, rolling_start
from ..solve import AbstractMethod
from .loads import FILM, LAND_LOADS, loads_of_lanes, mean_of_known, negligible_load
from .objective import AbstractObjective, DesignSpace, Models, Smooth


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
"""Parameters of a whole bearing that a design of its cage may change: load, speed and oil stay as they are."""
BALANCE, OBJECTIVE, EXPONENT = "balance_grade_mm_per_s", "objective", "exponent"
STATISTICS = (
    "cage_slip",
    "pocket_impulse_N_s",
    "land_impulse_N_s",
    "pocket_wear_mm3_per_h",
    "land_wear_mm3_per_h",
    "friction_power_W",
)
"""Quantities of a whole bearing that answer to its design."""
COMPARED = (*STATISTICS, "pocket_force_peak_N", "land_force_peak_N")
"""Quantities that are shown before and after, with the balance grade."""
TERMS: Mapping[str, tuple[str, ...]] = {
    "wear": ("pocket_wear_mm3_per_h+land_wear_mm3_per_h",),
    "force": ("pocket_force_peak_N", "land_force_peak_N"),
    "impulse": ("pocket_impulse_N_s", "land_impulse_N_s"),
    "power": ("friction_power_W",),
    "slip": ("cage_slip",),
    "balance": (BALANCE,),
}
"""Terms of the objective of a whole bearing: statistics relative to their present values; of two each counts half."""
BEARING_MEASURES: Mapping[str, str] = {
    **{term: names[0] for term, names in TERMS.items() if len(names) == 1 and term != "balance"},
    **{name: name for name in COMPARED},
}
"""Statistic of a whole bearing by the name of a measure."""
LEAST_SLIP, LEAST_SHARE = 1e-3, 0.01
"""A slip below this, and wear below that of this share of the cage's weight, are next to nothing."""


@dataclasses.dataclass(frozen=True, eq=False)
class Runs:
    """Settings by which designs are run to be measured. The last sweep is kept, for all statistics that are read off
    the same runs."""

    speeds: Speeds
    """Ascending speeds [rad/s], of a whole bearing its shaft's."""
    starts: Any = 1
    """Number of the model's own initial states, or initial states with which every design begins."""
    discard: int = 150
    revolutions: int = 100
    blocks: int = 1
    exponents: int = 1
    tolerance: float | None = None
    method: AbstractMethod | None = None
    weights: Float[np.ndarray, " speeds"] | None = None
    """Weight of each speed in a mean; equal weights by default."""
    seed: int | None = None
    """Seed by which `starts` positions of a whole bearing's cage are drawn in place of the model's own."""
    progress: Progress | None = None
    _last: list[Any] = dataclasses.field(default_factory=list, init=False, repr=False)

    def __post_init__(self):
        require_at_least(0, discard=self.discard, seed=self.seed or 0)
        if isinstance(self.starts, int):
            require_at_least(1, starts=self.starts)
        if self.revolutions < self.blocks or self.revolutions % self.blocks:
            raise ArgumentError(
                "revolutions", said=f"must be a multiple of {self.blocks} above 0, but {self.revolutions} was given."
            )

    @classmethod
    def of_bearing(cls, speeds: Speeds, starts: Any = 4, discard: int = 10, revolutions: int = 20, **more: Any):
        """Runs of a whole bearing in two blocks, from drawn positions of its cage; peaks are the largest in a block."""
        usual = {"blocks": 2, "exponents": 0, "tolerance": 1e-4, "seed": 0}
        return cls(speeds, starts, discard, revolutions, **usual | more)

    def fresh(self, starts: int = 8) -> "Runs":
        """Runs for a check: other drawn positions, a tenth of the tolerance, twice as many revolutions left out."""
        finer = {"discard": 2 * self.discard, "tolerance": (self.tolerance or 1e-4) / 10}
        return dataclasses.replace(self, starts=starts, seed=(self.seed or 0) + 1, progress=None, **finer)

    @property
    def speed(self) -> Float[np.ndarray, " speeds"]:
        """Speeds [rad/s] as an array."""
        return np.atleast_1d(np.asarray(self.speeds, dtype=float))

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean over the speeds, on the second axis."""
        return np.average(values, axis=1, weights=self.weights)

    def run(self, models: Models) -> xr.Dataset:
        """The sweep of some designs."""
        return self._swept(models)[1]

    def loads(self, models: Models, revolutions: int) -> dict[str, Float[np.ndarray, "designs speeds starts"]]:
        """Loads of the land over revolutions that go on from the end of the sweep."""
        _, found, loads = self._swept(models)
        if revolutions not in loads:
            loads[revolutions] = loads_of_lanes(models, found, revolutions, self.method)  # pyright: ignore
        return loads[revolutions]

    def _swept(self, models: Models) -> list[Any]:
        """The last designs, told by their numbers, their sweep and their loads."""
        key = jax.tree.structure(models[0]), b"".join(np.asarray(x).tobytes() for x in jax.tree.leaves(list(models)))
        if not self._last or self._last[0] != key:
            names = ("discard", "revolutions", "blocks", "exponents", "tolerance", "method")
            settings = {name: getattr(self, name) for name in names}
            run = Run.of(models[0], keep=1, confirm=False, horizon=0, **settings)
            self._last[:] = key, run_lanes(self._plan(models), run, self.progress), {}
        return self._last

    def _plan(self, models: Models) -> Plan:
        if self.seed is None:
            return Plan.over_speed(list(models), self.speed, self.starts)
        places = jnp.asarray(drawn_places(self.starts, self.seed))
        placed = [rolling_states(model, jnp.asarray(self.speed), places) for model in models]
        anywhere = [(0.0,) * models[0].dimension] * self.starts
        plan = Plan.over_speed(list(models), self.speed, anywhere)
        return dataclasses.replace(plan, states=np.concatenate(placed).reshape(plan.states.shape))


@compiled
def rolling_states(model: BearingModel, speeds: Array, places: Array) -> Float[Array, "speeds starts dim"]:
    """States of a bearing that rolls, with its cage at given places."""
    one = lambda speed, place: rolling_start(model, speed, place=place).row
    return jax.vmap(lambda speed: jax.vmap(lambda place: one(speed, place))(places))(speeds)


@dataclasses.dataclass(frozen=True, eq=False)
class AbstractStatistic(AbstractObjective):
    """An objective that is read off runs of designs by its `samples`."""

    runs: Runs

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        return self.samples(space.models(places)).mean(axis=(1, 2))

    def by_block(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k blocks"]:
        return self.samples(space.models(places)).mean(axis=1)

    def on(self, runs: Runs) -> "AbstractStatistic":
        return dataclasses.replace(self, runs=runs)


@dataclasses.dataclass(frozen=True, eq=False)
class Chaos(AbstractStatistic):
    """Mean over speeds of how chaotic a design is, times a number such as the width of the range.

    At each speed a smooth step of the largest exponent counts, between 0 and 1, of the worst initial state.
    """

    times: float = 1.0
    softness: float = 0.02
    """Half width of the step, in exponents per revolution."""
    measured_in: str = "1"
    """Unit of the number."""

    def __post_init__(self):
        if not self.softness > 0:
            raise ArgumentError("softness", said=f"must be positive, but {self.softness} was given.")

    def levels(self, models: Models) -> Float[np.ndarray, "k speeds"]:
        """How chaotic each design is at each speed. A lane that failed counts as chaotic."""
        exponent = self.runs.run(models)["exponents"].values[..., 0]
        level = expit((exponent - CHAOS_THRESHOLD) / self.softness)
        return np.max(np.where(np.isfinite(level), level, 1.0), axis=2)

    def samples(self, models: Models) -> Float[np.ndarray, "k 1 1"]:
        return self.times * self.runs.mean(self.levels(models))[:, None, None]

    def unit(self, model: AbstractForcedSystem) -> str:
        return self.measured_in


def chaotic_width(
    first_rpm: float, last_rpm: float, count: int = 48, softness: float = Chaos.softness, **runs: Any
) -> Chaos:
    """Chaotic speeds between two [rpm], on a grid of `count` speeds: a smoothed width of the zones in that range.

    **Arguments:** range and speeds; half width of the step; fields of `Runs`.

    **Returns:** an objective in rpm, at the resolution of the grid.
    """
    return Chaos(Runs(rpm(first_rpm, last_rpm, count), **runs), last_rpm - first_rpm, softness, "rpm")


def chaotic_share(
    spectrum: Sequence[tuple[float, float, float]], count: int = 12, softness: float = Chaos.softness, **runs: Any
) -> Chaos:
    """Share of its running time that a cage is chaotic.

    **Arguments:** operating spectrum as rows (first rpm, last rpm, hours), `count` speeds in each; half width of the
    step; fields of `Runs`.

    **Raises:** `ValueError` for ranges that overlap or descend.
    """
    rows = sorted(spectrum)
    ends = [x for first, last, _ in rows for x in (first, last)]
    if not rows or any(b <= a for a, b in zip(ends[:-1], ends[1:], strict=True)):
        raise ArgumentError("spectrum", said=f"must hold ranges that ascend and do not overlap, but is {spectrum}.")
    speeds = np.concatenate([rpm(first, last, count) for first, last, _ in rows])
    return Chaos(Runs(speeds, weights=np.repeat([hours for *_, hours in rows], count), **runs), 1.0, softness)


@dataclasses.dataclass(frozen=True, eq=False)
class Mean(AbstractStatistic):
    """Mean over speeds of a quantity that the model reports, or of its largest `exponent`."""

    name: str

    def samples(self, models: Models) -> Float[np.ndarray, "k starts blocks"]:
        known = (*(each.name for each in models[0].quantities), EXPONENT)
        if self.name not in known:
            raise ArgumentError("statistics", said=f"must hold some of {', '.join(known)}, but has '{self.name}'.")
        found = self.runs.run(models)
        blocks = found["block_growth"][..., 0] if self.name == EXPONENT else found[f"{self.name}_blocks"]
        return self.runs.mean(blocks.values)

    def unit(self, model: AbstractForcedSystem) -> str:
        return next((each.unit for each in model.quantities if each.name == self.name), "1")

    def negligible(self, model: Any) -> float:
        """Value that the cage's weight causes: as a force, over a revolution, rubbing with a hundredth of it."""
        if "wear" not in self.name and "force" not in self.name and "impulse" not in self.name:
            return LEAST_SLIP if self.name == "cage_slip" else 0.0
        weight = float(model.cage_mass * model.gravity)
        turning = float(np.mean(np.abs(_cage_speed(model, self.runs.speed))))
        if "wear" in self.name:
            return float(1e9 * 3600 * model.wear.volume(LEAST_SHARE * weight * turning * float(model.land_radius)))
        return weight if "force" in self.name else weight * 2 * math.pi / turning


@dataclasses.dataclass(frozen=True, eq=False)
class LandLoad(AbstractStatistic):
    """Mean over speeds of a load of a cage's land (`LAND_LOADS`), or the `least film` [m], which is to be made large.

    Loads are means over the initial states, of the film the least counts. They go on from the end of the sweep.
    """

    name: str = "wear load"
    over: int = 4
    """Revolutions over which loads are read."""

    def __post_init__(self):
        if self.name not in (*LAND_LOADS, FILM):
            raise ArgumentError(
                "name", said=f"must be one of {', '.join((*LAND_LOADS, FILM))}, but '{self.name}' was given."
            )

    def at_speeds(self, models: Models) -> Float[np.ndarray, "k speeds"]:
        """Load at each speed; NaN where every initial state failed."""
        each = self.runs.loads(models, self.over)[self.name]
        return np.fmin.reduce(each, axis=2) if self.name == FILM else mean_of_known(each)

    def samples(self, models: Models) -> Float[np.ndarray, "k starts 1"]:
        each, mean = self.runs.loads(models, self.over)[self.name], self.at_speeds(models)[..., None]
        return self.runs.mean(mean if self.name == FILM else np.where(np.isfinite(each), each, mean))[..., None]

    def negligible(self, model: Any) -> float:
        if self.name == FILM:
            raise ArgumentError("name", said=f"must be one of {', '.join(LAND_LOADS)}, but '{FILM}' was given.")
        speed = float(np.average(self.runs.speed, weights=self.runs.weights))
        return negligible_load(model, self.name, speed)

    def unit(self, model: AbstractForcedSystem) -> str:
        return LAND_LOADS.get(self.name, "m")


def _cage_speed(model: AbstractForcedSystem, speed: np.ndarray) -> np.ndarray:
    """Speeds of the cage [rad/s] at speeds of the model."""
    return np.array([float(model.turning_speed(v)) for v in speed.tolist()])


@dataclasses.dataclass(frozen=True, eq=False)
class Balance(AbstractStatistic):
    """Balance grade [mm/s], the G of ISO 21940-11: eccentricity times the highest speed of the cage in pure rolling."""

    def samples(self, models: Any) -> Float[np.ndarray, "k 1 1"]:
        highest = lambda model: np.max(np.abs(_cage_speed(model, self.runs.speed)))
        return np.array([float(m.eccentricity) * highest(m) * 1e3 for m in models])[:, None, None]

    def unit(self, model: AbstractForcedSystem) -> str:
        return "mm/s"


def statistic(runs: Runs, name: str) -> AbstractObjective:
    """The statistic of a name: a quantity of the model, `exponent`, a load of the land, the balance grade; or the sum
    of several names that are joined by +."""
    first, *others = (
        LandLoad(runs, each) if each in LAND_LOADS else Balance(runs) if each == BALANCE else Mean(runs, each)
        for each in name.split("+")
    )
    return sum(others, start=first)


def statistics_of(runs: Runs, given: Sequence[str] | Mapping[str, AbstractObjective]) -> dict[str, AbstractObjective]:
    """Statistics by name.

    **Raises:** `ValueError` if there is none.
    """
    if not given:
        raise ArgumentError("statistics", said="must hold at least one name, but it is empty.")
    return dict(given) if isinstance(given, Mapping) else {name: statistic(runs, name) for name in given}


def measure(runs: Runs, name: str) -> AbstractObjective:
    """A measure of a whole bearing.

    **Raises:** `ValueError` for one that is not in `BEARING_MEASURES`.
    """
    if name not in BEARING_MEASURES:
        raise ArgumentError("measure", said=f"must be one of {', '.join(BEARING_MEASURES)}, but '{name}' was given.")
    return statistic(runs, BEARING_MEASURES[name])


def relative(objective: AbstractObjective, model: AbstractForcedSystem, price: float) -> AbstractObjective:
    """`price` times an objective over its value for the model as it is, or over what is next to nothing if that is
    larger or the model fails."""
    each = objective.samples([model])
    now = each[np.isfinite(each)].mean() if np.isfinite(each).any() else 0.0
    beside = max(float(now), objective.negligible(model))
    return (price / beside if beside else 0.0) * objective


def bearing_objective(
    model: BearingModel, vary: Mapping[str, tuple[float, float]], runs: Runs, prices: Mapping[str, float]
) -> AbstractObjective:
    """Wear, forces, impulses, friction power, slip and balance of a whole bearing, each relative to its present value.

    **Arguments:** the bearing as it is; bounds of what will vary, of `CAGE_PARAMETERS`; how designs are run; prices of
    the `TERMS` by name: a term that is left out counts nothing.

    **Returns:** an objective that is 1 for the bearing as it is, the mean of all terms by their prices. A term that is
    next to nothing now is relative to what the cage's weight would cause.

    **Raises:** `ValueError` for parameters that are not the cage's, unknown terms, prices that are negative or all 0.
    """
    if wrong := [name for name in vary if name not in CAGE_PARAMETERS]:
        raise ArgumentError(
            "vary", said=f"must name parameters of the cage: {', '.join(CAGE_PARAMETERS)}; but has '{wrong[0]}'."
        )
    if wrong := [name for name in prices if name not in TERMS]:
        raise ArgumentError("prices", said=f"must name some of {', '.join(TERMS)}, but has '{wrong[0]}'.")
    total = sum(prices.values())
    if not all(price >= 0 for price in prices.values()) or not total > 0:
        raise ArgumentError("prices", said=f"must be at least 0 and not all 0, but are {dict(prices)}.")
    terms = [(price / len(TERMS[term]), name) for term, price in prices.items() if price for name in TERMS[term]]
    first, *others = (relative(statistic(runs, name), model, price / total) for price, name in terms)
    objective = sum(others, start=first)
    if not np.any(np.isfinite(objective.samples([model]))):
        raise ArgumentError("model", said="must run through from one of the starts at least, but fails from all.")
    return objective


@dataclasses.dataclass(frozen=True)
class BeforeAfter:
    """A statistic of two designs from the same initial states, with standard errors from their scatter."""

    name: str
    unit: str
    before: float
    before_error: float
    after: float
    after_error: float
    change: float
    """After less before, [unit]."""
    change_error: float
    """Standard error of the mean difference between runs from the same initial state; NaN of a single one."""

    @property
    def known(self) -> bool:
        """True if the change is more than twice its error."""
        return abs(self.change) > 2 * self.change_error


def before_and_after(
    before: AbstractForcedSystem,
    after: AbstractForcedSystem,
    runs: Runs,
    statistics: Sequence[str] | Mapping[str, AbstractObjective] = (*COMPARED, BALANCE),
) -> tuple[list[BeforeAfter], int]:
    """Statistics of two designs, from the same initial states.

    **Arguments:** designs; how to run them, best `Runs.fresh` of those of the search; names of statistics, or
    statistics by name.

    **Returns:** a row for each statistic; the number of lanes that failed, which are left out together with those of
    the other design from the same initial state.
    """
    pair, chosen = [before, after], statistics_of(runs, statistics)
    found = {name: each.samples(pair).mean(axis=2) for name, each in chosen.items()}
    starts = max(values.shape[1] for values in found.values())
    whole = np.all([np.isfinite(values).all(axis=0) & np.ones(starts, dtype=bool) for values in found.values()], axis=0)
    mean = lambda x: float(x.mean()) if x.size else math.nan

    def row(name: str, each: AbstractObjective) -> BeforeAfter:
        a, b = found[name][:, whole] if found[name].shape[1] == starts else found[name]
        alone = 0.0 if isinstance(each, Balance | Smooth) else math.nan
        error = lambda x: float(x.std(ddof=1) / math.sqrt(x.size)) if x.size > 1 else alone
        return BeforeAfter(name, each.unit(before), mean(a), error(a), mean(b), error(b), mean(b - a), error(b - a))

    return [row(name, each) for name, each in chosen.items()], int(failed(runs.run(pair)).sum())
