"""The cage in its guiding rib, driven by unbalance and roller impacts: paper eqs. (16)-(32) in the form
M r_C'' = F_film + F_contact + F_support + F_impact + M e omega^2 (cos tau, sin tau) - M g y.
"""

from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._arguments import is_concrete
from .._bearing_data import land_radius
from .._errors import ArgumentError
from .._parameters import parameter, reading, require_readings, with_numbers
from .._pytrees import Scalar, State
from ..bearing import Bearing, Lubricant
from ..forces import (
    LAWS,
    AbstractForce,
    AbstractForcing,
    AbstractLaw,
    ElasticRib,
    Force,
    Land,
    Motion,
    RigidRib,
    UnbalanceForce,
    UnbalanceReading,
    WeightForce,
    effective_eccentricity,
    smooth_norm,
)
from ..quantities import component_names
from .field import AbstractField, SecondOrderField
from .oscillator import require_repeats
from .protocol import AbstractForcedSystem, told


ClearanceReading = Literal["as_printed", "radial"]

NEEDED = ("film", "contact", "support", "impact")
"""Laws that every cage has."""
FORCES = (*NEEDED, "unbalance", "weight")
"""Forces on every cage, by name."""
TINY = 1e-30
"""Square of a speed [m^2/s^2] that keeps a division from being by zero."""
ONSET_WIDTH = 4.0
"""Distance from the onset of land contact, in smoothing lengths, within which steps are not shortened any more."""
SOMEWHERE = (0.4, 0.3, 20.0, -30.0)
"""State, over the clearance, in which a user's force is evaluated to see that it repeats."""
SMOOTHEST = 0.1
"""Largest smoothing length over clearance: a larger one is no detail of the contact or of the film's centre."""


def _in_order(laws: Any) -> Any:
    """Laws in the order of `LAWS`, those of a user after them, with plain numbers as arrays."""
    place = lambda law: LAWS.index(type(law)) if type(law) in LAWS else len(LAWS)
    return with_numbers(tuple(sorted(laws, key=place)) if isinstance(laws, tuple) else laws)


def _check_laws(laws: Any) -> None:
    """**Raises:** `ValueError` for anything but a tuple of laws, each of its own name, that has all of `NEEDED`."""
    if wrong := [law for law in (laws if isinstance(laws, tuple) else [laws]) if not isinstance(law, AbstractLaw)]:
        said = f"must be a tuple of laws, each a `jaxcage.forces.AbstractLaw`, but holds: {type(wrong[0]).__name__}."
        raise ArgumentError("forces", said=said)
    for law in laws:
        if law.law_name and type(law) not in LAWS:
            wanted = " or ".join(f"`{kind.__name__}`" for kind in LAWS if kind.law_name == law.law_name)
            said = f"must be a {wanted}, but is a `{type(law).__name__}`; a force of your own goes in `extra`."
            raise ArgumentError(law.law_name, said=said)
    names = [law.law_name or type(law).__name__ for law in laws]
    if missing := [name for name in NEEDED if name not in names]:
        raise ArgumentError("forces", said=f"must hold every cage's laws, but {', '.join(missing)} is missing.")
    taken = [name for i, name in enumerate(names) if name in ("unbalance", "weight", *names[:i])]
    if taken:
        raise ArgumentError(
            "forces",
            said=(
                f"must name each force once, beside {', '.join(FORCES)}, but `{taken[0]}` is there twice: "
                "a force of yours is named after its class, and a subclass gives it another name."
            ),
        )


