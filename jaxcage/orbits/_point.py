"""A bifurcation of a periodic orbit: solved for, met on a branch, or known from elsewhere."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from .._errors import ArgumentError
from .._notebook import notebook_html
from .._types import Scalar
from ..analysis import Edge
from ..models import AbstractForcedSystem
from ._problem import SPEED, Parameter, value_of
from ._singularity import CRITICAL


Numbers = np.ndarray | Array

UNEXPLAINED = "unexplained"
OUTCOMES = ("converged", "no such point", "other kind", "tangential", "not converged", UNEXPLAINED, "given")
"""What is known of a point, in the order of the codes: converged; Newton's method found no point; it found one at which
the multipliers are not those of the kind asked for (a neutral saddle instead of a Neimark-Sacker bifurcation); or one
at which the multiplier hardly crosses, so that its place is not a function of the design; or one that is elsewhere by
half the steps; the number of unstable multipliers changes and no bifurcation is found; not solved for yet."""
FOUND, NO_SUCH_POINT, OTHER_KIND, TANGENT, NOT_CONVERGED, NOT_EXPLAINED, GIVEN = range(len(OUTCOMES))


class Point(eqx.Module):
    """A bifurcation of a periodic orbit. Where none was found its numbers are NaN and `status` says so.

    Kind, speed and state are enough to start Newton's method from.
    """

    kind: str = eqx.field(static=True)
    """`period-doubling`, `Neimark-Sacker`, `fold` or `branch-point`; on a branch also `unexplained`: the number of
    unstable multipliers changes and no bifurcation is found, so that one was missed, or the branch is not one."""
    speed: Scalar
    """Speed [rad/s]; differentiable."""
    state: Float[Numbers, " dim"]
    """State of the orbit at phase 0 [SI]; differentiable."""
    periods: Int[Array, ""] | int = 1
    """Revolutions after which the orbit closes."""
    steps: Int[Array, ""] | int = 0
    """Steps per revolution; 0 where they are not known."""
    parameter: str = eqx.field(static=True, default=SPEED)
    value: Scalar = float("nan")
    """Value of the parameter [SI], which may be the speed; differentiable."""
    error: Scalar = float("nan")
    """Distance of the value to that by half the steps or, if that is more, twice the one to that by three quarters of
    them and one [SI]; infinite where these do not find it, NaN where the method has no number of steps; of something
    unexplained how far away it may be. Under `jit`, `vmap` and `grad` by half the steps alone."""
    multipliers: Complex[Numbers, " multipliers"] = eqx.field(default_factory=lambda: np.zeros(0, dtype=complex))
    """Floquet multipliers, the largest first."""
    direction: Float[Numbers, " coordinates"] = eqx.field(default_factory=lambda: np.zeros(0))
    """Critical direction in the state [SI], of length 1 in units of the scale; of a Neimark-Sacker bifurcation zero."""
    residual: Scalar = float("nan")
    """Largest component of the equations, in units of the system's scale."""
    transversality: Scalar = float("nan")
    """d|mu|/d parameter of the critical multiplier along the orbit [1/SI]; at a fold, where that is infinite, the drift
    p dP/d parameter of the map along the critical direction, with p q = 1. On a branch it is not computed."""
    outcome: Int[Array, ""] | int = GIVEN
    """Code: place in `OUTCOMES`."""
    iterations: Int[Array, ""] | int = 0
    index: int = eqx.field(static=True, default=-1)
    """Of a point on a branch: the branch's orbit before it."""
    edge: bool = eqx.field(static=True, default=False)
    """Of a point on a branch: whether a stable orbit is on one side of it."""
    looked: str = eqx.field(static=True, default="")
    """Where it was looked for, if Newton's method did not find it from the guess and neither did the branch."""

    def __post_init__(self) -> None:
        if self.parameter == SPEED:
            self.value = self.speed

    @property
    def speed_rpm(self) -> Scalar:
        """Speed in revolutions per minute."""
        return self.speed * 30 / np.pi

    @property
    def error_rpm(self) -> Scalar:
        """Error of a speed in revolutions per minute."""
        return self.error * 30 / np.pi

    @property
    def converged(self) -> Bool[Array, ""] | bool:
        """Whether a point of the kind asked for was found."""
        return (self.outcome == FOUND) | (self.outcome == TANGENT)

    @property
    def trusted(self) -> Bool[Array, ""] | bool:
        """Whether its place is a function of the design: found, and crossed at a finite rate."""
        return self.outcome == FOUND

    @property
    def critical(self) -> complex:
        """The multiplier on the unit circle, with a positive imaginary part."""
        target, mu = CRITICAL.get(self.kind), np.asarray(self.multipliers)
        if target is not None:
            return complex(mu[np.argmin(np.abs(mu - target))])
        mu = mu[np.imag(mu) > 0] if self.kind == "Neimark-Sacker" else mu
        return complex(mu[np.argmin(np.abs(np.abs(mu) - 1))])

    @property
    def angle(self) -> float:
        """Angle [rad] of the critical multiplier, pi at a period doubling; NaN where no point was found."""
        return abs(float(np.angle(self.critical))) if bool(self.converged) else float("nan")

    @property
    def status(self) -> str:
        """One of `OUTCOMES`."""
        return OUTCOMES[int(self.outcome)]

    def as_edge(self, kind: str) -> Edge:
        """The edge of a zone that it is: `chaotic` or `synchronous-loss`."""
        return Edge(float(self.speed_rpm), float(self.error_rpm), kind, self.kind, "located")

    def __str__(self) -> str:
        if int(self.outcome) == GIVEN:
            return f"{self.kind} near {float(self.speed_rpm):.3f} rpm, not solved for yet"
        if not bool(self.converged):
            looked = f"; {self.looked}" if self.looked else ""
            return f"No {self.kind} found: {self.status} (residual {float(self.residual):.1e}){looked}"
        angle = f", angle {np.degrees(self.angle):.2f} deg" if self.kind == "Neimark-Sacker" else ""
        error = f" +- {float(self.error_rpm):.1g}" if self.parameter == SPEED else ""
        return (
            f"{self.kind} at {float(self.speed_rpm):.3f}{error} rpm, {self.parameter} = {float(self.value):.9g} "
            f"+- {float(self.error):.1g}{angle}, {int(self.steps)} steps\n"
            f"  residual {float(self.residual):.1e}, transversality {float(self.transversality):.3g}, {self.status}"
        )

    _repr_html_ = notebook_html


def require_found(point: Point, value: Scalar, name: str = "point") -> None:
    """**Raises:** `ValueError` for a point that was looked for and not found, so that its value is none."""
    if not np.isfinite(float(value)):
        raise ArgumentError(name, said=f"must be one that was found, but this {point.kind} was not.")


def value_at(orbit: Any, system: AbstractForcedSystem, speed: Any, parameter: Parameter) -> Array:
    """What a parameter is at an orbit: the system's own, but at a bifurcation the value at which it was found."""
    if isinstance(orbit, Point) and orbit.parameter == parameter:
        return jnp.asarray(orbit.value, dtype=float)
    return value_of(system, speed, parameter)
