"""What a cage designer reads off a trajectory: forces, whirl, scatter, film thickness, power.

Motion is that of the cage centre relative to the rib (C - O). Averages are over time, sample by
sample: with evenly spaced phases and whole revolutions the sum is as good as the integral.
"""

import dataclasses
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from .._checks import require_x64
from .._errors import ArgumentError
from .._form import compiled
from .._notebook import notebook_html
from ..forces import Force
from ..integrate import Trajectory
from ..models import CageModel
from ._bearing_measures import measure


BATCH = 256
"""Samples whose forces are worked out at a time where the speed changes from sample to sample."""

Histories = dict[str, tuple[Array, Array, Array]]
"""(F_x, F_y, moment) of each force at every sample."""

STILL = 1e-9
"""A centre that moves by less than this part of the clearance, or per radian, stands still."""
AMBIGUOUS = 0.75 * np.pi
"""Angle about a centre from sample to sample that may as well be the other way around."""
DOUBT = 0.02
"""Of a whirl ratio, at most: an orbit may run through its centre once in fifty revolutions."""


def relative_state(
    model: CageModel, state: Float[np.ndarray, "n dim"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2"]]:
    """Position [m] and velocity [m/s] of the cage centre relative to the rib.

    **Raises:** `ValueError` for states of another model.
    """
    dim = model.dimension
    if state.shape[-1] != dim:
        raise ArgumentError("state", said=f"must have {dim} components, but it has {state.shape[-1]}.")
    q, v = state[:, : dim // 2], state[:, dim // 2 :]
    if dim == 4:
        return q, v
    return q[:, :2] - q[:, 2:], v[:, :2] - v[:, 2:]


@compiled
def _forces_at_one_speed(
    model: CageModel, speed: Array, tau: Float[Array, " n"], motion: Float[Array, "n 4"]
) -> Histories:
    cage = model.cage_at(speed)
    forces: Any = jax.vmap(lambda t, m: cage.forces(t, *m))  # of many samples, so not `Force` any more
    return forces(tau, motion)


@compiled
def _forces(
    model: CageModel,
    speed: Float[Array, " n"],
    tau: Float[Array, " n"],
    motion: Float[Array, "n 4"],
) -> Histories:
    def at(sample: tuple[Array, Array, Array]) -> dict[str, Force]:
        omega, t, m = sample
        return model.cage_at(omega).forces(t, *m)

    return jax.lax.map(at, (speed, tau, motion), batch_size=BATCH)


def cage_forces(model: CageModel, trajectory: Trajectory) -> dict[str, Float[np.ndarray, "n 2"]]:
    """Every force on the cage along a trajectory of `model`.

    **Returns:** `film`, `contact`, `support`, `impact`, `unbalance`, `weight` and those of the model's `extra`
    by the names of their classes, each (F_x, F_y) [N] at every sample, at the speed of that sample.
    """
    return {name: np.stack(force[:2], axis=1) for name, force in _along(model, trajectory).items()}


def cage_moments(model: CageModel, trajectory: Trajectory) -> dict[str, Float[np.ndarray, " n"]]:
    """The moment of every force on the cage about its centre along a trajectory of `model`, counter-clockwise.

    The cage turns at a speed that is given: moments enter no equation of motion. A moment times the speed is the power
    that it gives the cage, for the film minus that of `film_drag_power`.

    **Returns:** moments [N m] at every sample, by the names of `cage_forces`.
    """
    return {name: np.broadcast_to(force[2], len(trajectory.tau)) for name, force in _along(model, trajectory).items()}


def _along(model: CageModel, trajectory: Trajectory) -> Histories:
    """Every force and moment at each sample."""
    require_x64()
    position, velocity = relative_state(model, trajectory.state)
    motion = jax.numpy.asarray(np.concatenate([position, velocity], axis=1))
    tau, speed = jax.numpy.asarray(trajectory.tau), jax.numpy.asarray(trajectory.speed)
    if np.all(trajectory.speed == trajectory.speed[0]):
        forces = _forces_at_one_speed(model, speed[0], tau, motion)
    else:
        forces = _forces(model, speed, tau, motion)
    return {name: forces[name] for name in model.force_names}  # programs return a dictionary sorted


def film_drag_power(
    model: CageModel, speed: Float[np.ndarray, " n"], eps: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Power [W] that shearing the film in all lands costs: torque times speed.

    Torque of one land 2 pi mu omega R^3 L/(c sqrt(1 - eps^2)), the short bearing's; as the film
    force, it keeps its value beyond the onset of contact. The gap is taken as full of oil at the
    lubricant's own temperature: an upper bound where the land starves or warms up.

    **Arguments:** model; speed [rad/s] and eccentricity ratio at each sample.
    """
    film, radius = model.film, float(model.land_radius)
    kept = np.minimum(eps, float(model.contact.onset))
    shear = float(model.lubricant.dynamic_viscosity) * radius**3 * float(film.land_width)
    torque = 2 * np.pi * shear * speed / (float(model.clearance) * np.sqrt(1 - kept**2))
    return film.n_lands * torque * speed


def winding(
    position: Float[np.ndarray, "n 2"], centre: Float[np.ndarray, " 2"], resolution: float = 0.0
) -> tuple[float, int]:
    """Angle [rad] by which the motion has gone around `centre`, counter-clockwise, and how many steps are in doubt.

    A step of about half a turn from sample to sample may as well be the other way around, and so may one that begins
    nearer to the centre than `resolution` [m]: the orbit runs through the centre, or its samples are too far apart.
    """
    x, y = (position - centre).T
    turned = np.unwrap(np.arctan2(y, x))
    doubted = (np.abs(np.diff(turned)) > AMBIGUOUS) | (np.hypot(x, y)[:-1] < resolution)
    return float(turned[-1] - turned[0]), int(np.sum(doubted))


@dataclasses.dataclass(frozen=True)
class OrbitMeasures:
    """Measures of one orbit of the cage centre in its rib; printed, a table with units."""

    whirl_ratio: float = measure("1", "whirl speed about the mean centre / cage speed")
    """Mean angular velocity about the mean centre over the mean cage speed, positive in the sense
    of rotation; NaN where the centre moves by less than the run's error, or runs through its mean. 1 is synchronous,
    near 0.5 oil whirl."""
    rib_whirl_ratio: float = measure("1", "whirl speed about the rib centre / cage speed")
    """The same about the rib centre: 0 for an orbit that does not go around it, NaN for one that runs through it."""
    rms: float = measure("m", "rms displacement about the mean")
    """Root of the mean square distance from the mean centre [m]."""
    peak_displacement: float = measure("m", "largest displacement about the mean")
    """[m], at the samples."""
    largest_eps: float = measure("1", "largest eccentricity ratio")
    """At any step of the integration; above 1 the surfaces overlap."""
    minimum_film_thickness: float = measure("m", "smallest film thickness")
    """c (1 - eps) at the largest eps, not below 0 [m]."""
    velocity_scatter: float = measure("1", "scatter of the centre's speed / mean speed")
    """Standard deviation of |v| over its mean (Ghaisas et al. 2004): small is steady; 0 for a
    circle, NaN where the centre stands still."""
    peak_contact_force: float = measure("N", "largest land contact force")
    """[N], at the samples."""
    mean_contact_force: float = measure("N", "mean land contact force")
    """Mean of |F_contact| [N]."""
    contact_impulse: float = measure("N s", "land contact impulse per revolution")
    """Integral of |F_contact| over the time of a revolution [N s]; wear of the lands follows it."""
    peak_impact_force: float = measure("N", "largest impact force")
    """[N], at the samples."""
    impact_impulse: float = measure("N s", "impact impulse per revolution")
    """Integral of |F_impact| over the time of a revolution [N s]; wear of the pockets follows it
    (Archard)."""
    drag_power: float = measure("W", "power to shear the film")
    """Mean of `film_drag_power` [W]."""
    film_power: float = measure("W", "power the film takes from the centre's motion")
    """Mean of -F_film . v [W]; negative where the rotation drives the whirl through the film."""

    def __str__(self) -> str:
        lines = []
        for field in dataclasses.fields(self):
            unit = "" if field.metadata["unit"] == "1" else field.metadata["unit"]
            value = getattr(self, field.name)
            lines.append(f"{field.metadata['text']:<48s} {value:12.5g} {unit}".rstrip())
        return "\n".join(lines)

    _repr_html_ = notebook_html


def orbit_measures(model: CageModel, trajectory: Trajectory) -> OrbitMeasures:
    """Measures of a trajectory of `model`, best over whole revolutions without the transient.

    **Raises:** `ValueError` for a trajectory that failed, or of fewer than 3 samples.
    """
    require_x64()
    if trajectory.outcome != "successful" or len(trajectory.tau) < 3:
        raise ArgumentError(
            "trajectory",
            said="must be a run that succeeded, of at least 3 samples, "
            f"but this one has {len(trajectory.tau)} and ended with: {trajectory.outcome}.",
        )
    position, velocity = relative_state(model, trajectory.state)
    speed, c = trajectory.speed, float(model.clearance)
    weights = (1 / speed) / np.sum(1 / speed)  # samples are even in phase: time of each

    def mean(f: Float[np.ndarray, " n"]) -> float:
        return float(np.sum(weights * f))

    def whirl(centre: Float[np.ndarray, " 2"]) -> float:
        angle, doubted = winding(position, centre, float(np.fmax(STILL, trajectory.error)) * c)
        return angle / phase if 2 * np.pi * doubted <= DOUBT * phase else float("nan")

    def impulse(f: Float[np.ndarray, " n"]) -> float:
        return float(2 * np.pi * np.mean(f / speed))

    centre = np.sum(weights[:, None] * position, axis=0)
    away = np.hypot(*(position - centre).T)
    pace = np.hypot(*velocity.T)
    phase = float(trajectory.tau[-1] - trajectory.tau[0])
    paced = np.mean(pace) > STILL * c * np.mean(speed)
    eps = np.hypot(*position.T) / c
    largest = max(float(np.max(eps)), trajectory.peak)
    forces = cage_forces(model, trajectory)
    contact, impact = (np.hypot(*forces[name].T) for name in ("contact", "impact"))
    return OrbitMeasures(
        whirl_ratio=whirl(centre),
        rib_whirl_ratio=whirl(np.zeros(2)),
        rms=float(np.sqrt(mean(away**2))),
        peak_displacement=float(np.max(away)),
        largest_eps=largest,
        minimum_film_thickness=max(c * (1 - largest), 0.0),
        velocity_scatter=float(np.std(pace, ddof=1) / np.mean(pace)) if paced else float("nan"),
        peak_contact_force=float(np.max(contact)),
        mean_contact_force=mean(contact),
        contact_impulse=impulse(contact),
        peak_impact_force=float(np.max(impact)),
        impact_impulse=impulse(impact),
        drag_power=mean(film_drag_power(model, speed, eps)),
        film_power=mean(-np.sum(forces["film"] * velocity, axis=1)),
    )
