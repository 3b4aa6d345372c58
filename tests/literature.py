"""Numbers of this package beside numbers that others printed, or that follow from a closed form or another program.

`python tests/literature.py` writes VALIDATION.md; `test_literature` checks its rows; other tests read numbers here.
"""

import math
import pathlib
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import short_bearing as short_bearing_of
from reynolds import film_force
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.sparse import csc_matrix, csr_array, diags_array, kron
from scipy.sparse.linalg import spsolve
from scipy.special import gamma

import jaxcage as jc
from jaxcage import bearing, forces


class Number(NamedTuple):
    """Their number, how far from it the source lets an exact number be, and where it is from."""

    value: float
    tolerance: float
    source: str


class Row(NamedTuple):
    """A number of ours beside one that we did not make."""

    what: str
    theirs: float
    ours: float
    tolerance: float
    source: str

    @property
    def passed(self) -> bool:
        """False for a number that is not finite, too."""
        return bool(abs(self.ours - self.theirs) <= self.tolerance)


def row(what: str, theirs: Any, ours: Any, tolerance: float, source: str) -> Row:
    return Row(what, float(theirs), float(ours), float(tolerance), source)


def share(what: str, theirs: float, ours: Any, part: float, source: str) -> Row:
    """A row with a tolerance relative to theirs."""
    return row(what, theirs, ours, part * abs(theirs), source)


def beside(what: str, number: Number, ours: Any, sample: float = 0.0) -> Row:
    """A row with a number of the table; ours as a finite sample is uncertain by `sample`."""
    return row(what, number.value, ours, number.tolerance + sample, number.source)


# The table of numbers.

ROSS = "as printed by ROSS `tests/test_fluid_film_literature.py`"
FRISWELL = (
    "M. I. Friswell et al., Dynamics of Rotating Machines (2010), p. 177, as printed by ROSS `CylindricalBearing` "
    "(525 N, 30 x 100 mm, c 0.1 mm, 0.1 Pa s, 1500 rpm)"
)
LUND_THOMSEN = (
    "J. W. Lund and K. K. Thomsen, A calculation method and data for the dynamic coefficients of oil-lubricated "
    f"journal bearings, ASME (1978), two axial grooves of 20 degrees, {ROSS} and by DTU course 41524"
)
NICHOLAS = f"J. C. Nicholas, L. E. Barrett and M. E. Leader, ASME J. Mech. Des. 102 (1980) 344, table 6, set A, {ROSS}"
ASYMPTOTE = f"J. C. Nicholas (1994), large S, {ROSS}"
SOMMERFELD = "A. Sommerfeld (1904), long bearing, closed form"
GUEMBEL = "L. Guembel (1914), long bearing without negative pressure, closed form"
CONCENTRIC = "closed form of a concentric film, 3 (1 - tanh(l)/l)/l^2"
FINITE_VOLUMES = "finite volumes in SciPy on three grids, extrapolated (`tests/literature.py`)"
SHORT = "Routh's criterion on the short bearing's closed-form coefficients"
NSK = "NSK, Rolling Bearings, CAT. No. E728g, section 5, (5): Q_max = 4.08 F/Z for rollers without clearance"
SJOEVALL = "Sjoevall's load integral of line contacts, by SciPy's quad"
PALMGREN = "A. Palmgren: delta = 3.84e-5 Q^0.9/l^0.8 in N and mm"
BRENTQ = "line contacts added up in NumPy, the shift by SciPy's brentq"
ROLLING = "rolling without slip, (1 - d_w/d_m)/2"
CENTRIFUGAL = "m w^2 d_m/2 of a steel cylinder of 7800 kg/m^3"
HUNT_CROSSLEY = (
    "K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440, force law; the restitution asked for, as SciPy's "
    "DOP853 measures it on our force"
)
NEAR_ONE = "K. H. Hunt and F. R. E. Crossley (1975), chi = 3 (1 - e)/2 for e near 1"
IMPACT = "energy of an elastic impact with force K p^(10/9), closed form"
TRACE = "mean divergence, exact"
EIGENVALUES = "eigenvalues at the fixed point, exact"
SPROTT = "J. C. Sprott, Common Chaotic Systems (2004), sprott.physics.wisc.edu/chaos/comchaos.htm"
ENSEMBLE = "2048 runs of 500 periods in NumPy, Runge-Kutta on the variational equation (`tests/literature.py`)"
DOP853 = "SciPy's DOP853 at 1e-12 with Newton's method on the variational equations"
SHOOTING = f"{DOP853} (`tests/literature.py`)"
FEIGENBAUM_1978 = "M. J. Feigenbaum (1978): distances of period doublings shrink by 4.669..."
SCALING = "exact: under x -> s x the force at any edge goes with b^(-1/2)"
MATHIEU = "characteristic values at q = 1: DLMF chapter 28, computed by SciPy's `mathieu_a` and `mathieu_b`"
JEFFCOTT = "H. H. Jeffcott, Phil. Mag. 37 (1919) 304: unbalance response of a mass on springs"
NEWKIRK = "B. L. Newkirk and H. D. Taylor, General Electric Review 28 (1925) 559: oil whirl at half speed"
ROUTH = "short film of vanishing load: omega = sqrt(24/pi) sqrt(g/c)"
DAMPING = "mean divergence, -2 B/M times the period, exact"
POLAR = "(16)-(27) in polar form in plain Python (`tests/reference`), integrated by SciPy's DOP853"

