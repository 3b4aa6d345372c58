"""Quantities that a cage reports of a time history: whirl, displacement, film, forces, impulses, drag.

Motion is that of the cage centre relative to the rib (C - O). Averages are over time, sample by sample: with evenly
spaced phases and whole revolutions the sum is as good as the integral where forces are smooth. With 512 samples per
revolution the impulse of impacts on the land is accurate to 0.1 %, and their peak to 1 %; with 128, to 1 % and 5 %.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from ..quantities import Quantity


STILL = 1e-9
"""A centre that moves by less than this part of the clearance, or per radian, stands still."""
AMBIGUOUS = 0.75 * np.pi
"""Angle about a centre from sample to sample that may as well be the other way around."""
DOUBT = 0.02
"""Largest doubt of a whirl ratio: an orbit may run through its centre once in fifty revolutions."""


@dataclasses.dataclass(frozen=True)
class CageHistory:
    """Motion of a cage, and the forces on it, at samples that are even in phase. SI units."""

    speed: Float[np.ndarray, " n"]
    phase: float
    """Angle that the cage turns in all samples, with the step after the last one [rad]."""
    position: Float[np.ndarray, "n 2"]
    velocity: Float[np.ndarray, "n 2"]
    forces: dict[str, Float[np.ndarray, "n 2"]]
    drag_power: Float[np.ndarray, " n"]
    """Power to shear the film."""
    clearance: float
    peak: float
    """Largest eccentricity ratio, between the samples too."""
    error: float
    """Error of the states, in clearances."""

    def mean(self, f: Float[np.ndarray, " n"]) -> float:
        """Mean over time."""
        return float(np.sum(f / self.speed) / np.sum(1 / self.speed))

    def size(self, name: str) -> Float[np.ndarray, " n"]:
        """Size of a force."""
        return np.hypot(*self.forces[name].T)

    def impulse(self, f: Float[np.ndarray, " n"]) -> float:
        """Integral over the time of a revolution."""
        return float(2 * np.pi * np.mean(f / self.speed))

    @property
    def centre(self) -> Float[np.ndarray, " 2"]:
        """Mean place."""
        return np.array([self.mean(x) for x in self.position.T])

    @property
    def away(self) -> Float[np.ndarray, " n"]:
        """Distance from the mean place."""
        return np.hypot(*(self.position - self.centre).T)

    @property
    def largest_eps(self) -> float:
        """Largest eccentricity ratio."""
        return max(float(np.max(np.hypot(*self.position.T))) / self.clearance, self.peak)

    def whirl_ratio(self, centre: Float[np.ndarray, " 2"]) -> float:
        """Mean angular velocity about a centre over the cage speed; NaN where the orbit runs through the centre.

        The first and last velocity give the angle of the step after the last sample: half of it at each end.
        """
        resolution = float(np.fmax(STILL, self.error)) * self.clearance
        angle, doubted = winding(self.position, centre, resolution)
        (x, y), (vx, vy) = (self.position[[0, -1]] - centre).T, self.velocity[[0, -1]].T
        turning = (x * vy - y * vx) / np.maximum(x * x + y * y, resolution**2) / self.speed[[0, -1]]
        angle += np.mean(turning) * self.phase / len(self.speed)
        return angle / self.phase if 2 * np.pi * doubted <= DOUBT * self.phase else float("nan")

    @property
    def velocity_scatter(self) -> float:
        """Standard deviation of the centre's speed over its mean; NaN where the centre stands still."""
        pace = np.hypot(*self.velocity.T)
        moves = np.mean(pace) > STILL * self.clearance * np.mean(self.speed)
        return float(np.std(pace, ddof=1) / np.mean(pace)) if moves else float("nan")


def winding(
    position: Float[np.ndarray, "n 2"], centre: Float[np.ndarray, " 2"], resolution: float = 0.0
) -> tuple[float, int]:
    """Angle [rad] by which a motion has gone around `centre`, counter-clockwise, and the number of doubtful steps.

    A step of about half a turn from sample to sample may as well be the other way around, and so may one that begins
    nearer to the centre than `resolution` [m]: the orbit runs through the centre, or its samples are too far apart.
    """
    x, y = (position - centre).T
    turned = np.unwrap(np.arctan2(y, x))
    doubted = (np.abs(np.diff(turned)) > AMBIGUOUS) | (np.hypot(x, y)[:-1] < resolution)
    return float(turned[-1] - turned[0]), int(np.sum(doubted))


def cage_quantities(h: CageHistory) -> list[tuple[Quantity, float]]:
    """Quantities of a cage with their values; forces and displacements are those at the samples."""
    contact, impact, away = h.size("contact"), h.size("impact"), h.away
    taken = -np.sum(h.forces["film"] * h.velocity, axis=1)
    rubbing, hits = h.impulse(contact), h.impulse(impact)
    rows = (
        ("whirl_ratio", "1", "whirl speed about the mean centre / cage speed", h.whirl_ratio(h.centre)),
        ("rib_whirl_ratio", "1", "whirl speed about the rib centre / cage speed", h.whirl_ratio(np.zeros(2))),
        ("rms", "m", "rms displacement about the mean", np.sqrt(h.mean(away**2))),
        ("peak_displacement", "m", "largest displacement about the mean", np.max(away)),
        ("largest_eps", "1", "largest eccentricity ratio", h.largest_eps),
        ("minimum_film_thickness", "m", "smallest film thickness", max(h.clearance * (1 - h.largest_eps), 0.0)),
        ("velocity_scatter", "1", "scatter of the centre's speed / mean speed", h.velocity_scatter),
        ("peak_contact_force", "N", "largest land contact force", np.max(contact)),
        ("mean_contact_force", "N", "mean land contact force", h.mean(contact)),
        ("contact_impulse", "N s", "land contact impulse per revolution, which wear of the lands follows", rubbing),
        ("peak_impact_force", "N", "largest impact force", np.max(impact)),
        ("impact_impulse", "N s", "impact impulse per revolution, which wear of the pockets follows (Archard)", hits),
        ("drag_power", "W", "power to shear the film", h.mean(h.drag_power)),
        ("film_power", "W", "power that the film takes from the centre's motion", h.mean(taken)),
    )
    symbols, shown = {"largest_eps": r"$\epsilon$"}, {"m": "mm"}
    return [(Quantity(n, symbols.get(n, ""), unit, text, shown.get(unit, "")), float(x)) for n, unit, text, x in rows]
