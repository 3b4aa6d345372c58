"""The cage in its guiding rib, driven by unbalance and roller impacts: paper eqs. (16)-(32) in the form
M r_C'' = F_film + F_contact + F_support + F_impact + M e omega^2 (cos tau, sin tau) - M g y.
"""

from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._errors import ArgumentError
from .._parameters import parameter, reading, require_readings, with_numbers
from .._types import Scalar, State
from ..bearing import Bearing, Lubricant, is_concrete
from ..forces import (
    AbstractForce,
    ElasticRib,
    LandContact,
    RibFilm,
    RigidRib,
    RollerPassImpact,
    Support,
    SynchronousImpact,
    UnbalanceReading,
    smooth_norm,
)
from ..quantities import component_names
from ._cage_at_speed import FORCES, CageAtSpeed, ElasticRibLaw, RigidRibLaw
from ._field import AbstractField, SecondOrderField
from ._printed import printed
from ._system import AbstractForcedSystem


ClearanceReading = Literal["as_printed", "radial"]

TINY = 1e-30
"""Square of a speed [m^2/s^2] that keeps a division from being by zero."""
ONSET_WIDTH = 4.0
"""Distance from the onset of land contact, in smoothing lengths, within which steps are not shortened any more."""
SMOOTHEST = 0.1
"""Largest smoothing length over clearance: beyond, it is no longer a detail of the contact or of the film's centre."""


