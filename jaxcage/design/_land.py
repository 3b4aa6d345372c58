"""What running costs the guiding land: the force with which the cage meets it, the load that wears it, the film's drag.

Archard's law (J. F. Archard, J. Appl. Phys. 24 (1953) 981): the volume worn off is k N s, with the normal force N, the
way s slid and a specific wear rate k of the two surfaces and their oil. k is a shop's own number and the same before
and after; what a design changes is the mean of N times the sliding speed.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._errors import ArgumentError
from ..analysis import Sweep
from ..models import CageModel
from ..solve import AbstractMethod
from ..sweeps import averages
from ._chaos import ChaosMeasure
from ._objective import AbstractObjective, DesignSpace


MEASURES = {"wear load": "N m/s", "peak land force": "N", "film drag power": "W"}
"""What is to be made small, with its unit."""
FILM = "least film"
"""[m]. Where nothing touches it tells designs apart, which wear and force do not."""


def land_force(model: CageModel, speed: Array, tau: Array, state: Any) -> tuple[Array, Array, Array]:
    """Size of the land's contact force on the cage [N], the power to shear the film [W], and how far the cage is out of
    the middle of its guide [m]."""
    n = len(state) // 2
    q, v = state[:n], state[n:]
    if n == 4:  # an elastic rib moves too
        q, v = (q[0] - q[2], q[1] - q[3]), (v[0] - v[2], v[1] - v[3])
    forces = model.cage_at(speed).forces(tau, *q, *v)
    fx, fy, _ = forces["contact"]
    return jnp.sqrt(fx * fx + fy * fy), -forces["film"][2] * speed, jnp.sqrt(q[0] * q[0] + q[1] * q[1])


@dataclasses.dataclass(frozen=True, eq=False)
class LandMeasure(AbstractObjective):
    """The mean over speeds, weighted as in `chaos`, of what its designs' land feels; the mean over their starts.

    `wear load` [N m/s]: mean contact force times the speed at which the cage's land slides on the rib's; `peak land
    force` [N]: its largest value over some revolutions; `film drag power` [W]: what shearing the film takes; `least
    film` [m]: the smallest distance of cage and rib, of the starts the least, 0 where they touch: it is to be made
    large. They come from the same simulations as `chaos`.
    """

    chaos: ChaosMeasure
    what: str = "wear load"
    revolutions: int = 4

    def __post_init__(self):
        if self.what not in (*MEASURES, FILM):
            raise ArgumentError(
                "what", said=f"must be one of {', '.join((*MEASURES, FILM))}, but '{self.what}' was given."
            )

    def at_speeds(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k speeds"]:
        """At each speed; NaN where every start of a design failed."""
        models: list[Any] = [space.model(place) for place in places]
        ran = self.chaos.run(space, places)
        if self.revolutions not in ran.loads:
            ran.loads[self.revolutions] = _loads(models, self.chaos.speeds, ran.last, self.revolutions)
        return ran.loads[self.revolutions][self.what]

    def values(self, space: DesignSpace, places: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " k"]:
        weights = self.chaos.weights / np.sum(self.chaos.weights)
        return self.at_speeds(space, np.asarray(places)) @ weights

    def relative(self, space: DesignSpace, price: float) -> AbstractObjective:
        """`price` times this over what the design itself has; where that is next to nothing, over what its weight would
        do: as a peak the whole of it, as a mean force a hundredth, and so its power. Not of the least film."""
        if self.what == FILM:
            raise ArgumentError("what", said=f"must be one of {', '.join(MEASURES)}, but '{FILM}' was given.")
        model: Any = space.system
        speed = float(np.average(self.chaos.speeds, weights=self.chaos.weights))
        least = negligible_load(model, self.what, speed)
        own = float(self.values(space, space.place[None])[0])
        return price / (max(own, least) if np.isfinite(own) else least) * self


def negligible_load(model: CageModel, what: str, speed: float) -> float:
    """What is next to nothing of what `MEASURES` names, at a cage speed [rad/s]: as a peak the cage's weight, as a mean
    force a hundredth of it, and so its power."""
    weight = float(model.cage_mass * model.gravity)
    return weight if MEASURES[what] == "N" else 0.01 * weight * speed * float(model.land_radius)


def land_loads(
    model: CageModel, found: Sweep, method: AbstractMethod | None = None
) -> dict[str, Float[np.ndarray, " speeds"]]:
    """What `MEASURES` names at each speed of a sweep, the mean of its starts, and their `least film` [m], the smallest
    distance of cage and rib, 0 where they touch; over revolutions that begin where the sweep ended.

    **Arguments:** model and its sweep; integration method, by default `jaxcage.native()`.
    """
    return {name: rows[0] for name, rows in _loads([model], found.speed, found.last[None], method=method).items()}


def _loads(
    models: Sequence[Any],
    speeds: Float[np.ndarray, " speeds"],
    last: Float[np.ndarray, "k speeds starts dim"],
    revolutions: int = 4,
    method: AbstractMethod | None = None,
) -> dict[str, Float[np.ndarray, "k speeds"]]:
    starts = last.shape[2]
    which = np.repeat(np.arange(len(models)), speeds.size * starts)
    speed = np.tile(np.repeat(speeds, starts), len(models))
    states = last.reshape(-1, last.shape[-1])
    mean, largest = averages(models, speed, states, which, land_force, revolutions, method)
    radius, clearance = np.array([(float(m.land_radius), float(m.clearance)) for m in models])[which].T

    def mean_of_starts(found: np.ndarray) -> np.ndarray:
        rows = found.reshape(len(models), speeds.size, starts)
        known = np.isfinite(rows)
        return np.sum(np.where(known, rows, 0.0), axis=2) / np.where(known.any(axis=2), known.sum(axis=2), np.nan)

    return {
        "wear load": mean_of_starts(mean[:, 0] * speed * radius),
        "peak land force": mean_of_starts(largest[:, 0]),
        "film drag power": mean_of_starts(mean[:, 1]),
        FILM: np.fmin.reduce(np.maximum(clearance - largest[:, 2], 0.0).reshape(len(models), -1, starts), axis=2),
    }
