"""Quantities that a whole bearing reports from integrals over a run, and forces on every roller along a time history.

The quantities are slips, forces, losses, wear and whirl. Samples of a history are states; the forces at them are worked
out again by the laws that moved them.
"""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._pytrees import Scalar, compiled
from ..quantities import Averages, Quantity
from .bearing_states import LOSSES, BearingState
from .protocol import AbstractForcedSystem


BATCH = 512
"""Samples whose forces are worked out at a time."""


@dataclasses.dataclass(frozen=True)
class RollerHistory:
    """Every roller, cage and land at the samples of a time history. SI units."""

    time: Float[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    """Angle of the cage [rad]."""
    samples: int
    """Samples of a revolution of the cage."""
    roller_angle: Float[np.ndarray, "n rollers"]
    """Place on the circumference, counter-clockwise from the x axis [rad]."""
    pocket_force: Float[np.ndarray, "n rollers"]
    """[N], positive where a roller pushes the cage counter-clockwise, negative where it pushes it the other way."""
    inner_load: Float[np.ndarray, "n rollers"]
    roller_slip: Float[np.ndarray, "n rollers"]
    """1 less spin over that of pure rolling."""
    inner_sliding: Float[np.ndarray, "n rollers"]
    """Surface of the inner ring less that of the roller, where they meet or would meet [m/s]."""
    pocket_on_cage: Float[np.ndarray, "n 2"]
    """Force of all rollers on the cage [N]."""
    land_on_cage: Float[np.ndarray, "n 2"]
    """Force of the land, film and contact, on the cage [N]."""
    place: Float[np.ndarray, "n 2"]
    """Cage centre from that of its land, over the clearance."""


@compiled
def _at_samples(model: AbstractForcedSystem, speed: Scalar, states: BearingState) -> tuple[Array, ...]:
    at: Any = model.at_speed(speed)

    def one(state: BearingState) -> tuple[Any, ...]:
        f: Any = at.forces(state)
        g, pocket = f.geometry, f.pocket
        x = jnp.sum(pocket.along * g.pocket_sin - pocket.out * g.pocket_cos)
        y = jnp.sum(-pocket.along * g.pocket_cos - pocket.out * g.pocket_sin)
        on_cage, land = jnp.stack([x, y]), jnp.stack([jnp.asarray(f.land.x), jnp.asarray(f.land.y)])
        return -pocket.along, f.inner.load, f.inner.sliding, on_cage, land

    return jax.lax.map(one, states, batch_size=BATCH)


def roller_history(model: Any, run: Any) -> RollerHistory:
    """Forces, loads and slips of every roller of a `BearingModel` at the samples of its time history at one speed."""
    speed = float(run.speed[0])
    states = BearingState(*map(jnp.asarray, (run.rollers, run.bodies, run.integrals[:, :2])))
    found = tuple(map(np.asarray, _at_samples(model, jnp.asarray(speed), states)))
    place = run.bodies[:, 0:2] - (run.bodies[:, 5:7] if model.guidance == "inner" else 0.0)
    pocket, inner, inner_sliding, on_cage, land = found
    n = model.bearing.n_rollers
    return RollerHistory(
        time=run.time,
        angle=run.angle,
        samples=run.samples,
        roller_angle=run.angle[:, None] + 2 * np.pi / n * np.arange(n) + run.rollers[:, 0],
        pocket_force=pocket,
        inner_load=inner,
        roller_slip=1 - run.rollers[:, 1] / float(model.rolling_spin(speed)),
        inner_sliding=inner_sliding,
        pocket_on_cage=on_cage,
        land_on_cage=land,
        place=place / float(model.clearance),
    )


def bearing_orders(model: Any, run: Any) -> dict[str, float]:
    """Frequencies that a bearing is known by, over that of the cage: means over a run."""
    cage = run.total("cage_speed") / (run.time[-1] - run.time[0])
    spin = run.total("roller_spin") / (run.time[-1] - run.time[0])
    ring, n = float(run.speed[0]) / cage, model.bearing.n_rollers
    return {
        "cage": 1.0,
        "twice cage": 2.0,
        "inner ring": float(abs(ring)),
        "roller spin": float(abs(spin / cage)),
        "roller pass, outer ring": float(n * abs(1 - float(model.outer_speed) / cage)),
        "roller pass, inner ring": float(n * abs(ring - 1)),
    }


def _values(a: Averages) -> dict[str, np.ndarray]:
    """Value of each quantity."""
    lost = sum((a.mean(name) for name in LOSSES), np.zeros(()))
    worn_by = a.numbers["wear_mm3_per_h_per_W"]
    variance = a.mean("eccentricity_squared") - a.mean("eccentricity") ** 2
    harmonic = lambda axis: 2 * np.hypot(a.mean(f"pocket_{axis}_cos"), a.mean(f"pocket_{axis}_sin"))
    return {
        "cage_slip": 1 - 2 * np.pi * a.revolutions / a.integrals["time"] / a.numbers["rolling_cage_speed"],
        "roller_slip_max": a.largest["roller_slip"],
        "pocket_force_max_N": a.largest["pocket_force"],
        "pocket_force_peak_N": a.largest["pocket_force"],
        "pocket_force_mean_sum_N": a.mean("pocket_force"),
        "land_force_max_N": a.largest["land_force"],
        "land_force_peak_N": a.largest["land_force"],
        "pocket_impulse_N_s": a.per_revolution("pocket_force"),
        "land_impulse_N_s": a.per_revolution("land_force"),
        "pocket_wear_mm3_per_h": worn_by * a.mean("pocket_rubbing"),
        "land_wear_mm3_per_h": worn_by * a.mean("land_rubbing"),
        "friction_power_W": lost,
        "friction_torque_N_m": lost / a.numbers["relative_speed"],
        **{f"power_{name}_W": a.mean(name) for name in LOSSES},
        "land_power_W": a.mean("film") + a.mean("land_contact"),
        "input_power_W": a.mean("input"),
        "eccentricity_mean": a.mean("eccentricity"),
        "eccentricity_std": np.sqrt(np.maximum(variance, 0.0)),
        "eccentricity_max": a.largest["eccentricity"],
        "whirl_ratio": a.integrals["whirl"] / a.integrals["cage_speed"],
        "synchronous_force_x_N": harmonic("x"),
        "synchronous_force_y_N": harmonic("y"),
    }


_GROWS = "mean of the largest {} forces of the blocks, which grows with their length"
_HARMONIC = "first harmonic of the pocket forces, horizontal amplitude"
_TEXTS = {
    "cage_slip": ("1", "cage slip: 1 less the mean cage speed over that of pure rolling"),
    "roller_slip_max": ("1", "largest slip of a roller's spin against pure rolling"),
    "pocket_force_max_N": ("N", "largest pocket force"),
    "pocket_force_peak_N": ("N", _GROWS.format("pocket")),
    "pocket_force_mean_sum_N": ("N", "mean of the sum of all pocket forces"),
    "land_force_max_N": ("N", "largest force of the land on the cage"),
    "land_force_peak_N": ("N", _GROWS.format("land")),
    "pocket_impulse_N_s": ("N s", "integral of all pocket forces over a revolution of the cage"),
    "land_impulse_N_s": ("N s", "integral of the land's force on the cage over a revolution"),
    "pocket_wear_mm3_per_h": ("mm^3/h", "Archard wear of all pockets, with the coefficient of `wear`"),
    "land_wear_mm3_per_h": ("mm^3/h", "Archard wear of the cage's guiding land"),
    "friction_power_W": ("W", "mean power lost"),
    "friction_torque_N_m": ("N m", "power lost over the shaft's speed relative to the outer ring"),
    **{f"power_{name}_W": ("W", f"mean power lost to {text}") for name, text in LOSSES.items()},
    "land_power_W": ("W", "mean power lost in the guiding land, film and contact"),
    "input_power_W": ("W", "mean power of shaft and outer ring"),
    "eccentricity_mean": ("1", "mean eccentricity ratio"),
    "eccentricity_std": ("1", "standard deviation of the eccentricity ratio over time"),
    "eccentricity_max": ("1", "largest eccentricity ratio"),
    "whirl_ratio": ("1", "mean angular speed of the cage's centre about the land's, over that of the cage"),
    "synchronous_force_x_N": ("N", _HARMONIC),
    "synchronous_force_y_N": ("N", "first harmonic of the pocket forces, vertical amplitude"),
}
_SYMBOLS = {"cage_slip": "$s$", "eccentricity_mean": r"$\epsilon$"}


def _quantity(name: str) -> Quantity:
    (unit, text), of = _TEXTS[name], functools.partial(lambda name, a: _values(a)[name], name)
    return Quantity(name, _SYMBOLS.get(name, ""), unit, text, of=of, overall="mean" if "_peak_" in name else "whole")


QUANTITIES: tuple[Quantity, ...] = tuple(map(_quantity, _TEXTS))
"""Quantities of a whole bearing; their standard errors follow from the scatter of blocks of revolutions."""
