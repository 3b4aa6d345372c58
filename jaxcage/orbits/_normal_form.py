"""Super- or subcritical period doublings and Neimark-Sacker bifurcations: the cubic coefficient of the normal form.

With the return map P at its fixed point, A its derivative, B and C its second and third, A q = mu q and p A = mu p with
|q| = 1 and p q = 1, the coefficients are (Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4)
- of a period doubling  c = p C(q, q, q) / 6 + p B(q, (1 - A)^-1 B(q, q)) / 2, supercritical where it is positive;
- of a Neimark-Sacker bifurcation  d = Re(w / mu) / 2  with  w = p C(q, q, q*) + 2 p B(q, (1 - A)^-1 B(q, q*))
  + p B(q*, (mu^2 - A)^-1 B(q, q)), supercritical where it is negative.
All of it follows from A on both sides of the fixed point, along the real and the imaginary part of q: central
differences, extrapolated to the fourth order, with the step at which neighbouring steps agree best. The return map of a
self-excited orbit is that of Poincare, on the plane of its phase condition, the time of the return being another one
from each place.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ._arclength import ONCE, Corrected, Curves, correct, take


KINDS_WITH_ONE = ("period-doubling", "Neimark-Sacker")
STEPS = tuple(0.01 / 2**j for j in range(8))
"""Lengths of the differences, in units of the system's scale."""
FEW = STEPS[1:5]
"""As few of them as tell an error."""
RETURNS = 4
"""Newton steps for the time of return to the plane, which begin at most 0.01 away."""


class Critical(NamedTuple):
    """Critical multiplier and vectors; real at a period doubling."""

    multiplier: complex
    right: np.ndarray
    left: np.ndarray


class Coefficient(NamedTuple):
    """The cubic coefficient, and how far it is from those by neighbouring differences and by half the steps of a
    revolution; in units of the system's scale."""

    value: float
    error: float


def _solved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a^-1 b, NaN where there is none."""
    try:
        return np.linalg.solve(a, b)
    except np.linalg.LinAlgError:
        return np.full(b.shape, np.nan)


def critical_vectors(kind: str, monodromy: Float[Array | np.ndarray, "n n"]) -> Critical:
    """Those of the multiplier next to -1, or of the complex one next to the unit circle."""
    if kind == "period-doubling":
        u, _, vh = np.linalg.svd(monodromy + np.eye(len(monodromy)))
        return Critical(-1.0, vh[-1], u[:, -1] / (u[:, -1] @ vh[-1]))
    mu, v = np.linalg.eig(monodromy)
    i = np.argmin(np.where(np.imag(mu) > 1e-9, np.abs(np.abs(mu) - 1), np.inf))
    return Critical(np.exp(1j * np.angle(mu[i])), v[:, i], _solved(v, np.eye(len(v)))[i])


def normal_form_places(critical: Critical, steps: tuple[float, ...] = STEPS) -> Float[np.ndarray, "places n"]:
    """Where the derivative of the map is needed, from the fixed point, in units of the system's scale."""
    q = critical.right
    along = np.stack([np.real(q), np.imag(q)] if np.iscomplexobj(q) else [q])
    signed = np.outer(steps, [1.0, -1.0])
    moved = np.einsum("dn,js->djsn", along, signed)
    return np.concatenate([np.zeros((1, q.size)), moved.reshape(-1, q.size)])


def normal_form_coefficient(
    critical: Critical, derivatives: Float[Array | np.ndarray, "places n n"], steps: tuple[float, ...] = STEPS
) -> Coefficient:
    """The coefficient from the derivative of the map at the places of `normal_form_places`."""
    mu, q, p = critical
    derivatives = np.asarray(derivatives)
    a, n = derivatives[0], q.size
    sides = derivatives[1:].reshape(-1, len(steps), 2, n, n)
    h = np.array(steps)[None, :, None, None]
    finer = lambda x: (4 * x[:, 1:] - x[:, :-1]) / 3
    second = finer((sides[:, :, 0] - sides[:, :, 1]) / (2 * h))
    third = finer((sides[:, :, 0] + sides[:, :, 1] - 2 * a) / h**2)
    eye = np.eye(n)

    def one(b: np.ndarray, c: np.ndarray) -> float:
        """From B and C along the parts of q."""
        if not np.iscomplexobj(q):
            return p @ c[0] @ q / 6 + p @ b[0] @ _solved(eye - a, b[0] @ q) / 2
        of_q = b[0] + 1j * b[1]
        still = _solved(eye - a, b[0] @ np.real(q) + b[1] @ np.imag(q))
        turning = _solved(mu**2 * eye - a, of_q @ q)
        whole = p @ (c[0] + c[1]) @ q + 2 * p @ of_q @ still + p @ np.conj(of_q) @ turning
        return np.real(whole / mu) / 2

    found = np.array([one(second[:, j], third[:, j]) for j in range(len(steps) - 1)])
    moved = np.abs(np.diff(found))
    apart = np.maximum(moved[:-1], moved[1:])
    best = np.argmin(np.where(np.isfinite(apart), apart, np.inf))
    return Coefficient(found[best + 1], apart[best])


