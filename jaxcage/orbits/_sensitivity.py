"""How an edge moves with every parameter: derivatives, elasticities, and the identities they must satisfy.

An edge speed w is a rate. Whatever the units of mass, length and time, the same physics must come out, so that with the
exponents a_i of a unit in every parameter p_i
    sum a_i p_i dw/dp_i = 0 for mass and length, = -w for time.
These hold for every kind of edge and test a gradient without any reference.

With P(z, k) = z an orbit and M(z, k) its monodromy matrix, dz = -(M - 1)^-1 dP and dM = M_z dz + M_k dk; a simple
multiplier mu with left and right vectors l, r moves by l dM r / l r. One expansion of the return map to second order
gives all of it, for edges and for the largest multiplier of an orbit.
"""

import concurrent.futures
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from .._form import compiled
from .._notebook import notebook_html
from .._parameters import get, parameter_dimensions, parameter_paths, parameters
from ..models import AbstractForcedSystem, require_speeds
from ..solve import AbstractMethod, cores
from ._bifurcation import TANGENTIAL, Singular, critical_rate
from ._cascade import FEIGENBAUM, Cascade
from ._implicit import expansion, numbers_around, numbers_of
from ._orbit import OrbitEquations, StateLike
from ._point import Point
from ._problem import SPEED, Given, OrbitProblem, make_problem
from ._singularity import Kind, bordered, null_vectors, singular_matrix
from ._steps import GIVEN_UP, MOST_OF_A_POINT, POINT, SETTLED, SLOPE, Counts, by_steps, counted, from_steps, that_serves


PER_RPM = np.pi / 30
POLISHING = 6
POLISHED, SETTLED_TO, NEARBY = 1e-11, 1e-7, 0.5
"""Newton's steps end below the first, must be below the second, and may lead no further than the third, in units of the
system's scale and of a tenth of the speed."""
NEWTON, CLOSED, FAR = 20, 1e-10, 3.0
"""The same of orbits: most steps, size of a last step, and how far an orbit may lie from its guess."""


@dataclasses.dataclass(frozen=True)
class Sensitivity:
    """Derivatives of one edge, or of the width between two, with respect to every parameter."""

    name: str
    kind: str
    value_rpm: float
    derivative: dict[str, float]
    """d value [rpm] / d parameter [SI]."""
    elasticity: dict[str, float]
    """Relative change of the value over the relative change of the parameter."""
    homogeneity: dict[str, float]
    """Relative residuals of the identities for mass, length and time; NaN where a parameter's unit is not known."""
    transversality: float
    """d|mu|/d speed [s] (see `Point`); of a width or limit the smallest one."""
    status: str
    state: Float[np.ndarray, " dim"] | None = None
    """State of the orbit at phase 0 [SI]; of a width or limit None."""
    error_rpm: float = float("nan")
    """Distance of the value to that by half the steps."""
    steps: int = 0
    """Steps per revolution; of a width or limit 0."""

    @property
    def trusted(self) -> bool:
        """Whether the value is a function of the design here."""
        return self.status == "converged"

    def __str__(self) -> str:
        order = sorted(self.elasticity, key=lambda n: -abs(self.elasticity[n]))
        rows = [f"  {n:<28} {self.elasticity[n]:+.6f}" for n in order if self.elasticity[n] != 0.0]
        at = f"{self.kind} at {self.value_rpm:.3f} +- {self.error_rpm:.1g} rpm"
        return "\n".join([f"{self.name}: {at}, elasticities", *rows])

    _repr_html_ = notebook_html


class _Expansion(NamedTuple):
    """The return map and its monodromy matrix around an orbit, in the state and the field's numbers k."""

    image: Float[Array, " dim"]
    monodromy: Float[Array, "dim dim"]
    image_slope: Float[Array, "dim x"]
    monodromy_slope: Float[Array, "dim dim x"]
    of_u: Float[Array, "k n"]
    """Derivatives of k with respect to the unknowns."""


def _expand(problem: OrbitProblem, given: Given, u: Float[Array, " n"]) -> _Expansion:
    numbers = numbers_around(OrbitEquations(problem), u, given)
    (image, monodromy), (image_slope, monodromy_slope) = expansion(problem, u, numbers)
    return _Expansion(image, monodromy, image_slope, monodromy_slope, numbers.of_u)


@compiled
def _pull_back(problem: OrbitProblem, given: Given, u: Array, weight: Array) -> AbstractForcedSystem:
    """d(weight . k) / d system."""
    row = lambda s: numbers_of(problem.prepare(u, Given(s, given.speed)))[0]
    _, pull = eqx.filter_vjp(row, given.system)
    return pull(weight)[0]


