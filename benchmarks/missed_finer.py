"""The same run with half the step lengths and twice the integration steps, and lists of special points side by side."""

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.orbits import _arclength, _follower, _located


ORDER = 4
"""Of the integration: twice the steps are what errors smaller by two to this power ask for."""


@contextlib.contextmanager
def twice_the_steps() -> Iterator[None]:
    """Orbits and their special points take twice the integration steps that they would take."""
    part = 2.0**-ORDER
    changed = (
        (_arclength, "LOOSE", part),
        (_located, "POINT", part),
        (_located, "MOST_OF_A_POINT", 2),
    )
    kept = [(module, name, getattr(module, name)) for module, name, _ in changed]
    counted = _follower.counted

    def doubled(*given: Any, **settings: Any) -> Any:
        method, counts = counted(*given, **settings)
        return method, counts._replace(first=2 * counts.first, last=2 * counts.last)

    try:
        for (module, name, value), (_, _, times) in zip(kept, changed, strict=True):
            setattr(module, name, value * times)
        setattr(_follower, "counted", doubled)
        yield
    finally:
        for module, name, value in kept:
            setattr(module, name, value)
        setattr(_follower, "counted", counted)


def finer(branch: jc.Branch, unit: float, scale: np.ndarray) -> jc.orbits.Steps:
    """Steps at most half as long as those of a branch are in the mean."""
    u = np.column_stack([branch.state / scale, branch.value / unit])
    half = float(np.mean(np.linalg.norm(np.diff(u, axis=0), axis=1))) / 2
    return jc.orbits.Steps(first=min(0.01, half), longest=half, most=100000)


def compared(some: Sequence[Any], others: Sequence[Any], floor: float) -> list[str]:
    """Special points that are in one of two lists only, or further apart than they state."""
    left, found = list(others), []
    for p in some:
        near = [q for q in left if q.kind == p.kind and q.status == p.status]
        best = min(near, key=lambda q: abs(q.value - p.value) if np.isfinite(p.value) else 0.0, default=None)
        if best is None or abs(best.value - p.value) > np.nan_to_num(p.error + best.error) + floor:
            found.append(f"{p.kind} at {p.value:.9g}, {p.status}: not in the finer run")
        else:
            left.remove(best)
    return found + [f"{q.kind} at {q.value:.9g}, {q.status}: in the finer run only" for q in left]
