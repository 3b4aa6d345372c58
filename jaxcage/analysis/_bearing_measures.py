"""What a run of the whole bearing says: slips, forces, losses, whirl, and a name for the cage's motion."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from ..integrate import BearingRun
from ..models.whole import LEDGER, BearingModel


CIRCULAR, REPEATING = 0.1, 0.1
"""A cage whose eccentricity varies by less than this share of its mean while its centre goes round is `circular`; one
that comes back to within this many clearances after each revolution is `locally_periodic`."""


def measure(unit: str, text: str) -> Any:
    """A field with its unit and words."""
    return dataclasses.field(metadata={"unit": unit, "text": text})


@dataclasses.dataclass(frozen=True)
class BearingMeasures:
    """Means are means over time."""

    cage_slip: float = measure("1", "cage slip: 1 less the mean cage speed over that of pure rolling")
    cage_slip_drift: float = measure("1", "cage slip of the second half of the run less that of the first")
    roller_slip_max: float = measure("1", "largest slip of a roller's spin against pure rolling")
    pocket_force_max_N: float = measure("N", "largest pocket force")
    pocket_force_mean_sum_N: float = measure("N", "mean of the sum of all pocket forces")
    land_force_max_N: float = measure("N", "largest force of the land on the cage")
    friction_power_W: float = measure("W", "mean power lost")
    friction_torque_N_m: float = measure("N m", "power lost over shaft speed")
    power_parts_W: dict[str, float] = measure("W", "mean power lost by kind")
    input_power_W: float = measure("W", "mean power of the shaft")
    eccentricity_mean: float = measure("1", "mean eccentricity ratio")
    eccentricity_std: float = measure("1", "standard deviation of the eccentricity ratio, at the samples")
    eccentricity_max: float = measure("1", "largest eccentricity ratio")
    whirl_ratio: float = measure("1", "mean angular speed of the cage's centre about the land's, over that of the cage")
    state: str = measure("", "what the cage's centre does: circular, locally_periodic or disordered")


def bearing_measures(model: BearingModel, run: BearingRun, speed: float) -> BearingMeasures:
    """Measures of a run at the shaft speed `speed` [rad/s]; NaN where the run failed."""
    spent = run.time[-1] - run.time[0]
    rolling = float(model.rolling_cage_speed(speed))
    mean = lambda name: float(run.total(name) / spent)
    parts = {name: mean(name) for name in LEDGER[1:]}
    lost = sum(parts.values())
    middle = len(run.time) // 2
    slip = lambda part: 1 - np.diff(run.angle[part][[0, -1]])[0] / np.diff(run.time[part][[0, -1]])[0] / rolling
    eps = np.hypot(*_from_land(model, run).T) / float(model.clearance)
    whirl = mean("whirl") / mean("cage_speed")
    return BearingMeasures(
        cage_slip=float(slip(slice(None))),
        cage_slip_drift=float(slip(slice(middle, None)) - slip(slice(0, middle + 1))),
        roller_slip_max=run.largest("roller_slip"),
        pocket_force_max_N=run.largest("pocket_force"),
        pocket_force_mean_sum_N=mean("pocket_force"),
        land_force_max_N=run.largest("land_force"),
        friction_power_W=lost,
        friction_torque_N_m=lost / abs(speed),
        power_parts_W=parts,
        input_power_W=mean("input"),
        eccentricity_mean=mean("eccentricity"),
        eccentricity_std=float(np.std(eps)),
        eccentricity_max=run.largest("eccentricity"),
        whirl_ratio=whirl,
        state=cage_state(_from_land(model, run) / float(model.clearance), samples_of(run)),
    )


def samples_of(run: BearingRun) -> int:
    """Samples of a revolution."""
    return max(1, round(2 * np.pi / abs(float(run.angle[1] - run.angle[0]))))


def _from_land(model: BearingModel, run: BearingRun) -> Float[np.ndarray, "n 2"]:
    """Cage centre from the land's [m]."""
    return run.bodies[:, 0:2] - (run.bodies[:, 5:7] if model.guidance == "inner" else 0.0)


def cage_state(place: Float[np.ndarray, "n 2"], samples: int) -> str:
    """Name of the motion of a cage's centre, after those that the literature of cage stability uses.

    `circular`: the centre goes round at least once in ten revolutions of the cage, and its eccentricity varies
    (standard deviation over mean) by less than `CIRCULAR`. `locally_periodic`: not so, but after a revolution the
    centre is, in the mean over all samples, within `REPEATING` clearances of where it was. `disordered`: neither.

    **Arguments:** place over clearance, at equal angles of the cage; samples per revolution.
    """
    if not np.all(np.isfinite(place)):
        return "failed"
    eps = np.hypot(*place.T)
    turns = abs(np.diff(np.unwrap(np.arctan2(place[:, 1], place[:, 0]))).sum()) / (2 * np.pi)
    revolutions = (len(place) - 1) / samples
    if turns >= max(1.0, revolutions / 10) and np.std(eps) < CIRCULAR * np.mean(eps):
        return "circular"
    if len(place) <= samples:
        return "disordered"
    return "locally_periodic" if _return(place, samples) < REPEATING else "disordered"


def _return(place: Float[np.ndarray, "n 2"], samples: int) -> float:
    """Mean distance between places one revolution apart."""
    return float(np.hypot(*(place[samples:] - place[:-samples]).T).mean())