def _pulled_back(problem: OrbitProblem, given: Given, u: Array, weight: Array) -> dict[str, float]:
    """d(weight . k) / d parameter [SI]."""
    pulled = _pull_back(problem, given, u, weight)
    return {n: float(get(pulled, path)) for n, path in parameter_paths(given.system).items()}


class _Unfolding(NamedTuple):
    """What is known of a bifurcation point at one orbit."""

    residual: Float[Array, " m"]
    """Newton's step to the point, in the unknowns' units."""
    weight: Float[Array, " k"]
    """Derivatives of the parameter at the point by the numbers of the field."""
    rate: Array
    """d|mu| / d parameter in the parameter's unit (at a fold: the drift along the critical direction)."""


@compiled
def _unfold(kind: Kind, unit: Array, z: Array, around: _Expansion) -> _Unfolding:
    n = z.size
    borders = null_vectors(singular_matrix(kind, around.monodromy))
    scalar = lambda m: bordered(singular_matrix(kind, m), *borders)[0]
    g, slope = jax.value_and_grad(scalar)(around.monodromy)
    known = Singular(around.monodromy, *bordered(singular_matrix(kind, around.monodromy), *borders)[1:])
    closing = around.image_slope - jnp.eye(n, around.image_slope.shape[1])
    whole = jnp.concatenate([closing, jnp.einsum("ij,ijx->x", slope, around.monodromy_slope)[None]])
    of_numbers = whole[:, n:]
    of_unknowns = jnp.concatenate([whole[:, :n], (of_numbers @ around.of_u[:, n])[:, None]], axis=1)
    step = jnp.linalg.solve(of_unknowns, jnp.append(around.image - z, g))
    adjoint = jnp.linalg.solve(of_unknowns.T, jnp.zeros(n + 1).at[-1].set(1.0))
    return _Unfolding(step, -(adjoint @ of_numbers) * unit, critical_rate(kind, n, of_unknowns, known, borders))


class _Edge(NamedTuple):
    """An edge located to rounding, by some number of steps."""

    problem: OrbitProblem
    u: Array
    residual: Array
    weight: Array
    rate: float
    """See `_Unfolding`, here d|mu| / d speed."""
    found: bool
    error: float = float("nan")
    """Distance of the speed to that by half the steps [rad/s]."""
    steps: int = 0

    @property
    def speed(self) -> float:
        return float(self.problem.values(self.u)[0])

    @property
    def status(self) -> str:
        if not self.found:
            return "no such point"
        return "not converged" if self.error > SETTLED * self.speed else "converged"


def _located(system: AbstractForcedSystem, point: Point, method: AbstractMethod | None) -> _Edge:
    """The edge near `point`, solved for again by twice the steps until it stays where it is."""
    return that_serves(lambda chosen, counts: _settled(system, point, chosen, counts), method, MOST_OF_A_POINT)


def _settled(system: AbstractForcedSystem, point: Point, chosen: AbstractMethod, counts: Counts) -> _Edge:
    counts = from_steps(counts, int(point.steps) or None)
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    problem = make_problem(given, (SPEED,), [0.1 * given.speed], point.periods, chosen)
    near = begin = jnp.append(jnp.asarray(point.state) / problem.scale, 10.0)
    edge = None
    for steps in counts.each():
        before, edge = edge, _polished(by_steps(problem, steps), given, point.kind, near)._replace(steps=steps)
        if before is not None:
            both = before.found and edge.found
            edge = edge._replace(error=abs(edge.speed - before.speed) if both else float("inf"))
        known = edge.found or (before is not None and before.found)
        if edge.error <= POINT * edge.speed * float(counts.tolerance) or (steps >= GIVEN_UP and not known):
            break
        near = edge.u if edge.found else begin
    assert edge is not None
    return edge


def _polished(problem: OrbitProblem, given: Given, kind: Any, first: Array) -> _Edge:
    """The edge near the unknowns `first`, by the steps of the problem."""
    u, unit = first, problem.units[0]
    unfold = lambda u: _unfold(kind, unit, u[:-1], _expand(problem, given, u))
    here = unfold(u)
    for _ in range(POLISHING):
        leads = jnp.max(jnp.abs(u - here.residual - first))
        if not bool((jnp.max(jnp.abs(here.residual)) > POLISHED) & (leads < NEARBY)):  # there, lost, or not a number
            break
        u = u - here.residual
        here = unfold(u)
    found = bool(jnp.max(jnp.abs(here.residual)) < SETTLED_TO)
    return _Edge(problem, u, here.residual, here.weight, float(here.rate) / float(unit), found)


