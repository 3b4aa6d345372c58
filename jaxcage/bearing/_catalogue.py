"""Ready-made bearings."""

import dataclasses
from collections.abc import Callable

from ._geometry import Bearing


@dataclasses.dataclass(frozen=True)
class CatalogueRatings:
    """Loads in N and shaft speeds in rpm that a catalogue rates a bearing for."""

    dynamic_load_n: float
    static_load_n: float
    reference_speed_rpm: float
    limiting_speed_rpm: float


NU2310_RATINGS = CatalogueRatings(
    dynamic_load_n=186e3,
    static_load_n=186e3,
    reference_speed_rpm=6700.0,
    limiting_speed_rpm=12000.0,
)
"""Section 4 of the paper."""


def nu2310() -> Bearing:
    """NU2310, the bearing of the paper: Table 1, and the inner raceway of 65 mm of catalogues."""
    return Bearing(
        bore=50e-3,
        outside_diameter=110e-3,
        width=40e-3,
        n_rollers=13,
        roller_diameter=16e-3,
        roller_length=27e-3,
        rib_diameter=92.1e-3,
        inner_raceway_diameter=65e-3,
        radial_clearance=40e-6,
        pocket_clearance=0.3e-3,
    )


BEARINGS: dict[str, Callable[[], Bearing]] = {"NU2310": nu2310}
"""Bearings by their designation."""
