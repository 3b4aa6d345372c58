"""Whether a period doubling or torus bifurcation is super- or subcritical: the cubic coefficient of its normal form.

With the return map P at its fixed point, A its derivative, B and C its second and third, A q = mu q and p A = mu p with
|q| = 1 and p q = 1, the coefficients are (Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4)
- of a period doubling  c = p C(q, q, q) / 6 + p B(q, (1 - A)^-1 B(q, q)) / 2, supercritical where it is positive;
- of a torus bifurcation  d = Re(w / mu) / 2  with  w = p C(q, q, q*) + 2 p B(q, (1 - A)^-1 B(q, q*))
  + p B(q*, (mu^2 - A)^-1 B(q, q)), supercritical where it is negative.
All of it follows from A on both sides of the fixed point, along the real and the imaginary part of q: central
differences, extrapolated to the fourth order, with the step at which neighbouring steps agree best.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._arclength import ONCE, Corrected, Curves, correct, take
from ._singularity import null_vectors


KINDS_WITH_ONE = ("period-doubling", "torus")
STEPS = tuple(0.01 / 2**j for j in range(8))
"""Lengths of the differences, in units of the system's scale."""
FEW = STEPS[1:5]
"""As few of them as tell an error."""


class Critical(NamedTuple):
    """Critical multiplier and vectors; real at a period doubling."""

    multiplier: Array
    right: Array
    left: Array


class Coefficient(NamedTuple):
    """The cubic coefficient, and how far it is from those by neighbouring differences and by half the steps of a
    revolution; in units of the system's scale."""

    value: Float[Array, ""]
    error: Float[Array, ""]


def critical_vectors(kind: str, monodromy: Float[Array, "n n"]) -> Critical:
    """Those of the multiplier next to -1, or of the complex one next to the unit circle."""
    if kind == "period-doubling":
        left, right = null_vectors(monodromy + jnp.eye(monodromy.shape[0]))
        return Critical(-jnp.ones(()), right, left / (left @ right))
    mu, v = jnp.linalg.eig(monodromy)
    i = jnp.argmin(jnp.where(jnp.imag(mu) > 1e-9, jnp.abs(jnp.abs(mu) - 1), jnp.inf))
    return Critical(jnp.exp(1j * jnp.angle(mu[i]).astype(mu.dtype)), v[:, i], jnp.linalg.inv(v)[i])


def around(critical: Critical, steps: tuple[float, ...] = STEPS) -> Float[Array, "places n"]:
    """Where the derivative of the map is needed, from the fixed point, in units of the system's scale."""
    q = critical.right
    along = jnp.stack([jnp.real(q), jnp.imag(q)] if jnp.iscomplexobj(q) else [q])
    signed = jnp.outer(jnp.array(steps), jnp.array([1.0, -1.0]))
    moved = jnp.einsum("dn,js->djsn", along, signed)
    return jnp.concatenate([jnp.zeros((1, q.size)), moved.reshape(-1, q.size)])


