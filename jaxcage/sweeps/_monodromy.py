"""Monodromy matrices of many lanes at once: the strobe map and its derivative, by the kernels of the sweeps."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._checks import require_x64
from .._errors import ArgumentError
from .._form import compiled
from ..integrate import AbstractMethod, controlled, revolution
from ..models import AbstractForcedSystem
from ._engine import Designs, Part, over_lanes, run_parts


@compiled
def _monodromy_chunk(designs: Designs, method: AbstractMethod, part: Part) -> tuple[Array, ...]:
    def one(lane: Part) -> tuple[Array, ...]:
        basis = tuple(tuple(jnp.asarray(float(i == j)) for j in range(len(lane.y))) for i in range(len(lane.y)))
        moved = revolution(designs.strobe(method, lane), lane.y, basis, jnp.zeros((), jnp.int32))
        return jnp.stack(moved.y), jnp.stack([jnp.stack(t) for t in moved.tangents], axis=1), moved.outcome

    return over_lanes(one, part)


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
    with several systems, the place of each lane's; integration method, by default `jaxcage.controlled()`.

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
    designs, chosen = Designs.of(systems), controlled() if method is None else method
    image, matrix, outcome = run_parts(lambda part: _monodromy_chunk(designs, chosen, part), speed, place, state)
    ok = (outcome == 0)[:, None]
    return np.where(ok, image, np.nan), np.where(ok[..., None], matrix, np.nan)
