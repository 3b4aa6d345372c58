"""Materials of cage, rings and rollers: density and elastic constants."""

import equinox as eqx

from .._parameters import parameter
from .._types import Scalar


class Material(eqx.Module):
    """A linear elastic solid."""

    density: Scalar = parameter("kg/m^3", 100.0, 30e3, "density of the solid", kind="catalogue")
    youngs_modulus: Scalar = parameter("Pa", 1e8, 1e12, "Young's modulus", kind="catalogue")
    poisson_ratio: Scalar = parameter("1", 0.0, 0.5, "Poisson's ratio", kind="catalogue")


def brass() -> Material:
    """CuZn40Pb2, the cage brass of section 4 of the paper.

    Values of the extrusion brasses of this family (CW617N, CW608N): data sheets give
    8.40-8.44 g/cm^3 and 99-107 GPa.
    """
    return Material(density=8430.0, youngs_modulus=102e9, poisson_ratio=0.34)


def bearing_steel() -> Material:
    """100Cr6 (SAE 52100), the steel of rings and rollers in section 4 of the paper.

    EN ISO 683-17 data sheets give 210 GPa and 0.30. With 7800 kg/m^3 a roller of 16 mm x 27 mm
    weighs 42.3 g.
    """
    return Material(density=7800.0, youngs_modulus=210e9, poisson_ratio=0.30)
