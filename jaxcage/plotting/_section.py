"""Strobe section in (Y, Y') at one speed."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from ..quantities import component_names, quantity
from ._style import (
    BLUE,
    GREEN,
    PURPLE,
    SKY,
    VERMILION,
    axes_or_new,
    dots,
    enlarge_dots,
    padded_limits,
)


START_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY)


def strobe_section(
    states: Float[np.ndarray, "starts revolutions dim"],
    ax: Axes | None = None,
    *,
    coordinate: int = 1,
    names: Sequence[str] = (),
) -> Axes:
    """Strobe states in the plane of a coordinate and its velocity, one colour for each start.

    **Arguments:** states at tau = 2 pi n in SI units, coordinates before velocities; axes; which
    coordinate (1: vertical); what to call the starts.
    """
    ax = axes_or_new(ax, 6.5, 5.0)
    half = states.shape[-1] // 2
    components = component_names(states.shape[-1])
    place, velocity = quantity(components[coordinate]), quantity(components[coordinate + half])
    x, y = states[..., coordinate] * place.factor, states[..., coordinate + half] * velocity.factor
    for i, (across, up) in enumerate(zip(x, y, strict=True)):
        # Closed orbits of several starts may coincide: the later ones are drawn smaller, on top.
        closed = _spread(across) < 1e-3 * _spread(x)
        size = 14.0 - 4 * min(i, 2) if closed else 7.0 if across.size <= 100 else 2.5
        label = names[i] if names else f"start {i + 1}"
        style = dots(START_COLOURS[i % len(START_COLOURS)], size)
        ax.plot(across, up, **style, alpha=0.7, rasterized=across.size > 5000, label=label)
    ax.set(xlabel=place.label, ylabel=velocity.label, xlim=_not_too_narrow(x), ylim=_not_too_narrow(y))
    place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": len(x)}
    enlarge_dots(ax.legend(**place, frameon=False, fontsize=9))
    return ax


def _spread(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _not_too_narrow(values: np.ndarray) -> tuple[float, float]:
    """Limits; a point (a periodic orbit, but for rounding) is not blown up to a cloud."""
    low, high = padded_limits(values)
    centre, least = (low + high) / 2, 0.02 * max(abs(low), abs(high))
    return min(low, centre - least), max(high, centre + least)
