"""The oil film beside closed forms and printed tables of finite bearings.

Frame of the tables: x along the load (here -y) and y a quarter turn on in the direction of rotation, so that their
K_xx, K_xy, K_yx, K_yy are our K_yy, -K_yx, -K_xy, K_xx, and so with damping; the attitude angle runs from the load
line to the line of centres in the direction of rotation. S = mu N L D (R/c)^2/W with N in revolutions per second, which
for a film force f = W/(S_film omega), S_film = mu R L^3/c^2, and slenderness lambda = L/D is 1/(4 pi lambda^2 f).
"""

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._types import Scalar
from ..analysis import dimensional, eccentricity_ratio, film_coefficients, whirl_threshold
from ..forces import Cavitation, film_drive, film_pressure_field, film_scale, pressure_force
from ._comparison import Comparison, within, within_share


FRISWELL = (
    "M. I. Friswell et al., Dynamics of Rotating Machines (2010), p. 177, as printed by ROSS `CylindricalBearing` "
    "(525 N, 30 x 100 mm, c 0.1 mm, 0.1 Pa s, 1500 rpm)"
)
SOMMERFELD = "A. Sommerfeld (1904), long bearing, closed form"
GUEMBEL = "L. Guembel (1914), long bearing without negative pressure, closed form"
CONCENTRIC = "closed form of a concentric film, 3 (1 - tanh(l)/l)/l^2"
RAIMONDI_BOYD = "A. A. Raimondi and J. Boyd, A solution for the finite journal bearing III, ASLE Trans. 1 (1958)"
LUND_THOMSEN = (
    "J. W. Lund and K. K. Thomsen, A calculation method and data for the dynamic coefficients of oil-lubricated "
    "journal bearings, ASME (1978), two axial grooves of 20 degrees"
)
NICHOLAS = "J. C. Nicholas, L. E. Barrett and M. E. Leader, ASME J. Mech. Des. 102 (1980) 344, table 6, set A"
ROUTH = "Routh's criterion on the short bearing's closed-form coefficients"

STILL = jnp.zeros(2)


def _force(
    r: Array, v: Array, slenderness: Scalar, cavitation: Cavitation, stations: int, profiles: int, grooves: tuple
) -> Array:
    px, py = film_drive(r[0], r[1], v[0], v[1], 1.0)
    held = np.array(grooves) if grooves else None
    field = film_pressure_field(
        r[0], r[1], px, py, slenderness, cavitation=cavitation, stations=stations, profiles=profiles, grooves=held
    )
    return jnp.stack(pressure_force(field))


@functools.partial(jax.jit, static_argnames=("cavitation", "stations", "profiles", "grooves"))
def steady(
    eps: Scalar, slenderness: Scalar, cavitation: Cavitation, stations: int, profiles: int, grooves: tuple = ()
) -> Array:
    """(outward radial, tangential) force of a film at rest, in units of S_film omega."""
    r = jnp.stack([jnp.asarray(eps, dtype=float), jnp.zeros(())])
    return _force(r, STILL, slenderness, cavitation, stations, profiles, grooves)


class GroovedBearing(NamedTuple):
    """A bearing with two axial grooves in equilibrium: number of Sommerfeld, attitude angle [rad], coefficients."""

    sommerfeld: Array
    angle: Array
    stiffness: Array
    """In units of W/c, in our frame."""
    damping: Array
    """In units of W/(c omega)."""


GROOVED_STATIONS = 288


def _two_grooves() -> tuple[bool, ...]:
    """Stations within 10 degrees of the horizontal split, ends included."""
    angles = 360 * np.arange(GROOVED_STATIONS) / GROOVED_STATIONS
    away = np.minimum(np.abs((angles + 90) % 360 - 90), np.abs(angles - 180))
    return tuple(bool(a) for a in away < 10.1)


def grooved_bearing(eps: Scalar, slenderness: Scalar, guess: Scalar) -> GroovedBearing:
    """Two axial grooves of 20 degrees at right angles to the load, by Newton on the attitude angle."""
    return _grooved_bearing(*(jnp.asarray(x, dtype=float) for x in (eps, slenderness, guess)))  # one program for all


