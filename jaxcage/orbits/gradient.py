"""Gradients of edges and of multipliers: derivatives, elasticities, and the identities that they must satisfy.

An edge speed w is a rate, and must not depend on the units of mass, length and time. With the exponents a_i of a unit
in every parameter p_i,
    sum a_i p_i dw/dp_i = 0 for mass and length, = -w for time.
These identities hold for every kind of edge and test a gradient without any reference.

All derivatives follow from the equations of an edge or of an orbit by the implicit function theorem (`newton.as_root`).
"""

import dataclasses
from collections.abc import Callable, Mapping
from typing import NamedTuple, cast, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from .._arguments import require_x64
from .._parameters import get, parameter_dimensions, parameter_paths, parameters
from .._pytrees import compiled
from ..models import AbstractForcedSystem
from ..quantities import notebook_html
from ..solve import AbstractMethod
from .bifurcation import PointEquations, Solved, solve_point
from .continuation import in_parallel
from .newton import as_root, expanded
from .orbit import Orbit, OrbitEquations, sorted_multipliers
from .point import Kind, Point, Start
from .problem import MOST_OF_A_POINT, SPEED, Counts, Given, make_problem, with_fallback


PER_RPM = np.pi / 30
OUTSIDE = 1e-6  # distance from the unit circle beyond which a multiplier is outside


@dataclasses.dataclass(frozen=True)
class Sensitivity:
    """Derivatives of an edge, or of the width between two edges, with respect to every parameter.

    `derivative` is d value [rpm] / d parameter [SI], `elasticity` the relative change of the value over that of the
    parameter, and `homogeneity` the relative residuals of the identities for mass, length and time, NaN if a
    parameter's unit is not known. `transversality` is d|mu|/d speed [s] (see `Point`), for a width the
    smaller one; `error_rpm` is the change of the value when the `steps` per revolution are halved. The `state` of the
    orbit at phase 0 [SI] is None for a width.
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
        """True if the edge was found and its value is a differentiable function of the design."""
        return self.status == "converged"

    @property
    def bounds(self) -> bool:
        """True if a stable orbit ends here: only critical multipliers are on or outside the unit circle."""
        if self.multipliers is None:
            return False
        critical = 2 if self.kind == "Neimark-Sacker" else 1
        nearest = np.sort(np.abs(np.abs(self.multipliers) - 1))[:critical]
        return int(np.sum(np.abs(self.multipliers) > 1 + nearest.max() + OUTSIDE)) == 0

    def __str__(self) -> str:
        order = sorted(self.elasticity, key=lambda n: -abs(self.elasticity[n]))
        rows = [f"  {n:<28} {self.elasticity[n]:+.6f}" for n in order if self.elasticity[n] != 0.0]
        at = f"{self.kind} at {self.value_rpm:.3f} ± {self.error_rpm:.1g} rpm"
        return "\n".join([f"{self.name}: {at}, elasticities", *rows])

    _repr_html_ = notebook_html


@compiled
def _pull_back(equations: PointEquations, given: Given, u: Array) -> AbstractForcedSystem:
    """Return d speed / d system at a bifurcation over speed, the first derivative of `as_root` with less to trace."""

    def residual(system: AbstractForcedSystem, u: Array) -> Array:
        return expanded(equations, u, Given(system, given.speed))[0]

    _, pull = eqx.filter_vjp(residual, given.system, u)
    jacobian = jax.vmap(lambda row: pull(row)[1])(jnp.eye(u.size))
    of_speed = jax.grad(lambda u: equations.problem.values(u)[0])(u)
    return pull(-jnp.linalg.solve(jacobian.T, of_speed))[0]


def sensitivity(
    system: AbstractForcedSystem, point: Point, name: str = "edge", method: AbstractMethod | None = None
) -> Sensitivity:
    """Return the derivatives of an edge speed with respect to every parameter, exact for the discretised equations.

    Newton's method first locates the point, doubling the steps until it no longer moves. `bifurcation` gives the same
    derivatives, and higher ones.

    **Arguments:** a system whose parameters are declared, such as `CageModel`; a bifurcation over speed, located.

    **Returns:** `Sensitivity`; it is NaN for a branch point, and if Newton's method does not find the point again,
    finds a neutral saddle instead of a Neimark-Sacker bifurcation, or finds it elsewhere with half the steps.
    """
    require_x64()
    if point.kind not in get_args(Kind):  # a branch point exists only by symmetry, and is not a function of the design
        return _nowhere(system, point.kind, name)
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    begin = Start(jnp.asarray(point.state), given.speed, given.speed)

    def find(method: AbstractMethod, counts: Counts) -> Solved:
        near = counts.near(int(point.steps) or None)
        return solve_point(given, cast(Kind, point.kind), SPEED, point.periods, begin, method, near)

    solves = lambda found: np.isfinite(found[0].residual)
    edge, equations, u = with_fallback(find, method, solves, MOST_OF_A_POINT)
    if not bool(edge.converged):
        return _nowhere(system, point.kind, name, edge.status, float(edge.error_rpm))
    pulled, speed = _pull_back(equations, given, u), float(edge.speed)
    slope = {n: float(get(pulled, path)) for n, path in parameter_paths(system).items()}
    change = {n: slope[n] * float(v) / speed for n, v in parameters(system).items()}
    units, bases = parameter_dimensions(system), {"mass": 0.0, "length": 0.0, "time": 1.0}
    return Sensitivity(
        name=name,
        kind=point.kind,
        value_rpm=float(edge.speed_rpm),
        derivative={n: s / PER_RPM for n, s in slope.items()},
        elasticity=change,
        homogeneity={b: rate + sum(units[n][b] * e for n, e in change.items()) for b, rate in bases.items()},
        transversality=float(edge.transversality),
        status=edge.status,
        state=np.asarray(edge.state),
        error_rpm=float(edge.error_rpm),
        steps=int(edge.steps),
        multipliers=np.asarray(edge.multipliers),
    )


def _nowhere(
    system: AbstractForcedSystem, kind: str, name: str, status: str = "no such point", error_rpm: float = float("nan")
) -> Sensitivity:
    nan = float("nan")
    row = dict.fromkeys(parameter_paths(system), nan)
    broken: dict[str, float] = dict.fromkeys(("mass", "length", "time"), nan)
    return Sensitivity(name, kind, nan, row, row, broken, nan, status, error_rpm=error_rpm)


def sensitivities(
    system: AbstractForcedSystem, points: Mapping[str, Point], method: AbstractMethod | None = None
) -> dict[str, Sensitivity]:
    """Return the sensitivity of each named edge, computed on all cores."""
    require_x64()
    found = in_parallel(lambda name: sensitivity(system, points[name], name, method), list(points))
    return dict(zip(points, found, strict=True))


def width(onset: Sensitivity, exit_: Sensitivity, name: str = "width") -> Sensitivity:
    """Return the sensitivity of the width between two edges."""
    total, first, last = exit_.value_rpm - onset.value_rpm, onset.value_rpm, exit_.value_rpm
    difference = lambda a, b: {n: b[n] - a[n] for n in a}
    relative = lambda a, b: {n: (last * b[n] - first * a[n]) / total for n in a}
    return Sensitivity(
        name=name,
        kind="unstable",
        value_rpm=total,
        derivative=difference(onset.derivative, exit_.derivative),
        elasticity=relative(onset.elasticity, exit_.elasticity),
        homogeneity=relative(onset.homogeneity, exit_.homogeneity),
        transversality=min(abs(onset.transversality), abs(exit_.transversality)),
        status=next((s.status for s in (exit_, onset) if not s.trusted), "converged"),
        error_rpm=onset.error_rpm + exit_.error_rpm,
    )


class OrbitSlopes(NamedTuple):
    """Modulus of an orbit's largest multiplier, and derivatives of it and of the state [SI] by n design variables."""

    multiplier: float
    multiplier_slope: Float[np.ndarray, " n"]
    state_slope: Float[np.ndarray, "dim n"]


