"""Averages and largest values over revolutions of what is read off the motion: forces, power, film thickness."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._checks import require_x64
from .._form import compiled
from ..integrate import REVOLUTION, AbstractMethod, controlled
from ..models import AbstractForcedSystem
from ._engine import Designs, Part, over_lanes, run_parts


SAMPLES = 512
"""Phases of a revolution at which the motion is read. A blow on the land lasts for some hundredths of a radian: its
peak is read up to 5 % too low (case 1b at 9000 and 27500 rpm beside 4096 phases), its impulse to 0.5 %."""

Reading = Callable[[Any, Any, Any, Any], tuple[Any, ...]]
"""What is read: (system, speed, phase, state) -> numbers."""


@compiled
def _averages_chunk(
    designs: Designs, method: AbstractMethod, read: Reading, revolutions: Int[Array, ""], part: Part
) -> tuple[Array, Array]:
    def one(lane: Part) -> tuple[Array, Array]:
        strobe = designs.strobe(method, lane)

        def step(i: Array, carry: tuple) -> tuple:
            y, total, largest, error = carry
            phase = i % SAMPLES
            tau = phase.astype(float) * (REVOLUTION / SAMPLES)
            seen = jnp.stack([jnp.asarray(x, dtype=float) for x in read(strobe.system, lane.speed, tau, y)])
            moved = strobe.part(y, phase, SAMPLES)
            return moved.y, total + seen, jnp.maximum(largest, seen), error + moved.error

        count = len(jax.eval_shape(lambda: read(strobe.system, lane.speed, jnp.zeros(()), lane.y)))
        start = (lane.y, jnp.zeros(count), jnp.full(count, -jnp.inf), jnp.zeros(()))
        _, total, largest, error = jax.lax.fori_loop(0, revolutions * SAMPLES, step, start)
        known = error <= method.tolerance * revolutions  # pyright: ignore[reportAttributeAccessIssue]
        blank = lambda x: jnp.where(known, x, jnp.nan)
        return blank(total / (revolutions * SAMPLES)), blank(largest)

    return over_lanes(one, part)


def averages(
    systems: Sequence[AbstractForcedSystem],
    speeds: Float[np.ndarray, " lanes"],
    states: Float[np.ndarray, "lanes dim"],
    which: Int[np.ndarray, " lanes"],
    read: Reading,
    revolutions: int = 4,
    error: float | None = None,
) -> tuple[Float[np.ndarray, "lanes numbers"], Float[np.ndarray, "lanes numbers"]]:
    """What `read` sees over some revolutions from given states, in every lane.

    **Arguments:** systems of one structure; speed [rad/s], state at phase 0 [SI] and system of each lane; what is read
    at 512 phases of a revolution; revolutions; error of a revolution, by default that of `jaxcage.controlled`.

    **Returns:** means and largest values; NaN where a lane is not known to the error.
    """
    require_x64()
    method = controlled() if error is None else controlled(error)
    begin = lambda part: _averages_chunk(Designs.of(systems), method, read, jnp.asarray(revolutions), part)
    mean, largest = run_parts(begin, speeds, which, states)
    return mean, largest
