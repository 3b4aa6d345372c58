"""A sweep sees the same of every lane, which is one design at one speed from one start."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int


class Plan(NamedTuple):
    """How long to run and what to watch."""

    discard: int  # revolutions before anything is recorded
    block: int  # revolutions per block of the exponents' error estimate
    blocks: int  # number of blocks; block * blocks revolutions are observed
    keep: int  # strobe states kept, the last ones
    exponents: int  # number of Lyapunov exponents, from the largest down

    @property
    def align(self) -> int:
        """The last of the discarded revolutions, in which the tangent vectors turn to their directions."""
        return min(self.block, self.discard) if self.exponents else 0


class Observation(NamedTuple):
    """What lanes did, their axis last."""

    strobe: Float[np.ndarray, "keep dim *lanes"]
    growth: Float[np.ndarray, "blocks exponents *lanes"]  # mean logarithmic growth per revolution in each block
    last: Float[np.ndarray, " dim *lanes"]
    peak: Float[np.ndarray, "*lanes"]  # largest excursion (for a cage: eps) while observed
    outcome: Int[np.ndarray, "*lanes"]
    error: Float[np.ndarray, "*lanes"]  # largest error of a revolution from the start on, in units of the scale
    doubt: Float[np.ndarray, " exponents *lanes"]  # change of the mean growth by the method's reference


def start_tangents(dimension: int, exponents: int) -> Float[np.ndarray, "exponents dim"]:
    """Orthonormal directions with no component zero, so that none is orthogonal to a coordinate axis."""
    i, d = np.arange(exponents)[:, None], np.arange(dimension)
    return np.linalg.qr(np.cos((i + 1.0) * (d + 1) * 1.234 + d).T)[0].T
