"""Bearings by designation, and what the paper publishes: its cases (Table 2) and their zones (section 4).

Source: L. Chen, X. Xia, H. Zheng, M. Qiu, "Chaotic Dynamics of Cage Behavior in a High-Speed Cylindrical Roller
Bearing", Shock and Vibration 2016, article 9120505, http://dx.doi.org/10.1155/2016/9120505, open access under the
Creative Commons Attribution License (CC BY). The numbers are taken from it; the readings of its misprints are ours.
"""

import dataclasses
import functools
from typing import Any, NamedTuple

from .._bearing_data import clearances, designated, dimensions, estimated, rows
from .._errors import ArgumentError
from .geometry import Bearing


CHAMFERS = 1.5e-3
"""Total less effective length of a roller [m]: with 1.2 mm (small ones) to 1.7 mm ISO 76 gives the printed ratings."""


class Listed(NamedTuple):
    """A bearing of the catalogue: `catalogue.csv` has the source of each column.

    Load ratings are in N, the reference and limiting speeds of the shaft in rpm. `k_r` is SKF's minimum load factor
    with the usual cage and with a one-piece brass cage, NaN where none is printed. `estimated` names the parameters
    of `bearing` that are estimated.
    """

    designation: str
    bearing: Bearing
    dynamic_rating: float
    static_rating: float
    reference_rpm: float
    limiting_rpm: float
    k_r: tuple[float, float]
    estimated: tuple[str, ...]

    def minimum_loads(self, shaft_rpm: float) -> tuple[float, float]:
        """Least radial load [N] at a shaft speed, with the usual cage and with a one-piece brass cage: SKF's rule
        F = k_r (6 + 4 n/n_r) (d_m/100)^2 kN with d_m = (d + D)/2 in mm (Rolling bearings, 2018, p. 509)."""
        diameter = 1e3 * float(self.bearing.bore + self.bearing.outside_diameter) / 2
        usual, brass = (1e3 * k * (6 + 4 * shaft_rpm / self.reference_rpm) * (diameter / 100) ** 2 for k in self.k_r)
        return usual, brass


@functools.cache
def catalogue() -> dict[str, Listed]:
    """Bearings by designation, such as `NU2310`."""
    found = {name: _listed(row) for name, row in rows().items()}
    return found | {"NU2310": found["NU2310"]._replace(bearing=nu2310())}


def _listed(row: dict[str, str]) -> Listed:
    """A row of `catalogue.csv`."""
    number = lambda name: float(row[name] or "nan")
    name = row["designation"]
    sizes: dict[str, Any] = dimensions(name)
    sizes |= clearances(sizes)
    bearing = Bearing(
        **sizes,
        n_rollers=int(row["Z"]),
        effective_length=sizes["roller_length"] - CHAMFERS,
    )
    ratings = 1e3 * number("C"), 1e3 * number("C0")
    factors = number("k_r"), number("k_r_brass")
    return Listed(name, bearing, *ratings, number("n_ref"), number("n_lim"), factors, estimated(name))


def listed(designation: str) -> Listed:
    """The bearing with a designation; spaces, case and what stands behind it do not matter (`NU 2310 ECML`).

    **Raises:** `ValueError` that lists the designations.
    """
    return catalogue()[designated(designation)]


def listed_like(bearing: Bearing) -> Listed | None:
    """The bearing of the catalogue that has the boundary dimensions and the rollers of a given one, if there is one."""
    key = lambda b: [round(1e6 * float(x)) for x in (b.bore, b.outside_diameter, b.width, b.roller_diameter)]
    return next((each for each in catalogue().values() if key(each.bearing) == key(bearing)), None)


def static_load_rating(bearing: Bearing) -> float:
    """Basic static radial load rating [N], ISO 76: 44 (1 - d_w/d_m) Z l d_w with lengths in mm and the effective length
    l; where that is not known, it is taken to be 1.5 mm less than the roller's."""
    known = bearing.roller_length - CHAMFERS if bearing.effective_length is None else bearing.effective_length
    d, length = 1e3 * float(bearing.roller_diameter), 1e3 * float(known)
    return 44 * (1 - d / (1e3 * float(bearing.pitch_diameter))) * bearing.n_rollers * length * d


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