@compiled
def _moves(
    equations: OrbitEquations, orbit: Orbit, designs: Callable[[Array], AbstractForcedSystem], place: Array
) -> tuple[Array, tuple[Array, Array]]:
    """Return |mu| of the largest multiplier, and the derivatives of |mu| and of the state by the design variables."""
    problem = equations.problem

    def orbit_of(place: Array) -> tuple[tuple[Array, Array], Array]:
        given, u = Given(designs(place), orbit.speed), orbit.state / problem.scale
        u, monodromy = as_root(given, equations=equations, u=u)
        size = jnp.abs(sorted_multipliers(monodromy)[0])
        return (size, problem.state(u)), size

    slopes, size = jax.jacfwd(orbit_of, has_aux=True)(place)
    return size, slopes


def orbit_slopes(
    designs: Callable[[Array], AbstractForcedSystem], at: Float[np.ndarray, " n"], orbit: Orbit
) -> OrbitSlopes:
    """Return the derivatives of an orbit and its largest multiplier by the design, by the implicit function theorem.

    If two multipliers have the same modulus, one of them is taken.

    **Arguments:** module that maps design variables to a system; their values at `orbit`; the orbit.
    """
    place = jnp.asarray(at, dtype=float)
    given = Given(designs(place), jnp.asarray(orbit.speed, dtype=float))
    problem = make_problem(given, (), jnp.ones(0), orbit.periods, orbit.method)
    size, (multiplier, state) = _moves(OrbitEquations(problem), orbit, designs, place)
    return OrbitSlopes(float(size), np.asarray(multiplier), np.asarray(state))
