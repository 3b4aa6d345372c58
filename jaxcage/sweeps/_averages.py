"""Averages and largest values over revolutions of what is read off the motion: forces, power, film thickness."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._checks import require_x64
from .._form import Form, compiled
from ..models import AbstractForcedSystem
from ..solve import REVOLUTION, AbstractMethod, Lanes, histories, native


SAMPLES = 512
"""Phases of a revolution at which the motion is read. A blow on the land lasts for some hundredths of a radian: its
peak is read up to 5 % too low (case 1b at 9000 and 27500 rpm beside 4096 phases), its impulse to 0.5 %."""

CHUNK = 64
"""Lanes whose motion is read at a time."""
Reading = Callable[[Any, Any, Any, Any], tuple[Any, ...]]
"""What is read: (system, speed, phase, state) -> numbers."""


@compiled
def _read(
    form: Form, several: bool, read: Reading, speed: Array, rows: Any, tau: Float[Array, " n"], states: Array
) -> Float[Array, "lanes n numbers"]:
    def lane(speed: Array, row: Any, states: Array) -> Array:
        system = form.filled(row)
        row_of = lambda tau, y: jnp.stack([jnp.asarray(x, float) for x in read(system, speed, tau, tuple(y))])
        return jax.vmap(row_of)(tau, states)

    return jax.vmap(lane, in_axes=(0, 0 if several else None, 0))(speed, rows, states)


def averages(
    systems: Sequence[AbstractForcedSystem],
    speeds: Float[np.ndarray, " lanes"],
    states: Float[np.ndarray, "lanes dim"],
    which: Int[np.ndarray, " lanes"],
    read: Reading,
    revolutions: int = 4,
    method: AbstractMethod | None = None,
) -> tuple[Float[np.ndarray, "lanes numbers"], Float[np.ndarray, "lanes numbers"]]:
    """What `read` sees over some revolutions from given states, in every lane.

    **Arguments:** systems of one structure; speed [rad/s], state at phase 0 [SI] and system of each lane; what is read
    at 512 phases of a revolution; revolutions; integration method, by default `jaxcage.native()`.

    **Returns:** means and largest values; NaN where a lane is not known to the method's error.
    """
    require_x64()
    chosen, lanes = native() if method is None else method, Lanes.of(systems, speeds, which)
    tau = jnp.asarray(np.tile(np.arange(SAMPLES) * (REVOLUTION / SAMPLES), revolutions))
    parts = []
    for first in range(0, speeds.size, CHUNK):
        some = np.arange(first, min(first + CHUNK, speeds.size))
        seen, error = histories(lanes.at(some), states[some], SAMPLES, revolutions, chosen)
        given = [jnp.asarray(speeds[some]), [jnp.asarray(x) for x in lanes.rows(some)], tau, jnp.asarray(seen)]
        read_off = np.asarray(_read(lanes.form, lanes.several, read, *given))
        known = (error <= chosen.allowed)[:, None]
        parts.append([np.where(known, x, np.nan) for x in (read_off.mean(axis=1), read_off.max(axis=1))])
    mean, largest = (np.concatenate(x) for x in zip(*parts, strict=True))
    return mean, largest
