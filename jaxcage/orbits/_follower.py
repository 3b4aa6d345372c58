"""What the lanes of one continuation of orbits over a parameter share, its first points, and multipliers along it."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._errors import ArgumentError
from .._types import Scalar
from ..solve import AbstractMethod
from ._arclength import Corrected, Curves, settle_on, stack, take
from ._orbit import OrbitEquations
from ._problem import SPEED, Given, OrbitProblem, Parameter, make_problem
from ._steps import Counts, counted, stiff


Start = tuple[np.ndarray, float]
"""A state [SI] and the value of the parameter."""


class Follower(eqx.Module):
    """What all lanes of one continuation share."""

    problem: OrbitProblem
    counts: Counts
    given: Given
    lower: float
    upper: float

    @property
    def unit(self) -> float:
        """Unit of the parameter."""
        return (self.upper - self.lower) / 20

    @property
    def parameter(self) -> Parameter:
        return self.problem.parameters[0]

    def around(self, at: Scalar, periods: Any = None) -> "Follower":
        """The same in the system's scale at a value of the parameter, with other periods if they are given."""
        there, mine = self.given.changed(self.parameter, jnp.asarray(at, dtype=float)), self.problem
        periods = mine.periods if periods is None else periods
        problem = make_problem(there, mine.parameters, mine.units, periods, mine.method)
        return dataclasses.replace(self, problem=problem)

    def curves(self, lanes: int) -> Curves:
        """The branches of so many lanes."""
        return Curves(stack(OrbitEquations(self.problem), lanes), self.given, self.counts)

    def inside(self, u: np.ndarray) -> np.ndarray:
        """Whether the parameter is within the range."""
        value = u[..., -1] * self.unit
        return (value > self.lower) & (value < self.upper)

    def monodromy(self, points: Corrected) -> np.ndarray:
        n = self.problem.dimension
        return points.jacobian[..., :n, :n] + np.eye(n)

    def multipliers(self, points: Corrected) -> np.ndarray:
        """Those of each orbit, the largest first."""
        return eigenvalues(self.monodromy(points))

    def unstable(self, points: Corrected, circle: float = 1.0) -> Any:
        """How many multipliers of each orbit are outside a circle."""
        return np.sum(~(np.abs(self.multipliers(points)) < circle), axis=-1)


AT_THE_END = 1e-9
"""How far beyond its range a parameter may be, of the larger end: rounding of speeds in rpm is less."""


def require_range(parameter: Parameter, lower: float, upper: float) -> None:
    """**Raises:** `ArgumentError` for a range in which a parameter cannot be followed."""
    if not lower < upper:
        raise ArgumentError("upper", said=f"must be above `lower`, but they are {upper:g} and {lower:g}.")
    if not -math.inf < lower < upper < math.inf:
        raise ArgumentError("lower", "upper", said=f"must be finite, but are {lower:g} and {upper:g}.")
    if parameter == SPEED and lower <= 0:
        raise ArgumentError("lower", said=f"must be positive where the speed is followed, but {lower:g} was given.")


def require_within(name: str, at: float, lower: float, upper: float) -> None:
    """**Raises:** `ArgumentError` for an orbit outside the range in which it is to be followed."""
    slack = AT_THE_END * max(abs(lower), abs(upper))
    if at < lower - slack or at > upper + slack:
        said = f"must begin from {lower:g} to {upper:g}, `lower` and `upper`, but is at {at:g}."
        raise ArgumentError(name, said=said)


def make_follower(
    given: Given, parameter: Parameter, lower: float, upper: float, method: AbstractMethod | None, periods: int = 1
) -> Follower:
    """A follower in the system's scale at its own speed."""
    chosen, counts = counted(method)
    problem = make_problem(given, (parameter,), [(upper - lower) / 20], periods, chosen)
    return Follower(problem, counts, given, lower, upper)


def seeds(follower: Follower, starts: Sequence[Start], likely: np.ndarray | None = None) -> Corrected:
    """Orbits near (state, value of the parameter), the parameter kept, the lanes first; for those that are not `likely`
    only few steps are tried."""
    u = np.array([[*(s / np.asarray(follower.problem.scale)), p / follower.unit] for s, p in starts])
    normal = np.zeros_like(u)
    normal[:, -1] = 1.0
    return settle_on(follower.curves(len(u)), u, normal, likely=likely)


def stable_steps(follower: Follower, start: Start) -> Follower:
    """The follower itself or, where it chooses its steps and Runge-Kutta's are not stable, one with Rodas4."""
    if not follower.counts.tolerance > 0:
        return follower
    (u,) = seeds(follower.around(start[1]), [start]).jacobian
    return follower if np.all(np.isfinite(u)) else by_rodas4(follower)


def by_rodas4(follower: Follower) -> Follower:
    """The follower with Rodas4, as many steps as are needed."""
    return eqx.tree_at(lambda f: (f.problem.method, f.counts), follower, stiff())


def turned(points: Corrected, sign: Any) -> Corrected:
    """The same points, to be followed the other way where `sign` is -1."""
    return points._replace(tangent=points.tangent * np.asarray(sign)[..., None])


def in_a_row(back: Corrected, ahead: Corrected) -> Corrected:
    """The points of two directions from one point as one row, from the end of the first to that of the second."""
    back = turned(take(back, np.arange(len(back.u) - 1, 0, -1)), -1.0)
    return jax.tree.map(lambda a, b: np.concatenate([a, b]), back, ahead)


def eigenvalues(monodromy: np.ndarray) -> np.ndarray:
    """Multipliers, the largest first."""
    mu = np.linalg.eigvals(monodromy).astype(complex)
    return np.take_along_axis(mu, np.argsort(-np.abs(mu), axis=-1), axis=-1)
