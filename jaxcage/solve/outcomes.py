"""Results and outcomes of an integration."""

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
"""Names of outcomes in the order of their integer codes: all revolutions done; the state became infinite or undefined;
the state was initially outside, or went far outside, the range of the model; too many steps in a revolution; an
iteration did not converge; the tolerance cannot be met with the smallest step; another failure of diffrax; the measured
error of a revolution is larger than allowed even with the smallest steps."""
FINISHED, NOT_FINITE, OUTSIDE, TOO_MANY, DIVERGED, STUCK, OTHER, INACCURATE = range(len(OUTCOMES))


class March(NamedTuple):
    """Results of a run of lanes."""

    state: Float[np.ndarray, "lanes numbers"]
    """Final state in units of the scale, followed by the values of additional integrands."""
    tangents: Float[np.ndarray, "lanes tangents dim"]
    step: Float[np.ndarray, " lanes"]
    """Size of the next step [rad]."""
    peaks: Float[np.ndarray, "lanes parts watched"]
    """Maxima of the watched quantities between the strobe states kept or, for the excursion alone, over the whole run
    (parts = 1)."""
    steps: Float[np.ndarray, " lanes"]
    """Number of steps tried."""
    outcome: Int[np.ndarray, " lanes"]
    """Index into `OUTCOMES` of how each lane ended; -1 if it was not run."""
    strobe: Float[np.ndarray, "lanes keep numbers"]
    """Last strobe states in the form of `state`, the latest last."""
    growth: Float[np.ndarray, "lanes revolutions tangents"]
    """Logarithm of the growth of each tangent vector in each revolution."""

    @property
    def peak(self) -> Float[np.ndarray, " lanes"]:
        """Largest value of the first watched quantity, the excursion."""
        return np.fmax.reduce(self.peaks[..., 0], axis=1)
