"""Traction of an oil film between roller and raceway: Gupta's law, odd and smooth.

P. K. Gupta, *Advanced Dynamics of Rolling Elements* (Springer 1984), fits measured curves of the traction coefficient
over the sliding speed a >= 0 by kappa_G(a) = (A + B a) exp(-C a) + D.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..._arguments import is_concrete
from ..._errors import ArgumentError
from ..._parameters import parameter
from ..._types import Scalar


class TractionCurve(eqx.Module):
    """Coefficients of kappa(u) = (u/a) [(A + B a) exp(-C a) + D] with a = sqrt(u^2 + u_s^2)."""

    a: Scalar
    b: Scalar
    c: Scalar
    d: Scalar
    smoothing: Scalar
    """u_s, the sliding speed below which the law is linear [m/s]."""

    def __call__(self, sliding: Scalar) -> Array:
        """Traction coefficient at a sliding speed [m/s], of its sign."""
        speed = jnp.sqrt(sliding * sliding + self.smoothing * self.smoothing)
        return sliding / speed * ((self.a + self.b * speed) * jnp.exp(-self.c * speed) + self.d)


class Traction(eqx.Module):
    """Traction curve of the oil, by its values at rest, at the peak and far beyond it."""

    rest: Scalar = parameter("1", 0.0, 0.5, "traction coefficient of Gupta's law at zero sliding", default=0.0)
    peak: Scalar = parameter("1", 1e-4, 0.5, "largest traction coefficient", default=0.05)
    limit: Scalar = parameter("1", 0.0, 0.5, "traction coefficient at large sliding speeds", default=0.036)
    peak_speed: Scalar = parameter("m/s", 1e-3, 100.0, "sliding speed of the largest coefficient", default=1.0)
    traction_smoothing: Scalar = parameter(
        "m/s", 1e-6, 1.0, "sliding speed below which traction is linear in it", default=0.01
    )

    def __check_init__(self) -> None:
        known = (self.rest, self.peak, self.limit)
        if is_concrete(*known) and np.any(
            np.asarray(self.peak) <= np.maximum(*map(np.asarray, (self.rest, self.limit)))
        ):
            rest, peak, limit = map(float, known)
            raise ArgumentError(
                "peak", said=f"must be above `rest` and `limit`, but is {peak:g} beside {rest:g} and {limit:g}."
            )

    @property
    def curve(self) -> TractionCurve:
        """The law whose maximum is `peak`, exactly at `peak_speed`.

        With w = A + B u_m the slope vanishes at u_m if C = B/w, and the value there is the peak if
        w exp(A/w) = e (peak - limit), whose solution is Lambert's function.
        """
        a = self.rest - self.limit
        above = jnp.exp(1.0) * (self.peak - self.limit)
        w = above * jnp.exp(lambert_w(-a / above))
        b = (w - a) / self.peak_speed
        return TractionCurve(a, b, b / w, self.limit, self.traction_smoothing)


def lambert_w(x: Scalar) -> Array:
    """The upper branch of w exp(w) = x for x > -1/e, by Halley's method. Differentiable."""
    x = jnp.asarray(x, dtype=float)
    # Near the branch point w = -1 + p, elsewhere log(1 + x): both within a third of the root.
    p = jnp.sqrt(jnp.maximum(2 * (jnp.exp(1.0) * x + 1), 1e-30))
    start = jnp.where(x < 0, -1 + p - p * p / 3, jnp.log1p(jnp.maximum(x, 0.0)))

    def better(_: Array, w: Array) -> Array:
        e = jnp.exp(w)
        defect = w * e - x
        return w - defect / (e * (w + 1) - (w + 2) * defect / (2 * w + 2))

    root = jax.lax.fori_loop(0, 12, better, jax.lax.stop_gradient(start))
    e = jnp.exp(jax.lax.stop_gradient(root))
    w = jax.lax.stop_gradient(root)
    return w - (w * e - x) / (e * (w + 1))  # one of Newton's steps, which carries the derivative