class CageAtSpeed(eqx.Module):
    """All forces on a cage at one speed, with everything that does not change during a revolution evaluated once."""

    laws: tuple[AbstractForce, ...]
    names: tuple[str, ...] = eqx.field(static=True)
    land: Land
    mass: Scalar
    speed: Scalar
    shaft_speed: Scalar

    def law(self, name: str) -> Any:
        """The law of a force, with its constants."""
        return self.laws[self.names.index(name)]

    def forces(self, tau: Scalar, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> dict[str, Force]:
        """Every force on a cage by name, as (F_x, F_y, moment) [N, N, N m].

        **Arguments:** phase; place of the cage's centre from the rib's [m] and its velocity [m/s].
        """
        motion = Motion(tau, x, y, vx, vy, self.speed, 0.0, self.shaft_speed, self.land)
        return {name: _force(name, law, motion) for name, law in zip(self.names, self.laws, strict=True)}

    def __call__(self, tau: Scalar, q: State, v: State) -> State:
        """Acceleration of a cage in a rib that does not move."""
        f, per_mass = self.forces(tau, *q, *v).values(), 1 / self.mass
        return per_mass * sum(p[0] for p in f), per_mass * sum(p[1] for p in f)


def _force(name: str, law: AbstractForce, motion: Motion) -> Force:
    """**Raises:** `ValueError` for a user's law that returns anything but three numbers."""
    with told(f"Force `{name}`"):
        force = law.force(motion)
    if not isinstance(force, tuple) or [jnp.shape(part) for part in force] != [(), (), ()]:
        raise ValueError(f"Force `{name}` must return (F_x, F_y, moment), three numbers, but returned {force}.")
    return force


class ElasticRibLaw(eqx.Module):
    """Acceleration of cage and rib: forces between land and cage act on their difference and react on the rib."""

    cage: CageAtSpeed
    rib: ElasticRib
    gravity: Scalar

    def __call__(self, tau: Scalar, q: State, v: State) -> State:
        (xc, yc, xo, yo), (uc, wc, uo, wo) = q, v
        f = self.cage.forces(tau, xc - xo, yc - yo, uc - uo, wc - wo)
        held_x, held_y = self.rib.holding_force(xo, yo, uo, wo)
        laws = zip(f.values(), self.cage.laws, strict=True)
        mass, react = self.rib.mass, [force for force, law in laws if not isinstance(law, AbstractForcing)]
        on_rib = held_x - sum(p[0] for p in react), held_y - mass * self.gravity - sum(p[1] for p in react)
        on_cage = [sum(p[i] for p in f.values()) for i in (0, 1)]
        return (*(c / self.cage.mass for c in on_cage), *(c / mass for c in on_rib))


class CageModel(AbstractForcedSystem):
    """A cylindrical-roller-bearing cage guided by the outer-ring rib.

    State: (x_C, y_C, x_C', y_C') with a rigid rib, (x_C, y_C, x_O, y_O, velocities) with an elastic one; metres and
    metres per second, y up, rotation counter-clockwise. `speed` is the cage's speed relative to the rib [rad/s].
    """

    bearing: Bearing
    lubricant: Lubricant
    forces: tuple[AbstractLaw, ...] = eqx.field(converter=_in_order)
    """Laws of the forces, among them `film`, `contact`, `support` and `impact`: each is an attribute of its name. Laws
    of a user, usually a `jaxcage.forces.AbstractForce`, are named after their class and together are `extra`."""
    cage_mass: Scalar = parameter("kg", 1e-3, 100.0, "cage mass M", kind="drawing")
    guidance_gap: Scalar = parameter("m", 1e-5, 5e-3, "guidance gap C_r between cage and rib", kind="drawing")
    eccentricity: Scalar = parameter(
        "m", 0.0, 1e-3, "distance e of the cage's mass centre from its centre", kind="drawing"
    )
    rib: RigidRib | ElasticRib = eqx.field(default_factory=RigidRib)
    gravity: Scalar = parameter("m/s^2", 0.0, 100.0, "acceleration of gravity", default=9.81)
    load: Scalar = parameter("N", 0.0, 1e7, "shaft load F", kind="operating", default=4450.0)
    printed_unit: Scalar = parameter("m", 1e-6, 1.0, "unit in which unbalance = as_printed reads rho", default=1e-3)
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

    def __check_init__(self) -> None:
        require_readings(self)
        _check_laws(self.forces)
        if isinstance(self.rib, eqx.Module) and not isinstance(self.rib, RigidRib | ElasticRib):
            said = f"must be a `RigidRib` or `ElasticRib`, but is a `{type(self.rib).__name__}`."
            raise ArgumentError("rib", said=said)
        radial = self.bearing.radial_clearance
        if is_concrete(radial) and np.any(np.asarray(radial) < 0):
            said = "must be at least 0 for a cage model, whose rollers are not preloaded (a whole bearing's can be)"
            raise ArgumentError("bearing.radial_clearance", said=f"{said}, but is {1e6 * float(np.min(radial)):g} um.")
        clearance = self.clearance
        for name, length in (("contact", self.contact.smoothing), ("film", self.film.smoothing)):
            if is_concrete(length, clearance) and np.any(np.asarray(length) > SMOOTHEST * np.asarray(clearance)):
                given, room = (1e3 * a for a in _worst(length, clearance))
                raise ArgumentError(
                    f"{name}.smoothing",
                    said=f"must be at most a tenth of the clearance, {room:g} mm, but is {given:g} mm.",
                )
        motion = lambda tau, y, w: Motion(tau, y[0], y[1], y[2], y[3], w, 0.0, self.bearing.shaft_speed(w), self._land)
        for law in self.extra:
            force = lambda tau, y, w, law=law: law.at(self, w).force(motion(tau, y, w))
            require_repeats(f"Force `{type(law).__name__}`", force, [(tuple(clearance * np.array(SOMEWHERE)),)])

    def __getattr__(self, name: str) -> Any:
        """The law of that name, such as `film`."""
        if name != "forces":
            for law in self.forces:
                if law.law_name == name:
                    return law
        raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")

    @property
    def extra(self) -> tuple[AbstractLaw, ...]:
        """Laws of a user."""
        return tuple(law for law in self.forces if not law.law_name)

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
        x, dy = self._offset(y)
        return x / self.clearance, dy / self.clearance

    def _offset(self, y: State) -> tuple[Scalar, Scalar]:
        """Cage centre from that of the rib [m]."""
        return (y[0], y[1]) if isinstance(self.rib, RigidRib) else (y[0] - y[2], y[1] - y[3])

    def land_speed(self, speed: Scalar) -> Scalar:
        return speed * self.land_radius

    @property
    def clearance(self) -> Array:
        """Radial clearance c [m]: (12) defines C_r as diametral, (13) and (25)-(27) use it as radial."""
        return jnp.asarray(self.guidance_gap if self.clearance_reading == "as_printed" else self.guidance_gap / 2)

    @property
    def land_radius(self) -> Array:
        """Radius of the cage's guiding land R = (d_g - C_r)/2 [m]."""
        return jnp.asarray(land_radius(self.bearing.rib_diameter, self.guidance_gap))

    @property
    def harmonics(self) -> int:
        return max(law.highest_harmonic(self) for law in self.forces)

    def cage_at(self, speed: Scalar) -> CageAtSpeed:
        """The cage's force laws at `speed` [rad/s]."""
        named, extra = [law for law in self.forces if law.law_name], self.extra
        arm = effective_eccentricity(self.unbalance, self.eccentricity, self.guidance_gap, self.printed_unit)
        own = {"unbalance": UnbalanceForce(self.cage_mass * arm), "weight": WeightForce(self.cage_mass * self.gravity)}
        laws = (*(law.at(self, speed) for law in named), *own.values(), *(law.at(self, speed) for law in extra))
        names = (*(law.law_name for law in named), *own, *(type(law).__name__ for law in extra))
        return CageAtSpeed(laws, names, self._land, self.cage_mass, speed, self.bearing.shaft_speed(speed))

    @property
    def _land(self) -> Land:
        c = self.clearance
        return Land(c, 1 / c, self.contact.onset, self.contact.smoothing / c, self.film.smoothing / c)

    def at_speed(self, speed: Scalar) -> AbstractField:
        cage = self.cage_at(speed)
        law = cage if isinstance(self.rib, RigidRib) else ElasticRibLaw(cage, self.rib, self.gravity)
        return SecondOrderField(law, speed)

    def scale(self, speed: Scalar) -> State:
        n = self.dimension // 2
        return (self.clearance,) * n + (self.clearance * speed,) * n

    def initial_states(self, speed: Scalar) -> tuple[State, ...]:
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
        return smooth_norm(*self._offset(y), self.film.smoothing) / self.clearance

    def abrupt(self, y: State, rate: State) -> tuple[Scalar, Scalar]:
        """The onset of land contact, whose force sets in within a smoothing length.

        The rate is that with which the cage reaches the onset: at the deepest point of a contact the cage is at rest,
        and the contact force throws it out all the same.
        """
        eps, growth = jax.jvp(lambda *y: jnp.asarray(self.excursion(y)), y, rate)
        gap = eps - self.contact.onset
        width = ONSET_WIDTH * self.contact.smoothing / self.clearance
        gained = jnp.maximum(-2 * gap * self._radial_acceleration(y, rate), 0.0)
        return smooth_norm(gap, 0.0, width), jnp.sqrt(growth**2 + gained)

    def _radial_acceleration(self, y: State, rate: State) -> Scalar:
        """Acceleration of the eccentricity ratio along the line of centres [1/rad^2]."""
        n = self.dimension // 2
        v = y[n:]
        per_speed = sum(a * b for a, b in zip(v, rate, strict=False)) / (sum(a * a for a in v) + TINY)  # q' = v/omega
        pushed = (*(per_speed * a for a in rate[n:]), *(jnp.zeros_like(a) for a in v))
        return jax.jvp(lambda *y: jnp.asarray(self.excursion(y)), y, pushed)[1]


def _worst(length: Scalar | Array, clearance: Scalar | Array) -> tuple[float, float]:
    """The pair with the largest ratio, of one model or of many."""
    lengths, rooms = np.broadcast_arrays(np.asarray(length), np.asarray(clearance))
    most = int(np.argmax(lengths / rooms))
    return float(lengths.ravel()[most]), float(rooms.ravel()[most])
