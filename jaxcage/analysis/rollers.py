"""Rollers of a whole bearing along a time history: slips, loads and forces around the bearing; lines of spectra."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from .._errors import ArgumentError
from ..models import RollerHistory
from .spectra import OrderSpectrum, Peak, dominant_orders, spectrum_of


PARTS = 36
"""Number of parts of the circumference."""
SHARES = (0.5, 0.9, 0.99, 0.999)
"""Fractions of the contact time at which the distribution of the pocket forces is evaluated."""
LINES = 5
"""Number of lines of a spectrum that are named."""


def around(history: RollerHistory) -> xr.Dataset:
    """Slips, loads and pocket forces around the circumference: means over time and rollers, NaN where there was none.

    **Returns:** over `angle`, the middle of each part counter-clockwise from the x axis, 0 to 2 pi (the load points to
    3 pi/2): `roller_slip`; `inner_sliding`, speed at the inner ring [m/s]; `inner_load` between a roller and that ring
    [N]; `driving_force` and `braking_force` of rollers that drive or brake the cage, zero without contact [N].
    """
    where = np.floor(np.mod(history.roller_angle, 2 * np.pi) * PARTS / (2 * np.pi)).astype(int) % PARTS
    weight = np.broadcast_to(np.gradient(history.time)[:, None], where.shape)
    force = np.sign(history.angle[-1] - history.angle[0]) * history.pocket_force
    each = {name: getattr(history, name) for name in ("roller_slip", "inner_sliding", "inner_load")}
    each |= {"driving_force": np.maximum(force, 0.0), "braking_force": np.maximum(-force, 0.0)}
    total = lambda x: np.bincount(where.ravel(), x.ravel(), PARTS)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = {name: ("angle", total(weight * x) / total(weight)) for name, x in each.items()}
    return xr.Dataset(means, {"angle": (np.arange(PARTS) + 0.5) * 2 * np.pi / PARTS})


def pocket_force_distribution(history: RollerHistory) -> dict[str, float]:
    """Fraction of the time in which a pocket is in contact, and quantiles of the force [N] over that time."""
    force = np.abs(history.pocket_force)
    weight = np.broadcast_to(np.gradient(history.time)[:, None], force.shape)
    touching, levels = force > 0, np.zeros(len(SHARES))
    if touching.any():
        levels = np.quantile(force[touching], SHARES, weights=weight[touching], method="inverted_cdf")
    found = {"contact_share": float(weight[touching].sum() / weight.sum())}
    return found | {f"q{100 * share:g}": float(level) for share, level in zip(SHARES, levels, strict=True)}


def bearing_spectra(history: RollerHistory) -> dict[str, OrderSpectrum]:
    """Amplitude spectra, over orders of the cage speed, of the cage's vertical position over the clearance and of the
    vertical force of all pockets on the cage [N].

    **Raises:** `ValueError` for fewer than 2 revolutions.
    """
    revolutions = (len(history.time) - 1) // history.samples
    if revolutions < 2:
        raise ArgumentError("history", said=f"must last for at least 2 revolutions, but lasts for {revolutions}.")
    last = slice(-revolutions * history.samples, None)
    signals = {"cage_place": history.place[last, 1], "pocket_force": history.pocket_on_cage[last, 1]}
    return {name: spectrum_of(signal, history.samples) for name, signal in signals.items()}


def named_lines(spectrum: OrderSpectrum, orders: Mapping[str, float], count: int = LINES) -> list[Peak]:
    """Largest lines of a spectrum, in descending order, with names from `orders`."""

    def name(peak: Peak) -> str | None:
        nearest = min(orders, key=lambda k: abs(orders[k] - peak.order))
        return nearest if abs(orders[nearest] - peak.order) <= spectrum.resolution else None

    return [peak._replace(name=name(peak)) for peak in dominant_orders(spectrum, count)]
