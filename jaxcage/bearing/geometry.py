"""The bearing: its dimensions (Table 1), its kinematics (7)-(9), (11), (13), and the paper's design rule.

Speeds are positive counter-clockwise.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._arguments import is_concrete
from .._bearing_data import cage_speed_ratio
from .._errors import ArgumentError
from .._parameters import count, parameter
from .._pytrees import Scalar
from .line_contact import PALMGREN_CONSTANT, line_contact_stiffness


MOST_PRELOAD = -50e-6
"""Smallest radial clearance [m]. It presses rollers of 7 to 20 mm on both raceways with 1.5 to 2.5 GPa: 1.5 GPa is the
fatigue limit of ISO 281."""


class Material(eqx.Module):
    """A linear elastic solid."""

    density: Scalar = parameter("kg/m^3", 100.0, 30e3, "density of the solid", kind="catalogue")
    youngs_modulus: Scalar = parameter("Pa", 1e8, 1e12, "Young's modulus", kind="catalogue")


def bearing_steel() -> Material:
    """100Cr6 (SAE 52100), the steel of rings and rollers in section 4 of the paper.

    EN ISO 683-17 data sheets give 210 GPa. With 7800 kg/m^3 a roller of 16 mm x 27 mm weighs 42.3 g.
    """
    return Material(density=7800.0, youngs_modulus=210e9)


class Bearing(eqx.Module):
    """A cylindrical roller bearing with its outer ring at rest and the shaft in its inner ring.

    **Arguments:** the fields, lengths in metres; `jaxcage.parameter_info(bearing)` has their units and ranges.
    **Raises:** `ValueError` for dimensions that do not fit together.
    """

    bore: Scalar = parameter("m", 1e-3, 2.0, "bore diameter", kind="catalogue")
    outside_diameter: Scalar = parameter("m", 1e-3, 4.0, "outside diameter", kind="catalogue")
    width: Scalar = parameter("m", 1e-3, 1.0, "width of the rings", kind="catalogue")
    n_rollers: int = count(3, 200, "number of rollers Z")
    roller_diameter: Scalar = parameter("m", 1e-4, 0.5, "roller diameter d_w", kind="catalogue")
    roller_length: Scalar = parameter("m", 1e-4, 0.5, "roller length l", kind="catalogue")
    rib_diameter: Scalar = parameter("m", 1e-3, 4.0, "inner diameter d_g of the outer ring's ribs", kind="drawing")
    inner_raceway_diameter: Scalar = parameter("m", 1e-3, 4.0, "inner raceway diameter d_i", kind="catalogue")
    radial_clearance: Scalar = parameter(
        "m", MOST_PRELOAD, 1e-3, "radial clearance G_r, on the diameter; negative: preload", kind="catalogue"
    )
    pocket_clearance: Scalar = parameter("m", 0.0, 1e-2, "pocket clearance T, on the diameter", kind="drawing")
    palmgren_constant: Scalar = parameter(
        "Pa", 1e8, 1e13, "Palmgren's line-contact constant C_P", default=PALMGREN_CONSTANT
    )
    effective_length: Scalar | None = parameter(
        "m", 1e-4, 0.5, "effective roller length, which carries", kind="catalogue", default=None
    )
    """None: the whole roller carries."""
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
        """Outer raceway diameter d_i + 2 d_w [m], without the clearance."""
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
        length = self.roller_length if self.effective_length is None else self.effective_length
        return line_contact_stiffness(self.palmgren_constant, length)

    @property
    def cage_speed_ratio(self) -> Array:
        """Cage speed over shaft speed, from (8): (1 - d_w/d_m)/2 [1]."""
        return jnp.asarray(cage_speed_ratio(self.inner_raceway_diameter, self.roller_diameter))

    def cage_speed(self, shaft_speed: Scalar, outer_speed: Scalar = 0.0) -> Array:
        """Speed of rollers and cage in pure rolling, w_c = [w_i (1 - d_w/d_m) + w_o (1 + d_w/d_m)]/2 [rad/s], (8).

        **Arguments:** speeds of inner and outer ring [rad/s]. With the outer ring at rest it is also w_co of (11).
        """
        return jnp.asarray(shaft_speed * self.cage_speed_ratio + outer_speed * (1 - self.cage_speed_ratio))

    def shaft_speed(self, cage_speed: Scalar) -> Array:
        """Shaft speed at a cage speed, both in rad/s: the inverse of (8)."""
        return jnp.asarray(cage_speed / self.cage_speed_ratio)

    def roller_centrifugal_force(self, shaft_speed: Scalar) -> Array:
        """Centrifugal force of one roller at a shaft speed [rad/s], F_cen = m w_c^2 d_m/2 [N], (8) and (9)."""
        return jnp.asarray(self.roller_mass * self.cage_speed(shaft_speed) ** 2 * self.pitch_diameter / 2)


def design_rule_violations(bearing: Bearing, guidance_gap: Scalar) -> list[str]:
    """Sentences that say where T > C_r > G_r, the rule of the paper's introduction, is broken.

    The paper breaks it itself: every published case has T = 0.3 mm, below C_r. It is a warning and not an error.

    **Arguments:** the bearing, and the guidance gap C_r [m]; concrete values.

    **Returns:** a list of sentences, empty when the rule holds.
    """
    t, c_r, g_r = (1e3 * float(x) for x in (bearing.pocket_clearance, guidance_gap, bearing.radial_clearance))
    sentences = []
    if not t > c_r:
        sentences.append(
            f"Pocket clearance T = {t:g} mm should exceed the guidance gap C_r = {c_r:g} mm, "
            "so that the land and not the rollers guides the cage."
        )
    if not c_r > g_r:
        sentences.append(
            f"Guidance gap C_r = {c_r:g} mm should exceed the radial clearance G_r = {g_r:g} mm, "
            "so that the cage stays free when the shaft shifts."
        )
    return sentences
