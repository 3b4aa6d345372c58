"""Statistics of designs from one sweep of all of them: chaotic speeds, quantities of the model, land loads.

Every design is run at the same speeds with the same settings, and two designs are compared by runs that no search has
used. Chaotic trajectories are not differentiated: their derivatives grow like e^(lambda n), whatever the means do.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.special import expit

from .._errors import ArgumentError
from .._pytrees import compiled
from ..analysis import CHAOS_THRESHOLD, LAND_LOADS, failed, land_loads, scatter
from ..lanes import Plan, Progress, Run, Speeds, run_lanes
from ..models import AbstractForcedSystem, CageModel, drawn_places, rolling_start
from .design_space import Models
from .requirements import cost_function


CAGE_PARAMETERS = (
    *("guidance_gap", "pocket_clearance", "land_width", "eccentricity"),
    *("cage_mass", "cage_inertia", "pocket_stiffness", "inner_land_diameter"),
)
"""Parameters of a whole bearing that a design of its cage may change; load, speed and oil are fixed."""
BALANCE, OBJECTIVE, EXPONENT = "balance_grade_mm_per_s", "objective", "exponent"
IMPULSES, WEAR = ("pocket_impulse_N_s", "land_impulse_N_s"), ("pocket_wear_mm3_per_h", "land_wear_mm3_per_h")
STATISTICS = ("cage_slip", *IMPULSES, *WEAR, "friction_power_W")
"""Quantities of a whole bearing that depend on its design."""
FORCES = ("pocket_force_peak_N", "land_force_peak_N")
COMPARED = (*STATISTICS, *FORCES, BALANCE)
"""Statistics of a whole bearing that are compared before and after a search."""
TERMS: Mapping[str, tuple[str, ...]] = {
    **{"wear": ("+".join(WEAR),), "force": FORCES, "impulse": IMPULSES},
    **{"power": ("friction_power_W",), "slip": ("cage_slip",), "balance": (BALANCE,)},
}
"""Terms of the objective of a whole bearing: statistics over their present values; two in one term count half each."""
BEARING_MEASURES = {name: name for name in COMPARED[:-1]} | {n: TERMS[n][0] for n in ("wear", "power", "slip")}
"""Statistic of a whole bearing by the name of a measure."""
LEAST_SLIP, LEAST_SHARE = 1e-3, 0.01
"""Slip that is negligible, and share of the cage's weight under which wear is negligible."""
SOFTNESS = 0.02
"""Half width of the smooth step of the largest exponent that counts chaotic speeds [1/revolution]."""
SPREAD = 0.6
"""Fraction of the clearance over which initial states of a cage are drawn."""


class Runs:
    """Speeds, initial states and settings of the runs from which statistics of designs are computed."""

    def __init__(
        self,
        speeds: Speeds,
        initial_states: Any = 1,
        *,
        discard: int = 150,
        revolutions: int = 100,
        blocks: int = 1,
        seed: int | None = None,
        progress: Progress | None = None,
        **more: Any,
    ):
        """**Arguments:** ascending speeds [rad/s], for a whole bearing those of its shaft; number of the model's own
        initial states, or the initial states of every design; seed for as many random ones in place of the model's own;
        progress as in `sweep`; settings of `jaxcage.lanes.Run`."""
        if revolutions < blocks or revolutions % blocks:
            said = f"must be a multiple of {blocks} above 0, but {revolutions} was given."
            raise ArgumentError("revolutions", said=said)
        self.speed = np.atleast_1d(np.asarray(speeds, dtype=float))
        self.initial_states, self.seed, self.progress = initial_states, seed, progress
        length = {"discard": discard, "revolutions": revolutions, "blocks": blocks}
        self.settings: dict[str, Any] = {"exponents": 1, "keep": 1, **length, **more}

    @classmethod
    def of_bearing(cls, speeds: Speeds, initial_states: Any = 4, **more: Any) -> "Runs":
        """Runs of a whole bearing in two blocks, from random positions of its cage; peaks are maxima of a block."""
        length = {"discard": 10, "revolutions": 20, "blocks": 2}
        usual: dict[str, Any] = {**length, "exponents": 0, "tolerance": 1e-4, "seed": 0}
        return cls(speeds, initial_states, **usual | more)

    def fresh(self, number: int = 1, initial_states: int = 8) -> "Runs":
        """Independent runs for a check: other random initial states, twice as many speeds elsewhere in the range, twice
        as many discarded revolutions, and a tenth of the tolerance. Each `number` from 1 on gives another draw."""
        speeds, seed, finer = self.speed, (self.seed or 0) + number, dict(self.settings)
        if (n := 2 * speeds.size) > 2:
            share = (np.arange(n) + np.random.default_rng(seed).uniform(size=n)) / n
            share[-1] = 1.0  # the balance grade is that of the highest speed
            speeds = speeds[0] + share * (speeds[-1] - speeds[0])
        finer["discard"] *= 2
        if finer.get("tolerance"):
            finer["tolerance"] /= 10
        return Runs(speeds, initial_states, seed=seed, **finer)

    def run(self, models: Models) -> xr.Dataset:
        """Sweep of some designs."""
        run = Run.of(models[0], **self.settings | {"confirm": False, "horizon": 0})
        if self.seed is None:
            plan = Plan.over_speed(list(models), self.speed, self.initial_states)
        else:
            drawn = [drawn_states(model, self.speed, self.initial_states, self.seed) for model in models]
            plan = Plan.over_speed(list(models), self.speed, [(0.0,) * models[0].dimension] * self.initial_states)
            plan = dataclasses.replace(plan, states=np.concatenate(drawn).reshape(plan.states.shape))
        return run_lanes(plan, run, self.progress)


