"""Rollers of a whole bearing along a time history: slips, loads and forces around the bearing; lines of spectra."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from ..models import RollerHistory
from .spectra import OrderSpectrum, Peak, dominant_orders, spectrum_of


PARTS = 36
"""Number of parts of the circumference."""
SHARES = (0.5, 0.9, 0.99, 0.999)
"""Fractions of the contact time at which the distribution of the pocket forces is evaluated."""
LINES = 5
"""Number of lines of a spectrum that are named."""


@dataclasses.dataclass(frozen=True)
class Around:
    """Means over time in each part of the circumference; NaN where there was no roller."""

    angle: Float[np.ndarray, " bins"]
    """Middle of each part of the circumference, counter-clockwise from the x axis, 0 to 2 pi; the load points to
    3 pi/2."""
    roller_slip: Float[np.ndarray, " bins"]
    inner_sliding: Float[np.ndarray, " bins"]
    """Mean sliding speed at the inner ring [m/s]."""
    inner_load: Float[np.ndarray, " bins"]
    """Mean load between a roller and the inner ring [N]."""
    driving_force: Float[np.ndarray, " bins"]
    """Mean pocket force by which a roller drives the cage, counted as zero without contact [N]."""
    braking_force: Float[np.ndarray, " bins"]
    """Mean pocket force by which a roller brakes the cage, counted as zero without contact [N]."""


def around(history: RollerHistory) -> Around:
    """Slips, loads and pocket forces around the circumference, averaged over all rollers."""
    bins = PARTS
    where = np.floor(np.mod(history.roller_angle, 2 * np.pi) * bins / (2 * np.pi)).astype(int) % bins
    weight = np.broadcast_to(np.gradient(history.time)[:, None], where.shape)
    total = np.bincount(where.ravel(), weight.ravel(), bins)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = lambda x: np.bincount(where.ravel(), (weight * x).ravel(), bins) / total
        force = np.sign(history.angle[-1] - history.angle[0]) * history.pocket_force
        return Around(
            angle=(np.arange(bins) + 0.5) * 2 * np.pi / bins,
            roller_slip=mean(history.roller_slip),
            inner_sliding=mean(history.inner_sliding),
            inner_load=mean(history.inner_load),
            driving_force=mean(np.maximum(force, 0.0)),
            braking_force=mean(np.maximum(-force, 0.0)),
        )


def pocket_force_distribution(history: RollerHistory) -> dict[str, float]:
    """Fraction of the time in which a pocket is in contact, and quantiles of the force [N] over that time."""
    force = np.abs(history.pocket_force)
    weight = np.broadcast_to(np.gradient(history.time)[:, None], force.shape)
    touching = force > 0
    found = {"contact_share": float(weight[touching].sum() / weight.sum())}
    order = np.argsort(force[touching])
    sorted_force, below = force[touching][order], np.cumsum(weight[touching][order])
    for share in SHARES:
        i = np.searchsorted(below, share * below[-1]) if below.size else 0
        found[f"q{100 * share:g}"] = float(sorted_force[min(i, below.size - 1)]) if below.size else 0.0
    return found


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
