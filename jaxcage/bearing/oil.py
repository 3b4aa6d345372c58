"""Viscosity of the oil at its temperature.

The paper heads its last column "dynamic viscosity exponent (Pa s)" and prints VG56, VG78 and VG32. Two of them are not
ISO grades and VG is not in Pa s: it is read here as the kinematic viscosity in mm^2/s at 40 C, so that VG56 has
870 kg/m^3 * 56 mm^2/s = 0.04872 Pa s.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._allowed import ROUNDING
from .._arguments import is_concrete
from .._errors import ArgumentError, shown
from .._parameters import parameter
from .._pytrees import Scalar


CELSIUS_40 = 313.15
CELSIUS_100 = 373.15
WALTHER_CONSTANT = 0.7
THINNEST = 2e-6
"""Kinematic viscosity above which the law of Walther holds [m^2/s]."""


class Lubricant(eqx.Module):
    """An oil given by its density and two points of its viscosity-temperature line.

    **Arguments:** the fields: density [kg/m^3], kinematic viscosities [m^2/s], temperatures [K]; `jaxcage.bearing.vg`
    makes an oil by its grade. **Raises:** `ValueError` for points of one temperature, or that rise with it.
    """

    density: Scalar = parameter("kg/m^3", 500.0, 2000.0, "density of the oil", kind="oil")
    viscosity_1: Scalar = parameter("m^2/s", 1e-6, 1e-1, "kinematic viscosity at temperature_1", kind="oil")
    temperature_1: Scalar = parameter("K", 200.0, 600.0, "temperature of the first point", kind="oil")
    viscosity_2: Scalar = parameter("m^2/s", 1e-6, 1e-1, "kinematic viscosity at temperature_2", kind="oil")
    temperature_2: Scalar = parameter("K", 200.0, 600.0, "temperature of the second point", kind="oil")
    temperature: Scalar = parameter("K", 200.0, 600.0, "operating temperature", kind="operating", default=CELSIUS_40)
    reference_viscosity: Scalar = parameter(
        "m^2/s", 1e-7, 1e-5, "1 mm^2/s, the unit in the double logarithm of ASTM D341", default=1e-6
    )

    def __check_init__(self) -> None:
        first, second = self.temperature_1, self.temperature_2
        if is_concrete(first, second) and np.isclose(first, second, ROUNDING, 0.0):
            raise ArgumentError(
                "temperature_2", said=f"must differ from `temperature_1`, but both are {float(first):g} K."
            )
        points = self.viscosity_1, self.viscosity_2
        if is_concrete(first, second, *points):
            hotter = np.asarray(second) > np.asarray(first)
            thicker = np.asarray(points[1]) > np.asarray(points[0])
            if np.any((hotter == thicker) & ~np.isclose(*points, ROUNDING, 0.0)):
                row = zip(points, (first, second), strict=True)
                given = " and ".join(f"{np.ravel(x)[0]:g} m^2/s at {np.ravel(t)[0]:g} K" for x, t in row)
                raise ArgumentError(
                    "viscosity_1", "viscosity_2", said=f"must not rise with the temperature, but {given} were given."
                )

    @property
    def kinematic_viscosity(self) -> Array:
        """Kinematic viscosity at the operating temperature [m^2/s], by ASTM D341 (Walther).

        lg lg(nu/nu_0 + 0.7) is linear in lg T, with nu_0 = 1 mm^2/s. The constants of the line come from the two
        points, so the value at `temperature_1` is `viscosity_1` whatever the second point is. The form holds above
        2 mm^2/s, where the further terms of the standard vanish.
        """
        nu_0 = jnp.asarray(self.reference_viscosity, dtype=float)
        w1, w2 = (jnp.log(jnp.log(nu / nu_0 + WALTHER_CONSTANT)) for nu in (self.viscosity_1, self.viscosity_2))
        span = jnp.log(self.temperature_2 / self.temperature_1)
        fraction = jnp.log(self.temperature / self.temperature_1) / span
        return nu_0 * (jnp.exp(jnp.exp(w1 + (w2 - w1) * fraction)) - WALTHER_CONSTANT)

    @property
    def dynamic_viscosity(self) -> Array:
        """Dynamic viscosity at the operating temperature: density times the kinematic [Pa s]."""
        return jnp.asarray(self.density * self.kinematic_viscosity)

    def doubts(self) -> list[str]:
        """A list with one sentence if the oil is thinner than its law allows, else empty; concrete values."""
        viscosity = float(self.kinematic_viscosity)
        if viscosity >= THINNEST * (1 - ROUNDING):
            return []
        return [
            f"The oil has {1e6 * viscosity:.3g} mm²/s at {float(self.temperature) - 273.15:.4g} °C, but its law, ASTM "
            f"D341, holds above {1e6 * THINNEST:g} mm²/s: the films are uncertain."
        ]


def vg(grade: Scalar, temperature: Scalar = CELSIUS_40) -> Lubricant:
    """A mineral oil of viscosity index about 95 by its grade, e.g. 56: its mm^2/s at 40 C.

    The second point, at 100 C, is 7.54 mm^2/s exp(0.648 x + 0.0171 x^2 - 0.005 x^3) with x = ln(grade/56): a fit to the
    viscosities at 100 C that solve ASTM D2270 for an index of 95 (2.64, 5.29, 7.52, 11.07, 18.7 and 49.9 mm^2/s for
    grades 10, 32, 56, 100, 220 and 1000), which it meets within 1.4 % for grades from 10 to 1500. At 40 C, the default,
    the second point has no influence. Density 870 kg/m^3.

    **Arguments:** grade [mm^2/s at 40 C], operating temperature [K].
    """
    if is_concrete(grade) and not np.all((np.asarray(grade) > 0) & np.isfinite(grade)):
        raise ArgumentError("grade", said=f"must be positive and finite, but {shown(grade)} was given.")
    of: Any = np if is_concrete(grade) else jnp  # NumPy compiles no program
    given = of.asarray(grade, dtype=float)
    x = of.log(given / 56.0)
    return Lubricant(
        density=870.0,
        viscosity_1=1e-6 * given,
        temperature_1=CELSIUS_40,
        viscosity_2=7.54e-6 * of.exp(x * (0.648 + 0.0171 * x - 0.005 * x**2)),
        temperature_2=CELSIUS_100,
        temperature=temperature,
    )
