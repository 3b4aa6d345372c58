"""The strobe (Poincaré) map: one revolution of a forced system, from phase 0 to phase 2 pi.

It is differentiable (forward mode) with respect to state, speed and every parameter of the system.
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
    """The strobe map of a system at one speed, with everything that depends on the speed computed once."""

    field: AbstractField
    system: AbstractForcedSystem
    scale: State
    method: AbstractMethod

    def __call__(self, y: State, tangents: Tangents = ()) -> Stretch:
        """Advance by one revolution from `y`, with tangent vectors in units of the state, each with tangents of the
        field's numbers or None."""
        return self.part(y, 0, 1, tangents)

    def part(self, y: State, i: Int[Array, ""] | int, parts: Parts, tangents: Tangents = ()) -> Stretch:
        """Advance by the `i`-th of `parts` equal parts of a revolution."""
        phase = jnp.asarray(i, dtype=float) * (REVOLUTION / jnp.asarray(parts, dtype=float))
        return self.method.advance(Pieces(self.field, self.system, self.scale), y, phase, parts, tangents)


def strobe_map(system: AbstractForcedSystem, speed: Scalar, method: AbstractMethod | None = None) -> StrobeMap:
    """Build the strobe map of a system.

    **Arguments:** system; speed [rad/s]; integration method, by default the classical Runge-Kutta method with 1024
    steps, shortened near abrupt changes of the law.

    **Returns:** `StrobeMap`: called with a state, a tuple of scalars [SI], it returns a `Stretch` with the state `y`
    after one revolution. **Raises:** `ValueError` for an impossible speed, `RuntimeError` without double precision.
    """
    require_x64()
    require_speeds(system, speed)
    chosen = method_of() if method is None else method
    speed = jnp.asarray(speed, dtype=float)
    return StrobeMap(system.at_speed(speed), system, system.scale(speed), chosen)
