"""Fourier integrals of the force of one impact (14), for any pulse width and any number of bounces.

In units of the contact's depth P, of v_0 and of P/v_0, with p = w^9 and dt = 9 w^8 ds, motion in contact is
    dw/ds = r,   dr/ds = 9 w^8 (-w^10 + kappa B),   dv/ds = -9 w^8 beta w^10,   dB/ds = 9 w^8 kappa (v - r)
for the penetration p, its rate r, the roller's velocity v and kappa times the bar's position B. These are polynomials:
motion and force are analytic in s even at the instant of contact, where they vary as t^(10/9) in time, and Gauss
collocation needs few steps. The last step of a contact uses w instead of s as its variable and so ends at w = 0
(Hénon). Between contacts the motion of roller and bar has a closed form.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .._pytrees import Scalar


NODES = 16
SWEEPS = 14
"""Fixed-point iterations in a step."""
CONVERGED = 1e-13
SMOOTH = 1e-9
"""Largest allowed last Legendre coefficient of a step; results of the step are accurate to its square."""
PHASE = 8.0
"""Largest phase of the highest harmonic in a step [rad]; time is nonlinear in the step's variable."""
MOST_STEPS = 20_000


def _collocation() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights of the integrals from 0 to each Gauss point of (0, 1) and to 1, and of the last two Legendre terms."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    eye = np.eye(NODES)
    values = np.stack([np.polynomial.legendre.legval(x, e) for e in eye])
    to_coefficients = (2 * np.arange(NODES)[:, None] + 1) / 2 * values * w
    integrals = [np.polynomial.legendre.legint(e, lbnd=-1) for e in eye]
    inner = np.stack([np.polynomial.legendre.legval(x, c) for c in integrals], axis=1) @ to_coefficients / 2
    return inner, w / 2, to_coefficients[-2:]


INNER, WHOLE, LAST = _collocation()


class _Motion(NamedTuple):
    """Motion of roller and bar, in the units above."""

    w: Array
    r: Array
    v: Array
    bar: Array
    time: Array


class _State(NamedTuple):
    motion: _Motion
    step: Float[Array, ""]
    done: Bool[Array, ""]
    cosine: Float[Array, " harmonics"]
    sine: Float[Array, " harmonics"]
    steps: Int[Array, ""]


def pulse_integrals(share: Scalar, swing: Scalar, phase: Scalar, harmonics: int) -> Float[Array, "2 harmonics"]:
    """Integrals of q cos(k phase t) and q sin(k phase t) over one impact, k = 0 to `harmonics`.

    **Arguments:** the bar's share beta = M_c/(M_w + M_c) of the mass; `swing`, the bar's angular frequency kappa, and
    the `phase` of the first harmonic in a unit of time; the number of harmonics.

    **Returns:** integrals in units of m v_0 with m = M_w beta, and of P/v_0 with P = (m v_0^2/K)^(9/19); NaN for an
    impact that takes more than `MOST_STEPS`.
    """
    return _program(harmonics)(jnp.stack([share, swing, phase]))


@functools.cache
def _program(harmonics: int) -> Callable[[Array], Array]:
    return jax.jit(_differentiable(functools.partial(_integrals, harmonics=harmonics)))


