"""Period-doubling cascades: doubling after doubling along the doubled branches, and where they accumulate."""

import dataclasses
import itertools
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from ..analysis import Edge
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod
from ._arclength import ONCE, Corrected, Steps, correct, follow, settle_on
from ._branch import Branch, describe
from ._follower import Follower, make_follower, require_range
from ._point import Point, require_found
from ._problem import SPEED, Given, Parameter
from ._singularity import test_functions


FEIGENBAUM = 4.669201609102990
SMALLEST_AMPLITUDE = 1e-5


@dataclasses.dataclass(frozen=True)
class Cascade:
    """Period doublings of orbits of period 1, 2, 4, ... times the first one's."""

    points: tuple[Point, ...]
    """Fewer than asked for where the doubled branch was lost or does not double again (`ended`)."""
    limit: float
    """Where they accumulate [SI], extrapolated with Feigenbaum's ratio; NaN with fewer than two points."""
    error: float
    """Distance of the last two extrapolations and errors of the last two points; infinite with fewer than three."""
    ended: str = ""
    """Why there are not as many points as were asked for."""

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the parameter [SI]."""
        return tuple(float(p.value) for p in self.points)

    def as_edge(self, kind: str) -> Edge:
        """The chaotic edge that the limit of one over speed is."""
        return Edge(self.limit * 30 / np.pi, self.error * 30 / np.pi, kind, "period-doubling", "cascade")

    def __str__(self) -> str:
        rows = [
            f"  period {int(p.periods)} to {2 * int(p.periods)}: {float(p.value):.10g} +- {float(p.error):.1g}"
            for p in self.points
        ]
        last = [f"  ended: {self.ended}"] if self.ended else []
        return "\n".join(["Period-doubling cascade", *rows, f"  limit {self.limit:.10g} +- {self.error:.1g}", *last])

    _repr_html_ = notebook_html


def doubled_branch(
    system: AbstractForcedSystem,
    point: Point,
    parameter: Parameter = SPEED,
    *,
    lower: float,
    upper: float,
    steps: Steps = Steps(first=0.01, shortest=1e-7),
    amplitude: float = 0.02,
    until_doubling: bool = False,
    method: AbstractMethod | None = None,
) -> Branch:
    """The branch of orbits of twice the period that begins at a period doubling.

    **Arguments:**

    - `point`: a period doubling, of an orbit of any number of revolutions.
    - `lower`, `upper`, `steps`: as for `branch`.
    - `amplitude`: how far from the doubling it is entered, in units of the system's scale along the critical direction.
    - `until_doubling`: end with the branch's own first period doubling.

    **Raises:** `ValueError` if the branch is not found.
    """
    require_x64()
    require_range(parameter, lower, upper)
    if point.kind != "period-doubling":
        raise ArgumentError("point", said=f"must be a period doubling, but it is a {point.kind}.")
    require_found(point, point.value)
    at, periods = float(point.value), int(point.periods)
    given = Given(system, jnp.asarray(point.speed, dtype=float))
    follower = make_follower(given, parameter, lower, upper, method).around(at, 2 * periods)
    curves, half = follower.curves(1), follower.around(at, periods)
    scale = np.asarray(follower.problem.scale)
    u = np.array([[*(np.asarray(point.state) / scale), at / follower.unit]])
    across = np.zeros_like(u)
    across[0, : scale.size] = np.asarray(point.direction) / scale
    across /= np.linalg.norm(across)
    while amplitude > SMALLEST_AMPLITUDE:
        start = settle_on(curves, u + amplitude * across, across, int(point.steps))
        near = start.converged[0] and abs(start.u[0, -1] - u[0, -1]) < 1.0
        once = correct(half.curves(1), start.u, across, start.steps, ONCE)  # where it is half of its revolutions later
        away = np.linalg.norm(once.jacobian[0] @ (start.u - once.u)[0])  # nothing if it is the orbit that doubles
        if near and _doubling(follower, start)[0] > 0 and away > amplitude:
            break
        amplitude /= 4
    else:
        raise ArgumentError("point", said=f"must be a period doubling, but no doubled branch begins at {at:g}.")
    stop = lambda lane, points: until_doubling and bool(_doubling(follower, points[-1]) < 0)
    (trace,) = follow(curves, start, steps=steps, inside=follower.inside, stop=stop)
    (found,) = describe(follower, [(trace.points, ("doubling", trace.ended))])
    return found


def _doubling(follower: Follower, points: Corrected) -> np.ndarray:
    return test_functions(follower.multipliers(points))["period-doubling"]


def cascade(
    system: AbstractForcedSystem,
    point: Point,
    parameter: Parameter = SPEED,
    *,
    lower: float,
    upper: float,
    levels: int = 4,
    method: AbstractMethod | None = None,
) -> Cascade:
    """Follow a period-doubling cascade from its first point, the doubling of a period-1 orbit, over a range of the
    parameter [SI] and so many doublings."""
    require_x64()
    require_range(parameter, lower, upper)
    require_found(point, point.value)
    require_at_least(1, levels=levels)
    points = [point]
    how: dict[str, Any] = {"lower": lower, "upper": upper, "until_doubling": True, "method": method}
    amplitude, ended = 0.02, ""
    while len(points) < levels:
        try:
            doubled = doubled_branch(system, points[-1], parameter, amplitude=amplitude, **how)
        except ValueError as error:
            ended = str(error)
            break
        following = [p for p in doubled.special if p.kind == "period-doubling" and p.status == "converged"]
        if not following:
            ended = f"the branch of period {doubled.periods} does not double again (ends: {doubled.ended[1]})"
            break
        points.append(following[0])
        amplitude /= 2
    pairs = itertools.pairwise(float(p.value) for p in points)
    limits = [b + (b - a) / (FEIGENBAUM - 1) for a, b in pairs] or [float("nan")]
    error = abs(limits[-1] - limits[-2]) if len(limits) > 1 else float("inf")
    located = sum(w * float(np.nan_to_num(p.error)) for w, p in zip((1 + 1 / (FEIGENBAUM - 1), 0.3), points[::-1]))
    return Cascade(tuple(points), limits[-1], error + located, ended)
