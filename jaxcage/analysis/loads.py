"""Loads of the guiding land, and size and whirl of the motion, over revolutions that continue from the end of a sweep.

Archard's law (J. F. Archard, J. Appl. Phys. 24 (1953) 981): the volume worn off is k N s, with the normal force N, the
sliding distance s and a specific wear rate k of the two surfaces and their oil. k must be measured and is the same for
every design; a design changes the mean of N times the sliding speed.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Bool, Complex, Float

from ..models import CageModel
from ..solve import REVOLUTION, AbstractMethod, Lanes, histories, native
from .spectra import dominant_orders, spectrum_of


FILM = "least film"
LAND_LOADS = {"wear load": "N m/s", "peak land force": "N", "film drag power": "W", FILM: "m"}
"""Loads of the land, with their units: mean contact force times sliding speed, largest contact force, mean power lost
by shear of the film, and least distance of cage and rib, 0 where they touch."""
SAMPLES, REVOLUTIONS = 512, 4
"""Samples per revolution, and revolutions, for the loads. An impact on the land lasts some hundredths of a radian: its
peak is up to 5 % too low (case 1b at 9000 and 27500 rpm against 4096 samples), its impulse accurate to 0.5 %."""
MOTION_SAMPLES, MOTION_REVOLUTIONS = 64, 32
"""Samples per revolution, and revolutions, for the motion. The size of a circle at cage frequency is up to 0.1 % too
small, at the fourth order up to 2 %; orders are resolved to 1/32, and interpolated between."""
Designs = CageModel | Sequence[CageModel]


def _seen(
    models: Designs, found: xr.Dataset, samples: int, revolutions: int, method: AbstractMethod | None
) -> tuple[Lanes, Float[np.ndarray, "lanes samples dim"], Bool[np.ndarray, " lanes"]]:
    """Lanes continued from the end of a sweep, their states at each sample, and True where these are accurate."""
    last, several = found["last"], isinstance(models, Sequence)
    place = np.indices(last.shape[:-1]).reshape(last.ndim - 1, -1)
    which = place[0] if several else np.zeros(place.shape[1], dtype=int)
    lanes = Lanes.of(models if isinstance(models, Sequence) else [models], found["speed"].values[place[-2]], which)
    chosen = native() if method is None else method
    seen, error = histories(lanes, last.values.reshape(-1, last.shape[-1]), samples, revolutions, chosen)
    return lanes, seen, error <= chosen.allowed


def land_reading(model: CageModel, speed: Array, tau: Array, y: Array) -> Float[Array, "3"]:
    """Contact force of the land on the cage [N], power lost by shear of the film [W], and distance of the cage's centre
    from that of its guide [m], for state `y` at phase `tau`."""
    q, v = jnp.split(y, 2)
    if q.size == 4:  # an elastic rib moves too
        q, v = q[:2] - q[2:], v[:2] - v[2:]
    forces = model.cage_at(speed).forces(tau, *q, *v)
    fx, fy, _ = forces["contact"]
    square = fx * fx + fy * fy
    touches = square > 0  # the root has no derivative at 0
    force = jnp.where(touches, jnp.sqrt(jnp.where(touches, square, 1.0)), 0.0)
    return jnp.stack([force, -forces["film"][2] * speed, jnp.hypot(*q)])


def _loads(model: CageModel, speed: Array, states: Array) -> Float[Array, "4"]:
    """`LAND_LOADS` of a lane."""
    tau = jnp.arange(states.shape[0], dtype=float) * (REVOLUTION / SAMPLES)
    force, power, away = jax.vmap(lambda tau, y: land_reading(model, speed, tau, y))(tau, states).T
    film = jnp.maximum(model.clearance - jnp.max(away), 0.0)
    return jnp.stack([jnp.mean(force) * speed * model.land_radius, jnp.max(force), jnp.mean(power), film])


def land_loads(
    models: Designs, found: xr.Dataset, method: AbstractMethod | None = None
) -> dict[str, Float[np.ndarray, "*lanes"]]:
    """Loads of the land (`LAND_LOADS`) in each lane of a sweep; NaN where the error exceeds that allowed by the method.

    **Arguments:** model or designs, and their sweep; integration method, by default `jaxcage.native()`.
    """
    lanes, seen, known = _seen(models, found, SAMPLES, REVOLUTIONS, method)
    loads = lanes.each(_loads, np.arange(len(seen)), seen)
    each = np.where(known[:, None], loads, np.nan).T.reshape(len(LAND_LOADS), *found["last"].shape[:-1])
    return dict(zip(LAND_LOADS, each, strict=True))


def motions(
    models: Designs, found: xr.Dataset, method: AbstractMethod | None = None
) -> tuple[Float[np.ndarray, "*lanes"], Float[np.ndarray, "*lanes"]]:
    """Size and whirl of the motion of the cage centre relative to its rib, in each lane of a sweep.

    **Arguments:** as `land_loads`.

    **Returns:** peak-to-peak size [m], the larger of horizontal and vertical, as a probe measures it; order of the
    largest line in the spectrum of x + i y, a multiple of the cage speed, negative for backward whirl, NaN if the
    centre is at rest. Both are NaN where the error exceeds that allowed by the method.
    """
    _, seen, known = _seen(models, found, MOTION_SAMPLES, MOTION_REVOLUTIONS, method)
    state = np.where(known[:, None, None], seen, np.nan)
    q = state[..., :2] if state.shape[2] == 4 else state[..., :2] - state[..., 2:4]
    order = np.array([_order(x + 1j * y) for x, y in np.moveaxis(q, 2, 1)])
    return np.ptp(q, axis=1).max(axis=1).reshape(found["label"].shape), order.reshape(found["label"].shape)


def _order(path: Complex[np.ndarray, " samples"]) -> float:
    """Order of the largest spectral line; NaN for a centre at rest."""
    if not np.all(np.isfinite(path)) or np.max(np.abs(path - path[0])) == 0:
        return float("nan")
    peaks = dominant_orders(spectrum_of(path, MOTION_SAMPLES), 1)
    return peaks[0].order if peaks else float("nan")
