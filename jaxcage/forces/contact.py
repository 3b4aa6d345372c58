"""Land contact: line contact between cage and rib beyond a given eccentricity ratio, in addition to the film.

Force N = K p^(10/9) (1 + chi p'/v_0) on the penetration p, after Hunt and Crossley. The damping number chi follows from
the coefficient of restitution e by the exact law of this model, ln[(1 + chi)/(1 - chi e)] = chi (1 + e), whatever the
exponent: integrate m dv/dt = -K p^n (1 + chi v/v_0) over one contact, entered at v_0 and left at -e v_0.
"""

from typing import Any

import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array

from .._parameters import parameter
from .._pytrees import Scalar
from .elementary import power_10_9, smooth_plus
from .law import AbstractForce, AbstractLaw, Force, GuidedCage, Motion


def _restitution_defect(s: Array, e: Array) -> Array:
    """Restitution law over chi^2 (which removes its trivial double root), with chi = (1 - exp(-s))/e."""
    chi = -jnp.expm1(-s) / e
    small = jnp.abs(chi) < 1e-2
    safe, safe_s = jnp.where(small, 0.01, chi), jnp.where(small, -jnp.log1p(-0.01 * e), s)
    exact = (jnp.log1p(safe) + safe_s - safe * (1 + e)) / safe**2
    series = sum(((-1) ** (m + 1) + e**m) * chi ** (m - 2) / m for m in range(2, 11))
    return jnp.where(small, series, exact)


def restitution_damping(restitution: Scalar) -> Array:
    """Damping number chi of the Hunt-Crossley force for a coefficient of restitution.

    **Arguments:** coefficient of restitution e, in (0, 1].

    **Returns:** chi >= 0, solving ln[(1 + chi)/(1 - chi e)] = chi (1 + e); chi = 0 at e = 1. Differentiable.
    """
    e = jnp.asarray(restitution, dtype=float)
    solver = optx.Bisection(rtol=1e-12, atol=1e-12, flip=False)  # the defect increases
    # chi lies between -1/2 and nearly 1/e
    bounds = {"lower": -jnp.log1p(jax.lax.stop_gradient(e) / 2), "upper": jnp.array(60.0)}
    # No check and no derivative of the library: they put host callbacks into programs, which are then not kept on disk.
    search: dict[str, Any] = dict(options=bounds, max_steps=200, throw=False)
    find = lambda defect, start: optx.root_find(lambda s, _: defect(s), solver, start, **search).value
    slope = lambda linear, y: y / linear(jnp.ones_like(y))
    s = jax.lax.custom_root(lambda s: _restitution_defect(s, e), jnp.array(0.5), find, slope)
    return jnp.asarray(-jnp.expm1(-s) / e)


def contact_force(penetration: Scalar, rate: Scalar, stiffness: Scalar, damping: Scalar) -> Array:
    """Normal force [N] of the land contact, never adhesive.

    **Arguments:** penetration p >= 0 [m] (already regularised) and its rate [m/s]; stiffness K [N/m^(10/9)]; damping
    chi/v_0 [s/m], the Hunt-Crossley number over the approach speed at which it gives the restitution asked for.
    """
    loading = 1 + damping * rate
    return stiffness * power_10_9(penetration) * smooth_plus(loading, 1e-4)


class LandContact(AbstractLaw):
    """Contact of the cage's guiding lands with the rib."""

    law_name = "contact"

    stiffness: Scalar = parameter(
        "N/m^(10/9)",
        1e4,
        1e12,
        "line-contact stiffness of all lands together",
        source="press the land on its rib: force over approach",
    )
    onset: Scalar = parameter(
        "1",
        0.5,
        0.999,
        "eccentricity ratio at which the contact begins",
        source="roughness of land and rib over the clearance",
    )
    restitution: Scalar = parameter(
        "1",
        0.05,
        1.0,
        "coefficient of restitution at the approach speed",
        source="drop the cage on its rib: height of the rebound",
        default=1.0,
    )
    approach_speed: Scalar = parameter(
        "m/s", 1e-4, 10.0, "approach speed to which the restitution belongs", default=0.1
    )
    smoothing: Scalar = parameter(
        "m", 1e-12, 1e-5, "half width over which contact sets in and film coefficients saturate", default=2e-7
    )

    def at(self, cage: GuidedCage, speed: Scalar) -> "ContactForce":
        return ContactForce(self.stiffness, restitution_damping(self.restitution) / self.approach_speed)


class ContactForce(AbstractForce):
    """Normal force of the land contact along the line of centres."""

    stiffness: Scalar
    damping: Scalar
    """Hunt-Crossley number over its approach speed, chi/v_0 [s/m]."""

    def force(self, motion: Motion) -> Force:
        at, c = motion.place, motion.land.clearance
        rate = at.nx * at.vx + at.ny * at.vy
        normal = contact_force(c * at.excess, c * rate, self.stiffness, self.damping)
        return -normal * at.nx, -normal * at.ny, 0.0