# The short bearing, by entry of the stiffness matrix [N/m]; cut off, not rounded.
SHORT_BEARING = {"xx": 12807959.0, "xy": 16393593.0, "yx": -25060393.0, "yy": 8815302.0}
# L/D, S, eps, attitude angle [deg], K_xx, K_xy, K_yx, K_yy, B_xx, B_xy, B_yy.
GROOVED = """
0.5 6.430 0.071 81.89 1.55 14.41 -6.60 1.88 28.75 1.89 13.31
0.5 2.634 0.165 72.36 1.61 6.74 -3.01 1.91 13.36 2.00 6.28
0.5 1.656 0.244 65.85 1.69 5.06 -2.20 1.95 9.93 2.15 4.80
0.5 0.917 0.372 57.45 2.12 4.01 -1.30 1.85 7.70 2.06 3.23
0.5 0.580 0.477 51.01 2.67 3.70 -0.78 1.75 6.96 1.94 2.40
0.5 0.244 0.655 40.25 4.21 3.74 -0.13 1.64 6.87 1.82 1.54
0.5 0.086 0.809 30.04 7.51 4.42 0.47 1.59 8.03 1.79 1.03
1.0 0.991 0.150 70.58 1.56 7.29 -2.16 1.52 14.66 1.58 4.49
1.0 0.635 0.224 63.54 1.62 5.33 -1.57 1.56 10.80 1.70 3.41
1.0 0.235 0.460 49.27 2.19 3.57 -0.80 1.55 7.36 1.89 2.19
1.0 0.159 0.559 44.33 2.73 3.36 -0.48 1.48 6.94 1.78 1.74
1.0 0.108 0.650 39.72 3.45 3.34 -0.23 1.44 6.89 1.72 1.43
"""
COEFFICIENTS = "K_xx", "K_xy", "K_yx", "K_yy", "B_xx", "B_xy", "B_yy"
# L/D 1. S: eps; the whirl threshold omega sqrt(c/g) of both is 2.1.
GROOVED_WHIRL = {5.3: 0.03, 4.3: 0.04}
# Largest exponent per unit of time; the tolerance is three standard errors.
EXPONENTS = {
    "Ueda x'' + .05 x' + x^3 = 7.5 sin t": Number(0.10355, 0.0004, ENSEMBLE),
    "Duffing x'' + .25 x' - x + x^3 = .4 cos t": Number(0.15712, 0.0005, ENSEMBLE),
    "pendulum x'' + .05 x' + sin x = .6 cos .7t": Number(0.14114, 0.0004, ENSEMBLE),
    "Duffing x'' + .3 x' - x + x^3 = .5 cos 1.2t": Number(0.10480, 0.00065, ENSEMBLE),
    "Duffing x'' + .15 x' - x + x^3 = .3 cos t": Number(0.18333, 0.00045, ENSEMBLE),
    "pendulum x'' + .5 x' + sin x = 1.5 cos 2t/3": Number(0.11235, 0.0003, ENSEMBLE),
}
# Lorenz's system and Roessler's: all exponents per unit of time, and Kaplan and Yorke's dimension.
LORENZ = Number(0.9056, 0.005, SPROTT), Number(0.0, 0.002, SPROTT), Number(-14.5723, 0.007, SPROTT)
LORENZ_DIMENSION = Number(2.06215, 1e-3, SPROTT)
ROESSLER = Number(0.0714, 0.002, SPROTT), Number(0.0, 0.001, SPROTT), Number(-5.3943, 0.02, SPROTT)
# x'' + .3 x' - x + x^3 = g cos 1.2t. Periods: a force inside the stable range, the force at which the period doubles.
DUFFING_DOUBLINGS = {
    1: (0.262, Number(0.265581786, 2e-9, SHOOTING)),
    2: (0.285, Number(0.286693158, 2e-9, SHOOTING)),
    4: (0.2908, Number(0.291089909, 2e-9, SHOOTING)),
    8: (0.29196, Number(0.292031000, 2e-9, SHOOTING)),
}
DUFFING_SLOPES = {
    "the mass": Number(0.163248905, 2e-9, DOP853),
    "the damping": Number(0.543875937, 2e-9, DOP853),
    "a factor of both stiffnesses": Number(-0.060829900, 2e-9, DOP853),
}
FEIGENBAUM = 4.669201609
# x'' + .1 x' + x + x^3 = .3 cos wt: w at the folds where the large orbit ends, and the small one.
DUFFING_FOLDS = {"up": Number(1.77971952, 2e-8, DOP853), "down": Number(1.3242362, 1e-7, DOP853)}
VAN_DER_POL_LET_GO = Number(1.0175566306, 1e-9, DOP853)


