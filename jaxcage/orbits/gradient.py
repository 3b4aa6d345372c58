"""Gradients of edges and of multipliers: derivatives, elasticities, and the identities that they must satisfy.

An edge speed w is a rate. Whatever the units of mass, length and time, the same physics must come out, so that with the
exponents a_i of a unit in every parameter p_i
    sum a_i p_i dw/dp_i = 0 for mass and length, = -w for time.
These hold for every kind of edge and test a gradient without any reference.

With P(z, k) = z an orbit and M(z, k) its monodromy matrix, dz = -(M - 1)^-1 dP and dM = M_z dz + M_k dk; a simple
multiplier mu with left and right vectors l, r moves by l dM r / l r. One expansion of the return map to second order
gives all derivatives, for every kind of edge and for the largest multiplier of an orbit, by one compiled program.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from .._arguments import require_x64
from .._errors import ArgumentError
from .._parameters import get, parameter_dimensions, parameter_paths, parameters
from .._pytrees import compiled
from ..models import AbstractForcedSystem
from ..quantities import notebook_html
from ..solve import AbstractMethod
from .bifurcation import ON_CIRCLE, TANGENTIAL, PointEquations, critical_rate
from .branch import FEIGENBAUM, Cascade
from .continuation import in_parallel
from .newton import FieldNumbers, around_root, expansion, numbers_around, numbers_of
from .orbit import Orbit, OrbitEquations, sorted_multipliers
from .point import Kind, Point, eigenvalues, null_vectors, singular_matrix, to_critical
from .problem import SPEED, Given, OrbitProblem, make_problem
from .step_counts import GIVEN_UP, MOST_OF_A_POINT, POINT, SETTLED, Counts, by_steps, with_fallback


PER_RPM = np.pi / 30
ITERATIONS = 6
POLISHED, SETTLED_TO, NEARBY = 1e-11, 1e-7, 0.5
"""Limits of Newton's method, in units of the system's scale and of a tenth of the speed: it ends with a step below the
first, the step must be below the second, and it may lead no further from the guess than the third."""
OUTSIDE = 1e-6  # distance from the unit circle beyond which a multiplier is outside


@dataclasses.dataclass(frozen=True)
class Sensitivity:
    """Derivatives of an edge, or of the width between two edges, with respect to every parameter.

    `derivative` is d value [rpm] / d parameter [SI], `elasticity` the relative change of the value over that of the
    parameter, and `homogeneity` holds the relative residuals of the identities for mass, length and time, NaN if a
    parameter's unit is not known. `transversality` is d|mu|/d speed [s] (see `Point`), for a width or a limit the
    smallest one; `error_rpm` is the distance of the value to that by half the `steps` per revolution. The `state` of
    the orbit at phase 0 [SI] is None for a width or a limit.
    """

    name: str
    kind: str
    value_rpm: float
    derivative: dict[str, float]
    elasticity: dict[str, float]
    homogeneity: dict[str, float]
    transversality: float
    status: str
    state: Float[np.ndarray, " dim"] | None = None
    error_rpm: float = float("nan")
    steps: int = 0
    multipliers: Complex[np.ndarray, " dim"] | None = None

    @property
    def trusted(self) -> bool:
        """Whether the value is a function of the design here."""
        return self.status == "converged"

    @property
    def bounds(self) -> bool:
        """Whether a stable orbit ends here: no multiplier but the critical ones is outside the unit circle."""
        if self.multipliers is None:
            return False
        critical = 2 if self.kind == "Neimark-Sacker" else 1
        nearest = np.sort(np.abs(np.abs(self.multipliers) - 1))[:critical]
        return int(np.sum(np.abs(self.multipliers) > 1 + nearest.max() + OUTSIDE)) == 0

    def __str__(self) -> str:
        order = sorted(self.elasticity, key=lambda n: -abs(self.elasticity[n]))
        rows = [f"  {n:<28} {self.elasticity[n]:+.6f}" for n in order if self.elasticity[n] != 0.0]
        at = f"{self.kind} at {self.value_rpm:.3f} +- {self.error_rpm:.1g} rpm"
        return "\n".join([f"{self.name}: {at}, elasticities", *rows])

    _repr_html_ = notebook_html


@compiled
def _pull_back(problem: OrbitProblem, given: Given, u: Array, weight: Array) -> AbstractForcedSystem:
    """Return d(weight . k) / d system."""
    row = lambda s: numbers_of(problem.prepare(u, Given(s, given.speed)))[0]
    _, pull = eqx.filter_vjp(row, given.system)
    return pull(weight)[0]


def _pulled_back(problem: OrbitProblem, given: Given, u: Array, weight: Array) -> dict[str, float]:
    """Return d(weight . k) / d parameter [SI]."""
    pulled = _pull_back(problem, given, u, weight)
    return {n: float(get(pulled, path)) for n, path in parameter_paths(given.system).items()}


class _Edge(NamedTuple):
    """An edge located to rounding, by some number of steps: Newton's last step in the unknowns' units (`residual`), the
    derivatives of the speed by the field's numbers (`weight`), the rate d|mu| / d speed (at a fold the drift along the
    critical direction), and the distance of the speed to that by half the steps [rad/s] (`error`)."""

    kind: Kind
    problem: OrbitProblem
    u: Array
    residual: Array
    weight: Array
    rate: float
    monodromy: Array
    error: float = float("nan")
    steps: int = 0

    @property
    def speed(self) -> float:
        return float(self.problem.values(self.u)[0])

    @property
    def multipliers(self) -> Complex[np.ndarray, " dim"]:
        return eigenvalues(np.asarray(self.monodromy))

    @property
    def found(self) -> bool:
        return bool(jnp.max(jnp.abs(self.residual)) < SETTLED_TO)

    @property
    def status(self) -> str:
        if not self.found:
            return "no such point"
        if not to_critical(self.kind, jnp.asarray(self.multipliers)) < ON_CIRCLE**0.5:
            return "other kind"  # a neutral saddle
        return "not converged" if self.error > SETTLED * self.speed else "converged"


@compiled
def _unfold(
    kind: Kind, problem: OrbitProblem, u: Array, numbers: FieldNumbers, around: Any, slopes: Any
) -> tuple[Array, Array, Array, Array]:
    """Return Newton's step to the bifurcation near the unknowns u; weight, rate and monodromy there (see `_Edge`)."""
    n, m, unit = problem.dimension, u.size, problem.units[0]
    borders = null_vectors(singular_matrix(kind, around[1]))
    equations = PointEquations(problem, *borders, kind)
    (r, known), (of_r, _) = around_root(equations, u, numbers, around, slopes)
    jacobian = of_r[:, :m] + of_r[:, m:] @ numbers.of_u
    adjoint = jnp.linalg.solve(jacobian.T, jnp.zeros(m).at[-1].set(1.0))
    rate = critical_rate(kind, n, jacobian, known, borders) / unit
    return jnp.linalg.solve(jacobian, r), -(adjoint @ of_r[:, m:]) * unit, rate, known.monodromy


