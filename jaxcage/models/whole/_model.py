"""Parameters of the whole bearing: rollers, cage, guiding land, inner ring."""

from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..._parameters import choice, parameter
from ..._types import Scalar
from ...bearing import Bearing, Lubricant
from ...forces import LandContact, RibFilm
from ._drag import RollerDrag
from ._pockets import Pockets
from ._raceway import Raceways
from ._traction import Traction


Guided = Literal["outer", "inner"]


class InnerRing(eqx.Module):
    """The inner ring with its share of the shaft, on a mounting that damps but does not hold it."""

    ring_mass: Scalar = parameter("kg", 1e-3, 1e4, "mass of the inner ring with its share of the shaft", default=2.0)
    mounting_damping: Scalar = parameter("N s/m", 0.0, 1e7, "damping of the inner ring's mounting", default=500.0)
    ring_motion: str = choice(
        "dynamic",
        "quasi_static",
        text="the inner ring moves by its mass, or is always where contacts carry the load",
        default="dynamic",
    )


class Wear(eqx.Module):
    """What the cage loses where it is rubbed by Archard's law, worn volume = K times load times sliding distance over
    hardness; nothing that moves depends on it.

    J. F. Archard, J. Appl. Phys. 24 (1953) 981. The default is dry 60/40 leaded brass on tool steel, K = 6e-4 and
    95 kg/mm^2 (J. F. Archard and W. Hirst, Proc. R. Soc. A 236 (1956) 397): an upper bound, as oil makes it a hundred
    times smaller and more. Rates are proportional to it, so that designs can be compared without knowing it.
    """

    wear_coefficient: Scalar = parameter(
        "1", 0.0, 1.0, "wear coefficient K of Archard's law for the cage", kind="unknown", default=6e-4
    )
    hardness: Scalar = parameter("Pa", 1e6, 1e11, "indentation hardness of the cage", default=0.93e9)

    def volume(self, rubbing: Scalar) -> Scalar:
        """Volume [m^3] worn off by an integral of load over sliding distance [N m], or its rate by a power [W]."""
        return self.wear_coefficient * rubbing / self.hardness


class BearingModel(eqx.Module):
    """A cylindrical roller bearing in its plane: Z rollers, a cage with pockets, its guiding land, the inner ring.

    The input is what a designer knows, and the shaft's speed; slip, pocket forces and whirl are results. y points up,
    counter-clockwise is positive, and the load acts on the inner ring along -y. Cage and rollers turn freely between
    rings at prescribed speeds; the centre of the outer ring is fixed.
    """

    bearing: Bearing
    lubricant: Lubricant
    film: RibFilm
    contact: LandContact
    pockets: Pockets
    cage_mass: Scalar = parameter("kg", 1e-3, 100.0, "cage mass M")
    cage_inertia: Scalar = parameter("kg m^2", 1e-8, 10.0, "moment of inertia J_G of the cage about its mass centre")
    guidance_gap: Scalar = parameter("m", 1e-5, 5e-3, "guidance gap C_r between cage and land, on the diameter")
    eccentricity: Scalar = parameter("m", 0.0, 1e-3, "distance e of the cage's mass centre from its centre")
    traction: Traction = eqx.field(default_factory=Traction)
    raceways: Raceways = eqx.field(default_factory=Raceways)
    drag: RollerDrag = eqx.field(default_factory=RollerDrag)
    ring: InnerRing = eqx.field(default_factory=InnerRing)
    wear: Wear = eqx.field(default_factory=Wear)
    land_friction: Scalar = parameter("1", 0.0, 1.0, "friction coefficient of cage on land in contact", default=0.1)
    inner_land_diameter: Scalar = parameter(
        "m", 1e-3, 4.0, "diameter of the inner ring's land, where it guides the cage", default=69e-3
    )
    gravity: Scalar = parameter("m/s^2", 0.0, 100.0, "acceleration of gravity", default=9.81)
    load: Scalar = parameter("N", 0.0, 1e7, "shaft load F", default=4450.0)
    outer_speed: Scalar = parameter("rad/s", -1e5, 1e5, "speed of the outer ring", default=0.0)
    guidance: Guided = choice("outer", "inner", text="ring whose land guides the cage", default="outer")
    clearance_reading: str = choice(
        "radial", "as_printed", text="radial clearance c = C_r/2, or C_r as (13) reads it", default="radial"
    )
    cage_rotation: str = choice("free", "held", text="the cage turns freely, or at the speed it has", default="free")

    @property
    def clearance(self) -> Array:
        """Radial clearance c of the cage on its land [m]."""
        return jnp.asarray(self.guidance_gap if self.clearance_reading == "as_printed" else self.guidance_gap / 2)

    @property
    def land_radius(self) -> Array:
        """Radius of the cage's guiding surface [m]."""
        if self.guidance == "outer":
            return jnp.asarray((self.bearing.rib_diameter - self.guidance_gap) / 2)
        return jnp.asarray((self.inner_land_diameter + self.guidance_gap) / 2)

    @property
    def inner_radius(self) -> Array:
        """Radius of the inner raceway [m]."""
        return jnp.asarray(self.bearing.inner_raceway_diameter / 2)

    @property
    def outer_radius(self) -> Array:
        """Radius of the outer raceway, R_i + D + G_r/2 [m]."""
        bearing = self.bearing
        return jnp.asarray(self.inner_radius + bearing.roller_diameter + bearing.radial_clearance / 2)

    def rolling_cage_speed(self, speed: Scalar) -> Array:
        """Speed of rollers that roll on both rings without slip or load, at the shaft speed `speed` [rad/s].

        Slip refers to it: R_i omega_i/(2 (R_o - D/2)) with the outer ring at rest.
        """
        surfaces = self.inner_radius * speed + self.outer_radius * self.outer_speed
        return jnp.asarray(surfaces / (2 * self.outer_radius - self.bearing.roller_diameter))

    def rolling_spin(self, speed: Scalar) -> Array:
        """Spin of such a roller [rad/s], against the shaft's sense."""
        surfaces = self.outer_radius * self.outer_speed - self.inner_radius * speed
        return jnp.asarray(surfaces / self.bearing.roller_diameter)

    def at_speed(self, speed: Scalar) -> Any:
        """Equations of motion at the shaft speed `speed` [rad/s]."""
        from ._field import BearingAtSpeed

        return BearingAtSpeed.of(self, speed)