def _differentiable(f: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """`f` of a vector, differentiable to any order in both modes, though its loop has no reverse mode."""
    whole = jax.custom_jvp(f)

    @whole.defjvp
    def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
        (x,), (x_dot,) = primals, tangents
        return whole(x), _differentiable(jax.jacfwd(f))(x) @ x_dot

    return whole


def _integrals(x: Float[Array, "3"], harmonics: int) -> Float[Array, "2 harmonics"]:
    share, swing, phase = x
    order = jnp.arange(harmonics + 1, dtype=float)
    zero, one = jnp.zeros_like(share), jnp.ones_like(share)
    begin = _State(
        _Motion(zero, one, one, zero, zero), 0.3 * one, jnp.asarray(False), 0 * order, 0 * order, jnp.asarray(0)
    )

    def advance(state: _State) -> _State:
        return _advance(state, share, swing, phase, order)

    end = jax.lax.while_loop(lambda s: ~s.done & (s.steps < MOST_STEPS), advance, begin)
    return jnp.where(end.done, jnp.stack([end.cosine, end.sine]), jnp.nan)


def _advance(state: _State, share: Array, swing: Array, phase: Array, order: Array) -> _State:
    """One step in contact, kept if it converges, and the motion without contact after the last step."""
    at, highest = state.motion, phase * order[-1]
    leaving = (at.r < 0) & (-at.r * state.step >= at.w)
    step = jnp.where(leaving, at.w, state.step)
    nodes, weight, defect, tail = _contact_step(at, step, leaving, share, swing)
    inside = weight @ jnp.stack([-share * nodes.w**10, swing * (nodes.v - nodes.r), jnp.ones_like(nodes.w)], axis=1)
    turn = highest * inside[2]
    size = jnp.maximum(defect / CONVERGED, 1e-30) ** (-1 / (2 * SWEEPS))
    size = jnp.minimum(size, jnp.maximum(tail / SMOOTH, 1e-30) ** (-1 / NODES))
    size = jnp.minimum(size, PHASE / jnp.maximum(turn, 1e-30))
    fine = (defect <= CONVERGED) & (tail <= SMOOTH) & (turn <= 1.25 * PHASE)
    longer = jnp.where(fine, jnp.clip(0.9 * size, 0.3, 2.0), jnp.clip(0.8 * size, 0.1, 0.7))
    longer = jnp.where(jnp.isnan(longer), 0.3, longer)
    # A step that would have ended the contact and did not converge is repeated in s with a smaller step size.
    taken = jnp.where(leaving & ~fine, at.w / -jnp.where(leaving, at.r, -1.0), state.step)

    force = weight * nodes.w**10
    angle = phase * jnp.outer(order, nodes.time)
    keep = lambda new, old: jnp.where(fine, new, old)
    speed = jnp.where(leaving, -1 / nodes.r, 1.0)
    moved = _Motion(
        jnp.where(leaving, 0.0, at.w + step * jnp.dot(WHOLE, nodes.r * speed)),
        at.r + weight @ (swing * nodes.bar - nodes.w**10),
        at.v + inside[0],
        at.bar + inside[1],
        at.time + inside[2],
    )
    moved = jax.tree.map(keep, moved, at)
    apart = fine & leaving
    flown, again = jax.lax.cond(apart, lambda m: _flight(m, swing), lambda m: (m, jnp.asarray(True)), moved)
    rate = jnp.maximum(flown.r, 1e-12)
    fresh = 0.3 * rate ** (2 / 19 - 1)
    return _State(
        flown,
        jax.lax.stop_gradient(jnp.where(apart, fresh, longer * taken)),
        apart & ~again,
        keep(state.cosine + jnp.cos(angle) @ force, state.cosine),
        keep(state.sine + jnp.sin(angle) @ force, state.sine),
        state.steps + 1,
    )


def _contact_step(
    at: _Motion, step: Array, leaving: Array, share: Array, swing: Array
) -> tuple[_Motion, Array, Array, Array]:
    """Collocation at Gauss points, in s or, if `leaving`, in -w.

    **Returns:** motion at the points; time weights; last change of the iteration; largest of the last Legendre
    coefficients.
    """
    inner = jnp.asarray(INNER)

    def pace(r: Array) -> Array:
        return jnp.where(leaving, -1 / jnp.where(leaving, r, 1.0), 1.0)

    def sweep(_: Int[Array, ""], guess: tuple[_Motion, Array]) -> tuple[_Motion, Array]:
        y, _ = guess
        r = at.r + step * (inner @ (pace(y.r) * 9 * y.w**8 * (swing * y.bar - y.w**10)))
        w = at.w + step * (inner @ (pace(r) * r))
        rate = pace(r) * 9 * w**8
        v = at.v - step * (inner @ (rate * share * w**10))
        bar = at.bar + step * (inner @ (rate * swing * (v - r)))
        change = jnp.max(jnp.abs(jnp.stack([w - y.w, r - y.r, bar - y.bar])))
        return _Motion(w, r, v, bar, y.time), change

    everywhere = jnp.ones(NODES)
    first = jax.tree.map(lambda c: c * everywhere, at)
    nodes, defect = jax.lax.fori_loop(0, SWEEPS, sweep, (first, jnp.zeros(())))
    rate = pace(nodes.r) * 9 * nodes.w**8
    nodes = nodes._replace(time=at.time + step * (inner @ rate))
    tail = jnp.max(jnp.abs(jnp.asarray(LAST) @ jnp.stack([nodes.w, nodes.r, nodes.bar, rate * step], axis=1)))
    return nodes, step * jnp.asarray(WHOLE) * rate, defect, tail


def _flight(at: _Motion, swing: Array) -> tuple[_Motion, Array]:
    """Motion at the next contact, and True if there is one.

    With theta = kappa t and u = v - r the gap times kappa is G = B (cos theta - 1) + u sin theta - v theta. It first
    rises to a maximum, then falls to a minimum; successive minima rise if v < 0 and fall if v > 0. Newton's method from
    the inflection point between maximum and minimum converges to the root without passing it.
    """
    bar, u, v = at.bar, at.v - at.r, at.v
    reach, lag = jnp.sqrt(bar * bar + u * u), jnp.arctan2(u, bar)
    gap = lambda t: bar * (jnp.cos(t) - 1) + u * jnp.sin(t) - v * t
    slope = lambda t: u * jnp.cos(t) - bar * jnp.sin(t) - v
    turn = 2 * jnp.pi
    stops = reach > jnp.abs(v)
    lean = jnp.arcsin(jnp.where(stops, v / jnp.where(stops, reach, 1.0), 0.0))
    # G' = 0 where sin(theta - lag) = -v/reach; G falls from theta - lag = -lean to pi + lean, with inflection at pi/2.
    top = jnp.mod(lag - lean, turn)
    low = top + jnp.pi + 2 * lean
    deep = gap(low)
    turns = jnp.where((v > 0) & (deep > 0), jnp.ceil(deep / (turn * jnp.where(v > 0, v, 1.0))), 0.0)
    again = stops & ((deep <= 0) | (v > 0))
    middle = top + lean + jnp.pi / 2 + turn * turns

    def newton(t: Array) -> Array:
        steep = slope(t)
        return t - gap(t) / jnp.where(again & (steep < 0), steep, -1.0)

    def unfinished(carry: tuple[Array, Array, Array]) -> Array:
        t, before, count = carry
        return again & (jnp.abs(t - before) > 1e-13 * t) & (count < 60)

    start = jax.lax.stop_gradient((newton(middle), middle))
    hold = jax.lax.while_loop(unfinished, lambda c: (newton(c[0]), c[0], c[2] + 1), (*start, jnp.asarray(0)))[0]
    root = newton(newton(jax.lax.stop_gradient(hold)))  # these two iterations carry the derivatives
    c, s = jnp.cos(root), jnp.sin(root)
    there = _Motion(jnp.zeros_like(v), v - (u * c - bar * s), v, bar * c + u * s, at.time + root / swing)
    return jax.tree.map(lambda a, b: jnp.where(again, a, b), there, at), again
