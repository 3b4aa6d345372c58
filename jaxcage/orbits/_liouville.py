"""Liouville's identity: the determinant of a monodromy matrix is the exponential of the integrated divergence.

For a mechanical system the divergence is minus damping over mass. It checks every monodromy matrix: integration error,
differentiation and, in stiff systems, multipliers lost to rounding show as a disagreement.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..integrate import REVOLUTION, FixedSteps, StrobeMap


ADAPTIVE_PARTS, MOST_PARTS = 256, 4096


def divergence_integral(
    strobe: StrobeMap, state: Float[Array, " dim"], periods: Int[Array, ""] | int
) -> Float[Array, ""]:
    """Integral over `periods` revolutions of the field's divergence along the orbit through `state` (SI), log|det M|.

    By the trapezoidal rule at the integration steps, or at as many of them as is enough: on a closed orbit it converges
    faster than any power of the step where the field is smooth.
    """
    parts = ADAPTIVE_PARTS
    if isinstance(strobe.method, FixedSteps):
        steps = jnp.asarray(strobe.method.steps)
        parts = jnp.where(steps % MOST_PARTS == 0, MOST_PARTS, steps)
    h = REVOLUTION / jnp.asarray(parts, dtype=float)

    def part(i: Array, carry: tuple) -> tuple:
        y, total = carry
        tau = jnp.mod(i, parts).astype(float) * h
        divergence = strobe.field.linearise(tau, y).divergence
        return strobe.part(y, jnp.mod(i, parts), parts).y, total + divergence

    start = tuple(state[i] for i in range(state.size)), jnp.zeros(())
    _, total = jax.lax.fori_loop(0, periods * parts, part, start)
    return total * h
