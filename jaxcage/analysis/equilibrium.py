"""Equilibrium of a cage in its film under its weight, and the whirl that unsettles it.

A cage in its guiding rib is a lightly loaded short journal bearing. Ocvirk's load number is
N = W c^2/(mu omega R L^3), with W and L those of one land. The attitude angle runs from the load
line (here -y) to the line of centres, in the direction of rotation (here counter-clockwise):
r = eps (sin phi, -cos phi).

Linear coefficients are K = -dF/dr and C = -dF/dv, in units of W/c and W/(c omega). Friswell et al.,
Dynamics of Rotating Machines (2010), p. 177, give them in closed form with u across the load, v on
the load line and the rotation from u to v: entry by entry ours, with u = x and v = y.

For a rigid mass M the characteristic polynomial of M r'' + C r' + K r = 0 has a pair +- i nu omega
at M omega^2 c/W = omega^2 c/g = kappa/nu^2, with kappa = (K_xx C_yy + K_yy C_xx - K_xy C_yx -
K_yx C_xy)/(C_xx + C_yy) and nu^2 = det(K - kappa I)/det C (Routh).
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Complex, Float

from .._arguments import require_x64
from .._errors import ArgumentError
from .._parameters import replace
from .._types import Scalar
from ..forces import AbstractForcing, FilmModel, SynchronousImpact, film_scale, short_film_force
from ..models import CageModel, SecondOrderField, require_speeds


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


def _log_load(u: Array, log_number: Array) -> Array:
    """ln N less its target at eps = s/sqrt(1 + s^2), s = exp(u): smooth, with a slope of 1 to 4."""
    s2 = jnp.exp(2 * u)
    return u + jnp.log1p(s2) + 0.5 * jnp.log(16 * s2 + jnp.pi**2) - jnp.log(4.0) - log_number


def eccentricity_ratio(load_number: Scalar) -> Array:
    """Eccentricity ratio of the half film at a load number: the inverse of `load_number`.

    **Arguments:** load number N > 0.

    **Returns:** eps in (0, 1), to rounding error, by Newton's method; differentiable.

    **Raises:** an error as the computation runs, for a load number that is not positive.
    """
    n = jnp.asarray(load_number, dtype=float)
    n = eqx.error_if(n, ~(n > 0), "Argument `load_number` must be positive.")
    guess = jnp.minimum(jnp.log(4 * n / jnp.pi), jnp.log(n) / 4)
    solver = optx.Newton(rtol=1e-12, atol=1e-12)
    u = optx.root_find(_log_load, solver, guess, args=jnp.log(n), max_steps=64).value
    return jax.lax.rsqrt(1 + jnp.exp(-2 * u))


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


def film_coefficients(eccentricity_ratio: Scalar, film: FilmModel = "fixed_half") -> FilmCoefficients:
    """Static equilibrium and dimensionless dynamic coefficients, by differentiating the film force.

    The half film and the film of positive pressure agree in all of them: at rest the pressurised
    half circle is the same, and what its moving ends add is of second order.

    **Arguments:** eccentricity ratio in (0, 1); film model.
    """
    require_x64()
    eps = jnp.asarray(eccentricity_ratio, dtype=float)

    def force(r: Array, v: Array) -> Array:
        return jnp.stack(short_film_force(film, r[0], r[1], v[0], v[1], 1.0, 0.0))

    still = jnp.zeros(2)
    radial, tangential = force(jnp.stack([eps, jnp.zeros(())]), still)
    number = jnp.sqrt(radial**2 + tangential**2)
    angle = jnp.arctan2(tangential, -radial)
    r = eps * jnp.stack([jnp.sin(angle), -jnp.cos(angle)])
    k, c = jax.jacfwd(force, argnums=(0, 1))(r, still)
    return FilmCoefficients(number, angle, -k / number, -c / number)


class WhirlThreshold(NamedTuple):
    """Where the equilibrium of a rigid mass in its film loses stability."""

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


@eqx.filter_jit
def film_whirl_speed(model: CageModel) -> Array:
    """Speed [rad/s] above which the cage would whirl, in its film under its weight alone.

    Support, contact, supply pressure, forcing and forces of one's own are left out: it is the oil-whirl
    line to lay over a diagram of the full model. On it omega = threshold(eps) sqrt(g/c), with the load number of the
    weight at that speed: one equation for eps. Differentiable with respect to every parameter.

    **Returns:** the speed, infinite beyond 50 000 sqrt(g/c): a weak film that the weight squeezes.

    **Raises:** `ValueError` for the full film, in which the cage whirls at every speed.
    """
    require_x64()
    film, c = model.film, model.clearance
    if film.model == "full":
        raise ArgumentError("model", said="must have a half film, but its film model is 'full'.")
    oil = model.lubricant.dynamic_viscosity
    scale = film.n_lands * film_scale(oil, model.land_radius, film.land_width, c)
    unit = jnp.sqrt(model.gravity / c)
    wanted = model.cage_mass * model.gravity / (scale * unit)

    def at(u: Array) -> tuple[Array, Array]:
        coefficients = film_coefficients(LARGEST_WHIRLING * jax.nn.sigmoid(u), film.model)
        speed, _ = whirl_threshold(coefficients.stiffness, coefficients.damping)
        return coefficients.load_number, speed

    def excess(u: Array, wanted: Array) -> Array:
        number, speed = at(u)
        return jnp.log(number * speed / wanted)

    # Bisection to the last digit: near the largest eps the threshold is all rounding error, and no
    # tolerance on `excess` would be met.
    solver = optx.Bisection(rtol=0.0, atol=0.0, flip=False)
    bounds = dict(lower=-30.0, upper=22.0)
    root = optx.root_find(excess, solver, jnp.zeros(()), wanted, options=bounds, max_steps=64, throw=False)
    beyond = excess(jnp.asarray(22.0), wanted) < 0
    return jnp.where(beyond, jnp.inf, at(root.value)[1] * unit)


class Equilibrium(NamedTuple):
    """A cage at rest in its rib at one speed, with the linearised motion around it."""

    coordinates: Float[Array, " coordinates"]
    """(x_C, y_C), with an elastic rib (x_C, y_C, x_O, y_O) [m]."""
    eccentricity_ratio: Array
    """eps of the cage centre in its clearance circle."""
    attitude_angle: Array
    """From -y to the line of centres, in the direction of rotation [rad]."""
    eigenvalues: Complex[Array, " dim"]
    """Of the linearised motion [1/s]: growth rates and angular frequencies."""

    @property
    def growth_rate(self) -> Array:
        """Largest growth rate [1/s]; the equilibrium is stable where it is negative."""
        return jnp.max(self.eigenvalues.real)

    @property
    def whirl_frequency(self) -> Array:
        """Angular frequency of the least stable mode [rad/s]; over the speed, the whirl ratio."""
        return jnp.abs(self.eigenvalues.imag[jnp.argmax(self.eigenvalues.real)])


def _unforced(model: CageModel) -> CageModel:
    """The model without unbalance, impacts and forces of one's own that the phase alone decides."""
    calm = (jnp.zeros(()), SynchronousImpact(amplitude=jnp.zeros(()), exponent=jnp.ones(())))
    model = eqx.tree_at(lambda m: (m.eccentricity, m.impact), model, calm)
    return replace(model, extra=tuple(law for law in model.extra if not isinstance(law, AbstractForcing)))


