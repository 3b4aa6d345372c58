"""The whole bearing run up and down again: the shaft's speed changed in small steps, the motion carried on."""

import dataclasses
import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from .._arguments import require_above_zero, require_at_least
from .._errors import ArgumentError
from ..analysis import BearingSweep
from ..analysis._zones import runs
from ..models import CAGE_STARTS, BearingModel, BearingState, rolling_start
from ._bearing import sweep_bearing


SURE = 3.0
"""Standard errors by which up and down must differ."""
LEAST_SLIP = 1e-3
"""Slip by which they must differ as well."""


@dataclasses.dataclass(frozen=True)
class BearingRamp:
    """Steps of one way, in the order of growing speed. Means are over all starts."""

    cage_slip: Float[np.ndarray, " steps"]
    cage_slip_error: Float[np.ndarray, " steps"]
    """Standard error, from the scatter of revolutions."""
    eccentricity: Float[np.ndarray, " steps"]
    """Largest eccentricity ratio."""
    whirl_ratio: Float[np.ndarray, " steps"]
    friction_power_W: Float[np.ndarray, " steps"]
    pocket_force_mean_sum_N: Float[np.ndarray, " steps"]
    revolutions: Float[np.ndarray, " steps"]
    """Of the cage in each step."""
    failed: Bool[np.ndarray, " steps"]
    """Whether no start came to the end of the step."""


@dataclasses.dataclass(frozen=True)
class BearingUpDown:
    """Run-up and run-down of the whole bearing."""

    speed: Float[np.ndarray, " steps"]
    """Of the shaft [rad/s]."""
    rate: float
    """Of change of the shaft's speed [rad/s^2]."""
    up: BearingRamp
    down: BearingRamp

    @property
    def rpm(self) -> Float[np.ndarray, " steps"]:
        """Of the shaft."""
        return self.speed * 30 / math.pi

    @property
    def apart(self) -> Bool[np.ndarray, " steps"]:
        """Where the slips differ by more than three standard errors and by more than a thousandth."""
        away = np.abs(self.up.cage_slip - self.down.cage_slip)
        return (away > SURE * np.hypot(self.up.cage_slip_error, self.down.cage_slip_error)) & (away > LEAST_SLIP)

    @property
    def stretches(self) -> list[tuple[float, float]]:
        """Speeds between which both ways differ, first and last step of each [rpm of the shaft]."""
        return [(float(self.rpm[first]), float(self.rpm[last])) for first, last in runs(self.apart)]


def bearing_up_down(
    model: BearingModel,
    first: float,
    last: float,
    rate: float,
    *,
    steps: int = 24,
    starts: int = 3,
    settle: int = 10,
    tolerance: float = 1e-4,
) -> BearingUpDown:
    """Raise the shaft's speed and lower it again, carrying the motion of cage, rollers and ring on from step to step.

    Speed changes by equal steps, and stays for as long as a steady ramp of the same rate takes from step to step, in
    whole revolutions of the cage and at least one.

    **Arguments:** bearing; first and last shaft speed [rad/s]; rate [rad/s^2]; number of speeds; the model's own starts
    that are run side by side; revolutions at the first speed before the ramp begins; as in `sweep_bearing`.

    **Raises:** `ValueError` for speeds that are not positive and ascending, a rate that is not positive, counts that
    are impossible.
    """
    require_above_zero(first=first, last=last)
    require_at_least(1, steps=steps)
    if not 0 < first < last:
        raise ArgumentError("first", "last", said=f"must be positive and ascending, but are {first:g} and {last:g}.")
    if not rate > 0:
        raise ArgumentError("rate", said=f"must be positive, but {rate:g} was given.")
    if steps < 2 or settle < 0:
        raise ArgumentError("steps", "settle", said=f"must be at least 2 and 0, but are {steps} and {settle}.")
    if not 1 <= starts <= len(CAGE_STARTS):
        raise ArgumentError("starts", said=f"must be 1 to {len(CAGE_STARTS)}, but {starts} was given.")
    speed = np.linspace(first, last, steps)
    states = [rolling_start(model, float(first), k) for k in range(starts)]
    pause = (last - first) / (steps - 1) / rate
    ways = []
    for speeds, before in ((speed, settle), (speed[::-1], 0)):
        found = []
        for i, omega in enumerate(speeds.tolist()):
            turns = max(1, round(pause * float(model.rolling_cage_speed(omega)) / (2 * math.pi)))
            found.append(
                sweep_bearing(
                    model,
                    omega,
                    starts=states,
                    discard=0 if i else before,
                    revolutions=turns,
                    blocks=turns,
                    exponents=0,
                    tolerance=tolerance,
                )
            )
            states = _carried_on(states, found[-1])
        ways.append(_way(found if speeds is speed else found[::-1]))
    return BearingUpDown(speed, float(rate), *ways)


def _carried_on(states: list[BearingState], found: BearingSweep) -> list[BearingState]:
    """Where the lanes ended; one that failed goes on from where another one ended, or from where it began."""
    well = np.flatnonzero(~found.failed[0])
    ends = []
    for k, state in enumerate(states):
        if not well.size:
            ends.append(state)
            continue
        i = k if k in well else int(well[0])
        clock = jnp.array([found.last_angle[0, i], 0.0])
        ends.append(BearingState(jnp.asarray(found.last_rollers[0, i]), jnp.asarray(found.last_bodies[0, i]), clock))
    return ends


def _way(found: list[BearingSweep]) -> BearingRamp:
    """One way, step by step."""
    failed = np.array([bool(each.failed.all()) for each in found])
    mean = lambda name: np.array([_mean(getattr(each, name)) for each in found])
    slips = [each.block_means["cage_slip"] for each in found]
    error = lambda x: np.nanstd(x, ddof=1) / math.sqrt(np.isfinite(x).sum()) if np.isfinite(x).sum() > 1 else math.nan
    return BearingRamp(
        cage_slip=mean("cage_slip"),
        cage_slip_error=np.array([error(x) for x in slips]),
        eccentricity=np.array([np.max(each.eccentricity_max[~each.failed], initial=-np.inf) for each in found]),
        whirl_ratio=mean("whirl_ratio"),
        friction_power_W=mean("friction_power_W"),
        pocket_force_mean_sum_N=mean("pocket_force_mean_sum_N"),
        revolutions=np.array([float(each.revolutions) for each in found]),
        failed=failed,
    )


def _mean(x: np.ndarray) -> float:
    """Over lanes that did not fail; NaN if all did."""
    known = x[np.isfinite(x)]
    return float(known.mean()) if known.size else math.nan
