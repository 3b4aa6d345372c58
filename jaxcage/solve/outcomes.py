"""Results of an integration, and how it ended: diffrax's outcomes and our own, each a sentence with the cure."""

from typing import NamedTuple

import diffrax as dfx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .loop import DIVERGED, FINISHED, NOT_FINITE, OUTSIDE, STUCK, TOO_MANY


class RESULTS(dfx.RESULTS):  # pyright: ignore[reportGeneralTypeIssues]
    """Outcome of an integration; `successful` and the rest of diffrax's outcomes are inherited."""

    not_finite = "The state became infinite or undefined: use more steps per revolution, or a smaller tolerance."
    outside = (
        "The state started outside, or went far outside, what the model holds for (a cage: eps > 1 at the start, "
        "eps > 2 later): start inside the clearance, or use a stiffer contact or more steps per revolution."
    )
    inaccurate = (
        "A revolution still moves by more than the tolerance when its steps are halved, on the finest steps allowed: "
        "allow a larger error or finer steps, or look for a contact or spring that is stiffer than meant, or for a "
        "motion that grows without bound."
    )


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
"""Names of outcomes in the order of the integer codes that sweeps store."""


MARKS = {
    "successful": FINISHED,
    "outside": OUTSIDE,
    "not_finite": NOT_FINITE,
    "dt_min_reached": STUCK,
    "max_steps_reached": TOO_MANY,
    "nonlinear_divergence": DIVERGED,
    "other": DIVERGED,
}
"""The mark with which the integration loop says so."""
_OUTCOME = {mark: OUTCOMES.index(name) for name, mark in list(MARKS.items())[:6]}


def codes_of(marks: Float[np.ndarray, " lanes"]) -> Int[np.ndarray, " lanes"]:
    """Places in `OUTCOMES` of what the integration loop marked lanes with."""
    return np.array([_OUTCOME[mark] for mark in marks], dtype=np.int32)


INACCURATE = OUTCOMES.index("inaccurate")
_KNOWN = {name: i for i, name in enumerate(OUTCOMES) if name != "other"}


def outcome_code(result: RESULTS) -> Int[Array, ""]:
    """The place of `result` in `OUTCOMES`."""
    code = jnp.full((), OUTCOMES.index("other"), dtype=jnp.int32)
    for name, i in _KNOWN.items():
        code = jnp.where(result == getattr(RESULTS, name), jnp.int32(i), code)
    return code


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
    mark: Float[np.ndarray, " lanes"]
    """How each lane ended, as in `loop`; 0 if it was not run."""
    strobe: Float[np.ndarray, "lanes keep numbers"]
    """The last strobe states, the latest last, as `state` is."""
    growth: Float[np.ndarray, "lanes revolutions tangents"]
    """Logarithm of the growth of each tangent vector in each revolution."""

    @property
    def peak(self) -> Float[np.ndarray, " lanes"]:
        """Largest value of the first quantity that is watched: the excursion."""
        return np.fmax.reduce(self.peaks[..., 0], axis=1)
