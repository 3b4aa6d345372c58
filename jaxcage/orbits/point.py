"""Bifurcation points of periodic orbits: their kinds, and the matrices and functions that vanish there.

With monodromy matrix M an orbit is at a
- fold, where a multiplier is 1: M - I is singular;
- period doubling, where a multiplier is -1: M + I is singular;
- Neimark-Sacker bifurcation, where a complex pair is on the unit circle: the second compound matrix of M, whose
  eigenvalues are the products mu_i mu_j (i < j), has the eigenvalue 1. So it has at a neutral saddle, a real pair mu
  and 1/mu, which is not a bifurcation; unlike M - exp(i phi) I it is regular where the pair meets at 1 or -1.
The determinants are symmetric functions of all multipliers: nothing jumps when multipliers cross each other.
"""

import enum
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from .._arguments import shown, wrong
from .._errors import ArgumentError
from .._pytrees import Scalar
from ..analysis import Edge
from ..models import AbstractForcedSystem, require_speeds
from ..quantities import notebook_html
from .orbit import Orbit, guess_state
from .problem import SPEED, Parameter, frozen, is_traced, value_of


Kind = Literal["period-doubling", "Neimark-Sacker", "fold"]
"""Kinds of bifurcation that Newton's method solves for; a branch may also have branch points."""
CRITICAL = {
    "period-doubling": -1.0,
    "fold": 1.0,
    "branch-point": 1.0,
    "double period-doubling": -1.0,
    "double branch-point": 1.0,
}
"""Critical multiplier of each kind that has a real one."""
DOUBLE = {"double period-doubling": 2, "double branch-point": 2, "double Neimark-Sacker": 4}
"""Kinds at which two real multipliers or two complex pairs cross the unit circle together, as by a symmetry, and the
number of these multipliers."""
COMPLEX = 1e-5
"""Smallest imaginary part of a complex multiplier; that of a double real one may reach the square root of rounding."""


def _second_compound(m: Float[Array, "n n"]) -> Float[Array, "k k"]:
    """Return all 2 x 2 minors of `m`, k = n (n - 1)/2; the eigenvalues are products of pairs of those of `m`."""
    i, j = np.triu_indices(m.shape[0], 1)
    return m[np.ix_(i, i)] * m[np.ix_(j, j)] - m[np.ix_(i, j)] * m[np.ix_(j, i)]


def critical_of(kind: str) -> Float[Array, ""] | None:
    """Return the critical multiplier of a kind, None for a complex pair."""
    return jnp.asarray(CRITICAL[kind]) if kind in CRITICAL else None


def singular_matrix(critical: Float[Array, ""] | None, m: Float[Array, "n n"]) -> Float[Array, "k k"]:
    """Return the matrix that is singular at a bifurcation of an orbit with monodromy matrix `m`."""
    if critical is None:
        c = _second_compound(m)
        return c - np.eye(c.shape[0])
    return m - critical * np.eye(m.shape[0])


def null_vectors(a: Float[Array, "k k"]) -> tuple[Float[Array, " k"], Float[Array, " k"]]:
    """Return the left and right singular vectors of the smallest singular value of `a`."""
    u, _, vh = jnp.linalg.svd(a)
    return u[:, -1], vh[-1]


def bordered(
    a: Float[Array, "k k"], left: Float[Array, " k"], right: Float[Array, " k"]
) -> tuple[Float[Array, ""], Float[Array, " k"], Float[Array, " k"]]:
    """Return a scalar that vanishes where `a` is singular; unlike the determinant it is well scaled.

    **Arguments:** matrix; vectors not orthogonal to its left and right null vectors.

    **Returns:** g and the vectors q, p of [[a, left], [right, 0]] [q; g] = [0; 1] and of the transposed system; where
    g = 0, they are the right and left null vectors, and dg = -p da q.
    """
    k = a.shape[0]
    whole = jnp.block([[a, left[:, None]], [right[None, :], jnp.zeros((1, 1))]])
    one = jnp.zeros(k + 1).at[-1].set(1.0)
    q = jnp.linalg.solve(whole, one)
    p = jnp.linalg.solve(whole.T, one)
    return q[-1], q[:-1], p[:-1]


