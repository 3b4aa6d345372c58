"""Wear of the cage by Archard's law: worn volume = K times load times sliding distance over hardness.

J. F. Archard, J. Appl. Phys. 24 (1953) 981. The default is dry 60/40 leaded brass on tool steel, K = 6e-4 and
95 kg/mm^2 (J. F. Archard and W. Hirst, Proc. R. Soc. A 236 (1956) 397): an upper bound, as oil makes it a hundred times
smaller and more. Rates are proportional to it, so that designs can be compared without knowing it.
"""

import equinox as eqx

from ..._parameters import parameter
from ..._types import Scalar


class Wear(eqx.Module):
    """What the cage loses where it is rubbed; nothing that moves depends on it."""

    wear_coefficient: Scalar = parameter(
        "1", 0.0, 1.0, "wear coefficient K of Archard's law for the cage", kind="unknown", default=6e-4
    )
    hardness: Scalar = parameter("Pa", 1e6, 1e11, "indentation hardness of the cage", default=0.93e9)

    def volume(self, rubbing: Scalar) -> Scalar:
        """Volume [m^3] worn off by an integral of load over sliding distance [N m], or its rate by a power [W]."""
        return self.wear_coefficient * rubbing / self.hardness
