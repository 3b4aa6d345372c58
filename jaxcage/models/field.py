"""Fields dy/dtau and their linearisations: what a solver sees of a system at one speed.

A linearisation knows how to solve (shift I - J) u = r. For a second-order system positions are eliminated in closed
form, so that only a system of the size of the velocities is solved: with J = [[0, 1], [A_q, A_v]]/omega,
    u_q = (r_q + u_v/omega) / shift,
    (shift I - A_v/omega - A_q/(shift omega^2)) u_v = r_v + A_q r_q / (shift omega).
"""

import abc
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._pytrees import Scalar, State


Matrix = tuple[tuple[Array, ...], ...]
"""Rows of scalars: lanes stay innermost, and elimination of a small system unrolls into a few operations."""


def lu_factor(a: Matrix) -> Matrix:
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


def _shifted(shift: Scalar, a: Matrix) -> Matrix:
    """shift I - a."""
    return tuple(tuple(shift - c if i == j else -c for j, c in enumerate(row)) for i, row in enumerate(a))


def _trace(a: Matrix) -> Scalar:
    return sum((row[i] for i, row in enumerate(a)), start=jnp.zeros(()))


class AbstractLinearisation(eqx.Module):
    """A field near one point: value, phase derivative, and solves with shift I - Jacobian."""

    value: eqx.AbstractVar[State]
    phase_derivative: eqx.AbstractVar[State]

    @property
    @abc.abstractmethod
    def divergence(self) -> Scalar:
        """Trace of the Jacobian."""

    @abc.abstractmethod
    def solver(self, shift: Scalar) -> Callable[[State], State]:
        """r -> (shift I - J)^-1 r, factorised once."""


class DenseLinearisation(AbstractLinearisation):
    """Full Jacobian of a first-order system."""

    value: State
    phase_derivative: State
    jacobian: Matrix

    @property
    def divergence(self) -> Scalar:
        return _trace(self.jacobian)

    def solver(self, shift: Scalar) -> Callable[[State], State]:
        lu = lu_factor(_shifted(shift, self.jacobian))
        return lambda r: lu_solve(lu, r)


class SecondOrderLinearisation(AbstractLinearisation):
    """Stiffness and damping matrices of a second-order system, per unit mass."""

    value: State
    phase_derivative: State
    a_q: Matrix  # d acceleration / d coordinates
    a_v: Matrix  # d acceleration / d velocities
    speed: Scalar

    @property
    def divergence(self) -> Scalar:
        return _trace(self.a_v) / self.speed

    def solver(self, shift: Scalar) -> Callable[[State], State]:
        rate = 1 / self.speed
        per_shift = 1 / shift
        lever = rate * per_shift
        n = len(self.a_q)
        a = tuple(
            tuple(rate * (v + lever * q) for v, q in zip(*rows, strict=True))
            for rows in zip(self.a_v, self.a_q, strict=True)
        )
        lu = lu_factor(_shifted(shift, a))

        def solve(r: State) -> State:
            r_q, r_v = r[:n], r[n:]
            known = tuple(r_v[i] + lever * sum(self.a_q[i][j] * r_q[j] for j in range(n)) for i in range(n))
            u_v = lu_solve(lu, known)
            return (*((r_q[i] + rate * u_v[i]) * per_shift for i in range(n)), *u_v)

        return solve


class AbstractField(eqx.Module):
    """dy/dtau of a system at one speed."""

    @abc.abstractmethod
    def __call__(self, tau: Scalar, y: State) -> State:
        """dy/dtau at phase `tau`."""

    @abc.abstractmethod
    def linearise(self, tau: Scalar, y: State) -> AbstractLinearisation:
        """The field's value and derivatives at one point."""


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

    def linearise(self, tau: Scalar, y: State) -> AbstractLinearisation:
        value, slope = _phase_derivative(lambda t: self(t, y), tau)
        return DenseLinearisation(value, slope, _columns(lambda z: self(tau, z), y))


class SecondOrderField(AbstractField):
    """dq/dtau = v / speed, dv/dtau = acceleration(tau, q, v) / speed."""

    acceleration: Callable[[Scalar, State, State], State]
    speed: Scalar

    def __call__(self, tau: Scalar, y: State) -> State:
        n = len(y) // 2
        q, v = y[:n], y[n:]
        rate = 1 / self.speed
        return (*(c * rate for c in v), *(c * rate for c in self.acceleration(tau, q, v)))

    def linearise(self, tau: Scalar, y: State) -> AbstractLinearisation:
        n = len(y) // 2
        q, v = y[:n], y[n:]
        value, slope = _phase_derivative(lambda t: self(t, y), tau)
        a_q = _columns(lambda z: self.acceleration(tau, z, v), q)
        a_v = _columns(lambda z: self.acceleration(tau, q, z), v)
        return SecondOrderLinearisation(value, slope, a_q, a_v, self.speed)


class ScaledLinearisation(AbstractLinearisation):
    """A linearisation in units of `scale`."""

    value: State
    phase_derivative: State
    inner: AbstractLinearisation
    scale: State

    @property
    def divergence(self) -> Scalar:
        return self.inner.divergence

    def solver(self, shift: Scalar) -> Callable[[State], State]:
        solve = self.inner.solver(shift)
        return lambda r: divide(solve(multiply(r, self.scale)), self.scale)


class ScaledField(AbstractField):
    """A field in units of `scale`, so that one tolerance fits positions and velocities alike."""

    field: AbstractField
    scale: State

    def __call__(self, tau: Scalar, y: State) -> State:
        return divide(self.field(tau, multiply(y, self.scale)), self.scale)

    def linearise(self, tau: Scalar, y: State) -> AbstractLinearisation:
        inner = self.field.linearise(tau, multiply(y, self.scale))
        value, slope = divide(inner.value, self.scale), divide(inner.phase_derivative, self.scale)
        return ScaledLinearisation(value, slope, inner, self.scale)


def multiply(y: State, scale: State) -> State:
    """Each component times its scale."""
    return tuple(c * s for c, s in zip(y, scale, strict=True))


def divide(y: State, scale: State) -> State:
    """Each component over its scale."""
    return tuple(c / s for c, s in zip(y, scale, strict=True))