def test_functions(multipliers: Complex[np.ndarray, "*points n"]) -> dict[str, Float[np.ndarray, "*points"]]:
    """Return real functions of the multipliers that change sign at a bifurcation, by its kind."""
    mu = np.asarray(multipliers)
    i, j = np.triu_indices(mu.shape[-1], 1)
    product = lambda factors: np.asarray(np.prod(factors, axis=-1).real)
    return {
        "period-doubling": product(mu + 1),
        "Neimark-Sacker": product(mu[..., i] * mu[..., j] - 1),
        "fold": product(mu - 1),
    }


def to_critical(
    critical: Float[Array, ""] | None, multipliers: Complex[Array, "*points n"]
) -> Float[Array, "*points n"]:
    """Return the distances of the multipliers from the critical one, the smallest first, or, if that is None, of those
    of complex pairs from the unit circle; a real pair whose product is 1 is a neutral saddle and does not count."""
    if critical is None:
        off = jnp.where(jnp.abs(multipliers.imag) > COMPLEX, jnp.abs(jnp.abs(multipliers) - 1), jnp.inf)
    else:
        off = jnp.abs(multipliers - critical)
    return jnp.sort(off, axis=-1)


def eigenvalues(monodromy: np.ndarray) -> np.ndarray:
    """Return the multipliers, the largest first."""
    mu = np.linalg.eigvals(monodromy).astype(complex)
    return np.take_along_axis(mu, np.argsort(-np.abs(mu), axis=-1), axis=-1)


Numbers = np.ndarray | Array

UNEXPLAINED = "unexplained"


class Outcome(enum.IntEnum):
    """Outcome of the search for a point."""

    FOUND = 0
    NO_SUCH_POINT = 1  # Newton's method found none
    OTHER_KIND = 2  # the multipliers are not those of the kind requested, as at a neutral saddle
    TANGENTIAL = 3  # the multiplier hardly crosses, so that the value is not a smooth function of the design
    NOT_CONVERGED = 4  # the value changes too much when the steps are halved
    UNEXPLAINED = 5  # the number of unstable multipliers changes but no bifurcation is found
    GIVEN = 6  # not solved for yet


