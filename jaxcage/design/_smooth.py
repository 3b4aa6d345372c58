"""Objectives that are differentiable functions of a design: cost, measures of regular motion."""

import dataclasses
from collections.abc import Callable, Mapping

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._errors import ArgumentError
from .._parameters import parameters
from ..models import AbstractForcedSystem, CageModel
from ..orbits import Guess, periodic_orbit
from ..solve import AbstractMethod, strobe_map
from ._objective import Smooth


@dataclasses.dataclass(frozen=True)
class Price:
    """What accuracy in one parameter costs: `amount` at `at`, in proportion to (value/at)^exponent."""

    amount: float
    at: float
    """[SI]."""
    exponent: float = -1.0
    """Negative where small values are dear."""


COSTS: Mapping[str, Price] = {
    "guidance_gap": Price(1.0, 0.45e-3),
    "eccentricity": Price(1.0, 23e-6),
}
"""The cage of the paper's case 1a costs 2: one part for turning cage and rib to their gap, one for balancing. Both
fall with the reciprocal of the value, a common form of tolerance costs. A default to be replaced by a shop's own."""


def cost(prices: Mapping[str, Price] = COSTS) -> Smooth:
    """Manufacturing cost: the sum of the prices of some parameters, in units of their amounts."""

    def total(system: AbstractForcedSystem) -> Array:
        value = parameters(system)
        return sum((p.amount * (value[n] / p.at) ** p.exponent for n, p in prices.items()), jnp.zeros(()))

    return Smooth(total)


def regular_motion(
    measure: str, speed: float, guess: Guess, *, samples: int = 64, method: AbstractMethod | None = None
) -> Smooth:
    """A measure of the synchronous motion of a cage at one speed.

    `displacement` [m]: root mean square distance of the cage centre from the rib's; `peak displacement` [m]: its
    largest; `film thickness` [m]: the smallest, clearance less peak; `land force` [N]: mean size of the force of the
    rib's surface. Means are over equal steps of the phase.

    **Arguments:** what to measure; speed [rad/s]; a state [SI] near the orbit; samples in a revolution, a divisor of
    the method's steps; integration method.

    **Raises:** `ValueError` for a measure that is not offered.
    """
    if measure not in MEASURES:
        raise ArgumentError("measure", said=f"must be one of {', '.join(MEASURES)}, but '{measure}' was given.")

    def value(model: CageModel) -> Array:
        orbit = periodic_orbit(model, speed, guess=guess, method=method)
        tau, motion = _revolution(model, speed, orbit.state, samples, orbit.method)
        return jnp.where(orbit.converged, MEASURES[measure](model, speed, tau, motion), jnp.nan)

    return Smooth(value)


def _revolution(
    model: CageModel, speed: float, state: Array, samples: int, method: AbstractMethod
) -> tuple[Float[Array, " n"], Float[Array, "n 4"]]:
    """Phases and relative motion (x, y, x', y') over a revolution."""
    strobe = strobe_map(model, speed, method)
    advance = lambda y, i: (strobe.part(y, i, samples).y, jnp.stack(y))
    _, motion = jax.lax.scan(advance, tuple(state), jnp.arange(samples))
    if model.dimension == 8:  # an elastic rib moves too
        motion = (motion.reshape(-1, 2, 2, 2)[:, :, 0] - motion.reshape(-1, 2, 2, 2)[:, :, 1]).reshape(-1, 4)
    return jnp.arange(samples) * (2 * jnp.pi / samples), motion


def _distance(motion: Float[Array, "n 4"]) -> Float[Array, " n"]:
    return jnp.hypot(motion[:, 0], motion[:, 1])


def _land_force(model: CageModel, speed: float, tau: Array, motion: Array) -> Array:
    cage = model.cage_at(speed)
    fx, fy, _ = jax.vmap(lambda t, m: cage.forces(t, *m)["contact"])(tau, motion)
    return jnp.mean(jnp.sqrt(fx**2 + fy**2 + TOUCH**2) - TOUCH)


TOUCH = 1e-6
"""Force [N] below which the size of a force is rounded off, so that no contact has a derivative: 0."""
MEASURES: Mapping[str, Callable[[CageModel, float, Array, Array], Array]] = {
    "displacement": lambda model, speed, tau, motion: jnp.sqrt(jnp.mean(_distance(motion) ** 2)),
    "peak displacement": lambda model, speed, tau, motion: jnp.max(_distance(motion)),
    "film thickness": lambda model, speed, tau, motion: model.clearance - jnp.max(_distance(motion)),
    "land force": _land_force,
}
