"""The result of a sweep of the whole bearing: what every lane did, with error bars."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from .._errors import ArgumentError
from ..models import LEDGER
from ..solve import OUTCOMES
from ._bearing_measures import cage_state, measure
from ._labels import scatter


AVERAGED = (
    "cage_slip",
    "pocket_force_mean_sum_N",
    "friction_power_W",
    "land_power_W",
    "pocket_impulse_N_s",
    "land_impulse_N_s",
    "pocket_wear_mm3_per_h",
    "land_wear_mm3_per_h",
    "eccentricity_mean",
    "whirl_ratio",
    "pocket_force_peak_N",
    "land_force_peak_N",
    "exponent",
)
"""What `BearingSweep.block_means` has. Peaks are the largest of each block: means of them grow with its length."""
OfLanes = Float[np.ndarray, "speeds starts"]


@dataclasses.dataclass(frozen=True)
class BearingSweep:
    """Lanes over shaft speeds, from several starts. Means are means over time.

    A lane that could not be followed to the end is NaN, with an outcome that says why. One that is `inaccurate` keeps
    its values.
    """

    speed: Float[np.ndarray, " speeds"] = measure("rad/s", "shaft speeds")
    cage_slip: OfLanes = measure("1", "cage slip: 1 less the mean cage speed over that of pure rolling")
    roller_slip_max: OfLanes = measure("1", "largest slip of a roller's spin against pure rolling")
    pocket_force_max_N: OfLanes = measure("N", "largest pocket force")
    pocket_force_mean_sum_N: OfLanes = measure("N", "mean of the sum of all pocket forces")
    land_force_max_N: OfLanes = measure("N", "largest force of the land on the cage")
    pocket_impulse_N_s: OfLanes = measure("N s", "integral of all pocket forces over a revolution of the cage")
    land_impulse_N_s: OfLanes = measure("N s", "integral of the land's force on the cage over a revolution")
    pocket_wear_mm3_per_h: OfLanes = measure("mm^3/h", "Archard wear of all pockets, with the coefficient of `wear`")
    land_wear_mm3_per_h: OfLanes = measure("mm^3/h", "Archard wear of the cage's guiding land")
    friction_power_W: OfLanes = measure("W", "mean power lost")
    power_parts_W: dict[str, OfLanes] = measure("W", "mean power lost by kind")
    input_power_W: OfLanes = measure("W", "mean power of shaft and outer ring")
    eccentricity_mean: OfLanes = measure("1", "mean eccentricity ratio")
    eccentricity_std: OfLanes = measure("1", "standard deviation of the eccentricity ratio over time")
    eccentricity_max: OfLanes = measure("1", "largest eccentricity ratio")
    whirl_ratio: OfLanes = measure("1", "mean angular speed of the cage's centre about the land's, over the cage's")
    synchronous_force_x_N: OfLanes = measure(
        "N", "equivalent synchronous force: first harmonic of the pocket forces on the cage, horizontal amplitude"
    )
    synchronous_force_y_N: OfLanes = measure("N", "the same, vertical amplitude")
    synchronous_force_error_N: OfLanes = measure(
        "N", "standard error of the larger of both, from the scatter of the blocks"
    )
    exponent: OfLanes = measure("1", "largest Lyapunov exponent per revolution of the cage; NaN if not asked for")
    exponent_error: OfLanes = measure("1", "its standard error, from the scatter of the blocks")
    state: Shaped[np.ndarray, "speeds starts"] = measure("", "what the cage's centre does, as in `cage_state`")
    block_means: dict[str, Float[np.ndarray, "speeds starts _"]] = measure("", "means of blocks of revolutions")
    error: OfLanes = measure("1", "largest change of a state over a sample with about half the steps, in its scale")
    steps: OfLanes = measure("1", "mean steps of a revolution")
    outcome: Shaped[np.ndarray, "speeds starts"] = measure("", "how the lane ended, `successful` if well")
    last_rollers: Float[np.ndarray, "speeds starts 5 rollers"] = measure("SI", "rollers at the end, as in `Rollers`")
    last_bodies: Float[np.ndarray, "speeds starts 9"] = measure("SI", "cage and inner ring at the end, as in `Bodies`")
    last_angle: OfLanes = measure("rad", "angle of the cage at the end")
    discard: int = 0
    revolutions: int = 0
    settings: dict[str, Any] = dataclasses.field(default_factory=dict)
    """How it was computed."""

    @property
    def rpm(self) -> Float[np.ndarray, " speeds"]:
        """Shaft speeds in revolutions per minute."""
        return self.speed * 30 / np.pi

    @property
    def failed(self) -> Shaped[np.ndarray, "speeds starts"]:
        """Lanes that could not be followed to the end."""
        return ~np.isin(self.outcome, ("successful", "inaccurate"))

    def standard_error(self, name: str) -> OfLanes:
        """Standard error of a mean, from the scatter of its blocks: those of `block_means`."""
        if name not in self.block_means:
            known = ", ".join(self.block_means)
            raise ArgumentError("name", said=f"must be one of {known}, but '{name}' was given.")
        return scatter(self.block_means[name])


STATISTIC_UNITS: dict[str, str] = {
    "land_power_W": "W",
    "pocket_force_peak_N": "N",
    "land_force_peak_N": "N",
    **{field.name: field.metadata["unit"] for field in dataclasses.fields(BearingSweep) if field.name in AVERAGED},
}
"""Units of what `BearingSweep.block_means` has."""


@dataclasses.dataclass(frozen=True)
class BearingRecord:
    """What was gathered of lanes, block by block."""

    integrals: dict[str, Float[np.ndarray, "lanes blocks"]]
    """`time`, and the names of `jaxcage.models.INTEGRATED`."""
    peaks: dict[str, Float[np.ndarray, "lanes blocks"]]
    growth: Float[np.ndarray, "lanes followed"]
    place: Float[np.ndarray, "lanes samples 2"]
    """Of the cage's centre from the land's, in clearances."""
    error: Float[np.ndarray, " lanes"]
    steps: Float[np.ndarray, " lanes"]
    outcome: Int[np.ndarray, " lanes"]
    rollers: Float[np.ndarray, "lanes 5 rollers"]
    bodies: Float[np.ndarray, "lanes 9"]
    angle: Float[np.ndarray, " lanes"]


def summed_up(
    speed: Float[np.ndarray, " speeds"],
    rolling: Float[np.ndarray, " lanes"],
    worn: float,
    record: BearingRecord,
    *,
    block: int,
    samples: int,
    exponents: bool,
    discard: int,
    settings: dict[str, Any],
) -> BearingSweep:
    """A `BearingSweep` of lanes that are laid out as (speeds, starts).

    **Arguments:** shaft speeds; speed of the cage in pure rolling [rad/s]; volume worn off by 1 W that rubs [mm^3/h];
    what was gathered; revolutions of a block; samples of a revolution; whether there are exponents; revolutions left
    out; settings.
    """
    names = np.array(OUTCOMES)[record.outcome]
    lost = ~np.isin(names, ("successful", "inaccurate"))
    blocks = record.integrals["time"].shape[1]
    shaped = lambda x: np.where(lost.reshape(-1, *[1] * (x.ndim - 1)), np.nan, x).reshape(speed.size, -1, *x.shape[1:])
    time = np.where(lost[:, None], np.nan, record.integrals["time"])
    whole = lambda name: record.integrals[name].sum(axis=1)
    mean = lambda name: shaped(whole(name) / time.sum(axis=1))
    of_blocks = lambda name: shaped(record.integrals[name] / time)
    losses = LEDGER[1:]
    parts = {name: mean(name) for name in losses}
    squares = mean("eccentricity_squared") - mean("eccentricity") ** 2
    # A tangent vector that is no number any more grows by nothing at all: that is no exponent of zero.
    growth = np.where((record.growth != 0) & exponents, record.growth / block, np.nan)
    means = {
        "cage_slip": shaped(1 - 2 * np.pi * block / time / rolling[:, None]),
        "pocket_force_mean_sum_N": of_blocks("pocket_force"),
        "friction_power_W": shaped(sum(record.integrals[name] for name in losses) / time),
        "land_power_W": shaped((record.integrals["film"] + record.integrals["land_contact"]) / time),
        "pocket_impulse_N_s": shaped(record.integrals["pocket_force"] / block),
        "land_impulse_N_s": shaped(record.integrals["land_force"] / block),
        "pocket_wear_mm3_per_h": worn * of_blocks("pocket_rubbing"),
        "land_wear_mm3_per_h": worn * of_blocks("land_rubbing"),
        "eccentricity_mean": of_blocks("eccentricity"),
        "whirl_ratio": shaped(record.integrals["whirl"] / record.integrals["cage_speed"]),
        "pocket_force_peak_N": shaped(record.peaks["pocket_force"]),
        "land_force_peak_N": shaped(record.peaks["land_force"]),
        "exponent": shaped(growth),
    }
    states = [
        cage_state(place, samples) if not bad else "failed" for place, bad in zip(record.place, lost, strict=True)
    ]
    peak = lambda name: shaped(record.peaks[name].max(axis=1))
    harmonic = np.stack([[of_blocks(f"pocket_{axis}_{part}") for part in ("cos", "sin")] for axis in "xy"])
    force_x, force_y = 2 * np.hypot(*np.moveaxis(harmonic.mean(axis=-1), 1, 0))
    return BearingSweep(
        speed=speed,
        cage_slip=shaped(1 - 2 * np.pi * block * blocks / time.sum(axis=1) / rolling),
        roller_slip_max=peak("roller_slip"),
        pocket_force_max_N=peak("pocket_force"),
        pocket_force_mean_sum_N=mean("pocket_force"),
        land_force_max_N=peak("land_force"),
        pocket_impulse_N_s=means["pocket_impulse_N_s"].mean(axis=-1),
        land_impulse_N_s=means["land_impulse_N_s"].mean(axis=-1),
        pocket_wear_mm3_per_h=worn * mean("pocket_rubbing"),
        land_wear_mm3_per_h=worn * mean("land_rubbing"),
        friction_power_W=sum(parts.values(), np.zeros(())),
        power_parts_W=parts,
        input_power_W=mean("input"),
        eccentricity_mean=mean("eccentricity"),
        eccentricity_std=np.sqrt(np.maximum(squares, 0.0)),
        eccentricity_max=peak("eccentricity"),
        whirl_ratio=shaped(whole("whirl") / whole("cage_speed")),
        synchronous_force_x_N=force_x,
        synchronous_force_y_N=force_y,
        synchronous_force_error_N=2 * scatter(harmonic).max(axis=(0, 1)),
        exponent=shaped(growth.mean(axis=1)),
        exponent_error=shaped(scatter(growth)),
        state=np.array(states).reshape(speed.size, -1),
        block_means=means,
        error=shaped(record.error),
        steps=shaped(record.steps),
        outcome=names.reshape(speed.size, -1),
        last_rollers=shaped(record.rollers),
        last_bodies=shaped(record.bodies),
        last_angle=shaped(record.angle),
        discard=discard,
        revolutions=block * blocks,
        settings=settings,
    )
