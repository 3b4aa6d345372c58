"""How an edge moves with every parameter: derivatives, elasticities, and the identities they must satisfy.

An edge speed w is a rate. Whatever the units of mass, length and time, the same physics must come out, so that with the
exponents a_i of a unit in every parameter p_i
    sum a_i p_i dw/dp_i = 0 for mass and length, = -w for time.
These hold for every kind of edge and test a gradient without any reference.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from .._parameters import get, parameter_dimensions, parameter_paths
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ._branch import SpecialPoint
from ._point import POINT_OUTCOMES, BifurcationPoint, bifurcation


PER_RPM = np.pi / 30


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
    """Relative residuals of the identities for mass, length and time."""
    transversality: float
    """d|mu|/d speed [s]; of a width the smaller one."""
    status: str

    @property
    def trusted(self) -> bool:
        """Whether the value is a function of the design here."""
        return self.status == "converged"

    def __str__(self) -> str:
        order = sorted(self.elasticity, key=lambda n: -abs(self.elasticity[n]))
        rows = [f"  {n:<28} {self.elasticity[n]:+.6f}" for n in order if self.elasticity[n] != 0.0]
        return "\n".join([f"{self.name}: {self.kind} at {self.value_rpm:.3f} rpm, elasticities", *rows])


@eqx.filter_jit
def _speed_and_gradient(system: AbstractForcedSystem, guess: Any, kind: Any, method: Any) -> Any:
    def speed(s: AbstractForcedSystem) -> tuple[Any, BifurcationPoint]:
        point = bifurcation(s, kind, guess, method=method)
        return point.speed, point

    (_, point), gradient = eqx.filter_value_and_grad(speed, has_aux=True)(system)
    return point, gradient


def sensitivity(
    system: AbstractForcedSystem,
    point: SpecialPoint | BifurcationPoint,
    name: str = "edge",
    method: AbstractMethod | None = None,
) -> Sensitivity:
    """Derivatives of an edge speed, exact for the equations as integrated.

    **Arguments:** a system whose parameters are declared, such as `CageModel`; a bifurcation over speed, located.

    **Returns:** `Sensitivity`; NaN where Newton's method did not find the point again.
    """
    guess = (jnp.asarray(point.state), jnp.asarray(point.speed))
    found, gradient = _speed_and_gradient(system, guess, point.kind, method)
    paths = parameter_paths(system)
    speed = float(found.speed)
    slope = {n: float(get(gradient, path)) for n, path in paths.items()}
    change = {n: slope[n] * float(get(system, path)) / speed for n, path in paths.items()}
    return Sensitivity(
        name=name,
        kind=point.kind,
        value_rpm=speed / PER_RPM,
        derivative={n: s / PER_RPM for n, s in slope.items()},
        elasticity=change,
        homogeneity=_homogeneity(system, change),
        transversality=float(found.transversality),
        status=POINT_OUTCOMES[int(found.outcome)],
    )


def _homogeneity(system: AbstractForcedSystem, elasticity: Mapping[str, float]) -> dict[str, float]:
    """Residuals of the three identities, relative to the value."""
    dimensions = parameter_dimensions(system)
    total = {b: sum(dimensions[n][b] * e for n, e in elasticity.items()) for b in ("mass", "length", "time")}
    return total | {"time": total["time"] + 1.0}


def sensitivities(
    system: AbstractForcedSystem, points: Mapping[str, SpecialPoint], method: AbstractMethod | None = None
) -> dict[str, Sensitivity]:
    """The sensitivity of each named edge."""
    return {name: sensitivity(system, point, name, method) for name, point in points.items()}


def width(onset: Sensitivity, exit_: Sensitivity, name: str = "width") -> Sensitivity:
    """The sensitivity of the width between two edges."""
    value = exit_.value_rpm - onset.value_rpm
    slope = {n: exit_.derivative[n] - onset.derivative[n] for n in onset.derivative}
    weighted = lambda a, b: (exit_.value_rpm * b - onset.value_rpm * a) / value
    pairs = lambda a, b: {n: weighted(a[n], b[n]) for n in a}
    worst = next((s.status for s in (onset, exit_) if not s.trusted), "converged")
    return Sensitivity(
        name=name,
        kind="synchronous-loss",
        value_rpm=value,
        derivative=slope,
        elasticity=pairs(onset.elasticity, exit_.elasticity),
        homogeneity=pairs(onset.homogeneity, exit_.homogeneity),
        transversality=min(abs(onset.transversality), abs(exit_.transversality)),
        status=worst,
    )
