"""What a run of the whole bearing says: slips, forces, losses, whirl, and a name for the cage's motion."""

import dataclasses
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from ..models import LEDGER, BearingModel
from ..solve import Trajectory


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
    pocket_impulse_N_s: float = measure("N s", "integral of all pocket forces over a revolution of the cage")
    land_force_max_N: float = measure("N", "largest force of the land on the cage")
    land_impulse_N_s: float = measure("N s", "integral of the land's force on the cage over a revolution")
    friction_power_W: float = measure("W", "mean power lost")
    friction_torque_N_m: float = measure("N m", "power lost over the shaft's speed relative to the outer ring")
    friction_torque_parts_N_m: dict[str, float] = measure("N m", "parts of that torque, by kind of loss")
    power_parts_W: dict[str, float] = measure("W", "mean power lost by kind")
    input_power_W: float = measure("W", "mean power of shaft and outer ring")
    eccentricity_mean: float = measure("1", "mean eccentricity ratio")
    eccentricity_std: float = measure("1", "standard deviation of the eccentricity ratio, at the samples")
    eccentricity_max: float = measure("1", "largest eccentricity ratio")
    whirl_ratio: float = measure("1", "mean angular speed of the cage's centre about the land's, over that of the cage")
    synchronous_force_x_N: float = measure(
        "N", "equivalent synchronous force: first harmonic of the pocket forces on the cage, horizontal amplitude"
    )
    synchronous_force_y_N: float = measure("N", "the same, vertical amplitude")
    synchronous_force_error_N: float = measure(
        "N", "standard error of either, from the scatter of revolutions; NaN of a single one"
    )
    pocket_wear_mm3_per_h: float = measure("mm^3/h", "Archard wear of all pockets, with the coefficient of `wear`")
    land_wear_mm3_per_h: float = measure("mm^3/h", "Archard wear of the cage's guiding land")
    state: str = measure("", "what the cage's centre does: circular, locally_periodic or disordered")


def bearing_measures(model: BearingModel, run: Trajectory, speed: float) -> BearingMeasures:
    """Measures of a run at the shaft speed `speed` [rad/s]; NaN where the run failed."""
    spent = run.time[-1] - run.time[0]
    rolling = float(model.rolling_cage_speed(speed))
    mean = lambda name: float(run.total(name) / spent)
    parts = {name: mean(name) for name in LEDGER[1:]}
    lost, relative = sum(parts.values()), abs(speed - float(model.outer_speed)) or math.nan
    middle = len(run.time) // 2
    slip = lambda part: 1 - np.diff(run.angle[part][[0, -1]])[0] / np.diff(run.time[part][[0, -1]])[0] / rolling
    eps = np.hypot(*from_land(model, run).T) / float(model.clearance)
    whirl = mean("whirl") / mean("cage_speed")
    revolutions = abs(run.angle[-1] - run.angle[0]) / (2 * np.pi)
    force_x, force_y, error = equivalent_synchronous_force(run)
    worn = lambda name: float(1e9 * 3600 * model.wear.volume(mean(name)))
    return BearingMeasures(
        cage_slip=float(slip(slice(None))),
        cage_slip_drift=float(slip(slice(middle, None)) - slip(slice(0, middle + 1))),
        roller_slip_max=run.largest("roller_slip"),
        pocket_force_max_N=run.largest("pocket_force"),
        pocket_force_mean_sum_N=mean("pocket_force"),
        pocket_impulse_N_s=run.total("pocket_force") / revolutions,
        land_force_max_N=run.largest("land_force"),
        land_impulse_N_s=run.total("land_force") / revolutions,
        friction_power_W=lost,
        friction_torque_N_m=lost / relative,
        friction_torque_parts_N_m={name: part / relative for name, part in parts.items()},
        power_parts_W=parts,
        input_power_W=mean("input"),
        eccentricity_mean=mean("eccentricity"),
        eccentricity_std=float(np.std(eps)),
        eccentricity_max=run.largest("eccentricity"),
        whirl_ratio=whirl,
        synchronous_force_x_N=force_x,
        synchronous_force_y_N=force_y,
        synchronous_force_error_N=error,
        pocket_wear_mm3_per_h=worn("pocket_rubbing"),
        land_wear_mm3_per_h=worn("land_rubbing"),
        state=cage_state(from_land(model, run) / float(model.clearance), samples_of(run)),
    )


def equivalent_synchronous_force(run: Trajectory) -> tuple[float, float, float]:
    """First harmonic, over the cage's angle, of the force of all rollers on the cage: what a cage model that prescribes
    one force at cage frequency has in its place.

    **Returns:** horizontal and vertical amplitude, and the standard error of either [N], which is NaN of one
    revolution. An amplitude that is not several times its error is noise.
    """
    samples = samples_of(run)
    names = [run.beside.index(f"pocket_{axis}_{part}") for axis in "xy" for part in ("cos", "sin")]
    each = np.diff(run.integrals[::samples][:, names], axis=0) / np.diff(run.time[::samples])[:, None]
    x, y = (2 * np.hypot(*each.mean(axis=0)[pair]) for pair in (slice(0, 2), slice(2, 4)))
    if len(each) < 2:
        return float(x), float(y), float("nan")
    return float(x), float(y), float(2 * np.sqrt(each.var(axis=0, ddof=1).max() / len(each)))


def samples_of(run: Trajectory) -> int:
    """Samples of a revolution."""
    return max(1, round(2 * np.pi / abs(float(run.angle[1] - run.angle[0]))))


def from_land(model: BearingModel, run: Trajectory) -> Float[np.ndarray, "n 2"]:
    """Cage centre from the land's [m]."""
    return run.bodies[:, 0:2] - (run.bodies[:, 5:7] if model.guidance == "inner" else 0.0)


CAGE_STATES = ("failed", "circular", "locally_periodic", "disordered")
"""What `cage_state` may say, in the order of the codes that studies store."""


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
    away = np.hypot(*(place[samples:] - place[:-samples]).T)  # from where it was a revolution before
    return "locally_periodic" if np.mean(away) < REPEATING else "disordered"