def criticality(kind: str, value: float | np.floating, error: float | np.floating) -> str:
    """`supercritical` or `subcritical`; `unknown` where the coefficient is not known from zero, and nothing for a kind
    that is neither or where there is no coefficient."""
    if kind not in KINDS_WITH_ONE or not abs(value) >= 0:
        return ""
    if not abs(value) > error:
        return "unknown"
    return "supercritical" if (value > 0) == (kind == "period-doubling") else "subcritical"


class _Planes(NamedTuple):
    """The planes of return maps: all of the state of a driven system, across the orbit of a self-excited one."""

    basis: Float[np.ndarray, "points n k"]
    across: Float[np.ndarray, "points n"] | None

    @classmethod
    def of(cls, points: Corrected, n: int, free: bool) -> "_Planes":
        """Through some orbits, which may be `free` to have any period."""
        if not free:
            return cls(np.broadcast_to(np.eye(n), (len(points.u), n, n)), None)
        flow = points.jacobian[:, :n, n]  # the speed's column: the flow at the end, but for its length
        return cls(np.swapaxes(np.linalg.svd(flow[:, None])[2][:, 1:], 1, 2), flow)

    def of_lanes(self, lanes: np.ndarray) -> "_Planes":
        """Some of them."""
        return _Planes(self.basis[lanes], None if self.across is None else self.across[lanes])

    def derivative(self, points: Corrected) -> Float[np.ndarray, "points k k"]:
        """Of the return maps, NaN where a point is none: what ends beside the plane is led to it along the flow."""
        n = self.basis.shape[1]
        moved = points.jacobian[:, :n, :n] + np.eye(n)
        if self.across is not None:
            flow, along = points.jacobian[:, :n, n], self.across[:, None]
            moved = moved - flow[:, :, None] * (along @ moved) / (along @ flow[:, :, None])
        there = points.converged[:, None, None]
        return np.where(there, np.swapaxes(self.basis, 1, 2) @ moved @ self.basis, np.nan)

    def returned(self, curves: Curves, at: np.ndarray, normal: np.ndarray, count: np.ndarray) -> Corrected:
        """One step of Newton's method from `at`, whose derivatives are those at the place itself, after the speeds with
        which they return to the plane."""
        n = self.basis.shape[1]
        along = lambda x: np.sum(x * self.across, axis=1)
        for _ in range(0 if self.across is None else RETURNS):
            found = correct(curves, at, normal, count, ONCE)
            closing = np.einsum("pij,pj->pi", found.jacobian[:, :n], at - found.u)
            at = at.copy()
            at[:, n] -= along(closing) / along(found.jacobian[:, :n, n])
        return correct(curves, at, normal, count, ONCE)


def coefficients(
    curves: Curves,
    points: Corrected,
    kinds: Sequence[str],
    n: int,
    steps: tuple[float, ...] = STEPS,
    finer: Float[np.ndarray, "#points n"] | None = None,
    free: bool = False,
) -> Float[np.ndarray, "points 2"]:
    """The coefficients at points of curves and their errors, NaN for kinds that have none.

    **Arguments:** curves, one per point, whose first equations and unknowns are those of an orbit; points; kinds;
    dimension of the state; lengths of the differences; the curves' scale over that in whose units the coefficients
    are wanted, by default their own; whether the orbits are self-excited, of any period.
    """
    known = np.all(np.isfinite(points.jacobian), axis=(1, 2))
    mine = [i for i, kind in enumerate(kinds) if kind in KINDS_WITH_ONE and known[i]]
    found = np.full((len(kinds), 2), np.nan)
    if mine:
        planes = _Planes.of(take(points, mine), n, free)
        derivatives = planes.derivative(take(points, mine))
        critical = [critical_vectors(kinds[i], m) for i, m in zip(mine, derivatives, strict=True)]
        ways = [normal_form_places(c, steps) for c in critical]
        counts = [len(w) for w in ways]
        lane, planes = np.repeat(mine, counts), planes.of_lanes(np.repeat(np.arange(len(mine)), counts))
        at, counts = points.u[lane], np.cumsum(counts)
        at[:, :n] += (planes.basis @ np.concatenate(ways)[:, :, None])[..., 0]
        each = []
        for count in (points.steps[lane], (points.steps[lane] + 1) // 2):
            moved = planes.returned(curves.take(lane), at, points.tangent[lane], count)
            parts = np.split(planes.derivative(moved), counts[:-1])
            each.append([normal_form_coefficient(c, part, steps) for c, part in zip(critical, parts, strict=True)])
        found[mine] = [(f.value, f.error + abs(f.value - half.value)) for f, half in zip(*each, strict=True)]
        if finer is not None:
            own = planes.basis[np.concatenate([[0], counts[:-1]])]
            longer = np.stack([b @ c.right for b, c in zip(own, critical, strict=True)])
            longer = longer * np.broadcast_to(finer, (len(kinds), n))[mine]
            found[mine] /= np.sum(np.abs(longer) ** 2, axis=1, keepdims=True)
    return found
