"""Where a periodic orbit loses stability: matrices that are singular there, and test functions that vanish there.

With monodromy matrix M an orbit is at a
- fold, where a multiplier is 1: M - I is singular;
- period doubling, where a multiplier is -1: M + I is singular;
- Neimark-Sacker bifurcation, where a complex pair is on the unit circle: the second compound matrix of M, whose
  eigenvalues are the products mu_i mu_j (i < j), has the eigenvalue 1. It also has at a neutral saddle, a real pair
  mu and 1/mu, which is no bifurcation; and it is regular where the pair meets at 1 or -1, unlike M - exp(i phi) I.
The determinants are symmetric functions of all multipliers: nothing jumps when multipliers cross each other.
"""

from typing import Literal, get_args

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float


Kind = Literal["period-doubling", "Neimark-Sacker", "fold", "branch-point"]
KINDS: tuple[Kind, ...] = get_args(Kind)
CRITICAL = {"period-doubling": -1.0, "fold": 1.0, "branch-point": 1.0}
"""The multiplier that each kind is about, where it is real."""


def second_compound(m: Float[Array, "n n"]) -> Float[Array, "k k"]:
    """All 2 x 2 minors of `m`, k = n (n - 1)/2: its eigenvalues are the products of pairs of eigenvalues of `m`."""
    i, j = np.triu_indices(m.shape[0], 1)
    return m[np.ix_(i, i)] * m[np.ix_(j, j)] - m[np.ix_(i, j)] * m[np.ix_(j, i)]


def singular_matrix(kind: Kind, m: Float[Array, "n n"]) -> Float[Array, "k k"]:
    """The matrix that is singular at a bifurcation of `kind` of an orbit with monodromy matrix `m`."""
    if kind == "period-doubling":
        return m + np.eye(m.shape[0])
    if kind == "Neimark-Sacker":
        c = second_compound(m)
        return c - np.eye(c.shape[0])
    return m - np.eye(m.shape[0])


def null_vectors(a: Float[Array, "k k"]) -> tuple[Float[Array, " k"], Float[Array, " k"]]:
    """Left and right singular vectors of the smallest singular value of `a`."""
    u, _, vh = jnp.linalg.svd(a)
    return u[:, -1], vh[-1]


def bordered(
    a: Float[Array, "k k"], left: Float[Array, " k"], right: Float[Array, " k"]
) -> tuple[Float[Array, ""], Float[Array, " k"], Float[Array, " k"]]:
    """A scalar that vanishes where `a` is singular, smooth and well scaled where the determinant is not.

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
    """Real functions of all multipliers that change sign at a bifurcation of each kind."""
    mu = np.asarray(multipliers)
    i, j = np.triu_indices(mu.shape[-1], 1)
    product = lambda factors: np.asarray(np.prod(factors, axis=-1).real)
    return {
        "period-doubling": product(mu + 1),
        "Neimark-Sacker": product(mu[..., i] * mu[..., j] - 1),
        "fold": product(mu - 1),
    }


def to_critical(kind: str, multipliers: Complex[Array, " n"]) -> Float[Array, ""]:
    """How far the nearest multiplier is from where a bifurcation of `kind` has one: of a Neimark-Sacker bifurcation a
    complex one from the unit circle, since a real pair whose product is 1 is a neutral saddle's."""
    if kind == "Neimark-Sacker":
        return jnp.min(jnp.where(jnp.abs(multipliers.imag) > 1e-9, jnp.abs(jnp.abs(multipliers) - 1), jnp.inf))
    return jnp.min(jnp.abs(multipliers - CRITICAL[kind]))