@jax.jit
def _grooved_bearing(eps: Array, slenderness: Array, guess: Array) -> GroovedBearing:
    grooves = _two_grooves()
    force = lambda r, v: _force(r, v, slenderness, "reynolds", GROOVED_STATIONS, 2, grooves)
    place = lambda a: eps * jnp.stack([jnp.sin(a), -jnp.cos(a)])

    def newton(_: Array, a: Array) -> Array:
        value, slope = jax.jvp(lambda a: force(place(a), STILL)[0], (a,), (jnp.ones_like(a),))
        return a - value / slope

    angle = jax.lax.fori_loop(0, 8, newton, jnp.asarray(guess, dtype=float))
    r = place(angle)
    load = force(r, STILL)[1]
    k, c = jax.jacfwd(force, argnums=(0, 1))(r, STILL)
    return GroovedBearing(1 / (4 * jnp.pi * slenderness**2 * load), angle, -k / load, -c / load)


def film_comparisons() -> list[Comparison]:
    """All comparisons of the film."""
    return [*_short(), *_limits(), *_raimondi_boyd(), *lund_thomsen_comparisons(), *_nicholas()]


def _short() -> list[Comparison]:
    speed = 1500 * math.pi / 30
    eps = eccentricity_ratio(525 / (film_scale(0.1, 0.05, 0.03, 1e-4) * speed))
    stiffness, _ = dimensional(film_coefficients(eps), load=525.0, clearance=1e-4, speed=speed)
    printed = {"xx": 12807959.0, "xy": 16393593.0, "yx": -25060393.0, "yy": 8815302.0}  # cut off, not rounded
    names = dict(zip(printed, np.asarray(stiffness).ravel(), strict=True))
    rows = [within(f"short bearing, k_{n} [N/m]", FRISWELL, v, names[n], 1.0) for n, v in printed.items()]
    small = film_coefficients(1e-6)
    threshold = whirl_threshold(small.stiffness, small.damping)
    return [
        *rows,
        within(
            "whirl threshold of a vanishing load, omega sqrt(c/g)",
            ROUTH,
            math.sqrt(24 / math.pi),
            threshold.speed,
            1e-9,
        ),
        within("whirl ratio there", ROUTH, 0.5, threshold.whirl_ratio, 1e-9),
    ]


def _limits() -> list[Comparison]:
    rows = []
    for eps in (0.3, 0.7):
        tangential = 12 * math.pi * eps / ((2 + eps**2) * math.sqrt(1 - eps**2))
        radial = -12 * eps**2 / ((2 + eps**2) * (1 - eps**2))
        # What the ends of a long bearing take off goes with D/L: extrapolated from L/D = 10 and 20.
        long = lambda cavitation, lam: 4 * lam**2 * steady(eps, lam, cavitation, 256, 8)
        full, half = (2 * long(c, 20.0) - long(c, 10.0) for c in ("full", "guembel"))
        where = f"long bearing, eps {eps}"
        rows += [
            within_share(f"{where}, tangential force", SOMMERFELD, tangential, full[1], 2e-3),
            within_share(f"{where}, half film, tangential", GUEMBEL, tangential / 2, half[1], 2e-3),
            within_share(f"{where}, half film, radial", GUEMBEL, radial, half[0], 5e-3),
        ]
    for lam in (0.25, 1.0):
        ours = steady(1e-6, lam, "full", 256, 8)[1] / (math.pi / 2 * 1e-6)
        theirs = 3 * (1 - math.tanh(lam) / lam) / lam**2
        rows.append(within_share(f"concentric film over short film, L/D {lam}", CONCENTRIC, theirs, ours, 1e-4))
    return rows


# L/D: eps, S, attitude angle [deg].
FULL_BEARINGS = {
    1.0: [(0.2, 0.631, 74.02), (0.4, 0.264, 63.10), (0.6, 0.121, 50.58), (0.8, 0.0446, 36.24)],
    0.5: [(0.2, 2.03, 74.94), (0.4, 0.779, 61.45), (0.6, 0.319, 48.14), (0.8, 0.0923, 33.31)],
    0.25: [(0.2, 7.57, 75.18), (0.4, 2.83, 60.86), (0.6, 1.07, 46.72), (0.8, 0.261, 31.04)],
}


