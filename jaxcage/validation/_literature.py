"""Numbers that others printed or another program found, each once, with one tolerance: page and tests read them here.

A source is one that can be opened, or a computation: by the module that it names, or by the method that it states. A
reader whose own number is a finite sample adds the error of that sample.
"""

from typing import NamedTuple


class Number(NamedTuple):
    """What they have, how far from it the source lets an exact number be, and where it is from."""

    value: float
    tolerance: float
    source: str


FRISWELL = (
    "M. I. Friswell et al., Dynamics of Rotating Machines (2010), p. 177, as printed by ROSS `CylindricalBearing` "
    "(525 N, 30 x 100 mm, c 0.1 mm, 0.1 Pa s, 1500 rpm)"
)
LUND_THOMSEN = (
    "J. W. Lund and K. K. Thomsen, A calculation method and data for the dynamic coefficients of oil-lubricated "
    "journal bearings, ASME (1978), two axial grooves of 20 degrees, as printed by ROSS "
    "`tests/test_fluid_film_literature.py` and by DTU course 41524"
)
NICHOLAS = (
    "J. C. Nicholas, L. E. Barrett and M. E. Leader, ASME J. Mech. Des. 102 (1980) 344, table 6, set A, as printed by "
    "ROSS `tests/test_fluid_film_literature.py`"
)
ASYMPTOTE = "J. C. Nicholas (1994), large S, as printed by ROSS `tests/test_fluid_film_literature.py`"
NSK = "NSK, Rolling Bearings, CAT. No. E728g, section 5, (5): Q_max = 4.08 F/Z for rollers without clearance"
SPROTT = "J. C. Sprott, Common Chaotic Systems (2004), sprott.physics.wisc.edu/chaos/comchaos.htm"
ENSEMBLE = "2048 runs of 500 periods in NumPy, Runge-Kutta on the variational equation (`validation/_shooting.py`)"
DOP853 = "SciPy's DOP853 at 1e-12 with Newton's method on the variational equations"
SHOOTING = f"{DOP853} (`validation/_shooting.py`)"
FEIGENBAUM_1978 = "M. J. Feigenbaum (1978): distances of period doublings shrink by 4.669..."

# The short bearing, by entry of the stiffness matrix [N/m]; cut off, not rounded.
SHORT_BEARING = {
    "xx": Number(12807959.0, 1.0, FRISWELL),
    "xy": Number(16393593.0, 1.0, FRISWELL),
    "yx": Number(-25060393.0, 1.0, FRISWELL),
    "yy": Number(8815302.0, 1.0, FRISWELL),
}

# Two axial grooves. L/D: S, eps, attitude angle [deg], K_xx, K_xy, K_yx, K_yy, B_xx, B_xy, B_yy.
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

# Two axial grooves, L/D 1. S: eps, whirl threshold omega sqrt(c/g).
GROOVED_WHIRL = {
    5.3: (Number(0.03, 0.006, NICHOLAS), Number(2.1, 0.05, NICHOLAS)),
    4.3: (Number(0.04, 0.006, NICHOLAS), Number(2.1, 0.05, NICHOLAS)),
}
GROOVED_WHIRL_OF_NO_LOAD = Number(2.05, 0.05, ASYMPTOTE)

LARGEST_ROLLER_LOAD = Number(4.08, 0.006, NSK)
"""Q_max Z/F without clearance."""

# Largest exponent per unit of time; the tolerance is three standard errors.
EXPONENTS = {
    "Ueda x'' + .05 x' + x^3 = 7.5 sin t": Number(0.10355, 0.0004, ENSEMBLE),
    "Duffing x'' + .25 x' - x + x^3 = .4 cos t": Number(0.15712, 0.0005, ENSEMBLE),
    "pendulum x'' + .05 x' + sin x = .6 cos .7t": Number(0.14114, 0.0004, ENSEMBLE),
    "Duffing x'' + .3 x' - x + x^3 = .5 cos 1.2t": Number(0.10480, 0.00065, ENSEMBLE),
    "Duffing x'' + .15 x' - x + x^3 = .3 cos t": Number(0.18333, 0.00045, ENSEMBLE),
    "pendulum x'' + .5 x' + sin x = 1.5 cos 2t/3": Number(0.11235, 0.0003, ENSEMBLE),
}

# All exponents per unit of time.
LORENZ = (Number(0.9056, 0.005, SPROTT), Number(0.0, 0.002, SPROTT), Number(-14.5723, 0.007, SPROTT))
LORENZ_DIMENSION = Number(2.06215, 1e-3, SPROTT)
ROESSLER = (Number(0.0714, 0.002, SPROTT), Number(0.0, 0.001, SPROTT), Number(-5.3943, 0.02, SPROTT))

# x'' + .3 x' - x + x^3 = g cos 1.2t. Periods: a force inside the stable range, the force at which the period doubles.
DUFFING_DOUBLINGS = {
    1: (0.262, Number(0.265581786, 2e-9, SHOOTING)),
    2: (0.285, Number(0.286693158, 2e-9, SHOOTING)),
    4: (0.2908, Number(0.291089909, 2e-9, SHOOTING)),
    8: (0.29196, Number(0.292031000, 2e-9, SHOOTING)),
}
# Slopes of the first by the mass, the damping and a factor of both stiffnesses.
DUFFING_SLOPES = {
    "m": Number(0.163248905, 2e-9, DOP853),
    "d": Number(0.543875937, 2e-9, DOP853),
    "k": Number(-0.060829900, 2e-9, DOP853),
}
FEIGENBAUM = Number(4.669201609, 0.25, FEIGENBAUM_1978)
"""The limit; tolerance of a first ratio."""

# x'' + .1 x' + x + x^3 = .3 cos wt: w at the folds where the large orbit ends, and the small one.
DUFFING_FOLDS = {"up": Number(1.77971952, 2e-8, DOP853), "down": Number(1.3242362, 1e-7, DOP853)}

VAN_DER_POL_LET_GO = Number(1.0175566306, 1e-9, DOP853)
"""x'' - .3 (1 - x^2) x' + x = g cos 1.3t: g where the drive lets go of the oscillator."""
