"""Results of an integration, and how it ended."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int


OUTCOMES = (
    "successful",
    "not_finite",
    "outside",
    "max_steps_reached",
    "nonlinear_divergence",
    "dt_min_reached",
    "other",
    "inaccurate",
)
"""Names of outcomes in the order of the integer codes that sweeps store: all revolutions done; the state became
infinite or undefined; the state started outside, or went far outside, what the model holds for; too many steps in a
revolution; an iteration that did not converge; the error cannot be met by the smallest step; another failure of
diffrax; a revolution whose measured error is larger than allowed, on the finest steps."""
FINISHED, NOT_FINITE, OUTSIDE, TOO_MANY, DIVERGED, STUCK, OTHER, INACCURATE = range(len(OUTCOMES))


class March(NamedTuple):
    """Results of a run of lanes."""

    state: Float[np.ndarray, "lanes numbers"]
    """State at the end in units of the scale, and behind it the values of what is integrated beside it."""
    tangents: Float[np.ndarray, "lanes tangents dim"]
    step: Float[np.ndarray, " lanes"]
    """Step size to go on with [rad]."""
    peaks: Float[np.ndarray, "lanes parts watched"]
    """Largest values of what is watched: between the strobe states that are kept or, if it is the excursion alone, of
    the whole run (parts = 1)."""
    steps: Float[np.ndarray, " lanes"]
    """Number of steps tried."""
    outcome: Int[np.ndarray, " lanes"]
    """Code of how each lane ended, its place in `OUTCOMES`; -1 if it was not run."""
    strobe: Float[np.ndarray, "lanes keep numbers"]
    """The last strobe states, the latest last, as `state` is."""
    growth: Float[np.ndarray, "lanes revolutions tangents"]
    """Logarithm of the growth of each tangent vector in each revolution."""

    @property
    def peak(self) -> Float[np.ndarray, " lanes"]:
        """Largest value of the first quantity that is watched: the excursion."""
        return np.fmax.reduce(self.peaks[..., 0], axis=1)