def edge_speed(system: AbstractForcedSystem, point: Point, method: AbstractMethod | None = None) -> float:
    """Speed [rad/s] of the edge near `point`; NaN where it is not found, or elsewhere by half the steps."""
    require_x64()
    if point.kind == "branch-point":
        said = "must be a period-doubling, Neimark-Sacker or fold, but it is a branch-point."
        raise ArgumentError("point", said=said)
    edge = _located(system, point, method)
    return edge.speed if edge.status == "converged" else float("nan")


def sensitivity(
    system: AbstractForcedSystem, point: Point, name: str = "edge", method: AbstractMethod | None = None
) -> Sensitivity:
    """Derivatives of an edge speed with respect to every parameter, exact for the equations as integrated.

    The point is located by Newton's method first, and again with twice the steps until it no longer moves.
    `bifurcation` gives the same derivatives, and higher ones.

    **Arguments:** a system whose parameters are declared, such as `CageModel`; a bifurcation over speed, located.

    **Returns:** `Sensitivity`; NaN where Newton's method does not find the point again, or finds it elsewhere with half
    the steps, and for a branch point.
    """
    require_x64()
    if point.kind == "branch-point":  # it is there for the symmetry alone, and no function of the design
        return _nowhere(system, point.kind, name)
    edge = _located(system, point, method)
    if edge.status != "converged":
        return _nowhere(system, point.kind, name, edge.status, edge.error / PER_RPM)
    speed = edge.speed
    slope = _pulled_back(edge.problem, Given(system, jnp.asarray(point.speed, dtype=float)), edge.u, edge.weight)
    change = {n: slope[n] * float(v) / speed for n, v in parameters(system).items()}
    units, bases = parameter_dimensions(system), {"mass": 0.0, "length": 0.0, "time": 1.0}
    return Sensitivity(
        name=name,
        kind=point.kind,
        value_rpm=speed / PER_RPM,
        derivative={n: s / PER_RPM for n, s in slope.items()},
        elasticity=change,
        homogeneity={b: rate + sum(units[n][b] * e for n, e in change.items()) for b, rate in bases.items()},
        transversality=edge.rate,
        status="tangential" if abs(edge.rate * speed) < TANGENTIAL else "converged",
        state=np.asarray(edge.problem.state(edge.u)),
        error_rpm=edge.error / PER_RPM,
        steps=edge.steps,
    )


def _nowhere(
    system: AbstractForcedSystem, kind: str, name: str, status: str = "no such point", error_rpm: float = float("nan")
) -> Sensitivity:
    """What is known of an edge that was not found again, or elsewhere."""
    nan = float("nan")
    row = dict.fromkeys(parameter_paths(system), nan)
    broken: dict[str, float] = dict.fromkeys(("mass", "length", "time"), nan)
    return Sensitivity(name, kind, nan, row, row, broken, nan, status, error_rpm=error_rpm)


def sensitivities(
    system: AbstractForcedSystem, points: Mapping[str, Point], method: AbstractMethod | None = None
) -> dict[str, Sensitivity]:
    """The sensitivity of each named edge, on all cores."""
    require_x64()
    with concurrent.futures.ThreadPoolExecutor(cores()) as pool:
        found = pool.map(lambda name: sensitivity(system, points[name], name, method), points)
        return dict(zip(points, found, strict=True))


def limit_sensitivity(
    system: AbstractForcedSystem, cascade: Cascade, name: str = "limit", method: AbstractMethod | None = None
) -> Sensitivity:
    """The sensitivity of the speed at which a cascade accumulates, extrapolated like that speed itself.

    **Raises:** `ValueError` for a cascade over another parameter than speed, or of fewer than two points.
    """
    if len(cascade.points) < 2 or any(p.parameter != SPEED for p in cascade.points):
        raise ArgumentError("cascade", said=f"must have two points over speed, but has {len(cascade.points)}.")
    before, last = (sensitivity(system, p, name, method) for p in cascade.points[-2:])
    return _combined(name, "period-doubling", ((1 + 1 / (FEIGENBAUM - 1), last), (-1 / (FEIGENBAUM - 1), before)))


def width(onset: Sensitivity, exit_: Sensitivity, name: str = "width") -> Sensitivity:
    """The sensitivity of the width between two edges."""
    return _combined(name, "synchronous-loss", ((1.0, exit_), (-1.0, onset)))


