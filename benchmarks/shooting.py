"""Orbits by single shooting with SciPy: pseudo-arclength steps, difference quotients for derivatives.

Nothing here imports JAX: `python -m benchmarks.shooting NUMBERS` is a process of its own.
"""

import ctypes
import json
import math
import pathlib
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


Rates = Callable[[float, float, np.ndarray], np.ndarray]
DISTANCE, TOLERANCE = 1e-5, 1e-9
"""Distance of central difference quotients, and Newton's last step."""
SHORTEST, LONGEST = 1e-5, 0.05


class Orbit(NamedTuple):
    """A point (state, speed over the first), the derivative of P(z) - z by both, tangent, Newton's steps."""

    u: np.ndarray
    jacobian: np.ndarray
    tangent: np.ndarray
    steps: int


def compiled(folder: pathlib.Path, law: str) -> Rates:
    """The equations in C as the function (speed over the first, phase, state) -> rates."""
    target = folder / "law.so"
    command = ["cc", "-O2", "-shared", "-fPIC", str(folder / law), "-o", str(target), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    program = ctypes.CDLL(str(target)).rates
    table = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
    program.restype, program.argtypes = None, [ctypes.c_double] * 3 + [table, table]

    def rates(ratio: float, phase: float, z: np.ndarray) -> np.ndarray:
        out = np.empty_like(z)
        program(ratio, math.cos(phase), math.sin(phase), z, out)
        return out

    return rates


def history(rates: Rates, state: np.ndarray, samples: int = 400) -> np.ndarray:
    """The first revolution: rows of phase, state, cosine and sine."""
    tau = np.linspace(0, 2 * np.pi, samples + 1)
    field = lambda t, y: rates(1.0, t, y)
    found = solve_ivp(field, (0.0, 2 * np.pi), state, "DOP853", t_eval=tau, rtol=1e-11, atol=1e-12)
    return np.column_stack([tau, found.y.T, np.cos(tau), np.sin(tau)])


def returned(rates: Rates, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """P(z) - z and its derivative by (z, speed); the neighbours take the same steps, so that their errors cancel."""
    n = u.size - 1
    around = u + DISTANCE * np.vstack([np.zeros(n + 1), np.eye(n + 1), -np.eye(n + 1)])
    speeds, z = around[:, n], np.ascontiguousarray(around[:, :n])
    field = lambda t, y: np.concatenate([rates(s, t, r) for s, r in zip(speeds, y.reshape(z.shape), strict=True)])
    found = solve_ivp(field, (0.0, 2 * np.pi), z.ravel(), "DOP853", rtol=1e-12, atol=1e-13)
    off = found.y[:, -1].reshape(z.shape) - z
    return off[0], (off[1 : n + 2] - off[n + 2 :]).T / (2 * DISTANCE)


def corrected(rates: Rates, u: np.ndarray, normal: np.ndarray) -> Orbit | None:
    """The orbit in the plane through u across `normal`, by Newton's method."""
    u = u.copy()
    for i in range(8):
        off, jacobian = returned(rates, u)
        step = np.linalg.solve(np.vstack([jacobian, normal]), np.append(-off, 0.0))
        u += step
        if np.linalg.norm(step) < TOLERANCE:
            tangent = np.linalg.svd(jacobian)[2][-1]
            return Orbit(u, jacobian, tangent * np.sign(tangent @ normal), i + 1)
        if np.linalg.norm(step) > 1:
            return None
    return None


def tests(orbit: Orbit) -> dict[str, float]:
    """Function that vanishes at a fold and at a period doubling."""
    n = orbit.u.size - 1
    return {
        "fold": float(orbit.tangent[n]),
        "period-doubling": float(np.linalg.det(orbit.jacobian[:, :n] + 2 * np.eye(n))),
    }


def follow(rates: Rates, state: np.ndarray, end: float) -> dict[str, Any]:
    """The branch from an orbit at speed 1 to `end`: points and special points (kind, speed over the first)."""
    n = state.size
    up = np.append(np.zeros(n), 1.0 if end > 1 else -1.0)
    here, length = corrected(rates, np.append(state, 1.0), up), 0.1 * LONGEST
    assert here is not None
    points, special = 1, []
    while (here.u[n] - end) * up[n] < 0 and points < 4000:
        step = lambda s, here=here: corrected(rates, here.u + s * here.tangent, here.tangent)
        there = step(length)
        if there is None or there.tangent @ here.tangent < 0.9:
            length /= 2
            if length < SHORTEST:
                break
            continue
        for kind, value in tests(here).items():
            if value * tests(there)[kind] < 0:
                at = lambda s, kind=kind: tests(o)[kind] if (o := step(s)) else float("nan")
                found = step(brentq(at, 0.0, length, xtol=1e-9))
                special += [[kind, float(found.u[n])]] if found else []
        length = min(LONGEST, length * (1.5 if there.steps < 4 else 0.8))
        here, points = there, points + 1
    return {"points": points, "special": special}


if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    law = compiled(pathlib.Path(given["folder"]), given["law"])
    began = time.process_time()
    answer = follow(law, np.array(given["state"]), given["end"])
    print(json.dumps({**answer, "warm": time.process_time() - began}))
