"""Monodromy matrices of many lanes at once: the strobe map and its derivative, by the engine of the sweeps."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array, Float, Int

from .._checks import require_x64
from .._errors import ArgumentError
from ..models import AbstractForcedSystem
from ..solve import FINISHED, AbstractMethod, Lanes, cores, native


def monodromy(
    system: AbstractForcedSystem | Sequence[AbstractForcedSystem],
    speeds: Float[Array, " lanes"] | Float[np.ndarray, " lanes"],
    states: Float[Array, "lanes dim"] | Float[np.ndarray, "lanes dim"],
    *,
    which: Int[np.ndarray, " lanes"] | Sequence[int] | None = None,
    method: AbstractMethod | None = None,
) -> tuple[Float[np.ndarray, "lanes dim"], Float[np.ndarray, "lanes dim dim"]]:
    """One revolution from each state, and the derivative of where it ends with respect to where it began.

    **Arguments:** system, or several of one structure; speed of each lane [rad/s]; its state at phase 0, in SI units;
    with several systems, the place of each lane's; integration method, by default `jaxcage.native()`.

    **Returns:** states after the revolution and the matrices, in SI units; NaN where the revolution failed.

    **Raises:** `ValueError` for shapes that do not fit together.
    """
    require_x64()
    speed, state = np.asarray(speeds, dtype=float), np.asarray(states, dtype=float)
    systems = list(system) if isinstance(system, Sequence) else [system]
    if speed.ndim != 1 or state.shape != (speed.size, systems[0].dimension):
        raise ArgumentError(
            "states",
            said=f"must hold {systems[0].dimension} numbers for each of the {speed.size} speeds, but has "
            f"shape {state.shape}.",
        )
    place = np.zeros(speed.size, int) if which is None else np.asarray(which, int)
    lanes, chosen, dim = Lanes.of(systems, speed, place), native() if method is None else method, state.shape[1]
    alive = np.flatnonzero(np.all(np.isfinite(state), axis=1))
    image, matrix = np.full_like(state, np.nan), np.full((*state.shape, dim), np.nan)
    if alive.size:
        scale, _ = lanes.begin(alive, state[alive])
        engine, each = lanes.engine(1, chosen), np.repeat(alive, dim)  # a lane for each column
        numbers = lanes.numbers(engine, each)
        begun, along = np.repeat(state[alive] / scale, dim, axis=0), np.tile(np.eye(dim), (alive.size, 1))
        ran = engine(numbers, begun, 1, 1, chosen, tangents=along[:, None], threads=cores())
        columns = (np.exp(ran.growth[:, 0]) * ran.tangents[:, 0]).reshape(-1, dim, dim)
        ok = np.all((ran.mark == FINISHED).reshape(-1, dim), axis=1)
        image[alive[ok]] = (ran.state.reshape(-1, dim, dim)[:, 0] * scale)[ok]
        matrix[alive[ok]] = (np.swapaxes(columns, 1, 2) * scale[:, :, None] / scale[:, None, :])[ok]
    return image, matrix