def _raimondi_boyd() -> list[Comparison]:
    """A full bearing that is fed at the widest gap: there the pressure is held at zero."""
    stations = 256
    fed = tuple(i == stations // 2 for i in range(stations))
    rows = []
    for lam, table in FULL_BEARINGS.items():
        for eps, number, angle in table:
            radial, tangential = (float(f) for f in steady(eps, lam, "reynolds", stations, 3, fed))
            ours = 1 / (4 * math.pi * lam**2 * math.hypot(radial, tangential))
            where = f"full bearing, L/D {lam:g}, eps {eps}"
            rows.append(within_share(f"{where}, S", RAIMONDI_BOYD, number, ours, 0.03))
            ours = math.degrees(math.atan2(tangential, -radial))
            rows.append(within(f"{where}, attitude angle [deg]", RAIMONDI_BOYD, angle, ours, 1.0))
    return rows


# L/D: S, eps, attitude angle [deg], K_xx, K_xy, K_yx, K_yy, B_xx, B_xy, B_yy.
GROOVED = {
    0.5: [
        (6.430, 0.071, 81.89, 1.55, 14.41, -6.60, 1.88, 28.75, 1.89, 13.31),
        (2.634, 0.165, 72.36, 1.61, 6.74, -3.01, 1.91, 13.36, 2.00, 6.28),
        (1.656, 0.244, 65.85, 1.69, 5.06, -2.20, 1.95, 9.93, 2.15, 4.80),
        (0.917, 0.372, 57.45, 2.12, 4.01, -1.30, 1.85, 7.70, 2.06, 3.23),
        (0.580, 0.477, 51.01, 2.67, 3.70, -0.78, 1.75, 6.96, 1.94, 2.40),
        (0.244, 0.655, 40.25, 4.21, 3.74, -0.13, 1.64, 6.87, 1.82, 1.54),
        (0.086, 0.809, 30.04, 7.51, 4.42, 0.47, 1.59, 8.03, 1.79, 1.03),
    ],
    1.0: [
        (0.991, 0.150, 70.58, 1.56, 7.29, -2.16, 1.52, 14.66, 1.58, 4.49),
        (0.635, 0.224, 63.54, 1.62, 5.33, -1.57, 1.56, 10.80, 1.70, 3.41),
        (0.235, 0.460, 49.27, 2.19, 3.57, -0.80, 1.55, 7.36, 1.89, 2.19),
        (0.159, 0.559, 44.33, 2.73, 3.36, -0.48, 1.48, 6.94, 1.78, 1.74),
        (0.108, 0.650, 39.72, 3.45, 3.34, -0.23, 1.44, 6.89, 1.72, 1.43),
    ],
}
COEFFICIENTS = ("K_xx", "K_xy", "K_yx", "K_yy", "B_xx", "B_xy", "B_yy")


def lund_thomsen_comparisons() -> list[Comparison]:
    """Every number of their table."""
    rows = []
    for lam, table in GROOVED.items():
        for number, eps, angle, *printed in table:
            found = grooved_bearing(eps, lam, math.radians(angle))
            k, c = np.asarray(found.stiffness), np.asarray(found.damping)
            ours = (k[1, 1], -k[1, 0], -k[0, 1], k[0, 0], c[1, 1], -c[1, 0], c[0, 0])
            where = f"two grooves, L/D {lam:g}, eps {eps}"
            rows.append(within_share(f"{where}, S", LUND_THOMSEN, number, found.sommerfeld, 0.02))
            rows.append(within(f"{where}, attitude angle [deg]", LUND_THOMSEN, angle, math.degrees(found.angle), 0.5))
            for name, theirs, value in zip(COEFFICIENTS, printed, ours, strict=True):
                rows.append(within_share(f"{where}, {name}", LUND_THOMSEN, theirs, value, 0.06, least=0.06))
    return rows


def _nicholas() -> list[Comparison]:
    """Their eccentricity ratios have two digits: ours is solved for at their S, by the secant rule."""
    rows = []
    for number, printed in ((5.3, 0.03), (4.3, 0.04)):
        eps = printed
        for _ in range(4):  # the load is all but proportional to eps
            eps *= float(grooved_bearing(eps, 1.0, 1.5).sommerfeld) / number
        found = grooved_bearing(eps, 1.0, 1.5)
        threshold = whirl_threshold(found.stiffness, found.damping).speed
        where = f"two grooves, L/D 1, S {number}"
        rows.append(within(f"{where}, eps", NICHOLAS, printed, eps, 0.006))
        rows.append(within_share(f"{where}, whirl threshold omega sqrt(c/g)", NICHOLAS, 2.1, threshold, 0.05))
    return rows
