"""Rollers of a whole bearing along a time history: their loads, forces and slips, over time and around the bearing.

Samples of a history are states; the forces at them are worked out again by the laws that moved them.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError
from .._types import Scalar
from ..models import BearingModel, BearingState
from ..solve import Trajectory
from .spectra import OrderSpectrum, Peak, dominant_orders, spectrum_of


SHARES = (0.5, 0.9, 0.99, 0.999)
"""Shares of the time, for the distribution of the pocket forces."""
LINES = 5
"""Lines of a spectrum that are named."""
BATCH = 512
"""Samples whose forces are worked out at a time."""


@dataclasses.dataclass(frozen=True)
class RollerHistory:
    """Every roller, cage and land at the samples of a time history. SI units."""

    time: Float[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    """Angle of the cage [rad]."""
    samples: int
    """Samples of a revolution of the cage."""
    roller_angle: Float[np.ndarray, "n rollers"]
    """Place on the circumference, counter-clockwise from the x axis [rad]."""
    pocket_force: Float[np.ndarray, "n rollers"]
    """[N], positive where a roller pushes the cage counter-clockwise, negative where it pushes it the other way."""
    inner_load: Float[np.ndarray, "n rollers"]
    outer_load: Float[np.ndarray, "n rollers"]
    roller_slip: Float[np.ndarray, "n rollers"]
    """1 less spin over that of pure rolling."""
    inner_sliding: Float[np.ndarray, "n rollers"]
    """Surface of the inner ring less that of the roller, where they meet or would meet [m/s]."""
    outer_sliding: Float[np.ndarray, "n rollers"]
    pocket_on_cage: Float[np.ndarray, "n 2"]
    """Force of all rollers on the cage [N]."""
    land_on_cage: Float[np.ndarray, "n 2"]
    """Force of the land, film and contact, on the cage [N]."""
    place: Float[np.ndarray, "n 2"]
    """Cage centre from that of its land, over the clearance."""


@eqx.filter_jit
def _at_samples(model: BearingModel, speed: Scalar, states: BearingState) -> tuple[Array, ...]:
    at = model.at_speed(speed)

    def one(state: BearingState) -> tuple[Any, ...]:
        f: Any = at.forces(state)
        g, pocket = f.geometry, f.pocket
        x = jnp.sum(pocket.along * g.pocket_sin - pocket.out * g.pocket_cos)
        y = jnp.sum(-pocket.along * g.pocket_cos - pocket.out * g.pocket_sin)
        on_cage, land = jnp.stack([x, y]), jnp.stack([jnp.asarray(f.land.x), jnp.asarray(f.land.y)])
        return -pocket.along, f.inner.load, f.outer.load, f.inner.sliding, f.outer.sliding, on_cage, land

    return jax.lax.map(one, states, batch_size=BATCH)


def roller_history(model: BearingModel, run: Trajectory) -> RollerHistory:
    """Forces, loads and slips of every roller at the samples of a time history at one shaft speed."""
    speed = float(run.speed[0])
    states = BearingState(*map(jnp.asarray, (run.rollers, run.bodies, run.integrals[:, :2])))
    found = tuple(map(np.asarray, _at_samples(model, jnp.asarray(speed), states)))
    place = run.bodies[:, 0:2] - (run.bodies[:, 5:7] if model.guidance == "inner" else 0.0)
    pocket, inner, outer, inner_sliding, outer_sliding, on_cage, land = found
    n = model.bearing.n_rollers
    return RollerHistory(
        time=run.time,
        angle=run.angle,
        samples=run.samples,
        roller_angle=run.angle[:, None] + 2 * np.pi / n * np.arange(n) + run.rollers[:, 0],
        pocket_force=pocket,
        inner_load=inner,
        outer_load=outer,
        roller_slip=1 - run.rollers[:, 1] / float(model.rolling_spin(speed)),
        inner_sliding=inner_sliding,
        outer_sliding=outer_sliding,
        pocket_on_cage=on_cage,
        land_on_cage=land,
        place=place / float(model.clearance),
    )


@dataclasses.dataclass(frozen=True)
class Around:
    """Means over time at each place of the circumference; NaN where no roller was."""

    angle: Float[np.ndarray, " bins"]
    """Middle of each part of the circumference, counter-clockwise from the x axis, 0 to 2 pi; the load points to
    3 pi/2."""
    roller_slip: Float[np.ndarray, " bins"]
    inner_sliding: Float[np.ndarray, " bins"]
    """[m/s]."""
    inner_load: Float[np.ndarray, " bins"]
    """Load of a roller there [N]."""
    driving_force: Float[np.ndarray, " bins"]
    """Mean pocket force by which a roller there drives the cage, times without contact counted as zero [N]."""
    braking_force: Float[np.ndarray, " bins"]
    """Mean pocket force by which a roller there holds the cage back [N]."""
    largest_force: Float[np.ndarray, " bins"]
    """Largest pocket force at a sample."""


def around(history: RollerHistory, bins: int = 36) -> Around:
    """Slips, loads and pocket forces over the circumference, from all rollers as they pass.

    **Arguments:** history; parts of the circumference.

    **Raises:** `ValueError` for fewer than 2 parts.
    """
    if bins < 2:
        raise ArgumentError("bins", said=f"must be at least 2, but {bins} was given.")
    where = np.floor(np.mod(history.roller_angle, 2 * np.pi) * bins / (2 * np.pi)).astype(int) % bins
    weight = np.broadcast_to(np.gradient(history.time)[:, None], where.shape)
    total = np.bincount(where.ravel(), weight.ravel(), bins)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = lambda x: np.bincount(where.ravel(), (weight * x).ravel(), bins) / total
        force = np.sign(history.angle[-1] - history.angle[0]) * history.pocket_force
        largest = np.full(bins, -np.inf)
        np.maximum.at(largest, where.ravel(), np.abs(force).ravel())
        return Around(
            angle=(np.arange(bins) + 0.5) * 2 * np.pi / bins,
            roller_slip=mean(history.roller_slip),
            inner_sliding=mean(history.inner_sliding),
            inner_load=mean(history.inner_load),
            driving_force=mean(np.maximum(force, 0.0)),
            braking_force=mean(np.maximum(-force, 0.0)),
            largest_force=np.where(np.isfinite(largest), largest, np.nan),
        )


def pocket_force_distribution(history: RollerHistory) -> dict[str, float]:
    """Share of the time in which a pocket is in contact, and forces [N] not exceeded in given shares of that time."""
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


def bearing_orders(model: BearingModel, run: Trajectory) -> dict[str, float]:
    """Frequencies that a bearing is known by, over that of the cage: means over the run."""
    cage = run.total("cage_speed") / (run.time[-1] - run.time[0])
    spin = run.total("roller_spin") / (run.time[-1] - run.time[0])
    ring, n = float(run.speed[0]) / cage, model.bearing.n_rollers
    return {
        "cage": 1.0,
        "twice cage": 2.0,
        "inner ring": float(abs(ring)),
        "roller spin": float(abs(spin / cage)),
        "roller pass, outer ring": float(n * abs(1 - float(model.outer_speed) / cage)),
        "roller pass, inner ring": float(n * abs(ring - 1)),
    }


def bearing_spectra(history: RollerHistory) -> dict[str, OrderSpectrum]:
    """Amplitude spectra, by orders of the cage's speed: of the cage's vertical place over the clearance, and of the
    vertical force of all pockets on the cage [N].

    **Raises:** `ValueError` for fewer than 2 revolutions.
    """
    revolutions = (len(history.time) - 1) // history.samples
    if revolutions < 2:
        raise ArgumentError("history", said=f"must last for at least 2 revolutions, but lasts for {revolutions}.")
    last = slice(-revolutions * history.samples, None)
    signals = {"cage_place": history.place[last, 1], "pocket_force": history.pocket_on_cage[last, 1]}
    return {name: spectrum_of(signal, history.samples) for name, signal in signals.items()}


@dataclasses.dataclass(frozen=True)
class NamedLine:
    """A line of a spectrum with the frequency of the bearing that it is at, if one is within a line's width."""

    order: float
    amplitude: float
    name: str | None


def named_lines(spectrum: OrderSpectrum, orders: Mapping[str, float], count: int = LINES) -> list[NamedLine]:
    """The largest lines of a spectrum, largest first, with names out of `orders`."""

    def name(peak: Peak) -> str | None:
        nearest = min(orders, key=lambda k: abs(orders[k] - peak.order))
        return nearest if abs(orders[nearest] - peak.order) <= spectrum.resolution else None

    return [NamedLine(p.order, p.amplitude, name(p)) for p in dominant_orders(spectrum, count)]