def _combined(name: str, kind: str, parts: Sequence[tuple[float, Sensitivity]]) -> Sensitivity:
    """A weighted sum of edges."""
    total = sum(w * s.value_rpm for w, s in parts)
    first = parts[0][1]
    weighted = lambda rows: sum(w * s.value_rpm * row for (w, s), row in zip(parts, rows, strict=True)) / total
    return Sensitivity(
        name=name,
        kind=kind,
        value_rpm=total,
        derivative={n: sum(w * s.derivative[n] for w, s in parts) for n in first.derivative},
        elasticity={n: weighted([s.elasticity[n] for _, s in parts]) for n in first.elasticity},
        homogeneity={b: weighted([s.homogeneity[b] for _, s in parts]) for b in first.homogeneity},
        transversality=min(abs(s.transversality) for _, s in parts),
        status=next((s.status for _, s in parts if not s.trusted), "converged"),
        error_rpm=sum(abs(w) * s.error_rpm for w, s in parts),
    )


class LeadingMultiplier(NamedTuple):
    """The largest multiplier of the orbit near a guess; NaN where there is none."""

    size: float
    """|mu|: below 1 the orbit is stable."""
    derivative: dict[str, float]
    """d|mu| / d parameter [SI]."""
    state: Float[np.ndarray, " dim"]
    """Of the orbit at phase 0 [SI]."""
    error: float = float("nan")
    """Distance of the size to that by half the steps, infinite where these find no orbit."""
    steps: int = 0
    """Steps per revolution."""


@compiled
def _moved(n: int, around: _Expansion) -> tuple[Array, Array]:
    """|mu|, and its derivatives by the numbers of the field."""
    mu, right = jnp.linalg.eig(around.monodromy)
    left = jnp.linalg.inv(right)  # in rows, with l r = 1
    i = jnp.argmax(jnp.abs(mu))
    closing = around.image_slope[:, :n] - jnp.eye(n)
    orbit = -jnp.linalg.solve(closing, around.image_slope[:, n:])
    matrix = around.monodromy_slope[:, :, n:] + jnp.einsum("abz,zk->abk", around.monodromy_slope[:, :, :n], orbit)
    change = jnp.einsum("a,abk,b->k", left[i], matrix.astype(mu.dtype), right[:, i])
    size = jnp.abs(mu[i])
    return size, jnp.real(jnp.conj(mu[i]) * change) / size


def leading_multiplier(
    system: AbstractForcedSystem,
    speed: float,
    guess: StateLike,
    *,
    periods: int = 1,
    method: AbstractMethod | None = None,
) -> LeadingMultiplier:
    """Size of the largest multiplier of the orbit near `guess` (a state, SI), and its derivatives.

    **Arguments:** a system whose parameters are declared, such as `CageModel`; speed [rad/s]; guess; revolutions after
    which the orbit closes; integration method. Where two multipliers are equal in size, one of them is taken.
    """
    require_x64()
    require_at_least(1, periods=periods)
    require_speeds(system, speed)
    chosen, counts = counted(method)
    at, state = jnp.asarray(speed, dtype=float), jnp.asarray(guess, dtype=float)
    given = Given(system, at)
    problem = make_problem(given, (SPEED,), 0.1 * at[None], periods, chosen)
    first = jnp.append(state / problem.scale, 10.0)
    found, error, steps = None, np.inf, 0
    for steps in counts.each():
        before, found = found, _by_newton(by_steps(problem, steps), given, first if found is None else found[0])
        error = np.inf if found is None or before is None else abs(float(found[1] - before[1]))
        if error <= SLOPE * float(counts.tolerance) or (found is None and steps >= GIVEN_UP):
            break
    if found is None:
        nan, names = float("nan"), parameter_paths(system)
        return LeadingMultiplier(nan, dict.fromkeys(names, nan), np.full(system.dimension, nan), error, steps)
    u, size, weight = found
    slope = _pulled_back(by_steps(problem, steps), given, u, weight)
    return LeadingMultiplier(float(size), slope, np.asarray(problem.state(u)), error, steps)


def _by_newton(problem: OrbitProblem, given: Given, first: Array) -> tuple[Array, Array, Array] | None:
    """The orbit near the unknowns `first`, the size of its largest multiplier, and the derivatives of that."""
    n, u = problem.dimension, first
    for _ in range(NEWTON):
        around = _expand(problem, given, u)
        step = jnp.linalg.solve(around.image_slope[:, :n] - jnp.eye(n), around.image - u[:n])
        size = float(jnp.max(jnp.abs(step)))
        if not size < FAR or float(jnp.max(jnp.abs(u - first))) > FAR:
            return None
        if size < CLOSED:
            return u, *_moved(n, around)
        u = u.at[:n].add(-step)
    return None
