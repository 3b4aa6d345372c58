"""The guide as film and contact see it: its clearance, and where in it the cage is."""

from typing import NamedTuple

import equinox as eqx

from .._types import Scalar
from ._smooth import smooth_norm, smooth_plus, smooth_plus_slope


class Place(NamedTuple):
    """Where the cage is in its clearance circle, lengths over clearance."""

    x: Scalar
    y: Scalar
    vx: Scalar
    """Velocities over clearance [1/s]."""
    vy: Scalar
    eps: Scalar
    """Eccentricity ratio."""
    per_eps: Scalar
    nx: Scalar
    """Line of centres, a unit vector but for what rounds it off at the centre."""
    ny: Scalar
    gap: Scalar
    """How far eps is beyond the onset of contact, negative before it."""
    excess: Scalar
    """The same, smoothly cut off at 0."""
    touch: Scalar
    """Derivative of the excess with respect to eps."""


class Land(eqx.Module):
    """The guide's clearance, and the lengths that keep its forces smooth, over it.

    Divisions and roots are what a step costs: constants are inverted once, the eccentricity once.
    """

    clearance: Scalar
    per_clearance: Scalar
    onset: Scalar
    """Eccentricity ratio at which contact begins."""
    onset_width: Scalar
    centre_width: Scalar

    def place(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> Place:
        """Where a cage is whose centre is at (x, y) [m] and moves at (vx, vy) [m/s]."""
        per_c = self.per_clearance
        x, y, vx, vy = x * per_c, y * per_c, vx * per_c, vy * per_c
        eps = smooth_norm(x, y, self.centre_width)
        per_eps, gap = 1 / eps, eps - self.onset
        excess, touch = smooth_plus(gap, self.onset_width), smooth_plus_slope(gap, self.onset_width)
        return Place(x, y, vx, vy, eps, per_eps, x * per_eps, y * per_eps, gap, excess, touch)
