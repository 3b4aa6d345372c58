"""Weight of the cage (y points up), and centrifugal force of its mass centre, physical or as printed in the paper."""

from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array

from .._pytrees import Scalar
from .elementary import cos_sin
from .law import AbstractForcing, Force, Motion


UnbalanceReading = Literal["physical", "as_printed"]


def effective_eccentricity(
    reading: UnbalanceReading, eccentricity: Scalar, guidance_gap: Scalar, printed_unit: Scalar
) -> Array:
    """Eccentricity [m] that enters the unbalance force.

    `as_printed` takes (20) literally: 2 M rho omega^2 with rho = e/C_r read as a number of `printed_unit` (one
    millimetre): 4.44 e at a gap of 0.45 mm, 3.33 e at 0.60 mm.
    """
    if reading == "physical":
        return jnp.asarray(eccentricity)
    return jnp.asarray(2 * eccentricity / guidance_gap * printed_unit)


class UnbalanceForce(AbstractForcing):
    """Centrifugal force of the mass centre, M e omega^2 (cos tau, sin tau) [N]."""

    unbalance: Scalar
    """Mass times the eccentricity that enters the force, M e [kg m]."""

    def force(self, motion: Motion) -> Force:
        amplitude = self.unbalance * motion.cage_speed**2
        cosine, sine = cos_sin(motion.phase)
        return amplitude * cosine, amplitude * sine, 0.0


class WeightForce(AbstractForcing):
    """Weight of the cage."""

    weight: Scalar
    """M g [N]."""

    def force(self, motion: Motion) -> Force:
        return 0.0, -self.weight, 0.0