def _located(system: AbstractForcedSystem, point: Point, method: AbstractMethod | None) -> _Edge:
    """Locate the edge near `point`, and again with twice the steps until it stays where it is."""

    def find(chosen: AbstractMethod, counts: Counts) -> _Edge:
        counts = counts.near(int(point.steps) or None)
        given = Given(system, jnp.asarray(point.speed, dtype=float))
        problem = make_problem(given, (SPEED,), [0.1 * given.speed], point.periods, chosen)
        near = begin = jnp.append(jnp.asarray(point.state) / problem.scale, 10.0)
        before, edge = None, None
        for i in range(int(counts.tries)):
            steps = int(counts.steps(i))
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

    return with_fallback(find, method, MOST_OF_A_POINT)


def _polished(problem: OrbitProblem, given: Given, kind: Any, first: Array) -> _Edge:
    """Locate the edge near the unknowns `first` by Newton's method, with the steps of the problem."""
    u, orbit = first, OrbitEquations(problem)
    left = ITERATIONS
    while True:
        numbers = numbers_around(orbit, u, given)
        step, weight, rate, monodromy = _unfold(kind, problem, u, numbers, *expansion(problem, u, numbers))
        leads = jnp.max(jnp.abs(u - step - first))
        goes_on = (jnp.max(jnp.abs(step)) > POLISHED) & (leads < NEARBY)  # not if it is there, lost, or not a number
        if not (left and bool(goes_on)):
            return _Edge(kind, problem, u, step, weight, float(rate), monodromy)
        u, left = u - step, left - 1


def edge_speed(system: AbstractForcedSystem, point: Point, method: AbstractMethod | None = None) -> float:
    """Return the speed [rad/s] of the edge near `point`; NaN if it is not found, or elsewhere by half the steps."""
    require_x64()
    if point.kind == "branch-point":
        said = "must be a period-doubling, Neimark-Sacker or fold, but it is a branch-point."
        raise ArgumentError("point", said=said)
    edge = _located(system, point, method)
    return edge.speed if edge.status == "converged" else float("nan")


