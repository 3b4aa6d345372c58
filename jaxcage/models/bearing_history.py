"""Forces on every roller of a whole bearing along a time history.

Samples of a history are states; the forces at them are worked out again by the laws that moved them.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._pytrees import Scalar, compiled
from .bearing_states import BearingState
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
    outer_load: Float[np.ndarray, "n rollers"]
    roller_slip: Float[np.ndarray, "n rollers"]
    """1 less spin over that of pure rolling."""
    inner_sliding: Float[np.ndarray, "n rollers"]
    """Surface of the inner ring less that of the roller, where they meet or would meet [m/s]."""
    outer_sliding: Float[np.ndarray, "n rollers"]
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
        return -pocket.along, f.inner.load, f.outer.load, f.inner.sliding, f.outer.sliding, on_cage, land

    return jax.lax.map(one, states, batch_size=BATCH)


def roller_history(model: Any, run: Any) -> RollerHistory:
    """Forces, loads and slips of every roller of a `BearingModel` at the samples of its time history at one speed."""
    speed = float(run.speed[0])
    states = BearingState(*map(jnp.asarray, (run.rollers, run.bodies, run.integrals[:, :2])))
    found = tuple(map(np.asarray, _at_samples(model, jnp.asarray(speed), states)))
    place = run.bodies[:, 0:2] - (run.bodies[:, 5:7] if model.guidance == "inner" else 0.0)
    pocket, inner, outer, inner_sliding, outer_sliding, on_cage, land = found
    n = model.bearing.n_rollers
    return RollerHistory(
        time=run.time,
        angle=run.angle,
        samples=run.samples,
        roller_angle=run.angle[:, None] + 2 * np.pi / n * np.arange(n) + run.rollers[:, 0],
        pocket_force=pocket,
        inner_load=inner,
        outer_load=outer,
        roller_slip=1 - run.rollers[:, 1] / float(model.rolling_spin(speed)),
        inner_sliding=inner_sliding,
        outer_sliding=outer_sliding,
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