class Point(eqx.Module):
    """A bifurcation of a periodic orbit; if none was found, its numbers are NaN (see `status`).

    - `kind`: `period-doubling`, `Neimark-Sacker`, `fold` or `branch-point`; on a branch also one of `DOUBLE`, at which
        two cross together, and `unexplained`: the number of unstable multipliers changes but no bifurcation is found,
        so that one was missed, or the curve is not one branch. Kind, speed and state of one of the first three are a
        sufficient guess for Newton's method.
    - `speed` [rad/s], `state` at phase 0 [SI] and `value` of the `parameter` [SI], which may be the speed, are
        differentiable. `periods`: revolutions after which the orbit closes; `steps`: steps per revolution.
    - `error`: change of the value with half the steps or, if larger, twice the change with an odd number near three
        quarters of them [SI]; infinite if these do not find it, NaN if the method has no number of steps; for an
        unexplained change the distance within which it lies. Under `jit`, `vmap` and `grad`, and with a
        method of its own, only half are tried.
    - `residual`: largest component of the equations, in units of the scale.
    - `transversality`: d|mu|/d parameter of the critical multiplier along the orbit [1/SI]; at a fold, where that is
        infinite, the drift p dP/d parameter of the map along the critical direction, with p q = 1. It is not computed
        on a branch.
    - `index`, `edge`, on a branch: the orbit before the point; True if a stable orbit is on one side of it.
    """

    kind: str = eqx.field(static=True)
    speed: Scalar
    state: Float[Numbers, " dim"]
    periods: Int[Array, ""] | int = 1
    steps: Int[Array, ""] | int = 0
    parameter: str = eqx.field(static=True, default=SPEED)
    value: Scalar = float("nan")
    error: Scalar = float("nan")
    multipliers: Complex[Numbers, " multipliers"] = eqx.field(default_factory=lambda: np.zeros(0, dtype=complex))
    residual: Scalar = float("nan")
    transversality: Scalar = float("nan")
    outcome: Int[Array, ""] | int = Outcome.GIVEN.value
    index: int = eqx.field(static=True, default=-1)
    edge: bool = eqx.field(static=True, default=False)

    def __post_init__(self) -> None:
        if self.parameter == SPEED:
            self.value = self.speed

    @property
    def speed_rpm(self) -> Scalar:
        """Speed [rpm]."""
        return self.speed * 30 / np.pi

    @property
    def error_rpm(self) -> Scalar:
        """Error of a value that is a speed [rpm]."""
        return self.error * 30 / np.pi

    @property
    def converged(self) -> Bool[Array, ""] | bool:
        """True if a point of this kind was found."""
        return (self.outcome == Outcome.FOUND.value) | (self.outcome == Outcome.TANGENTIAL.value)

    @property
    def trusted(self) -> Bool[Array, ""] | bool:
        """True if it was found and its multiplier crosses at a finite rate: a smooth function of the design."""
        return self.outcome == Outcome.FOUND.value

    @property
    def critical(self) -> complex:
        """Multiplier on the unit circle, of a complex pair the one with positive imaginary part."""
        target, mu = CRITICAL.get(self.kind), np.asarray(self.multipliers)
        if target is not None:
            return complex(mu[np.argmin(np.abs(mu - target))])
        mu = mu[np.imag(mu) > 0] if self.kind.endswith("Neimark-Sacker") else mu
        return complex(mu[np.argmin(np.abs(np.abs(mu) - 1))])

    @property
    def angle(self) -> float:
        """Angle [rad] of the critical multiplier, pi at a period doubling; NaN if no point was found."""
        return abs(float(np.angle(self.critical))) if bool(self.converged) else float("nan")

    @property
    def status(self) -> str:
        """Status in words: `converged`, or the name of another `Outcome`."""
        outcome = Outcome(int(self.outcome))
        return "converged" if outcome == Outcome.FOUND else outcome.name.lower().replace("_", " ")

    def as_edge(self, kind: str) -> Edge:
        """Return the point as the edge of a zone of `kind` `chaotic` or `unstable`."""
        return Edge(float(self.speed_rpm), float(self.error_rpm), kind, self.kind, "located")

    def __str__(self) -> str:
        if self.status == "given":
            return f"{self.kind} near {float(self.speed_rpm):.3f} rpm, not solved for yet"
        if not bool(self.converged):
            return f"No {self.kind} found: {self.status} (residual {float(self.residual):.1e})"
        angle = f", angle {np.degrees(self.angle):.2f} deg" if self.kind.endswith("Neimark-Sacker") else ""
        error = f" ± {float(self.error_rpm):.1g}" if self.parameter == SPEED else ""
        return (
            f"{self.kind} at {float(self.speed_rpm):.3f}{error} rpm, {self.parameter} = {float(self.value):.9g} "
            f"± {float(self.error):.1g}{angle}, {int(self.steps)} steps\n"
            f"  residual {float(self.residual):.1e}, transversality {float(self.transversality):.3g}, {self.status}"
        )

    _repr_html_ = notebook_html


def require_found(point: Point, name: str = "point") -> None:
    """Raise `ArgumentError` for a point that was not found, so that it has no value."""
    if not np.isfinite(float(point.value)):
        raise ArgumentError(name, said=f"must be one that was found, but this {point.kind} was not.")


class Start(NamedTuple):
    """A state [SI] near an orbit, its speed [rad/s], and the value of the free parameter [SI]."""

    state: Any
    speed: Any
    at: Any


def read_start(
    name: str, guess: Any, system: AbstractForcedSystem, parameter: Parameter, speed: Scalar | None
) -> Start:
    """Return state, speed and value of an orbit, a point, or a pair (state, value). Only the speed has derivatives.

    A `speed` replaces that of an orbit or point, unless it is the parameter.

    **Raises:** `ArgumentError`, for the argument called `name`, if it is none of these or has no speed.
    """
    at: Any
    if isinstance(guess, Orbit | Point):
        state, at = guess.state, value_of(system, guess.speed, parameter)
        speed = guess.speed if speed is None else speed
        if isinstance(guess, Point) and not is_traced(guess):
            require_found(guess, name)
        if isinstance(guess, Point) and guess.parameter == parameter:
            at = guess.value
    else:
        state, at = guess if isinstance(guess, tuple) and len(guess) == 2 else (None, guess)
    if state is None or wrong(Scalar, at):
        said = "must be a state and a number, an `Orbit` or a `Point`"
        raise ArgumentError(name, said=f"{said}, but {shown(guess)} was given.")
    speed = at if parameter == SPEED else speed
    if speed is None:
        raise ArgumentError("speed", said=f"must be given where the parameter is `{parameter}`, but it is not.")
    require_speeds(system, speed)
    state = guess_state(system, speed, state, name)
    return Start(state, jnp.asarray(speed, dtype=float), frozen(jnp.asarray(at, dtype=float)))
