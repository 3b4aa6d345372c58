"""The paper's own eyes: zones as a reader sees them on a bifurcation diagram.

The paper ran Newmark's method from one start for a number of revolutions that it does not print, drew the strobe points
over speed and called chaotic what fills a band. No exponent was asked for: quasi-periodic motion, chaos that is about
to die out and an orbit that has not yet closed look the same. An observer does so here, at a stated step and length,
beside zones of chaos that lasts; it is never put in their place.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from ..analysis import CLOSE_BELOW_RPM, Edge, Zone, close_windows
from ..integrate import method
from ..models import CageModel
from ..sweeps import sweep_designs


@dataclasses.dataclass(frozen=True)
class Observer:
    """Someone who reads zones off a diagram."""

    name: str
    steps: int
    """Newmark steps of a revolution."""
    discard: int
    """Revolutions before the first point is drawn."""
    drawn: int
    """Points drawn at each speed, one a revolution."""
    mark: float = 6e-6
    """Size of a point [m]: a hundredth of the height of fig. 7, 0.6 mm."""
    dots: int = 8
    """Separate dots at one speed that are still seen as a periodic motion."""

    def settings(self) -> str:
        """How this observer looks, in words."""
        last = self.discard + self.drawn
        return f"Newmark, {self.steps} steps, the paper's start, revolutions {self.discard + 1} to {last}"


OBSERVERS = (
    Observer("diagram from 200", steps=128, discard=200, drawn=200),
    Observer("diagram from 600", steps=128, discard=600, drawn=200),
)
"""Figs. 7 and 8 do not say which revolutions they draw. From revolution 4 on, as fig. 9 does, transients blur every
speed: no zone ends."""


def marks(points: Float[np.ndarray, " points"], size: float) -> int:
    """How many marks of a size cover points on a line, as few as possible.

    A band of chaos takes as many as it is wide, a periodic motion one for each of its points.
    """
    left, count, points = -np.inf, 0, np.sort(points)
    for y in points.tolist():
        if y > left + size:
            left, count = y, count + 1
    return count


def looks_chaotic(points: Float[np.ndarray, "speeds drawn"], observer: Observer) -> Bool[np.ndarray, " speeds"]:
    """Speeds at which the vertical positions fill more than a few dots; a failed lane does not."""
    return np.array([bool(np.isfinite(y).all()) and marks(y, observer.mark) > observer.dots for y in points])


def observed_zones(
    models: Sequence[CageModel], speeds: Float[np.ndarray, " speeds"], observers: Sequence[Observer]
) -> dict[str, list[tuple[Zone, ...]]]:
    """The zones of each model that each observer, by name, reads off its diagram, at speeds [rad/s] in ascending order.

    Observers with the same step look at the same motion.
    """
    found = {}
    for steps in dict.fromkeys(o.steps for o in observers):
        these = [o for o in observers if o.steps == steps]
        first = min(o.discard for o in these)
        length = max(o.discard + o.drawn for o in these) - first
        swept = sweep_designs(
            models,
            speeds,
            starts=1,
            discard=first,
            revolutions=length,
            keep=length,
            blocks=1,
            exponents=0,
            confirm=False,
            horizon=0,
            method=method("newmark", steps=steps),
        )
        for o in these:
            drawn = slice(o.discard - first, o.discard - first + o.drawn)
            found[o.name] = [_zones(s.rpm, looks_chaotic(s.strobe[:, 0, drawn, 1], o)) for s in swept]
    return found


def _zones(rpm: Float[np.ndarray, " speeds"], chaotic: Bool[np.ndarray, " speeds"]) -> tuple[Zone, ...]:
    def edge(inside: int, outside: int) -> Edge | None:
        if not 0 <= outside < rpm.size:
            return None
        here, there = float(rpm[inside]), float(rpm[outside])
        return Edge((here + there) / 2, abs(there - here), "chaotic")

    spans = close_windows(rpm, chaotic, CLOSE_BELOW_RPM)
    return tuple(Zone("chaotic", edge(a, a - 1), edge(b, b + 1), float(np.mean(chaotic[a : b + 1]))) for a, b in spans)
