"""Coefficients of the Rosenbrock methods that the compiled rivals step with, for numba and, as a header, for C.

Form of Hairer and Wanner, Solving ODEs II, sec. IV.7: one matrix shift I - J a step, shift = 1/(gamma h).
"""

from typing import NamedTuple

import numpy as np


class Tableau(NamedTuple):
    """Lower triangles of a and c as full matrices; a row of zeros in a is a stage without an evaluation."""

    gamma: float
    alpha: np.ndarray
    gamma_sum: np.ndarray
    a: np.ndarray
    c: np.ndarray
    m: np.ndarray


def _triangle(*rows: tuple[float, ...]) -> np.ndarray:
    full = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        full[i, : len(row)] = row
    return full


# A. Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II, Atmos. Environ. 31 (1997) 3459.
RODAS3 = Tableau(
    0.5,
    np.array([0.0, 0.0, 1.0, 1.0]),
    np.array([0.5, 1.5, 0.0, 0.0]),
    _triangle((), (), (2.0,), (2.0, 0.0, 1.0)),
    _triangle((), (4.0,), (1.0, -1.0), (1.0, -1.0, -8 / 3)),
    np.array([2.0, 0.0, 1.0, 1.0]),
)

_LAST = (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950)
# E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), sec. VI.4 (their code RODAS).
RODAS4 = Tableau(
    0.25,
    np.array([0.0, 0.386, 0.21, 0.63, 1.0, 1.0]),
    np.array([0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0]),
    _triangle(
        (),
        (1.544,),
        (0.9466785280815826, 0.2557011698983284),
        (3.314825187068521, 2.896124015972201, 0.9986419139977817),
        _LAST,
        (*_LAST, 1.0),
    ),
    _triangle(
        (),
        (-5.6688,),
        (-2.430093356833875, -0.2063599157091915),
        (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
        (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
        (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
    ),
    np.array([*_LAST, 1.0, 1.0]),
)

TABLEAUX = {"rodas3": RODAS3, "rodas4": RODAS4}


def header() -> str:
    """The tableaux as C constants RODAS3_A, RODAS3_C, ..."""
    lines = []
    for name, tableau in TABLEAUX.items():
        stages = tableau.alpha.size
        lines.append(f"#define {name.upper()}_STAGES {stages}")
        lines.append(f"static const double {name.upper()}_GAMMA = {tableau.gamma!r};")
        for field in ("alpha", "gamma_sum", "m", "a", "c"):
            values = getattr(tableau, field)
            shape = "".join(f"[{n}]" for n in values.shape)
            rows = [", ".join(repr(float(x)) for x in row) for row in np.atleast_2d(values)]
            body = ", ".join(f"{{{row}}}" for row in rows) if values.ndim == 2 else rows[0]
            lines.append(f"static const double {name.upper()}_{field.upper()}{shape} = {{{body}}};")
    return "\n".join(lines) + "\n"
