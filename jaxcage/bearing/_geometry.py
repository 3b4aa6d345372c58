"""The bearing: its dimensions (Table 1), what follows from them, and the paper's design rule."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._arguments import require_above_zero
from .._errors import ArgumentError
from .._parameters import count, parameter
from .._types import Scalar
from . import _kinematics as kinematics
from ._line_contact import PALMGREN_CONSTANT, line_contact_stiffness, series_stiffness
from ._materials import Material, bearing_steel
from ._validate import is_concrete


class Bearing(eqx.Module):
    """A cylindrical roller bearing with its outer ring at rest and the shaft in its inner ring."""

    bore: Scalar = parameter("m", 1e-3, 2.0, "bore diameter", kind="catalogue")
    outside_diameter: Scalar = parameter("m", 1e-3, 4.0, "outside diameter", kind="catalogue")
    width: Scalar = parameter("m", 1e-3, 1.0, "width of the rings", kind="catalogue")
    n_rollers: int = count(3, 200, "number of rollers Z")
    roller_diameter: Scalar = parameter("m", 1e-4, 0.5, "roller diameter d_w", kind="catalogue")
    roller_length: Scalar = parameter("m", 1e-4, 0.5, "roller length l", kind="catalogue")
    rib_diameter: Scalar = parameter("m", 1e-3, 4.0, "inner diameter d_g of the outer ring's ribs", kind="drawing")
    inner_raceway_diameter: Scalar = parameter("m", 1e-3, 4.0, "inner raceway diameter d_i", kind="catalogue")
    radial_clearance: Scalar = parameter("m", 0.0, 1e-3, "radial clearance G_r, on the diameter", kind="catalogue")
    pocket_clearance: Scalar = parameter("m", 0.0, 1e-2, "pocket clearance T, on the diameter", kind="drawing")
    palmgren_constant: Scalar = parameter(
        "Pa", 1e8, 1e13, "Palmgren's line-contact constant C_P", kind="fixed", default=PALMGREN_CONSTANT
    )
    roller_material: Material = eqx.field(default_factory=bearing_steel)

    def __check_init__(self) -> None:
        names = "bore", "inner_raceway_diameter", "rib_diameter", "outside_diameter"
        sizes = [getattr(self, name) for name in names]
        if is_concrete(*sizes) and not np.all(np.diff(np.asarray(sizes, dtype=float)) > 0):
            found = ", ".join(f"{1e3 * float(size):g}" for size in sizes)
            raise ValueError(f"Arguments `{'` < `'.join(names)}` must grow, but are {found} mm.")
        across = self.inner_raceway_diameter, self.roller_diameter
        share = np.sin(np.pi / self.n_rollers)
        if is_concrete(*across) and np.any(sum(map(np.asarray, across)) * share <= np.asarray(self.roller_diameter)):
            raise ArgumentError(
                "n_rollers",
                said=f"must leave room between the rollers, but {self.n_rollers} rollers overlap on the pitch circle.",
            )

    @property
    def pitch_diameter(self) -> Array:
        """Pitch diameter d_m = d_i + d_w [m]."""
        return jnp.asarray(self.inner_raceway_diameter + self.roller_diameter)

    @property
    def outer_raceway_diameter(self) -> Array:
        """Outer raceway diameter d_i + 2 d_w [m], the clearance left out."""
        return jnp.asarray(self.inner_raceway_diameter + 2 * self.roller_diameter)

    @property
    def roller_mass(self) -> Array:
        """Mass of one roller, a full cylinder [kg]."""
        area = jnp.pi / 4 * self.roller_diameter**2
        return jnp.asarray(self.roller_material.density * area * self.roller_length)

    @property
    def land_width_limit(self) -> Array:
        """Widest guiding land that fits beside the rollers, (width - roller length)/2 [m]."""
        return jnp.asarray((self.width - self.roller_length) / 2)

    @property
    def raceway_stiffness(self) -> Array:
        """Stiffness of one roller on one raceway, (3) [N/m^(10/9)]."""
        return line_contact_stiffness(self.palmgren_constant, self.roller_length)

    @property
    def contact_stiffness(self) -> Array:
        """Stiffness of one roller between both raceways, (3) and (4) [N/m^(10/9)]."""
        return series_stiffness(self.raceway_stiffness, self.raceway_stiffness)

    @property
    def cage_speed_ratio(self) -> Array:
        """Cage speed over shaft speed, from (8) [1]."""
        return kinematics.cage_speed_ratio(self.roller_diameter, self.pitch_diameter)

    def cage_speed(self, shaft_speed: Scalar) -> Array:
        """Cage speed at a shaft speed, both in rad/s, (8): also w_co of (11), as the rib rests."""
        return kinematics.cage_speed(shaft_speed, 0.0, self.roller_diameter, self.pitch_diameter)

    def shaft_speed(self, cage_speed: Scalar) -> Array:
        """Shaft speed at a cage speed, both in rad/s: the inverse of (8)."""
        return jnp.asarray(cage_speed / self.cage_speed_ratio)

    def roller_centrifugal_force(self, shaft_speed: Scalar) -> Array:
        """Centrifugal force of one roller at a shaft speed [rad/s], (8) and (9) [N]."""
        speed = self.cage_speed(shaft_speed)
        return kinematics.centrifugal_force(self.roller_mass, speed, self.pitch_diameter)


def design_rule_violations(bearing: Bearing, guidance_gap: Scalar) -> list[str]:
    """Sentences that say where T > C_r > G_r, the rule of the paper's introduction, is broken.

    The paper breaks it itself: every published case has T = 0.3 mm below C_r. So it is a warning,
    not an error.

    **Arguments:** the bearing, and the guidance gap C_r [m]; concrete values.

    **Returns:** a list of sentences, empty when the rule holds.
    """
    require_above_zero(guidance_gap=guidance_gap)
    t, c_r, g_r = (1e3 * float(x) for x in (bearing.pocket_clearance, guidance_gap, bearing.radial_clearance))
    sentences = []
    if not t > c_r:
        sentences.append(
            f"Pocket clearance T = {t:g} mm should exceed the guidance gap C_r = {c_r:g} mm, "
            "so that the rib and not the rollers guides the cage."
        )
    if not c_r > g_r:
        sentences.append(
            f"Guidance gap C_r = {c_r:g} mm should exceed the radial clearance G_r = {g_r:g} mm, "
            "so that the cage stays free when the shaft shifts."
        )
    return sentences
