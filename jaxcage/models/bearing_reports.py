"""Quantities that a whole bearing reports from integrals over a run, and forces on every roller along a time history.

The quantities are slips, forces, losses, wear and whirl. Samples of a history are states; the forces at them are worked
out again by the laws that moved them.
"""

import dataclasses
from collections.abc import Callable
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
        return -pocket.along, f.inner.load, f.inner.sliding, on_cage, land, at.slip(state.rollers[1])

    return jax.lax.map(one, states, batch_size=BATCH)


def roller_history(model: Any, run: Any) -> RollerHistory:
    """Forces, loads and slips of every roller of a `BearingModel` at the samples of its time history at one speed."""
    speed = float(run.speed[0])
    states = BearingState(*map(jnp.asarray, (run.rollers, run.bodies, run.integrals[:, :2])))
    found = tuple(map(np.asarray, _at_samples(model, jnp.asarray(speed), states)))
    place = run.bodies[:, 0:2] - (run.bodies[:, 5:7] if model.guidance == "inner" else 0.0)
    pocket, inner, inner_sliding, on_cage, land, slip = found
    n = model.bearing.n_rollers
    return RollerHistory(
        time=run.time,
        angle=run.angle,
        samples=run.samples,
        roller_angle=run.angle[:, None] + 2 * np.pi / n * np.arange(n) + run.rollers[:, 0],
        pocket_force=pocket,
        inner_load=inner,
        roller_slip=slip,
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


_Of = Callable[[Averages], np.ndarray]
_mean: Callable[[str], _Of] = lambda name: lambda a: a.mean(name)
_most: Callable[[str], _Of] = lambda name: lambda a: a.largest[name]
_turn: Callable[[str], _Of] = lambda name: lambda a: a.per_revolution(name)
_worn: Callable[[str], _Of] = lambda name: lambda a: a.numbers["wear_mm3_per_h_per_W"] * a.mean(f"{name}_rubbing")
_bent: _Of = lambda a: a.numbers["bar_stress_MPa_per_N"] * a.largest["pocket_force"]
_slip: _Of = lambda a: 1 - 2 * np.pi * a.revolutions / a.integrals["time"] / np.abs(a.numbers["rolling_cage_speed"])
_variance: _Of = lambda a: a.mean("eccentricity_squared") - a.mean("eccentricity") ** 2
_deviation: _Of = lambda a: np.sqrt(np.maximum(_variance(a), 0.0))
_lost: _Of = lambda a: sum((a.mean(name) for name in LOSSES), np.zeros(()))
_torque: _Of = lambda a: _lost(a) / np.where(a.numbers["relative_speed"] > 0, a.numbers["relative_speed"], np.nan)
_in_land: _Of = lambda a: a.mean("film") + a.mean("land_contact")
_whirl: _Of = lambda a: a.integrals["whirl"] / a.integrals["cage_speed"]
_first_x: _Of = lambda a: 2 * np.hypot(a.mean("pocket_x_cos"), a.mean("pocket_x_sin"))
_first_y: _Of = lambda a: 2 * np.hypot(a.mean("pocket_y_cos"), a.mean("pocket_y_sin"))


_GROWS = "mean of the largest {} forces of the blocks, which grows with their length"
_ROWS: dict[str, tuple[str, str, _Of]] = {
    "cage_slip": ("1", "cage slip: 1 less the mean cage speed over that of pure rolling", _slip),
    "roller_slip_max": ("1", "largest slip of a roller's spin against pure rolling", _most("roller_slip")),
    "pocket_force_max_N": ("N", "largest pocket force", _most("pocket_force")),
    "pocket_force_peak_N": ("N", _GROWS.format("pocket"), _most("pocket_force")),
    "bar_stress_max_MPa": ("MPa", "bending stress of a bar under the largest pocket force", _bent),
    "pocket_force_mean_sum_N": ("N", "mean of the sum of all pocket forces", _mean("pocket_force")),
    "land_force_max_N": ("N", "largest force of the land on the cage", _most("land_force")),
    "land_force_peak_N": ("N", _GROWS.format("land"), _most("land_force")),
    "pocket_impulse_N_s": ("N s", "integral of all pocket forces over a revolution of the cage", _turn("pocket_force")),
    "land_impulse_N_s": ("N s", "integral of the land's force on the cage over a revolution", _turn("land_force")),
    "pocket_wear_mm3_per_h": ("mm^3/h", "Archard wear of all pockets, with the coefficient of `wear`", _worn("pocket")),
    "land_wear_mm3_per_h": ("mm^3/h", "Archard wear of the cage's guiding land", _worn("land")),
    "friction_power_W": ("W", "mean power lost", _lost),
    "friction_torque_N_m": ("N m", "power lost over the shaft's speed relative to the outer ring", _torque),
    **{f"power_{name}_W": ("W", f"mean power lost to {text}", _mean(name)) for name, text in LOSSES.items()},
    "land_power_W": ("W", "mean power lost in the guiding land, film and contact", _in_land),
    "input_power_W": ("W", "mean power of shaft and outer ring", _mean("input")),
    "eccentricity_mean": ("1", "mean eccentricity ratio", _mean("eccentricity")),
    "eccentricity_std": ("1", "standard deviation of the eccentricity ratio over time", _deviation),
    "eccentricity_max": ("1", "largest eccentricity ratio", _most("eccentricity")),
    "whirl_ratio": ("1", "mean angular speed of the cage's centre about the land's, over that of the cage", _whirl),
    "synchronous_force_x_N": ("N", "first harmonic of the pocket forces, horizontal amplitude", _first_x),
    "synchronous_force_y_N": ("N", "first harmonic of the pocket forces, vertical amplitude", _first_y),
}
"""Unit, words and function of each quantity."""
_SYMBOLS = {"cage_slip": "$s$", "eccentricity_mean": r"$\epsilon$"}

QUANTITIES: tuple[Quantity, ...] = tuple(
    Quantity(name, _SYMBOLS.get(name, ""), unit, text, of=of, overall="mean" if "_peak_" in name else "whole")
    for name, (unit, text, of) in _ROWS.items()
)
"""Quantities of a whole bearing; their standard errors follow from the scatter of blocks of revolutions."""