class CageModel(AbstractForcedSystem):
    """A cylindrical-roller-bearing cage guided by the outer-ring rib.

    State: (x_C, y_C, x_C', y_C') with a rigid rib, (x_C, y_C, x_O, y_O, velocities) with an elastic one; metres and
    metres per second, y up, rotation counter-clockwise. `speed` is the cage's speed relative to the rib [rad/s].
    """

    bearing: Bearing
    lubricant: Lubricant
    film: RibFilm
    contact: LandContact
    support: Support
    impact: SynchronousImpact | RollerPassImpact
    cage_mass: Scalar = parameter("kg", 1e-3, 100.0, "cage mass M", kind="drawing")
    guidance_gap: Scalar = parameter("m", 1e-5, 5e-3, "guidance gap C_r between cage and rib", kind="drawing")
    eccentricity: Scalar = parameter(
        "m", 0.0, 1e-3, "distance e of the cage's mass centre from its centre", kind="drawing"
    )
    rib: RigidRib | ElasticRib = eqx.field(default_factory=RigidRib)
    gravity: Scalar = parameter("m/s^2", 0.0, 100.0, "acceleration of gravity", kind="fixed", default=9.81)
    load: Scalar = parameter("N", 0.0, 1e7, "shaft load F", kind="operating", default=4450.0)
    printed_unit: Scalar = parameter(
        "m", 1e-6, 1.0, "unit in which unbalance = as_printed reads rho", kind="fixed", default=1e-3
    )
    clearance_reading: ClearanceReading = reading(
        "radial clearance c of film, contact and land",
        radial="c = C_r/2, as C_r is defined",
        as_printed="c = C_r, as the paper uses it",
    )
    unbalance: UnbalanceReading = reading(
        "centrifugal force of the mass centre",
        physical="M e omega^2",
        as_printed="2 M rho omega^2 with rho = e/C_r in mm, as the paper's eq. (20) reads",
    )
    extra: tuple[AbstractForce, ...] = eqx.field(default=(), converter=with_numbers)
    """Forces of one's own between land and cage, each a `jaxcage.forces.AbstractForce` named after its class."""

    def __check_init__(self) -> None:
        require_readings(self)
        for name, kinds in PARTS.items():
            part = getattr(self, name)
            if isinstance(part, eqx.Module) and type(part) not in kinds:
                wanted = " or ".join(f"`{kind.__name__}`" for kind in kinds)
                raise ArgumentError(
                    name,
                    said=f"must be a {wanted}, but is a `{type(part).__name__}`; a force of your own goes in `extra`.",
                )
        _check_extra(self.extra)
        clearance = self.clearance
        for name, length in (("contact", self.contact.smoothing), ("film", self.film.smoothing)):
            if is_concrete(length, clearance) and np.any(np.asarray(length) > SMOOTHEST * np.asarray(clearance)):
                given, room = (1e3 * a for a in _worst(length, clearance))
                raise ArgumentError(
                    f"{name}.smoothing",
                    said=f"must be at most a tenth of the clearance, {room:g} mm, but is {given:g} mm.",
                )

    def __str__(self) -> str:
        return printed(self)

    @property
    def dimension(self) -> int:
        return 4 if isinstance(self.rib, RigidRib) else 8

    speed_text = "cage speed"

    @property
    def components(self) -> tuple[str, ...]:
        return component_names(self.dimension)

    def other_speed(self, speed: Scalar) -> tuple[str, Scalar]:
        return "shaft speed", self.bearing.shaft_speed(speed)

    def centre(self, y: State) -> tuple[Scalar, Scalar]:
        x, dy = (y[0], y[1]) if isinstance(self.rib, RigidRib) else (y[0] - y[2], y[1] - y[3])
        return x / self.clearance, dy / self.clearance

    @property
    def clearance(self) -> Array:
        """Radial clearance c [m]: (12) defines C_r as diametral, (13) and (25)-(27) use it as radial."""
        return jnp.asarray(self.guidance_gap if self.clearance_reading == "as_printed" else self.guidance_gap / 2)

    @property
    def land_radius(self) -> Array:
        """Radius of the cage's guiding land R = (d_g - C_r)/2 [m]."""
        return jnp.asarray((self.bearing.rib_diameter - self.guidance_gap) / 2)

    @property
    def harmonics(self) -> int:
        """Unbalance and the impact of (15) turn with the cage; rollers pass Z times in a revolution."""
        own = max((law.harmonics for law in self.extra), default=1)
        if isinstance(self.impact, RollerPassImpact):
            return max(own, self.bearing.n_rollers * self.impact.harmonics)
        return own

    def cage_at(self, speed: Scalar) -> CageAtSpeed:
        """The cage's force laws at `speed` [rad/s]."""
        return CageAtSpeed.of(self, speed)

    def at_speed(self, speed: Scalar) -> AbstractField:
        cage = self.cage_at(speed)
        law = RigidRibLaw(cage) if isinstance(self.rib, RigidRib) else ElasticRibLaw(cage, self.rib, self.gravity)
        return SecondOrderField(law, speed)

    def scale(self, speed: Scalar) -> State:
        n = self.dimension // 2
        return (self.clearance,) * n + (self.clearance * speed,) * n

    def starts(self, speed: Scalar) -> tuple[State, ...]:
        """The paper's start, cage at rest on the rib (X = 0, Y = -C_r/2), and two more inside the clearance."""
        c, zero = self.clearance, jnp.zeros_like(self.clearance)
        rib = (zero,) * (self.dimension // 2 - 2)
        return (
            (zero, -jnp.minimum(self.guidance_gap / 2, self.contact.onset * c), *rib, zero, zero, *rib),
            (0.4 * c, 0.3 * c, *rib, zero, zero, *rib),
            (-0.6 * c, 0.1 * c, *rib, 0.2 * c * speed, -0.3 * c * speed, *rib),
        )

    def excursion(self, y: State) -> Scalar:
        """Eccentricity ratio eps of the cage centre in its clearance circle; 1 where the surfaces would overlap."""
        x, dy = (y[0], y[1]) if isinstance(self.rib, RigidRib) else (y[0] - y[2], y[1] - y[3])
        return smooth_norm(x, dy, self.film.smoothing) / self.clearance

    def abrupt(self, y: State, rate: State) -> tuple[Scalar, Scalar]:
        """The onset of land contact, whose force sets in within a smoothing length.

        The speed is that with which the cage comes to the onset: where it turns round, at the deepest of a contact, it
        is at rest, and the force of the contact throws it out all the same.
        """
        eps, growth = jax.jvp(lambda *y: jnp.asarray(self.excursion(y)), y, rate)
        gap = eps - self.contact.onset
        width = ONSET_WIDTH * self.contact.smoothing / self.clearance
        gained = jnp.maximum(-2 * gap * self._radial_acceleration(y, rate), 0.0)
        return smooth_norm(gap, 0.0, width), jnp.sqrt(growth**2 + gained)

    def _radial_acceleration(self, y: State, rate: State) -> Scalar:
        """That of the eccentricity ratio along the line of centres [1/rad^2]."""
        n = self.dimension // 2
        v = y[n:]
        per_speed = sum(a * b for a, b in zip(v, rate, strict=False)) / (sum(a * a for a in v) + TINY)  # q' = v/omega
        pushed = (*(per_speed * a for a in rate[n:]), *(jnp.zeros_like(a) for a in v))
        return jax.jvp(lambda *y: jnp.asarray(self.excursion(y)), y, pushed)[1]


PARTS: dict[str, tuple[type, ...]] = {
    "film": (RibFilm,),
    "contact": (LandContact,),
    "support": (Support,),
    "impact": (SynchronousImpact, RollerPassImpact),
    "rib": (RigidRib, ElasticRib),
}
"""Kinds of each part that a cage knows how to use."""


def _check_extra(laws: Any) -> None:
    """**Raises:** `ValueError` for anything but a tuple of force laws, each with a name of its own."""
    if not isinstance(laws, tuple) or not all(isinstance(law, AbstractForce) for law in laws):
        given = ", ".join(type(law).__name__ for law in laws) if isinstance(laws, tuple) else type(laws).__name__
        raise ArgumentError(
            "extra", said=f"must be a tuple of forces, each a `jaxcage.forces.AbstractForce`, but holds: {given}."
        )
    names = [type(law).__name__ for law in laws]
    taken = [name for i, name in enumerate(names) if name in (*FORCES, *names[:i])]
    if taken:
        raise ArgumentError(
            "extra",
            said=(
                f"must name each force once, beside {', '.join(FORCES)}, but `{taken[0]}` is there twice: "
                "a force is named after its class, and a subclass gives it another name."
            ),
        )


def _worst(length: Scalar | Array, clearance: Scalar | Array) -> tuple[float, float]:
    """The pair with the largest ratio, of one model or of many."""
    lengths, rooms = np.broadcast_arrays(np.asarray(length), np.asarray(clearance))
    most = int(np.argmax(lengths / rooms))
    return float(lengths.ravel()[most]), float(rooms.ravel()[most])
