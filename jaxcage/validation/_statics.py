"""Loads of the rollers, contact law and kinematics beside handbooks, and beside SciPy."""

import math

import equinox as eqx
import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from ..bearing import (
    PALMGREN_CONSTANT,
    Bearing,
    line_contact_approach,
    line_contact_stiffness,
    load_distribution,
    nu2310,
)
from ._comparison import Comparison, beside, within, within_share
from ._literature import LARGEST_ROLLER_LOAD


SJOEVALL = "Sjoevall's load integral of line contacts, by SciPy's quad"
PALMGREN = "A. Palmgren: delta = 3.84e-5 Q^0.9/l^0.8 in N and mm"
SCIPY = "line contacts added up in NumPy, the shift by SciPy's brentq"
ROLLING = "rolling without slip, (1 - d_w/d_m)/2"
CENTRIFUGAL = "m w^2 d_m/2 of a steel cylinder of 7800 kg/m^3"


def statics_comparisons() -> list[Comparison]:
    """All comparisons of statics and kinematics."""
    return [*_load_factors(), *_contact_law(), *_discrete(), *_kinematics()]


def _many_rollers(clearance: float) -> Bearing:
    """400 thin rollers: the sum over them is the integral."""
    return Bearing(0.05, 0.11, 0.04, 400, 5e-4, 0.027, 0.0921, 0.065, clearance, 3e-4)


def load_integral(zone: float) -> float:
    """J_r = 1/(2 pi) int (1 - (1 - cos a)/(2 zone))^(10/9) cos a da over the loaded angles, to 1e-12."""
    half = math.acos(1 - 2 * zone)
    share = lambda a: max(1 - (1 - math.cos(a)) / (2 * zone), 0.0) ** (10 / 9) * math.cos(a)
    return quad(share, 0.0, half, epsabs=0.0, epsrel=1e-12, limit=200)[0] / math.pi


def _load_factors() -> list[Comparison]:
    free = float(load_distribution(_many_rollers(0.0), 4450.0).max_load) * 400 / 4450
    rows = [
        beside("Q_max Z/F without clearance", LARGEST_ROLLER_LOAD, free),
        within_share("load integral at zone parameter 0.5", SJOEVALL, load_integral(0.5), 1 / free, 1e-4),
    ]
    # J_r = F/(Z Q_max) at the load zone parameter 1/2 - G_r/(4 delta_s): the load that gives it is solved for.
    bearing = _many_rollers(4e-6)

    def parameter(load: float) -> float:
        return 0.5 * (1 - 4e-6 / (2 * float(load_distribution(bearing, load).shaft_shift)))

    for zone in (0.1, 0.2, 0.3, 0.4):
        load = float(brentq(lambda load: parameter(load) - zone, 10.0, 1e6, xtol=1e-3))  # pyright: ignore
        ours = load / (400 * float(load_distribution(bearing, load).max_load))
        rows.append(within_share(f"load integral at zone parameter {zone}", SJOEVALL, load_integral(zone), ours, 1e-4))
    return rows


def _contact_law() -> list[Comparison]:
    rows = []
    for load, length in ((1000.0, 10.0), (5000.0, 27.0)):
        theirs = 3.84e-5 * load**0.9 / length**0.8
        ours = 1e3 * float(line_contact_approach(line_contact_stiffness(PALMGREN_CONSTANT, 1e-3 * length), load))
        rows.append(within_share(f"approach at {load:g} N and {length:g} mm [mm]", PALMGREN, theirs, ours, 1e-3))
    return rows


def loads_by_scipy(load: float, clearance: float, rollers: int, length: float) -> tuple[float, np.ndarray]:
    """Shift of the shaft [m] and loads of the rollers [N], one of them at the bottom; nothing of it is the package's.

    **Arguments:** load [N]; clearance of the diameters [m]; rollers; their length [mm].
    """
    raceway = 8.06e4 * length ** (8 / 9) * 1e3 ** (10 / 9)
    both = raceway / 2 ** (10 / 9)
    direction = np.cos(2 * np.pi * np.arange(rollers) / rollers)
    loads = lambda shift: both * np.maximum(shift * direction - clearance / 2, 0.0) ** (10 / 9)
    shift = float(brentq(lambda s: loads(s) @ direction - load, clearance / 2, 1e-3, xtol=1e-16))  # pyright: ignore
    return shift, loads(shift)


def _discrete() -> list[Comparison]:
    rows = []
    for clearance, load in ((0.0, 4450.0), (40e-6, 4450.0), (40e-6, 18600.0)):
        bearing = eqx.tree_at(lambda b: b.radial_clearance, nu2310(), clearance)
        found, (shift, loads) = load_distribution(bearing, load), loads_by_scipy(load, clearance, 13, 27.0)
        where = f"NU2310, {load:g} N, clearance {1e6 * clearance:g} um"
        rows.append(within_share(f"{where}, Q_max [N]", SCIPY, loads[0], found.max_load, 1e-6))
        rows.append(within_share(f"{where}, shift [um]", SCIPY, 1e6 * shift, 1e6 * found.shaft_shift, 1e-6))
    return rows


def _kinematics() -> list[Comparison]:
    bearing = nu2310()
    ratio = 0.5 * (1 - 16 / 81)
    mass = math.pi / 4 * 0.016**2 * 0.027 * 7800
    cage = ratio * 6700 * math.pi / 30
    ours = bearing.roller_centrifugal_force(6700 * math.pi / 30)
    return [
        within("NU2310, cage speed over shaft speed", ROLLING, ratio, bearing.cage_speed_ratio, 1e-12),
        within_share(
            "NU2310, centrifugal force of a roller at 6700 rpm [N]", CENTRIFUGAL, mass * cage**2 * 0.0405, ours, 5e-3
        ),
    ]
