"""Where a function along a curve vanishes, between two of its points: the Illinois variant of regula falsi.

The function is evaluated at points of the curve itself, on planes across the chord between the two ends; many curves
are treated at a time.
"""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from ._arclength import Corrected, Curves, correct, take


MOST = 40
LOCATED = 1e-9
"""As closely as places are refined, in the unknowns' units."""
ASIDE = 1e-5
"""At a branch point the curve's equations are singular, and no point is found where the function vanishes: it is then
bracketed this closely, and interpolated."""


def zeros(
    curves: Curves,
    ends: Sequence[Corrected],
    signal: Callable[[int, Corrected], np.ndarray],
    steps: np.ndarray,
    within: Any = LOCATED,
) -> list[Corrected | None]:
    """Points at which `signal` vanishes.

    **Arguments:**

    - `curves`: as for `correct`, one curve per pair of ends.
    - `ends`: pairs of neighbouring points.
    - `signal`: values for the lane's number and some points of its curve.
    - `steps`: per revolution.
    - `within`: places are refined until they move by less than this, in the unknowns' units; one for all or each.

    **Returns:** a point per pair, None where the signal does not change sign between them, or the curve was lost.
    """
    lanes = len(ends)
    within = np.broadcast_to(within, lanes)
    values = np.array([signal(i, e) if np.all(e.converged) else [np.nan, np.nan] for i, e in enumerate(ends)])
    active = np.prod(values, axis=1) < 0
    f0, f1 = np.where(active[:, None], values, np.nan).T.copy()
    u0, u1 = np.where(active[:, None], np.stack([e.u for e in ends], axis=1), np.nan)
    chord = u1 - u0
    length = np.linalg.norm(chord, axis=1)
    normal = chord / length[:, None]
    low, high, last, aside = np.zeros(lanes), np.ones(lanes), np.zeros(lanes), np.zeros(lanes)
    sides = [[take(e, np.array(j)) for j in (0, 1)] for e in ends]
    best: list[Corrected | None] = [None] * lanes
    for _ in range(MOST):
        index = np.flatnonzero(active)
        if index.size == 0:
            break
        margin = 1e-3 * (high - low)
        aimed = np.clip((low * f1 - high * f0) / (f1 - f0), low + margin, high - margin)
        share = np.clip(aimed + aside, low, high)
        at = np.stack([_on_plane(u0[i] + share[i] * chord[i], normal[i], sides[i]) for i in index])
        got = correct(curves.take(index), at, normal[index], steps[index])
        for k, i in enumerate(index):
            if not got.converged[k]:
                near = (high[i] - low[i]) * length[i] < 4 * ASIDE
                best[i] = _between(sides[i], (aimed[i] - low[i]) / (high[i] - low[i])) if near else None
                active[i] = not near and aside[i] == 0.0
                aside[i] = ASIDE / length[i]
                continue
            before, best[i] = best[i], take(got, np.array(k))
            f = float(signal(int(i), take(got, np.array([k])))[0])
            sides[i][int(f * f1[i] >= 0)] = best[i]
            if aside[i] != 0.0:
                aside[i] = -aside[i] if aside[i] > 0 else 0.0
            halve = 0.5 if f * last[i] > 0 else 1.0  # the same end was kept twice
            if f * f1[i] < 0:
                low[i], f0[i], f1[i] = share[i], f, f1[i] * halve
            else:
                high[i], f1[i], f0[i] = share[i], f, f0[i] * halve
            last[i] = f
            moved = np.inf if before is None else np.linalg.norm(got.u[k] - before.u)
            active[i] = aside[i] != 0.0 or f != 0.0 and moved > within[i] and (high[i] - low[i]) * length[i] > within[i]
    return best


def _on_plane(at: np.ndarray, normal: np.ndarray, sides: list[Corrected]) -> np.ndarray:
    """The point of a plane, through `at`, where the cubic through two points of the curve passes it, nearly."""
    first, second = sides
    chord = second.u - first.u
    across = np.dot(chord, normal)
    if not across > 0:
        return at
    share = np.dot(at - first.u, normal) / across
    length = np.linalg.norm(chord)
    out, back = length * first.tangent - chord, chord - length * second.tangent
    aside = share * (1 - share) * ((1 - share) * out + share * back)
    found = first.u + share * chord + aside
    return found + np.dot(at - found, normal) * normal


def _between(sides: list[Corrected], share: float) -> Corrected:
    """Linear interpolation of two near points."""
    mix = lambda x, y: (1 - share) * x + share * y if np.issubdtype(np.asarray(x).dtype, np.floating) else x
    return jax.tree.map(mix, *sides)
