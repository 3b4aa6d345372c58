"""Edges followed from one design to another: continuation of a bifurcation point along the line between the two.

The unknowns are the orbit's state, the speed and the share of the way, so that an edge that turns back in the design is
followed round the turn. The predictor has the full tangent of all three by the implicit function theorem, and so the
orbit moves with its land; `Continuation` shortens its steps where the curve bends, and refuses points of other curves.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._arguments import require_x64
from .._parameters import parameters
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod
from .continuation import ContinuationProblem, in_parallel
from .curves import follow_curve, point_curve
from .gradient import Sensitivity, sensitivity
from .point import Point
from .problem import SPEED, Given, Parameter
from .step_lengths import Points, StepControl


SHARE = "share"
LONGEST, SHORTEST, MOST = 1.5, 1e-6, 80
"""Longest and shortest step, in clearances and tenths of the speed and of the largest relative change; most steps."""
LEAST = 1e-10  # designs that differ by less are the same up to rounding
SAME_EDGE = 2e-3
"""Largest relative distance of the edge by its final equations from the end of its curve."""


class Between(Given):
    """A system on the straight line between two designs; the parameter `share` is 0 at the first and 1 at the other."""

    other: AbstractForcedSystem

    def changed(self, parameter: Parameter, new: Any) -> Given:
        if parameter == SPEED:
            return dataclasses.replace(self, speed=new)
        mixed = jax.tree.map(lambda a, b: a + new * (b - a), self.system, self.other)
        return Given(mixed, self.speed)


class Followed(NamedTuple):
    """An edge after a change of design, or why there is none.

    - `edge`: the edge with its derivatives, None if it was lost.
    - `ended`: empty; `turned back`, the edge met another one before the change was complete and both vanished;
        `left the range` of speed; `neutral saddle`, the pair of multipliers of a Neimark-Sacker bifurcation is real
        there, so that nothing bifurcates; `lost`, continuation found no further point.
    - `share`: how far along the change the edge existed, 1 if it reached the new design.
    """

    edge: Sensitivity | None
    ended: str = ""
    share: float = 1.0


def relative_change(one: AbstractForcedSystem, other: AbstractForcedSystem) -> float:
    """Return the largest relative difference of the parameters of two designs."""
    a, b = (np.array([float(x) for x in parameters(m).values()]) for m in (one, other))
    size = np.maximum(np.abs(a), np.abs(b))
    return float(np.max(np.abs(b - a)[size > 0] / size[size > 0], initial=0.0))


def follow(
    system: AbstractForcedSystem,
    point: Point,
    other: AbstractForcedSystem,
    *,
    lower: float,
    upper: float,
    name: str = "edge",
    method: AbstractMethod | None = None,
) -> Followed:
    """Follow an edge from the design `system`, at which it is `point`, to the design `other`.

    **Arguments:** design; a period doubling, Neimark-Sacker bifurcation or fold over speed that was found there; new
    design, of the same kind of model; range of speed [rad/s] within which the edge is followed.

    **Returns:** the edge at the new design with its exact derivatives, or why it is not there.
    """
    require_x64()
    length = 10 * relative_change(system, other)
    if length < LEAST:
        return _solved(other, point, name, method)
    given = Between(system, jnp.asarray(point.speed, dtype=float), other)
    units = np.array([0.1 * float(point.speed), 1 / length])
    limits = np.array([lower, -1e-9]), np.array([upper, 1.0])
    problem, start = point_curve(given, (SPEED, SHARE), units, limits, point, 0.0, method)
    if not bool(start.converged[0]):
        return Followed(None, "lost", 0.0)
    ahead = float(start.tangent[0, -1])
    first = min(LONGEST, length / max(abs(ahead), 1e-3))
    control = StepControl(first=first, longest=max(LONGEST, first), shortest=min(SHORTEST, first), most=MOST)
    path = follow_curve(problem, start.turned(np.sign(ahead)), control)
    row = path.row
    share = row.u[:, -1] / length
    if share[-1] >= 1:
        return _solved(other, _landed(problem, row, share, point), name, method)
    reach = float(np.max(share))
    if row.tangent[-1, -1] < 0:
        return Followed(None, "turned back", reach)
    return Followed(None, "left the range" if path.ended == "range" else "lost", reach)


def _landed(problem: ContinuationProblem, row: Points, share: np.ndarray, point: Point) -> Point:
    """Return the point of a curve at the new design, by a cubic through its last two points and their tangents."""
    (a, b), (sa, sb) = row.take(slice(-2, None)).u, share[-2:]
    da, db = (t * (sb - sa) / (t[-1] * problem.units[1]) for t in row.tangent[-2:])
    s = (1 - sa) / (sb - sa)
    u = a + s * (b - a) + s * (1 - s) * ((1 - s) * (da - (b - a)) + s * ((b - a) - db))
    speed = float(problem.values(u)[0])
    return dataclasses.replace(point, speed=speed, value=speed, state=problem.states(u), steps=int(row.steps[-1]))


def _solved(system: AbstractForcedSystem, point: Point, name: str, method: AbstractMethod | None) -> Followed:
    """Return the edge by its equations at the new design alone."""
    edge = sensitivity(system, point, name, method)
    if edge.status == "other kind":
        return Followed(None, "neutral saddle")
    near = abs(edge.value_rpm - float(point.speed_rpm)) < SAME_EDGE * float(point.speed_rpm)
    return Followed(edge) if np.isfinite(edge.value_rpm) and near else Followed(None, "lost")


def follow_all(
    system: AbstractForcedSystem,
    points: Mapping[str, Point],
    other: AbstractForcedSystem,
    limits: tuple[float, float],
    method: AbstractMethod | None = None,
) -> dict[str, Followed]:
    """Return what became of each edge at another design; edges run on all cores."""
    lower, upper = limits
    one = lambda name: follow(system, points[name], other, lower=lower, upper=upper, name=name, method=method)
    return dict(zip(points, in_parallel(one, list(points)), strict=True)) if points else {}
