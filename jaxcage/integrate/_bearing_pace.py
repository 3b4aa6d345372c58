"""The pace of the whole bearing: limits of its steps, and the stretch over which two runs can be compared."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..models.whole import BearingAtSpeed, BearingState
from ..solve import BearingLimits


TURN = 2 * np.pi
SAMPLES = 16
"""The motion is recorded at so many samples in a revolution of the cage."""
SPACING = TURN / SAMPLES
FIRST, LONGEST, SHORTEST = TURN / 20_000, TURN / 200, TURN / 4e6
"""First, longest and shortest step [rad] of the cage's angle."""
PERIODS, COMPARED = 50, 10
"""A shaft is slow if more than the first number of periods of a loaded roller's vibration on its raceway pass from
sample to sample (NU2310 below 4000 rpm). Two runs are then compared over the second number of periods only: what
rollers do to their bars depends little on the speed, and neighbouring motions diverge over time, not over revolutions.
"""
SLOWEST = 1000.0
"""The slowness of a shaft is cut off here."""
MOST_STEPS = 5_000
"""From sample to sample, in the mean: a lane that needs more has failed. As many times more as the shaft is slow."""
STALLED = 0.05
"""Speed of the cage over that of pure rolling below which its angle is no measure of progress."""


def slowness(at: BearingAtSpeed, scale: BearingState) -> Float[Array, "*lanes"]:
    """The slowness of a shaft is the number of a roller's periods from sample to sample over `PERIODS`, at least 1.

    **Arguments:** laws, each number a scalar or of lanes; magnitudes of the state, of one roller each.
    """
    period = TURN * scale.rollers[2] / scale.rollers[3]
    turned = PERIODS * period * jnp.abs(jnp.asarray(at.rolling_cage_speed))
    return jnp.clip(SPACING / turned, 1.0, SLOWEST)


def comparable(slow: Float[np.ndarray, "*lanes"]) -> Float[np.ndarray, "*lanes"]:
    """Each lane is compared with a run by shorter steps over this angle [rad]: to the next sample, or less."""
    return np.where(slow > 1, COMPARED / PERIODS * SPACING / slow, SPACING)


def limits_of(slow: Any) -> BearingLimits:
    """Limits of steps over the cage's angle."""
    return BearingLimits(FIRST, LONGEST, SHORTEST, MOST_STEPS * float(np.max(slow)))
