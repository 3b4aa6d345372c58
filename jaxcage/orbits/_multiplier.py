"""The largest Floquet multiplier of an orbit and how its size moves with every parameter, exact for the equations as
integrated.

With P(z, k) = z the orbit and M(z, k) the monodromy matrix, dz = -(M - 1)^-1 dP and dM = M_z dz + M_k dk; a simple
eigenvalue mu with left and right vectors l, r moves by l dM r / l r. One expansion of the return map to second order,
the same as for edges, gives all of it.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least
from .._checks import require_x64
from .._parameters import get, parameter_paths
from ..integrate import AbstractMethod, compiled
from ..models import AbstractForcedSystem, require_speeds
from ._by_name import SPEED
from ._orbit import StateLike
from ._problem import Frame, Given, OrbitProblem, make_frame
from ._sensitivity import _expand, _Expansion, _pull_back
from ._steps import GIVEN_UP, SLOPE, by_steps, counted


NEWTON, CLOSED, NEARBY = 20, 1e-10, 3.0
"""Most steps; size of a last step, and how far an orbit may lie from its guess, in units of the system's scale."""


class LeadingMultiplier(NamedTuple):
    """The largest multiplier of the orbit near a guess; NaN where there is none."""

    size: float
    """|mu|: below 1 the orbit is stable."""
    derivative: dict[str, float]
    """d|mu| / d parameter [SI]."""
    state: Float[np.ndarray, " dim"]
    """Of the orbit at phase 0 [SI]."""
    error: float = float("nan")
    """Distance of the size to that by half the steps, infinite where these find no orbit."""
    steps: int = 0
    """Steps per revolution."""


@compiled
def _moved(n: int, around: _Expansion) -> tuple[Array, Array]:
    """|mu|, and its derivatives by the numbers of the field."""
    mu, right = jnp.linalg.eig(around.monodromy)
    left = jnp.linalg.inv(right)  # in rows, with l r = 1
    i = jnp.argmax(jnp.abs(mu))
    closing = around.image_slope[:, :n] - jnp.eye(n)
    orbit = -jnp.linalg.solve(closing, around.image_slope[:, n:])
    matrix = around.monodromy_slope[:, :, n:] + jnp.einsum("abz,zk->abk", around.monodromy_slope[:, :, :n], orbit)
    change = jnp.einsum("a,abk,b->k", left[i], matrix.astype(mu.dtype), right[:, i])
    size = jnp.abs(mu[i])
    return size, jnp.real(jnp.conj(mu[i]) * change) / size


def leading_multiplier(
    system: AbstractForcedSystem,
    speed: float,
    guess: StateLike,
    *,
    periods: int = 1,
    method: AbstractMethod | None = None,
) -> LeadingMultiplier:
    """Size of the largest multiplier of the orbit near `guess` (a state, SI), and its derivatives.

    **Arguments:** a system whose parameters are declared, such as `CageModel`; speed [rad/s]; guess; revolutions after
    which the orbit closes; integration method.

    **Returns:** `LeadingMultiplier`. Where two multipliers are equal in size, of one of them.
    """
    require_x64()
    require_at_least(1, periods=periods)
    require_speeds(system, speed)
    chosen, counts = counted(method)
    problem = OrbitProblem(chosen, system.dimension, False, (SPEED,))
    at, state = jnp.asarray(speed, dtype=float), jnp.asarray(guess, dtype=float)
    given = Given(system, at)
    frame = make_frame(problem, given, state, at, 0.1 * at[None], periods)
    first = jnp.append(state / frame.scale, 10.0)
    before, steps = None, int(counts.first)
    while True:
        found = _by_newton(by_steps(problem, steps), given, frame, first if before is None else before[0])
        error = np.inf if found is None or before is None else abs(float(found[1] - before[1]))
        given_up = found is None and steps >= GIVEN_UP
        if steps >= int(counts.last) or error <= SLOPE * float(counts.tolerance) or given_up:
            break
        before, steps = found, min(2 * steps, int(counts.last))
    paths = parameter_paths(system)
    if found is None:
        nan = float("nan")
        return LeadingMultiplier(nan, dict.fromkeys(paths, nan), np.full(system.dimension, nan), error, steps)
    u, size, weight = found
    pulled = _pull_back(by_steps(problem, steps), given, frame, u, weight)
    slope = {name: float(get(pulled, path)) for name, path in paths.items()}
    return LeadingMultiplier(float(size), slope, np.asarray(problem.state(u, frame)), error, steps)


def _by_newton(problem: OrbitProblem, given: Given, frame: Frame, first: Array) -> tuple[Array, Array, Array] | None:
    """The orbit near the unknowns `first`, the size of its largest multiplier, and the derivatives of that."""
    n, u = problem.dimension, first
    for _ in range(NEWTON):
        around = _expand(problem, given, frame, u)
        step = jnp.linalg.solve(around.image_slope[:, :n] - jnp.eye(n), around.image - u[:n])
        size = float(jnp.max(jnp.abs(step)))
        if not size < NEARBY or float(jnp.max(jnp.abs(u - first))) > NEARBY:
            return None
        if size < CLOSED:
            return u, *_moved(n, around)
        u = u.at[:n].add(-step)
    return None