def sensitivity(
    system: AbstractForcedSystem, point: Point, name: str = "edge", method: AbstractMethod | None = None
) -> Sensitivity:
    """Return the derivatives of an edge speed with respect to every parameter, exact for the equations as integrated.

    Newton's method locates the point first, and again with twice the steps until it no longer moves. `bifurcation`
    gives the same derivatives, and higher ones.

    **Arguments:** a system whose parameters are declared, such as `CageModel`; a bifurcation over speed, located.

    **Returns:** `Sensitivity`; it is NaN for a branch point, and if Newton's method does not find the point again,
    finds a neutral saddle instead of a Neimark-Sacker bifurcation, or finds it elsewhere with half the steps.
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
        multipliers=edge.multipliers,
    )


def _nowhere(
    system: AbstractForcedSystem, kind: str, name: str, status: str = "no such point", error_rpm: float = float("nan")
) -> Sensitivity:
    """Return the result for an edge that was not found again, or elsewhere."""
    nan = float("nan")
    row = dict.fromkeys(parameter_paths(system), nan)
    broken: dict[str, float] = dict.fromkeys(("mass", "length", "time"), nan)
    return Sensitivity(name, kind, nan, row, row, broken, nan, status, error_rpm=error_rpm)


def sensitivities(
    system: AbstractForcedSystem, points: Mapping[str, Point], method: AbstractMethod | None = None
) -> dict[str, Sensitivity]:
    """Return the sensitivity of each named edge; edges run on all cores."""
    require_x64()
    found = in_parallel(lambda name: sensitivity(system, points[name], name, method), list(points))
    return dict(zip(points, found, strict=True))


def limit_sensitivity(
    system: AbstractForcedSystem, cascade: Cascade, name: str = "limit", method: AbstractMethod | None = None
) -> Sensitivity:
    """Return the sensitivity of the speed at which a cascade accumulates, extrapolated like that speed itself.

    **Raises:** `ValueError` for a cascade over another parameter than speed, or of fewer than two points.
    """
    if len(cascade.points) < 2 or any(p.parameter != SPEED for p in cascade.points):
        raise ArgumentError("cascade", said=f"must have two points over speed, but has {len(cascade.points)}.")
    before, last = (sensitivity(system, p, name, method) for p in cascade.points[-2:])
    return _combined(name, "period-doubling", ((1 + 1 / (FEIGENBAUM - 1), last), (-1 / (FEIGENBAUM - 1), before)))


def width(onset: Sensitivity, exit_: Sensitivity, name: str = "width") -> Sensitivity:
    """Return the sensitivity of the width between two edges."""
    return _combined(name, "synchronous-loss", ((1.0, exit_), (-1.0, onset)))


def _combined(name: str, kind: str, parts: Sequence[tuple[float, Sensitivity]]) -> Sensitivity:
    """Return the sensitivity of a weighted sum of edges."""
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


class OrbitSlopes(NamedTuple):
    """The size of the largest multiplier of an orbit, its derivatives by design variables, shape (n,), and those of the
    state at phase 0 [SI], shape (dim, n)."""

    multiplier: float
    multiplier_slope: Float[np.ndarray, " n"]
    state_slope: Float[np.ndarray, "dim n"]


@compiled
def _numbers_by(
    problem: OrbitProblem, u: Array, speed: Array, designs: Callable[[Array], AbstractForcedSystem], at: Array
) -> Array:
    """Return the derivatives of the field's numbers by the design variables."""
    return jax.jacfwd(lambda x: numbers_of(problem.prepare(u, Given(designs(x), speed)))[0])(at)


@compiled
def _orbit_moves(monodromy: Array, of_r: Array, of_monodromy: Array, by_design: Array) -> tuple[Array, Array, Array]:
    """Return |mu| of the largest multiplier, its derivatives, and those of the unknowns, by the design variables."""
    n = monodromy.shape[0]
    size, weight = jax.value_and_grad(lambda m: jnp.abs(sorted_multipliers(m)[0]))(monodromy)
    moved = -jnp.linalg.solve(of_r[:, :n], of_r[:, n:])
    of_numbers = jnp.einsum("ij,ijk->k", weight, of_monodromy[..., n:] + of_monodromy[..., :n] @ moved)
    return size, of_numbers @ by_design, moved @ by_design


def orbit_slopes(
    designs: Callable[[Array], AbstractForcedSystem], at: Float[np.ndarray, " n"], orbit: Orbit
) -> OrbitSlopes:
    """Return how an orbit and its largest multiplier change with the design, by the implicit function theorem.

    **Arguments:** the system as a function of design variables, a module; the values of these at which `orbit` was
    found. If two multipliers are equal in size, one of them is taken.
    """
    place = jnp.asarray(at, dtype=float)
    given = Given(designs(place), jnp.asarray(orbit.speed, dtype=float))
    problem = make_problem(given, (), jnp.ones(0), orbit.periods, orbit.method)
    equations, u = OrbitEquations(problem), orbit.state / problem.scale
    numbers = numbers_around(equations, u, given)
    (_, monodromy), slopes = around_root(equations, u, numbers, *expansion(problem, u, numbers))
    by_design = _numbers_by(problem, u, given.speed, designs, place)
    size, multiplier, unknowns = _orbit_moves(monodromy, *slopes, by_design)
    state = np.asarray(problem.scale)[:, None] * np.asarray(unknowns)
    return OrbitSlopes(float(size), np.asarray(multiplier), state)
