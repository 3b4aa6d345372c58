"""Step control of continuation: predict the next point of a curve, accept or reject it, and choose the next length.

The prediction is the cubic through the last two points and their tangents. A point of the same curve has a tangent that
is consistent with its position, and the orientation of the curve; a point of a neighbouring curve has neither, and a
step to it is rejected.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from .._errors import ArgumentError


AIM = 3e-3  # target distance of the next point from its prediction, in the unknowns' units
VEER = 0.7  # target angle between tangents of the next step, over the largest angle allowed
SHRINKAGE, GROWTH = 0.5, 1.8  # smallest and largest ratio of a step to the one before, if that was accepted
TURN = 0.9  # smallest cosine of the angle between the tangents of a step
BEND = 0.3  # largest correction over the step's length: beyond it, Newton's method may have gone to another curve
SWING = 0.5  # largest change of the derivative, over its size plus one: beyond it, folds may have been passed over
NEARBY, OF_LENGTH, OF_MISSED = 1e-4, 1e-2, 0.5
"""Largest distance of a point from the position that its tangent implies: in the unknowns' units, over the step's
length, or over its distance from the prediction."""


class Points(NamedTuple):
    """Points of curves: NumPy arrays, with an axis of points first if there are several.

    `u`: unknowns, shape (n,); `tangent`: unit tangent on the side of the plane's normal; `jacobian`: derivative of the
    equations, shape (m, n); `aux`: further results of the equations; `steps` per revolution. `error` is the distance to
    the point with half the steps (see `AbstractEquations.apart`), `excess` its ratio to the tolerance, and `moved` the
    distance in the unknowns' units.
    """

    u: Any
    tangent: Any
    jacobian: Any
    converged: Any
    aux: Any
    steps: Any
    error: Any
    excess: Any
    moved: Any

    @staticmethod
    def stacked(points: Sequence["Points"]) -> "Points":
        """Stack single points as a row."""
        return jax.tree.map(lambda *x: np.stack(x), *points)

    def take(self, which: Any) -> "Points":
        return jax.tree.map(lambda x: x[which], self)  # NumPy arrays: JAX takes a millisecond for each

    def put(self, which: np.ndarray, new: "Points") -> "Points":
        """Return the points with those at `which` replaced."""
        whole = jax.tree.map(np.array, self)
        jax.tree.map(lambda x, y: x.__setitem__(which, y), whole, new)
        return whole

    def with_errors_of(self, old: "Points") -> "Points":
        return self._replace(error=old.error, excess=old.excess, moved=old.moved)

    def turned(self, sign: Any) -> "Points":
        """Return the points with their tangents reversed where `sign` is -1."""
        return self._replace(tangent=self.tangent * np.asarray(sign)[..., None])

    def after(self, back: "Points") -> "Points":
        """Join two directions from one point in a row, from the end of `back` on."""
        back = back.take(slice(None, 0, -1)).turned(-1.0)
        return jax.tree.map(lambda a, b: np.concatenate([a, b]), back, self)


class Comparison(NamedTuple):
    """Comparison of a new point: distance from its prediction; angle between its tangent and the last, over the largest
    allowed; `sure`, True if it is on the curve or one that crosses it; `same`, True if the orientation is the same."""

    missed: float
    turned: float
    sure: bool
    same: bool


@dataclasses.dataclass(frozen=True)
class StepControl:
    """Lengths of steps in the unknowns' units, and their maximum number in each direction."""

    first: float = 0.02
    longest: float = 0.5
    shortest: float = 1e-7
    most: int = 400

    def __post_init__(self):
        if not 0 < self.shortest <= self.first <= self.longest:
            given = f"{self.shortest:g}, {self.first:g} and {self.longest:g}"
            raise ArgumentError("steps", said=f"must have 0 < shortest <= first <= longest, but has {given}.")

    def predict(self, points: list[Points], length: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the point at a distance `length` beyond the last one, and the curve's unit tangent there."""
        last, tangent = points[-1], points[-1].tangent
        if len(points) == 1:
            return last.u + length * tangent, tangent
        chord = last.u - points[-2].u
        apart = np.linalg.norm(chord)
        off, bent = (apart * tangent - chord) / apart, tangent - points[-2].tangent
        share = length / apart
        square, cube = share * (3 * off - bent), share**2 * (2 * off - bent)
        slope = tangent + 2 * square + 3 * cube
        return last.u + length * (tangent + square + cube), slope / np.linalg.norm(slope)

    def compare(
        self, points: list[Points], new: Points, ahead: np.ndarray, normal: np.ndarray, length: float
    ) -> Comparison:
        """Compare a new point with its prediction and the last point.

        The prediction over `length` from two points `apart` omits the term a s^2 (s + apart)^2, which fixes the ratio
        of the errors of point and tangent: a point that violates it is not on this curve. The determinant of the
        equations with the tangent keeps its sign along a curve, at folds too, but not where it crosses another.
        """
        if not new.converged:
            return Comparison(np.inf, np.inf, False, False)
        last = points[-1]
        apart = np.linalg.norm(last.u - points[-2].u) if len(points) > 1 else np.inf
        turned = np.arccos(np.clip(new.tangent @ last.tangent, -1.0, 1.0)) / np.arccos(TURN)
        way, slope = new.u - ahead, new.tangent - normal
        missed = np.linalg.norm(way)
        smooth = np.max(np.abs(new.jacobian - last.jacobian)) < SWING * (1 + np.max(np.abs(last.jacobian)))
        share = 1 / (2 / length + 2 / (length + apart))
        off = np.linalg.norm(way - share * (slope - (slope @ normal) * normal))
        belongs = off < max(min(NEARBY, OF_LENGTH * length), OF_MISSED * missed)
        sure = turned < 1 and missed < BEND * length and smooth and belongs
        orientation = lambda p: np.linalg.slogdet(np.vstack([p.jacobian, p.tangent]))[0]
        return Comparison(float(missed), float(turned), bool(sure), orientation(new) == orientation(last))

    def after_success(self, length: float, step: Comparison) -> float:
        """Return the length of the step after an accepted one; the error of the cubic grows with its fourth power."""
        growth = min((AIM / max(step.missed, 1e-12)) ** 0.25, VEER / max(step.turned, 1e-12))
        return min(self.longest, length * float(np.clip(growth, SHRINKAGE, GROWTH)))

    def after_failure(self, length: float, converged: bool) -> float:
        """Return the length with which a rejected step is repeated."""
        return length / (2 if converged else 4)
