"""Bearings by designation, and what the paper publishes: its cases (Table 2) and their zones (section 4).

Source: L. Chen, X. Xia, H. Zheng, M. Qiu, "Chaotic Dynamics of Cage Behavior in a High-Speed Cylindrical Roller
Bearing", Shock and Vibration 2016, article 9120505, http://dx.doi.org/10.1155/2016/9120505, open access under the
Creative Commons Attribution License (CC BY). The numbers are taken from it; the readings of its misprints are ours.
"""

import dataclasses
from collections.abc import Callable

from .._errors import ArgumentError
from .geometry import Bearing


def nu2310() -> Bearing:
    """NU2310, the bearing of the paper: Table 1, with the inner raceway of 65 mm that catalogues give."""
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


@dataclasses.dataclass(frozen=True)
class PublishedCase:
    """One row of Table 2 with its chaotic zones.

    Speeds are w_co, cage relative to rib, as section 4 calls them. Table 2 heads the eccentricity "(mm)", impossible in
    a gap of 0.45 mm: it is read in micrometres. VG is read as mm^2/s at 40 C.
    """

    name: str
    guidance_gap_mm: float
    eccentricity_um: float
    viscosity_grade: float
    zone_1_onset_rpm: float
    zone_1_exit_rpm: float
    zone_2_onset_rpm: float


PUBLISHED_CASES: dict[str, PublishedCase] = {
    case.name: case
    for case in (
        PublishedCase("1a", 0.45, 23.0, 56.0, 9100.0, 12000.0, 25500.0),
        PublishedCase("1b", 0.60, 23.0, 56.0, 7100.0, 22000.0, 26000.0),
        PublishedCase("2a", 0.45, 35.0, 56.0, 7600.0, 14000.0, 22500.0),
        PublishedCase("2b", 0.45, 57.0, 56.0, 7800.0, 13000.0, 19800.0),
        PublishedCase("3a", 0.45, 42.0, 78.0, 7650.0, 13400.0, 21000.0),
        PublishedCase("3b", 0.45, 42.0, 32.0, 7650.0, 13400.0, 21000.0),
    )
}
"""The cases by name."""

PUBLISHED_SPEED_RANGE_RPM = (2500.0, 27500.0)
"""Speed axis of fig. 7. Read as w_co, its end means a shaft at 68500 rpm, where catalogues allow 12000 rpm."""


def published_case(name: str) -> PublishedCase:
    """The published case `name`.

    **Raises:** `ValueError` that lists the names of the cases.
    """
    if name not in PUBLISHED_CASES:
        raise ArgumentError("name", said=f"must be one of {', '.join(PUBLISHED_CASES)}, but {name!r} was given.")
    return PUBLISHED_CASES[name]
