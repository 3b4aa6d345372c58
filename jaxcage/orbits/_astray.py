"""Steps along a curve that lead to another curve, or past a bend: told from the point that they lead to.

A point of the same curve has the tangent that belongs to its place, and the orientation of the curve. Another curve
beside it has its own place, but neither; two that nearly meet look as if they crossed, until steps are shorter than
what is between them.
"""

from typing import Any

import numpy as np
from jaxtyping import Float


ASTRAY, OF_LENGTH, OF_MISSED = 1e-4, 1e-2, 0.5
"""How far a point may be from where its tangent says that it is (see `astray`), in the unknowns' units and over the
step's length, or over its distance from the prediction."""
CROSSED, ASIDE = 1e-4, 0.01
"""A step across which the orientation changes is halved down to this length. Where it changes all the same the curve
crosses another, and the step is taken in one from so far off: near the crossing tangents are lost to rounding."""


def classified(
    steps: Any, last: Any, got: Any, ahead: np.ndarray, normal: np.ndarray, length: np.ndarray, apart: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Steps classified by the points that they begin and end with.

    **Arguments:** what is allowed (`Steps`); last points and new ones (`Corrected`); predictions and their unit
    tangents; lengths of the steps and of those before, infinite where there was none.

    **Returns:** distance of each point from its prediction; angle between the tangents, over the largest allowed;
    whether the point is on the curve, or on one that crosses it; and whether the orientation is the same.
    """
    turned = np.arccos(np.clip(np.sum(got.tangent * last.tangent, axis=1), -1.0, 1.0)) / np.arccos(steps.turn)
    missed = np.linalg.norm(got.u - ahead, axis=1)
    largest = lambda m: np.max(np.abs(m), axis=(1, 2))
    smooth = largest(got.jacobian - last.jacobian) < steps.swing * (1 + largest(last.jacobian))
    off = astray(got.u - ahead, got.tangent - normal, normal, length, apart)
    belongs = off < np.maximum(np.minimum(ASTRAY, OF_LENGTH * length), OF_MISSED * missed)
    sure = got.converged & (turned < 1) & (missed < steps.bend * length) & smooth & belongs
    same = orientation(got) == orientation(last)
    return missed, turned, sure, same


def astray(
    missed: np.ndarray, turned: np.ndarray, normal: np.ndarray, length: np.ndarray, apart: np.ndarray
) -> Float[np.ndarray, " lanes"]:
    """How far points are from where their tangents say that they are.

    What a prediction over `length` from two points `apart` leaves out, a s^2 (s + apart)^2, is nearly as far in the
    tangent as in the point.
    """
    across = turned - np.sum(turned * normal, axis=1, keepdims=True) * normal
    share = 1 / (2 / length + 2 / (length + apart))
    return np.linalg.norm(missed - share[:, None] * across, axis=1)


def to_crossing(before: Any, last: Any) -> Float[np.ndarray, " lanes"]:
    """How far beyond its last point a curve crosses another, over the step that led there: where its equations with its
    tangent are singular if they change on as they did. Infinite where they are not.

    A step that leads beyond that place and has the orientation kept is not on the curve any more but on the other:
    from a branch that forks off to its stem.
    """
    there = bordered(last)
    change = there - bordered(before)
    known = np.all(np.isfinite(change), axis=(1, 2)) & (orientation(last) != 0)
    there, change = (np.where(known[:, None, None], x, np.eye(there.shape[-1])) for x in (there, change))
    rates = np.linalg.eigvals(np.linalg.solve(there, change))
    falls = np.where(np.abs(rates.imag) <= 1e-9 * np.abs(rates), -rates.real, 0.0).max(axis=-1)
    with np.errstate(divide="ignore"):
        return np.where(known & (falls > 0), 1 / falls, np.inf)


def bordered(points: Any) -> Float[np.ndarray, "lanes n n"]:
    """A curve's equations with its tangent, which are singular only where it crosses another."""
    return np.concatenate([points.jacobian, points.tangent[:, None]], axis=1)


def orientation(points: Any) -> Float[np.ndarray, " lanes"]:
    """Sign of the determinant of a curve's equations with its tangent: a fold does not change it, a crossing does."""
    whole = bordered(points)
    known = np.all(np.isfinite(whole), axis=(1, 2), keepdims=True)
    return np.linalg.slogdet(np.where(known, whole, 0.0))[0]