# Film. Frame of the tables: x along the load (here -y) and y a quarter turn on in the direction of rotation, so that
# their K_xx, K_xy, K_yx, K_yy are our K_yy, -K_yx, -K_xy, K_xx, and so with damping; the attitude angle runs from the
# load line to the line of centres in the direction of rotation. S = mu N L D (R/c)^2/W with N in revolutions per second
# is 1/(4 pi lambda^2 f) of a force f in units of mu R L^3/c^2 omega, lambda = L/D.


def short_bearing() -> Iterator[Row]:
    speed = 1500 * math.pi / 30
    eps = short_bearing_of.eccentricity_ratio(525 / (forces.film_scale(0.1, 0.05, 0.03, 1e-4) * speed))
    yield row("short bearing, eccentricity ratio", 0.266298, eps, 6e-7, FRISWELL)
    stiffness = short_bearing_of.film_coefficients(eps).stiffness * 525.0 / 1e-4
    for (name, printed), ours in zip(SHORT_BEARING.items(), np.asarray(stiffness).ravel(), strict=True):
        yield row(f"short bearing, k_{name} [N/m]", printed, ours, 1.0, FRISWELL)
    small = short_bearing_of.film_coefficients(1e-6)
    whirl = short_bearing_of.whirl_threshold(small.stiffness, small.damping)
    what = "whirl threshold of a vanishing load, omega sqrt(c/g)"
    yield row(what, math.sqrt(24 / math.pi), whirl.speed, 1e-9, SHORT)
    yield row("whirl ratio there", 0.5, whirl.whirl_ratio, 1e-9, SHORT)


def film_limits() -> Iterator[Row]:
    for eps in (0.3, 0.7):
        tangential = 12 * math.pi * eps / ((2 + eps**2) * math.sqrt(1 - eps**2))
        radial = -12 * eps**2 / ((2 + eps**2) * (1 - eps**2))
        # What the ends of a long bearing take off goes with D/L: extrapolated from L/D = 10 and 20.
        long = lambda how, lam: 4 * lam**2 * film_force((eps, 0.0), (0.0, 0.0), lam, cavitation=how, profiles=8)
        full, half = (2 * long(how, 20.0) - long(how, 10.0) for how in ("full", "guembel"))
        where = f"long bearing, eps {eps}"
        yield share(f"{where}, tangential force", tangential, full[1], 2e-3, SOMMERFELD)
        yield share(f"{where}, half film, tangential", tangential / 2, half[1], 2e-3, GUEMBEL)
        yield share(f"{where}, half film, radial", radial, half[0], 5e-3, GUEMBEL)
    for lam in (0.25, 1.0):
        ours = film_force((1e-6, 0.0), (0.0, 0.0), lam, cavitation="full", profiles=8)[1] / (math.pi / 2 * 1e-6)
        theirs = 3 * (1 - math.tanh(lam) / lam) / lam**2
        yield share(f"concentric film over short film, L/D {lam}", theirs, ours, 1e-4, CONCENTRIC)


