"""Loads of the guiding land, and size and whirl of the motion, over revolutions that go on from the end of a sweep.

Archard's law (J. F. Archard, J. Appl. Phys. 24 (1953) 981): the volume worn off is k N s, with the normal force N, the
sliding distance s and a specific wear rate k of the two surfaces and their oil. k is a shop's own number and the same
for every design; a design changes the mean of N times the sliding speed.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Complex, Float

from .._pytrees import Form, compiled
from ..analysis import OrderSpectrum, dominant_orders
from ..models import AbstractForcedSystem, CageModel
from ..solve import REVOLUTION, AbstractMethod, Lanes, histories, native


LAND_LOADS = {"wear load": "N m/s", "peak land force": "N", "film drag power": "W"}
"""Loads of the land, with their units: mean contact force times sliding speed, largest contact force over some
revolutions, mean power to shear the film."""
FILM = "least film"
"""Smallest distance of cage and rib [m], 0 where they touch."""
SAMPLES = 512
"""Phases of a revolution at which loads are read. A blow on the land lasts for some hundredths of a radian: its peak is
read up to 5 % too low (case 1b at 9000 and 27500 rpm beside 4096 phases), its impulse to 0.5 %."""
CHUNK = 64
"""Lanes whose loads are read at a time."""
MOTION_SAMPLES = 32
"""Phases of a revolution at which the motion is read: the size of a circle at cage frequency is read up to 0.5 % too
small, that of one at the fourth order up to 8 %."""
MOTION_REVOLUTIONS = 32
"""Revolutions over which the motion is read: orders are resolved to 1/32, and interpolated between."""

Reading = Callable[[Any, Any, Any, Any], tuple[Any, ...]]
"""Function of (model, speed, phase, state) that returns numbers."""


def _ended(models: Sequence[AbstractForcedSystem], found: xr.Dataset) -> tuple[Lanes, Float[np.ndarray, "lanes dim"]]:
    """Lanes of a sweep of designs, and their last states."""
    last = found["last"]
    place = np.indices(last.shape[:-1]).reshape(last.ndim - 1, -1)
    which = place[0] if "design" in last.dims else np.zeros(place.shape[1], dtype=int)
    return Lanes.of(models, found["speed"].values[place[-2]], which), last.values.reshape(-1, last.shape[-1])


@compiled
def _read(
    form: Form, several: bool, read: Reading, speed: Array, rows: Any, tau: Float[Array, " n"], states: Array
) -> Float[Array, "lanes n numbers"]:
    def lane(speed: Array, row: Any, states: Array) -> Array:
        system = form.filled(row)
        row_of = lambda tau, y: jnp.stack([jnp.asarray(x, float) for x in read(system, speed, tau, tuple(y))])
        return jax.vmap(row_of)(tau, states)

    return jax.vmap(lane, in_axes=(0, 0 if several else None, 0))(speed, rows, states)


def averages(
    models: Sequence[AbstractForcedSystem],
    found: xr.Dataset,
    read: Reading,
    revolutions: int = 4,
    method: AbstractMethod | None = None,
) -> tuple[Float[np.ndarray, "*lanes numbers"], Float[np.ndarray, "*lanes numbers"]]:
    """Means and largest values of what `read` returns, over revolutions that go on from the end of a sweep.

    **Arguments:** models and their sweep; reading at 512 phases of a revolution; revolutions; integration method, by
    default `jaxcage.native()`.

    **Returns:** both over the axes of the sweep; NaN where a lane is not known to the method's error.
    """
    chosen, (lanes, last) = native() if method is None else method, _ended(models, found)
    tau = jnp.asarray(np.tile(np.arange(SAMPLES) * (REVOLUTION / SAMPLES), revolutions))
    parts = []
    for first in range(0, len(last), CHUNK):
        some = np.arange(first, min(first + CHUNK, len(last)))
        seen, error = histories(lanes.at(some), last[some], SAMPLES, revolutions, chosen)
        given = [jnp.asarray(lanes.speed[some]), [jnp.asarray(x) for x in lanes.rows(some)], tau, jnp.asarray(seen)]
        values = np.asarray(_read(lanes.form, lanes.several, read, *given))
        known = (error <= chosen.allowed)[:, None]
        parts.append([np.where(known, x, np.nan) for x in (values.mean(axis=1), values.max(axis=1))])
    mean, largest = (np.concatenate(x).reshape(*found["last"].shape[:-1], -1) for x in zip(*parts, strict=True))
    return mean, largest


def _land_force(model: CageModel, speed: Array, tau: Array, state: Any) -> tuple[Array, Array, Array]:
    """Size of the land's contact force on the cage [N], power to shear the film [W], distance of the cage's centre from
    that of its guide [m]."""
    n = len(state) // 2
    q, v = state[:n], state[n:]
    if n == 4:  # an elastic rib moves too
        q, v = (q[0] - q[2], q[1] - q[3]), (v[0] - v[2], v[1] - v[3])
    forces = model.cage_at(speed).forces(tau, *q, *v)
    fx, fy, _ = forces["contact"]
    return jnp.sqrt(fx * fx + fy * fy), -forces["film"][2] * speed, jnp.sqrt(q[0] * q[0] + q[1] * q[1])


def loads_of_lanes(
    models: Sequence[CageModel], found: xr.Dataset, revolutions: int = 4, method: AbstractMethod | None = None
) -> dict[str, Float[np.ndarray, "designs speeds starts"]]:
    """Loads of the land and least film in each lane of a sweep of designs; NaN where a lane failed."""
    mean, largest = averages(models, found, _land_force, revolutions, method)
    radius, clearance = np.array([(float(m.land_radius), float(m.clearance)) for m in models]).T[:, :, None, None]
    return {
        "wear load": mean[..., 0] * found["speed"].values[:, None] * radius,
        "peak land force": largest[..., 0],
        "film drag power": mean[..., 1],
        FILM: np.maximum(clearance - largest[..., 2], 0.0),
    }


def mean_of_known(values: Float[np.ndarray, "*lanes starts"]) -> Float[np.ndarray, "*lanes"]:
    """Mean over the initial states that did not fail; NaN where all failed."""
    known = np.isfinite(values)
    return np.sum(np.where(known, values, 0.0), axis=-1) / np.where(known.any(axis=-1), known.sum(axis=-1), np.nan)


def land_loads(
    model: CageModel, found: xr.Dataset, method: AbstractMethod | None = None
) -> dict[str, Float[np.ndarray, " speeds"]]:
    """Loads of the land (`LAND_LOADS`) at each speed of a sweep, means over the initial states, and the `least film`.

    **Arguments:** model and its sweep; integration method, by default `jaxcage.native()`.
    """
    lanes = loads_of_lanes([model], found.expand_dims("design"), method=method)
    film = np.fmin.reduce(lanes.pop(FILM)[0], axis=1)
    return {name: mean_of_known(values[0]) for name, values in lanes.items()} | {FILM: film}


def negligible_load(model: CageModel, name: str, speed: float) -> float:
    """Load of the land that is next to nothing at a cage speed [rad/s]: for a peak the cage's weight, for a mean force
    a hundredth of it."""
    weight = float(model.cage_mass * model.gravity)
    return weight if LAND_LOADS[name] == "N" else 0.01 * weight * speed * float(model.land_radius)


@dataclasses.dataclass(frozen=True)
class Motion:
    """Motion of the cage centre relative to its rib in each lane of a sweep; NaN where a lane failed."""

    horizontal: Float[np.ndarray, "*lanes"]
    """From one end to the other [m], as a probe reads it."""
    vertical: Float[np.ndarray, "*lanes"]
    """From one end to the other [m]."""
    whirl_order: Float[np.ndarray, "*lanes"]
    """Order of the largest line in the spectrum of x + i y, a multiple of the cage speed: negative where it whirls
    against the rotation; NaN where the centre stands still."""

    @property
    def size(self) -> Float[np.ndarray, "*lanes"]:
        """Size of the orbit [m], the larger of both."""
        return np.maximum(self.horizontal, self.vertical)


def motions(
    models: CageModel | Sequence[CageModel],
    found: xr.Dataset,
    *,
    revolutions: int = MOTION_REVOLUTIONS,
    method: AbstractMethod | None = None,
) -> Motion:
    """The motion over revolutions that go on from the end of a sweep.

    **Arguments:** model or designs, and their sweep; revolutions; integration method, by default `jaxcage.native()`.

    **Returns:** the motion over the axes of the sweep; NaN where a lane is not known to the method's error.
    """
    chosen = native() if method is None else method
    lanes, last = _ended(models if isinstance(models, Sequence) else [models], found)
    label, dim = found["label"].values.ravel(), last.shape[1]
    state = np.empty((len(last), revolutions * MOTION_SAMPLES, dim))
    for some, read in ((label == "periodic-1", 1), (label != "periodic-1", revolutions)):
        if np.any(some):  # one revolution shows all of a motion of period 1
            seen, error = histories(lanes.at(np.flatnonzero(some)), last[some], MOTION_SAMPLES, read, chosen)
            seen = np.where((error <= chosen.allowed)[:, None, None], seen, np.nan)
            state[some] = np.tile(seen, (1, revolutions // read, 1))
    q = state[..., :2] if dim == 4 else state[..., :2] - state[..., 2:4]
    across = np.ptp(q, axis=1)
    order = np.array([_order(x + 1j * y, revolutions) for x, y in np.moveaxis(q, 2, 1)])
    return Motion(*(x.reshape(found["label"].shape) for x in (across[:, 0], across[:, 1], order)))


def _order(path: Complex[np.ndarray, " samples"], revolutions: int) -> float:
    """Order of the largest line, by a Hann window."""
    if not np.all(np.isfinite(path)) or np.max(np.abs(path - path[0])) == 0:
        return float("nan")
    n = path.size
    weights = np.hanning(n + 1)[:-1]
    weights /= weights.sum()
    lines = np.abs(np.fft.fftshift(np.fft.fft(weights * (path - weights @ path))))
    order = np.fft.fftshift(np.fft.fftfreq(n, revolutions / n))
    peaks = dominant_orders(OrderSpectrum(order, lines), 1)
    return peaks[0].order if peaks else float("nan")
