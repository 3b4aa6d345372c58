"""Land contact: beyond a given eccentricity ratio a line contact between cage and rib takes over from the film.

Force N = K p^(10/9) (1 + chi p'/v_0) on the penetration p, after Hunt and Crossley. The damping number chi follows from
the coefficient of restitution e by the exact law of this model, ln[(1 + chi)/(1 - chi e)] = chi (1 + e), whatever the
exponent: integrate m dv/dt = -K p^n (1 + chi v/v_0) over one contact, entered at v_0 and left at -e v_0.
"""

import equinox as eqx
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array

from .._parameters import parameter
from .._types import Scalar
from ._smooth import power_10_9, root_9, smooth_plus, smooth_plus_slope


def _restitution_defect(s: Array, e: Array) -> Array:
    """The restitution law over chi^2 (which removes its trivial double root), with chi = (1 - exp(-s))/e."""
    chi = -jnp.expm1(-s) / e
    small = jnp.abs(chi) < 1e-2
    safe, safe_s = jnp.where(small, 0.01, chi), jnp.where(small, -jnp.log1p(-0.01 * e), s)
    exact = (jnp.log1p(safe) + safe_s - safe * (1 + e)) / safe**2
    series = sum(((-1) ** (m + 1) + e**m) * chi ** (m - 2) / m for m in range(2, 11))
    return jnp.where(small, series, exact)


def restitution_damping(restitution: Scalar) -> Array:
    """Damping number chi of the Hunt-Crossley force that gives back `restitution` times the approach speed.

    **Arguments:** coefficient of restitution, in (0, 1].

    **Returns:** chi >= 0, solving ln[(1 + chi)/(1 - chi e)] = chi (1 + e); chi = 0 at e = 1. Differentiable.
    """
    e = jnp.asarray(restitution, dtype=float)
    solver = optx.Bisection(rtol=1e-12, atol=1e-12, flip=False)  # the defect increases
    bounds = {"lower": -jnp.log1p(e / 2), "upper": jnp.array(60.0)}  # chi from -1/2 to nearly 1/e
    # The bracket always holds the root: nothing to check or throw, which would put a host callback into every program.
    root = optx.root_find(_restitution_defect, solver, jnp.array(0.5), e, bounds, max_steps=200, throw=False)
    s = root.value
    return jnp.asarray(-jnp.expm1(-s) / e)


def contact_force(
    penetration: Scalar, rate: Scalar, stiffness: Scalar, damping: Scalar, approach_speed: Scalar
) -> Array:
    """Normal force [N] of the land contact, never adhesive.

    **Arguments:** penetration p >= 0 [m] (already regularised) and its rate [m/s]; stiffness K [N/m^(10/9)];
    Hunt-Crossley number chi and the approach speed v_0 [m/s] at which it gives the restitution asked for.
    """
    loading = 1 + (damping / approach_speed) * rate
    return stiffness * power_10_9(penetration) * smooth_plus(loading, 1e-4)


def contact_slopes(
    penetration: Scalar, rate: Scalar, stiffness: Scalar, damping: Scalar, approach_speed: Scalar
) -> tuple[Array, Array]:
    """Derivatives of `contact_force` with respect to penetration [N/m] and its rate [N s/m]."""
    ratio = damping / approach_speed
    loading = 1 + ratio * rate
    return (
        stiffness * (10 / 9) * root_9(penetration) * smooth_plus(loading, 1e-4),
        stiffness * power_10_9(penetration) * smooth_plus_slope(loading, 1e-4) * ratio,
    )


class LandContact(eqx.Module):
    """The contact of the cage's guiding lands with the rib."""

    stiffness: Scalar = parameter("N/m^(10/9)", 1e4, 1e12, "line-contact stiffness of all lands together")
    onset: Scalar = parameter("1", 0.5, 0.999, "eccentricity ratio at which the contact begins")
    restitution: Scalar = parameter("1", 0.05, 1.0, "coefficient of restitution at the approach speed", default=1.0)
    approach_speed: Scalar = parameter(
        "m/s", 1e-4, 10.0, "approach speed to which the restitution belongs", default=0.1
    )
    smoothing: Scalar = parameter(
        "m", 1e-12, 1e-5, "half width over which contact sets in and film coefficients saturate", default=2e-7
    )
