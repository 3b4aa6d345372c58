"""All the periodic orbits that many starts lead to at one speed, stable and unstable."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least
from .._checks import require_x64
from .._types import Scalar
from ..integrate import AbstractMethod, compiled, strobe_map
from ..models import AbstractForcedSystem, require_speeds
from ._orbit import Orbit, periodic_orbit


SPREAD = 0.6
"""Random starts are spread over this share of the system's scale in every direction."""
SAME = 1e-4
"""Orbits are the same within this distance, in units of the system's scale: an orbit that hardly attracts moves by a
hundred times the error of its map."""


def coexisting_orbits(
    system: AbstractForcedSystem,
    speed: Scalar,
    periods: int = 1,
    *,
    count: int = 24,
    revolutions: int = 5,
    seed: int = 0,
    method: AbstractMethod | None = None,
) -> list[Orbit]:
    """Orbits that close after `periods` revolutions and not earlier, from the system's own starts and random ones.

    **Arguments:** system and speed [rad/s]; number of random starts and their seed; revolutions of simulation before
    Newton's method takes over: with few, unstable orbits are found as well.

    **Returns:** distinct orbits, the stable ones first. There is no proof that these are all.
    """
    require_x64()
    require_at_least(0, seed=seed)
    require_at_least(1, periods=periods, count=count)
    require_speeds(system, speed)
    scale = np.array([float(c) for c in system.scale(speed)])
    own = np.array([[float(c) for c in y] for y in system.starts(speed)])
    random = np.random.default_rng(seed).uniform(-SPREAD, SPREAD, (count, scale.size)) * scale
    starts = jnp.asarray(np.concatenate([own, random]))
    find = lambda y: periodic_orbit(system, speed, periods, guess=y, revolutions=revolutions, method=method)
    found = jax.vmap(find)(starts)
    images = _images(system, speed, periods, found) / scale
    kept: list[int] = []
    for i in np.flatnonzero(np.asarray(found.converged)):
        shorter = any(_near(images[i, 0], images[i, j]) for j in range(1, periods))
        if not shorter and not any(_near(images[i, 0], image) for k in kept for image in images[k]):
            kept.append(int(i))
    orbits = [jax.tree.map(lambda x: x[i] if eqx.is_array(x) and x.ndim else x, found) for i in kept]
    return sorted(orbits, key=lambda o: float(jnp.max(jnp.abs(o.multipliers))))


def _near(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.max(np.abs(a - b)) < SAME)


def _images(
    system: AbstractForcedSystem, speed: Scalar, periods: int, found: Orbit
) -> Float[np.ndarray, "orbits periods dim"]:
    """All strobe states of each orbit [SI]."""

    def step(orbit: Orbit, y: Array) -> Array:
        strobe = strobe_map(system, jnp.asarray(speed, dtype=float), orbit.method)
        return jnp.stack(strobe(tuple(y[i] for i in range(y.size))).y)

    advance = compiled(jax.vmap(step))
    rows = [found.state]
    for _ in range(periods - 1):
        rows.append(advance(found, rows[-1]))
    return np.stack([np.asarray(r) for r in rows], axis=1)