def drawn_states(
    model: AbstractForcedSystem, speed: Float[np.ndarray, " speeds"], count: int, seed: int
) -> Float[np.ndarray, "speeds count dim"]:
    """Random initial states within the clearance; for a whole bearing, random cage positions with rolling rollers."""
    if model.samples > 1:
        return np.asarray(_rolling_states(model, jnp.asarray(speed), jnp.asarray(drawn_places(count, seed))))
    size = SPREAD * np.array([[float(x) for x in model.scale(s)] for s in speed.tolist()])
    size[:, size.shape[1] // 2 :] *= 0.3  # velocities, relative to clearance times speed
    return size[:, None] * np.random.default_rng(seed).uniform(-1, 1, (count, size.shape[1]))


@compiled
def _rolling_states(model: Any, speeds: Array, places: Array) -> Float[Array, "speeds initial_states dim"]:
    one = lambda speed, place: rolling_start(model, speed, place=place).row
    return jax.vmap(lambda speed: jax.vmap(lambda place: one(speed, place))(places))(speeds)


@dataclasses.dataclass(frozen=True, eq=False)
class Statistic:
    """Scalar statistic of designs, computed from one sweep of all of them."""

    unit: str
    samples: Callable[[Models, xr.Dataset], Any]
    """Function of designs and their sweep that returns an array (designs, speeds, initial states, blocks); the mean
    over all but the first axis gives the value of each design."""

    def values(self, runs: Runs) -> Callable[[Models], Float[np.ndarray, " designs"]]:
        """Function that runs designs and returns the value of each; NaN where a lane failed."""
        return lambda models: self.samples(models, runs.run(models)).mean(axis=(1, 2, 3))

    def blocks(self, runs: Runs) -> Callable[[Models], Float[np.ndarray, "designs blocks"]]:
        """Function that runs designs and returns the value of each in each block."""
        return lambda models: self.samples(models, runs.run(models)).mean(axis=(1, 2))


def chaotic_width(first_rpm: float, last_rpm: float, price: float = 0.0) -> Statistic:
    """Width of the chaotic speeds between two [rpm], counted at the speeds of the runs, plus `price` times the cost.

    Each speed counts between 0 and 1, by a smooth step of the largest exponent. Failed lanes count as chaotic.
    """

    def samples(models: Models, found: xr.Dataset) -> np.ndarray:
        level = expit((found["exponents"].values[..., :1] - CHAOS_THRESHOLD) / SOFTNESS)
        costs = np.array([float(cost_function(None, model)(model)) if price else 0.0 for model in models])
        wide = (last_rpm - first_rpm) * np.where(np.isfinite(level), level, 1.0)
        return wide + price * costs[:, None, None, None]

    return Statistic("rpm", samples)


def statistic(model: AbstractForcedSystem, name: str) -> Statistic:
    """Statistic by name: a quantity that the model reports, the largest `exponent`, the balance grade G of ISO
    21940-11, or the sum of names joined by +; in `before_and_after` also a load of a cage's land.

    **Raises:** `ValueError` for an unknown name.
    """
    units = {each.name: each.unit for each in model.quantities} | {EXPONENT: "1"}
    if "+" in name:
        parts = [statistic(model, each) for each in name.split("+")]
        return Statistic(parts[0].unit, lambda models, found: sum(each.samples(models, found) for each in parts))
    if name == BALANCE:  # eccentricity times the highest speed of the cage in pure rolling
        grade = lambda m, speed: float(m.eccentricity) * np.max(np.abs(_cage_speed(m, speed))) * 1e3
        each = lambda models, found: np.array([grade(m, found["speed"].values) for m in models])
        return Statistic("mm/s", lambda models, found: each(models, found)[:, None, None, None])
    if name in LAND_LOADS and isinstance(model, CageModel):
        return Statistic(LAND_LOADS[name], lambda _, found: found[name].values[..., None])
    if name not in units:
        raise ArgumentError("statistics", said=f"must hold some of {', '.join(units)}, but has '{name}'.")
    if name == EXPONENT:
        return Statistic("1", lambda _, found: found["block_growth"].values[..., 0])
    return Statistic(units[name], lambda _, found: found[f"{name}_blocks"].values)


def statistics_of(model: AbstractForcedSystem, given: Sequence[str] | Mapping[str, Statistic]) -> dict[str, Statistic]:
    """Statistics by name. **Raises:** `ValueError` if there is none, or for an unknown name."""
    if not given:
        raise ArgumentError("statistics", said="must hold at least one name, but it is empty.")
    return dict(given) if isinstance(given, Mapping) else {name: statistic(model, name) for name in given}


def _cage_speed(model: Any, speed: np.ndarray) -> np.ndarray:
    return np.array([float(model.turning_speed(v)) for v in speed.tolist()])


def _negligible(model: Any, name: str, speed: np.ndarray) -> float:
    """Negligible value, due to the cage's weight: as a force, its impulse per revolution, or rubbing with 1 % of it."""
    weight, turning = float(model.cage_mass * model.gravity), float(np.mean(np.abs(_cage_speed(model, speed))))
    if "wear" in name:
        return float(1e9 * 3600 * model.wear.volume(LEAST_SHARE * weight * turning * float(model.land_radius)))
    if "impulse" in name:
        return weight * 2 * math.pi / turning
    return weight if "force" in name else LEAST_SLIP if name == "cage_slip" else 0.0


def bearing_objective(model: AbstractForcedSystem, runs: Runs, prices: Mapping[str, float]) -> Statistic:
    """Weighted mean of wear, forces, impulses, friction power, slip and balance of a whole bearing, each over its
    present value or, if that is negligible, over what the cage's weight would cause: 1 for the given bearing.

    **Arguments:** the given bearing; settings of the runs; weights of the `TERMS` by name.

    **Raises:** `ValueError` for unknown terms, weights that are negative or all 0, and a bearing that fails in all
    runs.
    """
    if wrong := [name for name in prices if name not in TERMS]:
        raise ArgumentError("prices", said=f"must name some of {', '.join(TERMS)}, but has '{wrong[0]}'.")
    total, terms = sum(prices.values()), []
    if not all(price >= 0 for price in prices.values()) or not total > 0:
        raise ArgumentError("prices", said=f"must be at least 0 and not all 0, but are {dict(prices)}.")
    found = runs.run([model])
    for name, price in ((name, price / len(TERMS[term])) for term, price in prices.items() for name in TERMS[term]):
        each = statistic(model, name)
        now = each.samples([model], found)
        if not np.any(np.isfinite(now)):
            raise ArgumentError(
                "model", said="must run through from one of the initial states at least, but fails from all."
            )
        beside = max(float(np.nanmean(now)), _negligible(model, name, runs.speed))
        terms.append((price / total / beside if beside else 0.0, each.samples))
    return Statistic("1", lambda models, found: sum(by * samples(models, found) for by, samples in terms))


@dataclasses.dataclass(frozen=True)
class BeforeAfter:
    """Statistic of two designs from the same initial states, and its change, with standard errors from the scatter of
    runs and of their differences; infinite for a single one."""

    name: str
    unit: str
    before: float
    before_error: float
    after: float
    after_error: float
    change: float
    change_error: float

    @property
    def known(self) -> bool:
        """True if the change is more than twice its error."""
        return abs(self.change) > 2 * self.change_error


def before_and_after(
    before: AbstractForcedSystem,
    after: AbstractForcedSystem,
    runs: Runs,
    statistics: Sequence[str] | Mapping[str, Statistic] = COMPARED,
) -> tuple[list[BeforeAfter], int]:
    """Compare statistics of two designs from the same initial states.

    **Arguments:** designs; settings of the runs, best `Runs.fresh` of those of the search; statistics, by name or as a
    mapping.

    **Returns:** a row for each statistic; the number of failed lanes, which are left out together with those of the
    other design at the same speed from the same initial state.
    """
    pair, rows = [before, after], []
    found = runs.run(pair)
    if isinstance(before, CageModel):
        loads: Any = land_loads(pair, found, runs.settings.get("method"))  # pyright: ignore[reportArgumentType]
        found = found.assign({name: (found["label"].dims, load) for name, load in loads.items()})
    for name, each in statistics_of(before, statistics).items():
        values = np.broadcast_to(each.samples(pair, found).mean(axis=3), failed(found).shape)
        known = np.all(np.isfinite(values), axis=0)
        some = np.any(known, axis=0)
        a, b = (np.average(np.where(known, x, 0.0)[:, some], axis=0, weights=known[:, some]) for x in values)
        numbers = [float(number) for x in (a, b, b - a) for number in (np.mean(x), scatter(x))]
        rows.append(BeforeAfter(name, each.unit, *numbers))
    return rows, int(failed(found).sum())
