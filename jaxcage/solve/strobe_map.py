"""The strobe (Poincare) map: one revolution of a forced system, from phase 0 to phase 2 pi.

Simulation, sweeps, exponents, orbits and gradients all advance through it, so that a solver or a speed-up is written
once. It is differentiable (forward mode) with respect to state, speed and every parameter of the system.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._arguments import require_x64
from .._pytrees import Scalar, State
from ..models import AbstractField, AbstractForcedSystem, require_speeds
from .kernel import REVOLUTION, Parts, Pieces, Tangents
from .method import AbstractMethod, Stretch, method as method_of


class StrobeMap(eqx.Module):
    """The strobe map of a system at one speed, with all that depends on the speed worked out once."""

    field: AbstractField
    system: AbstractForcedSystem
    scale: State
    method: AbstractMethod

    def __call__(self, y: State, tangents: Tangents = ()) -> Stretch:
        """One revolution from `y`: state after it, largest excursion on the way, outcome, tangent vectors.

        **Arguments:** state; tangent vectors in units of the state, each with the tangents of the field's numbers along
        which the field changes too, or None.
        """
        return self.part(y, 0, 1, tangents)

    def part(self, y: State, i: Int[Array, ""] | int, parts: Parts, tangents: Tangents = ()) -> Stretch:
        """The `i`-th of `parts` equal parts of a revolution."""
        phase = jnp.asarray(i, dtype=float) * (REVOLUTION / jnp.asarray(parts, dtype=float))
        return self.method.advance(Pieces(self.field, self.system, self.scale), y, phase, parts, tangents)


def strobe_map(system: AbstractForcedSystem, speed: Scalar, method: AbstractMethod | None = None) -> StrobeMap:
    """The strobe map of `system` at `speed` [rad/s].

    **Arguments:** system; speed; integration method, by default the classical
    Runge-Kutta method with 1024 steps, shortened where the law changes abruptly.
    """
    require_x64()
    require_speeds(system, speed)
    chosen = method_of() if method is None else method
    speed = jnp.asarray(speed, dtype=float)
    return StrobeMap(system.at_speed(speed), system, system.scale(speed), chosen)
