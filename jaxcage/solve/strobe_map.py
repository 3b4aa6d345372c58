"""The strobe (Poincare) map: one revolution of a forced system, from phase 0 to phase 2 pi.

Simulation, sweeps, exponents, orbits and gradients all advance through it, so that a solver or a speed-up is written
once. It is differentiable (forward mode) with respect to state, speed and every parameter of the system.
"""

from collections.abc import Sequence

import diffrax as dfx
import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._arguments import require_x64
from .._pytrees import Scalar, State, split
from ..models import AbstractField, AbstractForcedSystem, require_speeds
from .kernel import REVOLUTION, Pieces, steps_through
from .method import (
    AbstractMethod,
    FixedSteps,
    Moved,
    Stretch,
    Tangents,
    method as method_of,
    moved_by,
    result_at,
)
from .outcomes import outcome_code


class StrobeMap(eqx.Module):
    """The strobe map of a system at one speed, with all that depends on the speed worked out once."""

    field: AbstractField
    system: AbstractForcedSystem
    scale: State
    method: AbstractMethod

    def __call__(self, y: State) -> Stretch:
        """One revolution from `y`: state after it, largest excursion on the way, outcome."""
        return self.part(y, 0, 1)

    def part(self, y: State, i: Int[Array, ""] | int, parts: Int[Array, ""] | Scalar) -> Stretch:
        """The `i`-th of `parts` equal parts of a revolution."""
        phase = jnp.asarray(i, dtype=float) * (REVOLUTION / jnp.asarray(parts, dtype=float))
        return self.method.advance(Pieces(self.field, self.system, self.scale), y, phase, parts)


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


Drift = Sequence[Scalar | None]
"""Tangents of the numbers of a field, in the order of its leaves; None where there is none."""


def pushed(strobe: StrobeMap, y: State, tangents: Tangents, drifts: Sequence[Drift | None]) -> Moved:
    """A lane one revolution on, with tangent vectors along which the field changes too.

    **Arguments:** strobe map; state; tangent vectors (in units of the state), and for each of them the tangents of the
    field's numbers, None where there are none.
    """
    method = strobe.method
    if isinstance(method, FixedSteps):
        pieces = Pieces(strobe.field, strobe.system, strobe.scale)
        y, peak, after = steps_through(method.solver, method.steps, pieces, y, tangents, drifts)
        return Moved(y, after, peak, outcome_code(result_at(dfx.RESULTS.successful, y, peak)))
    form, row = split(strobe.field, eqx.is_inexact_array)

    def advance(start: tuple[State, list[Array]]) -> Stretch:
        y, row = start
        return eqx.tree_at(lambda s: s.field, strobe, form.filled(row))(y)

    zero = list(map(jnp.zeros_like, row))
    filled = [[z if d is None else d for z, d in zip(zero, drift or zero, strict=True)] for drift in drifts]
    return moved_by(advance, (y, row), list(zip(tangents, filled, strict=True)))