def _phase_free(model: CageModel, speed: Scalar, q: Array) -> Array:
    """Positions, checked: what asks for the phase gets none, and says so by what it returns."""
    cage = model.cage_at(speed)
    x, y = (q[0], q[1]) if q.size == 2 else (q[0] - q[2], q[1] - q[3])
    forces = cage.forces(jnp.nan, x, y, 0.0, 0.0)
    own = [jnp.asarray(part) for law in model.extra for part in forces[type(law).__name__][:2]]
    words = "Argument `model` must have an equilibrium, but a force in its `extra` changes with the phase."
    return eqx.error_if(q, jnp.any(~jnp.isfinite(jnp.stack(own))), words) if own else q


def _film_position(model: CageModel, speed: Scalar) -> Float[Array, " coordinates"]:
    """Ocvirk's equilibrium of the film alone, at most at eps = 0.9, in units of the clearance."""
    film, c, oil = model.film, model.clearance, model.lubricant.dynamic_viscosity
    scale = film.n_lands * film_scale(oil, model.land_radius, film.land_width, c)
    number = model.cage_mass * model.gravity / (scale * speed)
    eps = jnp.minimum(eccentricity_ratio(jnp.maximum(number, 1e-6)), 0.9)
    angle = attitude_angle(eps)
    rib = jnp.zeros(model.dimension // 2 - 2)
    return jnp.concatenate([eps * jnp.stack([jnp.sin(angle), -jnp.cos(angle)]), rib])


def _acceleration(field: SecondOrderField, q: Array, v: Array) -> Array:
    return jnp.stack(field.acceleration(0.0, tuple(q), tuple(v)))


def _imbalance(z: Array, args: tuple[SecondOrderField, Array, Scalar]) -> Array:
    """Acceleration at rest at coordinates z c, in units of c omega^2."""
    field, c, speed = args
    return _acceleration(field, z * c, jnp.zeros_like(z)) / (c * speed**2)


@eqx.filter_jit
def _equilibrium(model: CageModel, speed: Array, start: Array | None) -> Equilibrium:
    c, n = model.clearance, model.dimension // 2
    calm = _unforced(model)
    field = calm.at_speed(speed)
    assert isinstance(field, SecondOrderField)
    start = jax.lax.stop_gradient(_film_position(model, speed) if start is None else start)
    solver = optx.Dogleg(rtol=1e-12, atol=1e-12)
    q = c * optx.root_find(_imbalance, solver, start, (field, c, speed), max_steps=256).value
    q = _phase_free(calm, speed, q)
    still = jnp.zeros_like(q)
    a_q, a_v = jax.jacfwd(_acceleration, argnums=(1, 2))(field, q, still)
    matrix = jnp.block([[jnp.zeros((n, n)), jnp.eye(n)], [a_q, a_v]])
    x, y = (q[0], q[1]) if n == 2 else (q[0] - q[2], q[1] - q[3])
    eps = jnp.asarray(model.excursion((*q, *still)))
    return Equilibrium(q, eps, jnp.arctan2(x, -y), jnp.linalg.eigvals(matrix))


def equilibrium(model: CageModel, speed: Scalar, *, start: Float[Array, " coordinates"] | None = None) -> Equilibrium:
    """Where film, support, contact, weight and user-defined forces hold the cage, without unbalance and impacts.

    Differentiable with respect to speed and every parameter, by the implicit function theorem.

    **Arguments:** model; cage speed [rad/s]; where the root find starts [m], by default at Ocvirk's
    equilibrium of the film alone. A nonlinear support can allow more than one equilibrium.

    **Raises:** an error at run time where no equilibrium is found, or a user-defined force changes with the phase (one
    that depends on the phase alone, an `AbstractForcing`, is left out like the unbalance).
    """
    require_x64()
    require_speeds(model, speed)
    first = None if start is None else jnp.asarray(start) / model.clearance
    return _equilibrium(model, jnp.asarray(speed, dtype=float), first)