def coefficient(
    critical: Critical, derivatives: Float[Array, "places n n"], steps: tuple[float, ...] = STEPS
) -> Coefficient:
    """The coefficient from the derivative of the map at the places of `around`."""
    mu, q, p = critical
    a, n = derivatives[0], q.size
    sides = derivatives[1:].reshape(-1, len(steps), 2, n, n)
    h = jnp.array(steps)[None, :, None, None]
    finer = lambda x: ((4 * x[:, 1:] - x[:, :-1]) / 3).astype(q.dtype)
    second = finer((sides[:, :, 0] - sides[:, :, 1]) / (2 * h))
    third = finer((sides[:, :, 0] + sides[:, :, 1] - 2 * a[None, None]) / h**2)
    eye, a = jnp.eye(n, dtype=q.dtype), a.astype(q.dtype)

    def one(b: Array, c: Array) -> Array:
        """From B and C along the parts of q."""
        if not jnp.iscomplexobj(q):
            return p @ c[0] @ q / 6 + p @ b[0] @ jnp.linalg.solve(eye - a, b[0] @ q) / 2
        of_q, (x, y) = b[0] + 1j * b[1], (part(q).astype(q.dtype) for part in (jnp.real, jnp.imag))
        still = jnp.linalg.solve(eye - a, b[0] @ x + b[1] @ y)
        turning = jnp.linalg.solve(mu**2 * eye - a, of_q @ q)
        whole = p @ (c[0] + c[1]) @ q + 2 * p @ of_q @ still + p @ jnp.conj(of_q) @ turning
        return jnp.real(whole / mu) / 2

    found = jax.vmap(one, in_axes=1)(second, third)
    moved = jnp.abs(jnp.diff(found))
    apart = jnp.maximum(moved[:-1], moved[1:])
    best = jnp.argmin(jnp.where(jnp.isfinite(apart), apart, jnp.inf))
    return Coefficient(found[best + 1], apart[best])


def with_half(fine: Coefficient, coarse: Coefficient) -> Coefficient:
    """The first, with its distance to the second, by half the steps of a revolution, in its error."""
    return Coefficient(fine.value, fine.error + abs(fine.value - coarse.value))


def criticality(kind: str, value: Any, error: Any) -> str:
    """`supercritical` or `subcritical`; `unknown` where the coefficient is not known from zero, and nothing for a kind
    that is neither or where there is no coefficient."""
    if kind not in KINDS_WITH_ONE or not abs(value) >= 0:
        return ""
    if not abs(value) > error:
        return "unknown"
    return "supercritical" if (value > 0) == (kind == "period-doubling") else "subcritical"


_vectors = jax.jit(critical_vectors, static_argnums=0)
_around, _coefficient = jax.jit(around, static_argnums=1), jax.jit(coefficient, static_argnums=2)


def coefficients(
    curves: Curves,
    points: Corrected,
    kinds: Sequence[str],
    n: int,
    steps: tuple[float, ...] = STEPS,
    finer: Float[np.ndarray, "#points n"] | None = None,
) -> Float[np.ndarray, "points 2"]:
    """The coefficients at points of curves and their errors, NaN for kinds that have none.

    **Arguments:** curves, one per point, whose first equations and unknowns are those of an orbit; points; kinds;
    dimension of the state; lengths of the differences; the curves' scale over that in whose units the coefficients
    are wanted, by default their own.
    """
    monodromy = lambda found: found.jacobian[:, :n, :n] + np.eye(n)
    mine = [i for i, kind in enumerate(kinds) if kind in KINDS_WITH_ONE]
    found = np.full((len(kinds), 2), np.nan)
    if mine:
        critical = [_vectors(kinds[i], m) for i, m in zip(mine, monodromy(take(points, mine)), strict=True)]
        ways = [np.asarray(_around(c, steps)) for c in critical]
        lane, counts = np.repeat(mine, [len(w) for w in ways]), np.cumsum([len(w) for w in ways])
        at = points.u[lane]
        at[:, :n] += np.concatenate(ways)
        each = []
        for count in (points.steps[lane], (points.steps[lane] + 1) // 2):
            # One step of Newton's method, whose derivative is that at the place itself.
            moved = correct(curves.take(lane), at, points.tangent[lane], count, ONCE)
            parts = np.split(np.where(moved.converged[:, None, None], monodromy(moved), np.nan), counts[:-1])
            each.append([_coefficient(c, part, steps) for c, part in zip(critical, parts, strict=True)])
        found[mine] = [with_half(fine, coarse) for fine, coarse in zip(*each, strict=True)]
        if finer is not None:
            longer = np.stack([np.asarray(c.right) for c in critical]) * np.broadcast_to(finer, (len(kinds), n))[mine]
            found[mine] /= np.sum(np.abs(longer) ** 2, axis=1, keepdims=True)
    return found
