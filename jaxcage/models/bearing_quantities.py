"""Quantities that a whole bearing reports: slips, forces, losses, wear and whirl, from integrals over a run."""

from collections.abc import Callable

import numpy as np

from ..quantities import Averages, Quantity
from .bearing_states import LOSSES


def _lost(a: Averages) -> np.ndarray:
    return sum((a.mean(name) for name in LOSSES), np.zeros(()))


def _synchronous(axis: str, a: Averages) -> np.ndarray:
    return 2 * np.hypot(a.mean(f"pocket_{axis}_cos"), a.mean(f"pocket_{axis}_sin"))


def _mean(name: str) -> Callable[[Averages], np.ndarray]:
    return lambda a: a.mean(name)


def _largest(name: str) -> Callable[[Averages], np.ndarray]:
    return lambda a: a.largest[name]


def _of_part(name: str) -> Quantity:
    return Quantity(f"power_{name}_W", "", "W", f"mean power lost to {LOSSES[name]}", of=_mean(name))


QUANTITIES: tuple[Quantity, ...] = (
    Quantity(
        "cage_slip",
        "$s$",
        "1",
        "cage slip: 1 less the mean cage speed over that of pure rolling",
        of=lambda a: 1 - 2 * np.pi * a.revolutions / a.integrals["time"] / a.numbers["rolling_cage_speed"],
    ),
    Quantity(
        "roller_slip_max", "", "1", "largest slip of a roller's spin against pure rolling", of=_largest("roller_slip")
    ),
    Quantity("pocket_force_max_N", "", "N", "largest pocket force", of=_largest("pocket_force")),
    Quantity(
        "pocket_force_peak_N",
        "",
        "N",
        "mean of the largest pocket forces of the blocks, which grows with their length",
        of=_largest("pocket_force"),
        overall="mean",
    ),
    Quantity("pocket_force_mean_sum_N", "", "N", "mean of the sum of all pocket forces", of=_mean("pocket_force")),
    Quantity("land_force_max_N", "", "N", "largest force of the land on the cage", of=_largest("land_force")),
    Quantity(
        "land_force_peak_N",
        "",
        "N",
        "mean of the largest land forces of the blocks, which grows with their length",
        of=_largest("land_force"),
        overall="mean",
    ),
    Quantity(
        "pocket_impulse_N_s",
        "",
        "N s",
        "integral of all pocket forces over a revolution of the cage",
        of=lambda a: a.per_revolution("pocket_force"),
    ),
    Quantity(
        "land_impulse_N_s",
        "",
        "N s",
        "integral of the land's force on the cage over a revolution",
        of=lambda a: a.per_revolution("land_force"),
    ),
    Quantity(
        "pocket_wear_mm3_per_h",
        "",
        "mm^3/h",
        "Archard wear of all pockets, with the coefficient of `wear`",
        of=lambda a: a.numbers["wear_mm3_per_h_per_W"] * a.mean("pocket_rubbing"),
    ),
    Quantity(
        "land_wear_mm3_per_h",
        "",
        "mm^3/h",
        "Archard wear of the cage's guiding land",
        of=lambda a: a.numbers["wear_mm3_per_h_per_W"] * a.mean("land_rubbing"),
    ),
    Quantity("friction_power_W", "", "W", "mean power lost", of=_lost),
    Quantity(
        "friction_torque_N_m",
        "",
        "N m",
        "power lost over the shaft's speed relative to the outer ring",
        of=lambda a: _lost(a) / a.numbers["relative_speed"],
    ),
    *map(_of_part, LOSSES),
    Quantity(
        "land_power_W",
        "",
        "W",
        "mean power lost in the guiding land, film and contact",
        of=lambda a: a.mean("film") + a.mean("land_contact"),
    ),
    Quantity("input_power_W", "", "W", "mean power of shaft and outer ring", of=_mean("input")),
    Quantity("eccentricity_mean", r"$\epsilon$", "1", "mean eccentricity ratio", of=_mean("eccentricity")),
    Quantity(
        "eccentricity_std",
        "",
        "1",
        "standard deviation of the eccentricity ratio over time",
        of=lambda a: np.sqrt(np.maximum(a.mean("eccentricity_squared") - a.mean("eccentricity") ** 2, 0.0)),
    ),
    Quantity("eccentricity_max", "", "1", "largest eccentricity ratio", of=_largest("eccentricity")),
    Quantity(
        "whirl_ratio",
        "",
        "1",
        "mean angular speed of the cage's centre about the land's, over that of the cage",
        of=lambda a: a.integrals["whirl"] / a.integrals["cage_speed"],
    ),
    Quantity(
        "synchronous_force_x_N",
        "",
        "N",
        "first harmonic of the pocket forces, horizontal amplitude",
        of=lambda a: _synchronous("x", a),
    ),
    Quantity(
        "synchronous_force_y_N",
        "",
        "N",
        "first harmonic of the pocket forces, vertical amplitude",
        of=lambda a: _synchronous("y", a),
    ),
)
"""Quantities of a whole bearing; their standard errors follow from the scatter of blocks of revolutions."""
