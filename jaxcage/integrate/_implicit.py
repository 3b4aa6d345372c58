"""An implicit step of the whole bearing: RODAS4 with the exact Jacobian, for oil so thick that it makes the cage stiff.

A cage at its land squeezes the film out at a rate that grows with the oil's viscosity over the cube of the film. Slow
shafts in cold oil make that rate forty times the frequency of the rollers on their raceways: explicit steps are then
as short as is stable, however little happens.

What is integrated beside the state (time, energies, means) depends on the state and nothing on it. So the method's
quadrature of it is one weighted sum of its rates at the stages, and one directional derivative.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._types import Scalar
from ..models.whole import PEAKS, BearingAtSpeed, BearingState, Bodies, Rates
from ..solve import RODAS4
from ._arrow import Parts, arrow, factors


STAGES = len(RODAS4.m)
A = np.array([[*row, *[0.0] * (STAGES - len(row))] for row in (*RODAS4.a, RODAS4.m)])
C = np.array([[*row, *[0.0] * (STAGES - len(row))] for row in (*RODAS4.c, ())])
"""A row for each stage, and one for the end of the step."""
QUADRATURE = np.append(
    RODAS4.gamma * np.linalg.solve((np.eye(STAGES) - RODAS4.gamma * C[:-1]).T, np.array(RODAS4.m)), 0.0
)
"""Weights of the stages in a quadrature: of the rates there and, with their increments, of the derivative."""
Numbers = tuple[BearingState, Array]
"""A state and what is integrated beside it, as in `LEDGER` and `MEANS`; or their rates over time."""


def film_rate(at: BearingAtSpeed, state: BearingState) -> Scalar:
    """How fast the film at the land damps the cage [1/s]: the norm of its force's derivative by the cage's velocity,
    over the cage's mass."""

    def force(velocity: Array) -> Array:
        cage = Bodies(*state.bodies)._replace(vx=velocity[0], vy=velocity[1])
        land = at.on_land(cage)
        return jnp.stack([land.x, land.y])

    return jnp.linalg.norm(jax.jacfwd(force)(state.bodies[2:4])) / at.cage_mass


def implicit_step(
    at: BearingAtSpeed, numbers: Numbers, rates: Numbers, h: Scalar, over_angle: bool
) -> tuple[Numbers, Numbers, Parts, Array]:
    """One step of one lane.

    **Arguments:** laws, of a bearing whose inner ring moves by its own inertia; state and what is integrated beside it;
    their rates over time; step, of the cage's angle (`over_angle`) or of time.

    **Returns:** the same numbers at the end, their rates over time, the estimated error of the state, and the values
    there of which `PEAKS` are followed.
    """
    begin, moved, passing = _apart(numbers)[0], *_paced(rates, over_angle)
    blocks = arrow(at, begin, over_angle)
    held = factors(blocks, 1 / (RODAS4.gamma * h))
    added = lambda row, u: jax.tree.map(lambda x: jnp.sum(row.reshape(-1, *[1] * (x.ndim - 1)) * x, axis=0), u)

    def stage(i: Array, carry: Any) -> Any:
        """A stage; the last one is the end of the step."""
        u, total, *_ = carry
        y = jax.tree.map(jnp.add, begin, added(jnp.asarray(A)[i], u))
        rates = at(_state_of(y))
        moved, passing = _paced((rates.state, rates.integrals), over_angle)
        f = jax.tree.map(lambda k, s: k + s / h, moved, added(jnp.asarray(C)[i], u))
        u = jax.tree.map(lambda every, new: every.at[i].set(new, mode="drop"), u, held.solve(f))
        return u, total + jnp.asarray(QUADRATURE)[i] * passing, y, rates

    first = held.solve(moved)
    u = jax.tree.map(lambda x: jnp.zeros((STAGES, *x.shape)).at[0].set(x), first)
    empty = Rates(*rates, peaks=jnp.zeros(len(PEAKS)))
    u, total, y, after = jax.lax.fori_loop(1, STAGES + 1, stage, (u, QUADRATURE[0] * passing, begin, empty))
    passed = h * (total + blocks.beside(added(QUADRATURE[:STAGES], u)))
    state, integrals = numbers
    end = _state_of(y, state.clock[1] + passed[0]), integrals + passed[1:]
    return end, (after.state, after.integrals), jax.tree.map(lambda x: x[-1], u), after.peaks


def _apart(numbers: Numbers) -> tuple[Parts, Array]:
    """The state without time; time and integrals."""
    state, integrals = numbers
    parts = Parts(state.rollers.T, jnp.append(state.bodies, state.clock[0]))
    return parts, jnp.append(state.clock[1:], integrals)


def _paced(rates: Numbers, over_angle: bool) -> tuple[Parts, Array]:
    """Rates over time, as they are or over the cage's angle."""
    pace = 1 / jnp.abs(rates[0].clock[0]) if over_angle else 1.0
    return jax.tree.map(lambda x: pace * x, _apart(rates))


def _state_of(y: Parts, time: Scalar = 0.0) -> BearingState:
    return BearingState(y.rollers.T, y.bodies[:-1], jnp.stack([y.bodies[-1], time]))