def full_bearings() -> Iterator[Row]:
    """A bearing fed at the widest gap, where the pressure is zero, as in A. A. Raimondi and J. Boyd's tables (1958)."""
    for lam, eps in ((lam, eps) for lam in (1.0, 0.5, 0.25) for eps in (0.2, 0.4, 0.6, 0.8)):
        radial, tangential = film_force((eps, 0.0), (0.0, 0.0), lam, held=np.arange(256) == 128)
        number, angle = finite_volumes(lam, eps)
        ours = 1 / (4 * math.pi * lam**2 * math.hypot(radial, tangential))
        where = f"full bearing, L/D {lam:g}, eps {eps}"
        yield share(f"{where}, S", number, ours, 3e-4, FINITE_VOLUMES)
        ours = math.degrees(math.atan2(tangential, -radial))
        yield row(f"{where}, attitude angle [deg]", angle, ours, 0.01, FINITE_VOLUMES)


def finite_volumes(slenderness: float, eps: float) -> np.ndarray:
    """S and attitude angle [deg] of a full bearing a second time, extrapolated from grids whose errors fall by four.

        d/dtheta (H^3 dp/dtheta) + (D/L)^2 H^3 d^2p/dzeta^2 = 6 dH/dtheta,  H = 1 + eps cos theta,
    by finite volumes of five points on a grid that is even in theta, from the widest gap, and across half of the land.
    """
    wet, found = np.arange(1, 20)[:, None] < 11, []
    for around, across in ((240, 16), (480, 32), (960, 64)):
        h, k = 2 * math.pi / around, 1 / across
        theta, gap = h * np.arange(1, around), 1 + eps * np.cos(h * (np.arange(around) + 0.5))
        face, thick = gap**3 / h, (1 + eps * np.cos(theta)) ** 3 * h / slenderness**2
        half = np.concatenate([[0.5], np.ones(across - 1)])  # the first cell across begins at the middle of the land
        size, ends = k * half, np.full(across - 1, -1 / k)
        along = diags_array([-face[1:-1], face[:-1] + face[1:], -face[1:-1]], offsets=[-1, 0, 1])  # pyright: ignore
        over = diags_array([ends, 2 / k * half, ends], offsets=[-1, 0, 1])  # pyright: ignore
        matrix = csr_array(kron(along, diags_array(size)) + kron(diags_array(thick), over))
        source = 6 * np.outer(gap[:-1] - gap[1:], size).ravel()
        rows = (np.arange(1, around) * (wet.shape[0] + 1) // around).clip(1, wet.shape[0]) - 1
        on = wet[rows][:, np.arange(across) * wet.shape[1] // across].ravel()  # as on the coarser grid
        while True:  # until p >= 0, and where p > 0 the equation holds
            p = np.zeros(source.size)
            p[on] = np.asarray(spsolve(csc_matrix(matrix[on][:, on]), source[on]))
            before, on = on, np.where(on, p > 0, source - matrix @ p > 0)
            if np.array_equal(on, before):
                break
        wet, p = on.reshape(around - 1, across), p.reshape(around - 1, across)
        mean = (p[:, 0] / 2 + p[:, 1:].sum(axis=1)) / across
        radial, tangential = (h * float(mean @ f(theta)) for f in (np.cos, np.sin))
        angle = math.degrees(math.atan2(tangential, -radial))
        found.append((1 / (math.pi * math.hypot(radial, tangential)), angle))
    _, middle, fine = np.array(found)
    return fine + (fine - middle) / 3


TINY = 1e-30


def grooved_bearing(eps: float, slenderness: float, angle: float) -> tuple[float, float, np.ndarray, np.ndarray]:
    """S, attitude angle, stiffness over W/c and damping over W/(c omega) in our frame; grooves of 20 degrees.

    By Newton's method on the angle between load and grooves, from a guess; derivatives by imaginary steps.
    """
    degrees = np.arange(288) * 1.25
    away = np.minimum(np.abs((degrees + 90) % 360 - 90), np.abs(degrees - 180))
    force = lambda r, v: film_force(r, v, slenderness, stations=288, profiles=2, held=away < 10.1)
    place = lambda a: eps * np.array([np.sin(a), -np.cos(a)])
    for _ in range(8):
        sideways = force(place(angle + 1j * TINY), (0.0, 0.0))[0]
        angle -= sideways.real / (sideways.imag / TINY)
    r, still, steps = place(angle), np.zeros(2), 1j * TINY * np.eye(2)
    load = force(r, still)[1]
    k = np.stack([force(r + h, still).imag / TINY for h in steps], axis=1)
    c = np.stack([force(r, h).imag / TINY for h in steps], axis=1)
    return 1 / (4 * math.pi * slenderness**2 * load), angle, -k / load, -c / load


def lund_thomsen() -> Iterator[Row]:
    for line in GROOVED.split("\n")[1:-1]:
        lam, number, eps, angle, *printed = map(float, line.split())
        sommerfeld, attitude, k, c = grooved_bearing(eps, lam, math.radians(angle))
        ours = (k[1, 1], -k[1, 0], -k[0, 1], k[0, 0], c[1, 1], -c[1, 0], c[0, 0])
        where = f"two grooves, L/D {lam:g}, eps {eps}"
        yield share(f"{where}, S", number, sommerfeld, 0.02, LUND_THOMSEN)
        yield row(f"{where}, attitude angle [deg]", angle, math.degrees(attitude), 0.5, LUND_THOMSEN)
        for name, theirs, value in zip(COEFFICIENTS, printed, ours, strict=True):
            yield row(f"{where}, {name}", theirs, value, max(0.06 * abs(theirs), 0.06), LUND_THOMSEN)


def nicholas() -> Iterator[Row]:
    """Their eccentricity ratios have two digits: ours is solved for at their S, by the secant rule."""
    whirl = lambda eps: short_bearing_of.whirl_threshold(*map(jnp.asarray, grooved_bearing(eps, 1.0, 1.5)[2:])).speed
    for number, printed in GROOVED_WHIRL.items():
        eps = printed
        for _ in range(4):  # the load is all but proportional to eps
            eps *= grooved_bearing(eps, 1.0, 1.5)[0] / number
        where = f"two grooves, L/D 1, S {number}"
        yield row(f"{where}, eps", printed, eps, 0.006, NICHOLAS)
        yield row(f"{where}, whirl threshold omega sqrt(c/g)", 2.1, whirl(eps), 0.05, NICHOLAS)
    yield row("two grooves, L/D 1, no load, whirl threshold omega sqrt(c/g)", 2.05, whirl(1e-3), 0.05, ASYMPTOTE)


# Statics.


def load_factors() -> Iterator[Row]:
    """400 thin rollers: the sum over them is the integral J_r = F/(Z Q_max), at the zone 1/2 - G_r/(4 delta_s)."""
    many = lambda gap: bearing.Bearing(0.05, 0.11, 0.04, 400, 5e-4, 0.027, 0.0921, 0.065, gap, 3e-4)
    free = float(bearing.load_distribution(many(0.0), 4450.0).max_load) * 400 / 4450
    yield row("Q_max Z/F without clearance", 4.08, free, 0.006, NSK)

    def integral(zone: float) -> float:
        part = lambda a: max(1 - (1 - math.cos(a)) / (2 * zone), 0.0) ** (10 / 9) * math.cos(a)
        return quad(part, 0.0, math.acos(1 - 2 * zone), epsabs=0.0, epsrel=1e-12, limit=200)[0] / math.pi

    yield share("load integral at zone parameter 0.5", integral(0.5), 1 / free, 1e-4, SJOEVALL)
    at = lambda load: bearing.load_distribution(many(4e-6), load)
    for zone in (0.1, 0.2, 0.3, 0.4):
        off = lambda load: 0.5 * (1 - 4e-6 / (2 * float(at(load).shaft_shift))) - zone
        load: Any = brentq(off, 10.0, 1e6, xtol=1e-3)
        ours = load / (400 * float(at(load).max_load))
        yield share(f"load integral at zone parameter {zone}", integral(zone), ours, 1e-4, SJOEVALL)
    for load, length in ((1000.0, 10.0), (5000.0, 27.0)):
        stiffness = bearing.line_contact_stiffness(bearing.PALMGREN_CONSTANT, 1e-3 * length)
        ours = 1e3 * bearing.line_contact_approach(stiffness, load)
        what = f"approach at {load:g} N and {length:g} mm [mm]"
        yield share(what, 3.84e-5 * load**0.9 / length**0.8, ours, 1e-3, PALMGREN)


def loads_by_scipy(load: float, clearance: float, rollers: int, length: float) -> tuple[float, np.ndarray]:
    """Shift of the shaft [m] and loads of the rollers [N], one at the bottom, of a diametral clearance [m].

    The length of the rollers is in millimetres.
    """
    both = 8.06e4 * length ** (8 / 9) * 1e3 ** (10 / 9) / 2 ** (10 / 9)
    direction = np.cos(2 * np.pi * np.arange(rollers) / rollers)
    loads = lambda shift: both * np.maximum(shift * direction - clearance / 2, 0.0) ** (10 / 9)
    shift: Any = brentq(lambda s: loads(s) @ direction - load, clearance / 2, 1e-3, xtol=1e-16)
    return shift, loads(shift)


def nu2310() -> Iterator[Row]:
    ours = bearing.nu2310()
    for clearance, load in ((0.0, 4450.0), (40e-6, 4450.0), (40e-6, 18600.0)):
        found = bearing.load_distribution(jc.replace(ours, radial_clearance=clearance), load)
        shift, loads = loads_by_scipy(load, clearance, 13, 27.0)
        where = f"NU2310, {load:g} N, clearance {1e6 * clearance:g} um"
        yield share(f"{where}, Q_max [N]", loads[0], found.max_load, 1e-6, BRENTQ)
        yield share(f"{where}, shift [um]", 1e6 * shift, 1e6 * found.shaft_shift, 1e-6, BRENTQ)
    ratio, shaft = 0.5 * (1 - 16 / 81), 6700 * math.pi / 30
    yield row("NU2310, cage speed over shaft speed", ratio, ours.cage_speed_ratio, 1e-12, ROLLING)
    force = math.pi / 4 * 0.016**2 * 0.027 * 7800 * (ratio * shaft) ** 2 * 0.0405
    what = "NU2310, centrifugal force of a roller at 6700 rpm [N]"
    yield share(what, force, ours.roller_centrifugal_force(shaft), 5e-3, CENTRIFUGAL)


# Contact.


def bounce(force: Callable[[Any, Any], Any], mass: float, v0: float, scale: float) -> tuple[float, float, float]:
    """Speed after over speed before, greatest depth [m] and duration [s] of an impact on a force of depth and its rate;
    `scale` is the order of the depth."""
    normal = jax.jit(force)
    push = lambda t, y: [float(y[1]), -float(normal(jnp.asarray(y[0]), jnp.asarray(y[1]))) / mass]
    out, deepest = (lambda t, y: float(y[0])), (lambda t, y: float(y[1]))
    out.terminal, out.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    how: Any = dict(method="DOP853", events=[out, deepest], rtol=1e-10, atol=[1e-11 * scale, 1e-11 * v0])
    done = solve_ivp(push, (0.0, 200 * scale / v0), [0.0, v0], **how)
    assert done.status == 1, "the body did not leave the contact"
    return -done.y[1, -1] / v0, float(done.y_events[1][0][0]), float(done.t[-1])


MASS, STIFFNESS, V0, N = 0.2, 3e8, 0.1, 10 / 9
DEPTH = (MASS * V0**2 / STIFFNESS) ** (1 / (N + 1))
"""Scale of the depth of an impact of this mass [kg] at this speed [m/s]."""


def impact(restitution: float) -> tuple[float, float, float]:
    """A bounce from our contact force."""
    chi = float(forces.restitution_damping(restitution))
    normal = lambda p, v: forces.contact_force(jnp.maximum(p, 0.0), v, STIFFNESS, chi / V0)
    return bounce(normal, MASS, V0, DEPTH)


def contact() -> Iterator[Row]:
    for restitution in (0.9, 0.7, 0.5, 0.3):
        yield row(f"restitution, {restitution} asked for", restitution, impact(restitution)[0], 1e-5, HUNT_CROSSLEY)
    near = forces.restitution_damping(0.9999) / 1.5e-4
    yield row("damping number over 3 (1 - e)/2 at e = 0.9999", 1.0, near, 2e-4, NEAR_ONE)
    speed, depth, duration = impact(1.0)
    deepest = ((N + 1) / 2) ** (1 / (N + 1)) * DEPTH
    lasting = 2 * deepest / V0 * math.sqrt(math.pi) * gamma(1 + 1 / (N + 1)) / gamma(0.5 + 1 / (N + 1))
    yield row("restitution of an elastic impact", 1.0, speed, 1e-6, IMPACT)
    yield share("greatest depth [um]", 1e6 * deepest, 1e6 * depth, 1e-6, IMPACT)
    yield share("duration [us]", 1e6 * lasting, 1e6 * duration, 1e-6, IMPACT)


Rows = Callable[[], Iterator[Row]]


def topics() -> dict[str, tuple[Rows, ...]]:
    """All comparisons; those of `literature_motion` read the table above."""
    import literature_motion as motion

    cage = motion.unbalance, motion.divergence, motion.whirl, motion.half_a_revolution
    bifurcations = motion.doublings, motion.pendulum_doublings, motion.folds, motion.van_der_pol, motion.mathieu
    return {
        "film": (short_bearing, film_limits, full_bearings, lund_thomsen, nicholas),
        "statics": (load_factors, nu2310),
        "contact": (contact,),
        "exponents": (motion.driven_exponents, motion.flows),
        "bifurcations": bifurcations,
        "cage": cage,
    }


OF_REYNOLDS = (SOMMERFELD, GUEMBEL, CONCENTRIC, FINITE_VOLUMES, LUND_THOMSEN, NICHOLAS, ASYMPTOTE)
"""Sources of the numbers that the solver in `reynolds` is compared with."""


def page(found: dict[str, list[Row]]) -> str:
    """All rows as Markdown."""
    rows = [r for of in found.values() for r in of]
    reynolds = sum(r.source in OF_REYNOLDS for r in rows)
    lines = [
        f"# Validation\n\n{sum(r.passed for r in rows)} of {len(rows)} comparisons pass: {len(rows) - reynolds} "
        f"numbers of jaxcage, and {reynolds} of the solver of\nReynolds' equation in `tests/reynolds.py`, with which "
        "the tests compare the short film of the package: the rows of long\n"
        "and concentric films, of full bearings and of grooves.\n"
        f"The numbers were made with jaxcage {jc.__version__} by `python tests/literature.py`.\n",
        "A tolerance is what the source supports: half a unit of the last printed digit where ours is exact, more",
        "where theirs was computed on a coarse grid or ours is a finite sample. FAILS marks a difference beyond it.",
        "A source is a publication that can be read, or a second computation that shares no code with the first one.",
    ]
    for topic, of in found.items():
        lines += [f"\n## {topic.capitalize()}\n", "| what | theirs | ours | difference | tolerance | | source |"]
        lines += ["|---|---:|---:|---:|---:|---|---|", *map(_line, of)]
    return "\n".join(lines) + "\n"


def _line(r: Row) -> str:
    """Ours has the digits of the difference, ten at most, as theirs."""
    digits, away = 2, r.ours - r.theirs
    while digits < 10 and abs(r.ours) * 10.0 ** (2 - digits) > abs(away):
        digits += 1
    numbers = f"{r.theirs:.10g} | {r.ours:.{digits}g} | {away:+.2g} | {r.tolerance:.2g}"
    return f"| {r.what} | {numbers} | {'pass' if r.passed else '**FAILS**'} | {r.source} |"


if __name__ == "__main__":
    jc.enable_x64()
    made = {topic: [r for rows in of for r in rows()] for topic, of in topics().items()}
    (pathlib.Path(__file__).parents[1] / "VALIDATION.md").write_text(page(made), encoding="utf-8")
