"""States to start from, and the magnitude of each part of a state."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._errors import ArgumentError
from ..._types import Scalar
from ...bearing import line_contact_approach, load_distribution, raceway_loads_of_all
from ._model import BearingModel
from ._state import BearingState, Bodies, Rollers


CagePlace = tuple[float, float, float, float]
"""Place of the cage's centre in clearances, and its velocity in clearances times the cage's speed."""
CAGE_STARTS: tuple[CagePlace, ...] = ((0.0, -0.9, 0.0, 0.0), (0.4, 0.3, 0.0, 0.0), (-0.6, 0.1, 0.2, -0.3))
"""Near its lowest place, and twice inside the clearance."""


WITHIN = 0.8
"""Of the clearance, in which drawn starts lie."""


LEAST_DEPTH, LEAST_SPEED = 1e-5, 1e-3
"""Of a contact over the roller's diameter, and of the cage over the radial frequency of the rollers, for a scale."""


LEAST_LOAD = 1e-3
"""By which the inner ring is placed where there is no load [N]."""


def drawn_places(count: int, seed: int = 0) -> tuple[CagePlace, ...]:
    """Places of the cage drawn evenly from most of its clearance, at the speed of rolling.

    **Arguments:** how many; seed.

    **Raises:** `ValueError` for none.
    """
    if count < 1:
        raise ArgumentError("count", said=f"must be at least 1, but {count} was given.")
    rng = np.random.default_rng(seed)
    place = WITHIN * np.sqrt(rng.uniform(size=count)) * np.exp(2j * np.pi * rng.uniform(size=count))
    return tuple((float(z.real), float(z.imag), 0.0, 0.0) for z in place)


def rolling_start(
    model: BearingModel,
    speed: Scalar,
    cage: int = 0,
    turning: Scalar = 1.0,
    place: Sequence[float] | Float[Array, " 4"] | None = None,
) -> BearingState:
    """Rollers in the middle of their pockets, rolling without slip, pressed as in a static bearing; one at the bottom.

    **Arguments:** model; shaft speed [rad/s]; which of the `CAGE_STARTS`; the speed of cage and rollers over that of
    pure rolling, with which a start below 1 slips; a place such as the `CAGE_STARTS` are, instead of one of them.
    """
    bearing, c = model.bearing, model.clearance
    omega, spin = turning * model.rolling_cage_speed(speed), turning * model.rolling_spin(speed)
    n, stiff = bearing.n_rollers, bearing.raceway_stiffness
    angles = -jnp.pi / 2 + 2 * np.pi / n * jnp.arange(n, dtype=float)
    down = -load_distribution(bearing, jnp.maximum(model.load, LEAST_LOAD)).shaft_shift
    pitch = model.outer_radius - bearing.roller_diameter / 2
    centrifugal = bearing.roller_mass * pitch * omega**2
    approach = down * jnp.sin(angles) - bearing.radial_clearance / 2
    _, outer = raceway_loads_of_all(approach, stiff, stiff, centrifugal)
    radius = pitch + jax.vmap(line_contact_approach, in_axes=(None, 0))(stiff, outer)
    x, y, vx, vy = CAGE_STARTS[cage] if place is None else place
    lag = jnp.arcsin(c * (y * jnp.cos(angles) - x * jnp.sin(angles)) / radius)
    full = lambda value: jnp.ones((n,)) * value
    rollers = Rollers(lag, full(spin), radius, full(0.0), full(omega))
    moving = c * omega
    bodies = Bodies(x * c, y * c, vx * moving, vy * moving, omega, 0.0, down, 0.0, 0.0)
    return BearingState.of(rollers, bodies, angle=-jnp.pi / 2)


def state_scale(model: BearingModel, speed: Scalar) -> BearingState:
    """Magnitude of each part of a state, in whose units errors are stated.

    Lengths of the cage in clearances, those of contacts in the approach of one raceway under the most loaded roller.
    """
    bearing, c, n = model.bearing, model.clearance, model.bearing.n_rollers
    pitch, stiff = model.outer_radius - bearing.roller_diameter / 2, bearing.raceway_stiffness
    # A bearing at rest and without load too has a depth of contact and a speed in whose units errors can be stated.
    least = stiff * (LEAST_DEPTH * bearing.roller_diameter) ** (10 / 9)
    force = 4 * model.load / n + bearing.roller_mass * (pitch * model.rolling_cage_speed(speed) ** 2 + model.gravity)
    depth = line_contact_approach(stiff, force + least)
    fast = jnp.sqrt((force + least) / (depth * bearing.roller_mass))
    omega = jnp.hypot(model.rolling_cage_speed(speed), LEAST_SPEED * fast)
    spin = 2 * pitch / bearing.roller_diameter * omega
    full = lambda value: jnp.ones((n,)) * value
    lag = (bearing.pocket_clearance / 2 + 1e-5 * bearing.roller_diameter) / pitch
    rollers = Rollers(full(lag), full(spin), full(depth), full(depth * fast), full(omega))
    bodies = Bodies(c, c, c * omega, c * omega, omega, depth, depth, depth * fast, depth * fast)
    return BearingState.of(rollers, bodies, angle=1.0, time=1 / omega)
