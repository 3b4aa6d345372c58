"""Fields dy/dtau and their linearisations: what a solver sees of a system at one speed.

A linearisation knows how to solve (shift I - J) u = r. For a second-order system positions are eliminated in closed
form, so that only a system of the size of the velocities is solved: with J = [[0, 1], [A_q, A_v]]/omega,
    u_q = (r_q + u_v/omega) / shift,
    (shift I - A_v/omega - A_q/(shift omega^2)) u_v = r_v + A_q r_q / (shift omega).
"""

import abc
from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._pytrees import Scalar, State


Matrix = tuple[tuple[Array, ...], ...]
"""Rows of scalars: lanes stay innermost, and elimination of a small system unrolls into a few operations."""


def lu_factor(a: Sequence[Sequence[Array]]) -> Matrix:
    """LU factors of a small matrix of scalars, without pivoting; the diagonal holds the inverse pivots.

    No pivoting: the matrices here are shift I - J with a shift of the order of 1/step, close to a multiple of I where
    the problem is not stiff and dominated by a damping or stiffness matrix with positive diagonal where it is.
    """
    rows = [list(row) for row in a]
    n = len(rows)
    for k in range(n):
        rows[k][k] = 1 / rows[k][k]
        for i in range(k + 1, n):
            rows[i][k] = rows[i][k] * rows[k][k]
            for j in range(k + 1, n):
                rows[i][j] = rows[i][j] - rows[i][k] * rows[k][j]
    return tuple(tuple(row) for row in rows)


def lu_solve(lu: Matrix, r: State) -> State:
    """Solve with the factors of `lu_factor`."""
    n, x = len(lu), list(r)
    for i in range(n):
        for j in range(i):
            x[i] = x[i] - lu[i][j] * x[j]
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            x[i] = x[i] - lu[i][j] * x[j]
        x[i] = x[i] * lu[i][i]
    return tuple(x)


class Linearisation(eqx.Module):
    """A field near one point: value, phase derivative, and solves with shift I - Jacobian.

    Of a second-order system the coordinates, of a first-order one nothing, are eliminated before the solve.
    """

    value: State
    phase_derivative: State
    a_q: Matrix
    """Derivative of the acceleration with respect to the coordinates; empty for a first-order system."""
    a_v: Matrix
    """Derivative of the acceleration with respect to the velocities, or of the rates with respect to the state."""
    rate: Scalar
    """Factor from rates over time to rates over the phase, for both."""
    scale: State | None = None
    """Units of value and solves, where the field is in units of a scale."""

    @property
    def divergence(self) -> Scalar:
        """Trace of the Jacobian."""
        return self.rate * sum((row[i] for i, row in enumerate(self.a_v)), start=jnp.zeros(()))

    def solver(self, shift: Scalar) -> Callable[[State], State]:
        """r -> (shift I - J)^-1 r, factorised once."""
        n, per_shift = len(self.a_q), 1 / shift
        lever = self.rate * per_shift
        a = self.a_v
        if n:
            pairs = zip(self.a_v, self.a_q, strict=True)
            a = tuple(tuple(v + lever * q for v, q in zip(*rows, strict=True)) for rows in pairs)
        shifted = [[-self.rate * c for c in row] for row in a]
        for i, row in enumerate(shifted):
            row[i] = shift + row[i]
        lu = lu_factor(shifted)

        def solve(r: State) -> State:
            if self.scale is not None:
                r = multiply(r, self.scale)
            r_q, r_v = r[:n], r[n:]
            known = tuple(r_v[i] + lever * sum(a * b for a, b in zip(row, r_q)) for i, row in enumerate(self.a_q))
            u_v = lu_solve(lu, known or r_v)
            u = (*((r_q[i] + self.rate * u_v[i]) * per_shift for i in range(n)), *u_v)
            return u if self.scale is None else divide(u, self.scale)

        return solve


class AbstractField(eqx.Module):
    """dy/dtau of a system at one speed."""

    @abc.abstractmethod
    def __call__(self, tau: Scalar, y: State) -> State:
        """dy/dtau at phase `tau`."""

    def linearise(self, tau: Scalar, y: State) -> Linearisation:
        """The field's value and derivatives at one point, for implicit methods."""
        raise NotImplementedError("This field has no linearisation: its methods are explicit.")


def _columns(f: Callable[[State], State], x: State) -> Matrix:
    """Jacobian of f at x as rows of scalars, by forward differentiation along each coordinate.

    The other coordinates are constants, so that no products with zero tangents are computed.
    """

    def along(i: int) -> State:
        return jax.jvp(lambda c: f((*x[:i], c, *x[i + 1 :])), (x[i],), (jnp.ones_like(x[i]),))[1]

    return tuple(zip(*map(along, range(len(x))), strict=True))


def _phase_derivative(f: Callable[[Scalar], State], tau: Scalar) -> tuple[State, State]:
    tau = jnp.asarray(tau)
    return jax.jvp(f, (tau,), (jnp.ones_like(tau),))


class FirstOrderField(AbstractField):
    """dy/dtau = rates(tau, y) / speed."""

    rates: Callable[[Scalar, State], State]
    speed: Scalar

    def __call__(self, tau: Scalar, y: State) -> State:
        return tuple(c / self.speed for c in self.rates(tau, y))

    def linearise(self, tau: Scalar, y: State) -> Linearisation:
        value, slope = _phase_derivative(lambda t: self(t, y), tau)
        return Linearisation(value, slope, (), _columns(lambda z: self(tau, z), y), 1.0)


class SecondOrderField(AbstractField):
    """dq/dtau = v / speed, dv/dtau = acceleration(tau, q, v) / speed."""

    acceleration: Callable[[Scalar, State, State], State]
    speed: Scalar

    def __call__(self, tau: Scalar, y: State) -> State:
        n = len(y) // 2
        q, v = y[:n], y[n:]
        rate = 1 / self.speed
        return (*(c * rate for c in v), *(c * rate for c in self.acceleration(tau, q, v)))

    def linearise(self, tau: Scalar, y: State) -> Linearisation:
        n = len(y) // 2
        q, v = y[:n], y[n:]
        value, slope = _phase_derivative(lambda t: self(t, y), tau)
        a_q = _columns(lambda z: self.acceleration(tau, z, v), q)
        a_v = _columns(lambda z: self.acceleration(tau, q, z), v)
        return Linearisation(value, slope, a_q, a_v, 1 / self.speed)


class ScaledField(AbstractField):
    """A field in units of `scale`, so that one tolerance fits positions and velocities alike."""

    field: AbstractField
    scale: State

    def __call__(self, tau: Scalar, y: State) -> State:
        return divide(self.field(tau, multiply(y, self.scale)), self.scale)

    def linearise(self, tau: Scalar, y: State) -> Linearisation:
        inner = self.field.linearise(tau, multiply(y, self.scale))
        value, slope = divide(inner.value, self.scale), divide(inner.phase_derivative, self.scale)
        return Linearisation(value, slope, inner.a_q, inner.a_v, inner.rate, self.scale)


def multiply(y: State, scale: State) -> State:
    """Each component times its scale."""
    return tuple(c * s for c, s in zip(y, scale, strict=True))


def divide(y: State, scale: State) -> State:
    """Each component over its scale."""
    return tuple(c / s for c, s in zip(y, scale, strict=True))
