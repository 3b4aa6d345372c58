"""Spectra over speed."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from .._glossary import quantity
from ._orbit_diagram import label_speed
from ._style import axes_or_new


def waterfall_map(
    rpm: Float[np.ndarray, " speeds"],
    orders: Float[np.ndarray, " orders"],
    amplitude: Float[np.ndarray, "speeds orders"],
    ax: Axes | None = None,
    *,
    decades: float = 4.0,
) -> Axes:
    """Amplitude spectra over speed as a colour map: orders of the cage's rotation upward, amplitude
    logarithmic.

    **Arguments:** speeds [rpm], orders (frequency over rotation), amplitudes [m], axes, decades of
    the colour scale below the largest amplitude. Speeds without a spectrum (NaN) stay white.
    """
    ax = axes_or_new(ax, 8.5, 4.8)
    shown = np.ma.masked_invalid(np.asarray(amplitude) * quantity("amplitude").factor)
    top = float(shown.max()) if shown.count() else 1.0
    top = top if top > 0 else 1.0
    norm = LogNorm(top * 10**-decades, top)
    floor = np.ma.maximum(shown, top * 10**-decades)
    ax.grid(False)
    mesh = ax.pcolormesh(rpm, orders, floor.T, norm=norm, cmap="cividis", shading="nearest", rasterized=True)
    ax.figure.colorbar(mesh, ax=ax, label=quantity("amplitude").label, pad=0.01)
    ax.set(ylabel=quantity("order").label, ylim=(float(orders[0]), float(orders[-1])))
    return label_speed(ax)
