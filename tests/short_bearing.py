"""A short bearing under a load along -y, the film of the package differentiated: Ocvirk's equilibrium, dynamic
coefficients, whirl threshold of a rigid mass.

Ocvirk's load number is N = W c^2/(mu omega R L^3). The attitude angle runs from the load line to the line of centres,
in the direction of rotation (counter-clockwise): r = eps (sin phi, -cos phi). Linear coefficients are K = -dF/dr and
C = -dF/dv, in units of W/c and W/(c omega). For a rigid mass M the characteristic polynomial of M r'' + C r' + K r = 0
has a pair +- i nu omega at M omega^2 c/W = omega^2 c/g = kappa/nu^2, with kappa = (K_xx C_yy + K_yy C_xx - K_xy C_yx -
K_yx C_xy)/(C_xx + C_yy) and nu^2 = det(K - kappa I)/det C (Routh).
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from scipy.optimize import brentq

from jaxcage.forces import FilmModel, arc_centre, film_drive, film_resistance


Scalar = Any
LARGEST_WHIRLING = 0.7560303864710124
"""Eccentricity ratio from which a rigid mass in a half film is stable at every speed."""


def load_number(eccentricity_ratio: Scalar) -> Array:
    """Ocvirk's load number N = W c^2/(mu omega R L^3) of the half film at an eccentricity ratio.

    N = eps/(4 (1 - eps^2)^2) sqrt(16 eps^2 + pi^2 (1 - eps^2)).
    """
    rest = 1 - eccentricity_ratio**2
    root = jnp.sqrt(16 * eccentricity_ratio**2 + jnp.pi**2 * rest)
    return jnp.asarray(eccentricity_ratio * root / (4 * rest**2))


def attitude_angle(eccentricity_ratio: Scalar) -> Array:
    """Attitude angle of the half film from the load line [rad]; tan = pi sqrt(1-eps^2)/(4 eps)."""
    return jnp.arctan2(jnp.pi * jnp.sqrt(1 - eccentricity_ratio**2), 4 * eccentricity_ratio)


def eccentricity_ratio(number: float) -> float:
    """Eccentricity ratio of the half film at a load number: the inverse of `load_number`."""
    return float(brentq(lambda eps: float(load_number(eps)) - number, 1e-12, 1 - 1e-9, xtol=1e-15, rtol=1e-14))  # pyright: ignore


class FilmCoefficients(NamedTuple):
    """A film in static equilibrium under a load along -y, and its linear coefficients there."""

    load_number: Array
    """N = W c^2/(mu omega R L^3)."""
    attitude_angle: Array
    """From the load line to the line of centres, in the direction of rotation [rad]."""
    stiffness: Float[Array, "2 2"]
    """-dF_i/dr_j in units of W/c, rows and columns x, y."""
    damping: Float[Array, "2 2"]
    """-dF_i/dv_j in units of W/(c omega)."""


def short_film_force(model: FilmModel, r: Any, v: Any, omega: Scalar = 1.0, smoothing: float = 1e-9) -> Array:
    """Force of the film in units of S = mu R L^3 / c^2, times 1/s: -(1/2) M P.

    **Arguments:** `model`; position and velocity of the cage centre over clearance [-, 1/s]; cage speed [rad/s];
    `smoothing`, a small length over clearance.
    """
    (x, y), (px, py) = r, film_drive(*r, *v, omega)
    per_eps = 1 / jnp.sqrt(x * x + y * y + smoothing * smoothing)
    n = x * per_eps, y * per_eps
    m = film_resistance(model, x, y, n, arc_centre(model, n, (px, py), smoothing * omega))
    return -jnp.stack([m.xx * px + m.xy * py, m.xy * px + m.yy * py]) / 2


def film_coefficients(eccentricity_ratio: Scalar, film: FilmModel = "fixed_half") -> FilmCoefficients:
    """Static equilibrium and dimensionless dynamic coefficients, by differentiating the film force.

    The half film and the film of positive pressure agree in all of them: at rest the pressurised
    half circle is the same, and what its moving ends add is of second order.

    **Arguments:** eccentricity ratio in (0, 1); film model.
    """
    eps = jnp.asarray(eccentricity_ratio, dtype=float)

    def force(r: Array, v: Array) -> Array:
        return short_film_force(film, r, v, 1.0, 0.0)

    still = jnp.zeros(2)
    radial, tangential = force(jnp.stack([eps, jnp.zeros(())]), still)
    number = jnp.sqrt(radial**2 + tangential**2)
    angle = jnp.arctan2(tangential, -radial)
    r = eps * jnp.stack([jnp.sin(angle), -jnp.cos(angle)])
    k, c = jax.jacfwd(force, argnums=(0, 1))(r, still)
    return FilmCoefficients(number, angle, -k / number, -c / number)


class WhirlThreshold(NamedTuple):
    """Speed at which the equilibrium of a rigid mass in its film loses stability."""

    speed: Array
    """omega sqrt(c/g) above which it whirls; infinite where it never does."""
    whirl_ratio: Array
    """Whirl speed at the threshold over omega; NaN where it never whirls."""


def whirl_threshold(stiffness: Float[Array, "2 2"], damping: Float[Array, "2 2"]) -> WhirlThreshold:
    """Threshold of a rigid mass on dimensionless film coefficients, in closed form (Routh).

    It is 0 where the mass whirls at every speed, as in a full film. Coefficients must be those of a
    film: det K, det C and the trace of C positive.
    """
    (kxx, kxy), (kyx, kyy) = stiffness
    (cxx, cxy), (cyx, cyy) = damping
    kappa = (kxx * cyy + kyy * cxx - kxy * cyx - kyx * cxy) / (cxx + cyy)
    square = ((kxx - kappa) * (kyy - kappa) - kxy * kyx) / (cxx * cyy - cxy * cyx)
    whirls, held = square > 0, kappa > 0
    safe = jnp.where(whirls, square, 1.0)
    speed = jnp.where(whirls, jnp.sqrt(jnp.where(held, kappa, 1.0) / safe), jnp.inf)
    return WhirlThreshold(jnp.where(held, speed, 0.0), jnp.where(whirls, jnp.sqrt(safe), jnp.nan))
