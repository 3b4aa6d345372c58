"""`python -m benchmarks.bearing_speed`: how long a sweep of the whole bearing takes, and what others take for the same.

The aim: 100 shaft speeds from 4000 to 16000 rpm, 3 initial states, 300 revolutions of the cage, NU2310 at 4450 N, with
slips, forces and the largest exponent, in 15 minutes on two cores. By default every second speed is run, fewer
revolutions long, in chunks of as many lanes as the whole has; `--whole` runs all of it. Beside it stand two that do the
same arcs of a sixteenth of a revolution, without forces, exponent and control of the error: plain Runge-Kutta steps in
C, and SciPy on the second implementation in NumPy. Errors are those reached at the end of an arc, in units of the
state's scale, against the C program with far shorter steps, which is held against SciPy's DOP853. Processor time counts
all threads: other jobs on the machine change it less than wall time.
"""

import argparse
import ctypes
import pathlib
import subprocess
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import csr_matrix

import jaxcage as jc
from benchmarks.common import FAST_MATH, columns
from jaxcage.models import state_scale
from tests.reference import WholeBearing


SPEEDS, STARTS, REVOLUTIONS, MINUTES = 100, 3, 300, 15.0
"""Size of the sweep that is aimed at, and its time."""
ARC = 2 * np.pi / 16
FINE = 40_000
"""Steps of an arc of the reference."""
STEPS = (100, 200, 400, 800, 1600)
"""Steps of an arc in C."""
TOLERANCES = (1e-4, 1e-5, 1e-6)
"""Tolerances of LSODA."""
BLOCK = 5
"""Revolutions of a block of the sweep."""
CHECKED = 3
"""Arcs on which SciPy is tried."""


def measured(run: Callable[[], Any]) -> tuple[Any, float, float]:
    """Return what a call gives, its wall time and its processor time [s]."""
    wall, processor = time.perf_counter(), time.process_time()
    found = run()
    return found, time.perf_counter() - wall, time.process_time() - processor


def law(theirs: WholeBearing) -> np.ndarray:
    """Constants as `bearing_law.c` has them, from the second implementation."""
    g, oil = theirs.g, theirs.curve
    rows = [theirs.half, theirs.r_o, theirs.r_i, theirs.speed, theirs.k, 1.5 * g["raceway_damping"]]
    rows += [g["raceway_smoothing"], *oil, g["traction_smoothing"]]
    rows += [g["pocket_clearance"], g["pocket_stiffness"], 1.5 * g["pocket_damping"], g["pocket_smoothing"]]
    rows += [g["pocket_friction"], g["saturation_speed"]]
    rows += [theirs.c, theirs.land, theirs.film_scale, theirs.petroff, g["film.smoothing"] / theirs.c, g["onset"]]
    rows += [g["contact.smoothing"] / theirs.c, g["stiffness"], theirs.chi, g["land_friction"]]
    rows += [theirs.m, theirs.m * theirs.half**2 / 2, g["cage_mass"], g["cage_inertia"], g["eccentricity"]]
    return np.array([*rows, g["ring_mass"], g["mounting_damping"], g["gravity"], g["load"]])


def compiled() -> Any:
    """`bearing_law.c` as a function (laws, angles, states, span, steps) -> states."""
    source = pathlib.Path(__file__).with_name("bearing_law.c")
    with tempfile.TemporaryDirectory() as folder:
        target = pathlib.Path(folder, "law.so")
        flags = ("-O3", "-march=native", *FAST_MATH, "-shared", "-fPIC")
        subprocess.run(["cc", *flags, str(source), "-lm", "-o", str(target)], check=True)
        turned = ctypes.CDLL(str(target)).turned
    rows = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
    turned.argtypes = [ctypes.c_long, rows, rows, rows, ctypes.c_double, ctypes.c_long]

    def run(laws: np.ndarray, angles: np.ndarray, states: np.ndarray, span: float, steps: int) -> np.ndarray:
        after = np.ascontiguousarray(states.copy())
        turned(len(after), np.ascontiguousarray(laws), np.ascontiguousarray(angles), after, span, steps)
        return after

    return run


def flat(rollers: np.ndarray, bodies: np.ndarray) -> np.ndarray:
    """A state, or several, as one row of numbers."""
    return np.concatenate([rollers.reshape(*rollers.shape[:-2], -1), bodies], axis=-1)


def pattern(n: int) -> csr_matrix:
    """Sparsity of the Jacobian: a roller depends on itself and the bodies, a body on everything."""
    size = 5 * n + 10
    found = np.zeros((size, size), dtype=bool)
    for i in range(5):
        for k in range(5):
            found[i * n + np.arange(n), k * n + np.arange(n)] = True
    found[:, 5 * n :] = found[5 * n :, :] = True
    return csr_matrix(found)


def by_scipy(
    theirs: WholeBearing, angle: float, y: np.ndarray, method: str, rtol: float, scale: np.ndarray
) -> np.ndarray:
    """An arc by SciPy over time, to where the cage has turned by it."""
    n = theirs.n

    def rate(_: float, z: np.ndarray) -> np.ndarray:
        rollers, bodies = theirs.rates(z[-1], z[: 5 * n].reshape(5, n), z[5 * n : -1])
        return np.concatenate([rollers.ravel(), bodies, [z[5 * n + 4]]])

    def over(_: float, z: np.ndarray) -> float:
        return z[-1] - angle - ARC

    over.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    sparse: Any = {"jac_sparsity": pattern(n)} if method == "Radau" else {}
    end = 1.5 * ARC / y[5 * n + 4]
    start, room = np.append(y, angle), rtol * np.append(scale, 1.0)
    done = solve_ivp(rate, (0, end), start, method, events=over, rtol=rtol, atol=room, max_step=end / 20, **sparse)
    return done.y_events[0][0][:-1]


def arcs(model: jc.BearingModel, speeds: np.ndarray) -> tuple[Any, ...]:
    """Arcs that the package ran at its usual tolerance: laws, begin, end, angles, scales, by speed."""
    rows = []
    for speed in speeds:
        run = jc.simulate(model, float(speed), revolutions=1, discard=2, samples=16, method=jc.native(1e-4, 1e-2))
        states, scale = flat(run.rollers, run.bodies), state_scale(model, float(speed))
        theirs = WholeBearing(model, float(speed))
        size = flat(np.asarray(scale.rollers), np.asarray(scale.bodies))
        rows += [(theirs, law(theirs), a, b, t, size) for a, b, t in zip(states[:-1], states[1:], run.angle[:-1])]
    theirs, *rest = zip(*rows, strict=True)
    return theirs, *map(np.array, rest)


def show_sweep(model: jc.BearingModel, speeds: np.ndarray, discard: int, revolutions: int) -> None:
    """Run the sweep twice, first to compile, and say what it took and what the whole would take."""
    run = lambda discard, revolutions, blocks: jc.sweep(
        model, speeds, initial_states=STARTS, discard=discard, revolutions=revolutions, blocks=blocks
    )
    run(1, 1, 1)
    found, wall, processor = measured(lambda: run(discard, revolutions, revolutions // BLOCK))
    lanes, each = found["label"].size, discard + revolutions
    share = SPEEDS * STARTS * REVOLUTIONS / (lanes * each)
    rows = [
        ("", "measured", "", "all of it", ""),
        ("lanes x revolutions", f"{lanes} x {each}", "", f"{SPEEDS * STARTS} x {REVOLUTIONS}", ""),
        ("processor time of a revolution", f"{1e3 * processor / (lanes * each):.1f}", "ms", "", ""),
        ("processor time", f"{processor:.0f}", "s", f"{processor * share / 60:.0f}", "min"),
        ("wall time here", f"{wall:.0f}", "s", f"{wall * share / 60:.0f}", "min"),
        ("half the processor time", "", "", f"{processor * share / 120:.0f} (aim {MINUTES:.0f})", "min"),
    ]
    print(columns(rows))
    mean = lambda name: f"{np.nanmin(found[name]):.3g} to {np.nanmax(found[name]):.3g}"
    print(f"\nSlip {mean('cage_slip')}, largest pocket force {mean('pocket_force_max_N')} N")
    print(f"Exponent {mean('exponents')}, its error {mean('standard_error')}; steps {mean('steps')}")
    failed, inaccurate = (
        int((found[name] == word).sum()) for name, word in (("label", "failed"), ("outcome", "inaccurate"))
    )
    print(f"Error {mean('error')}; failed {failed}, inaccurate {inaccurate}")


def show_rivals(model: jc.BearingModel, speeds: np.ndarray) -> None:
    """Reached errors of arcs, and the processor time of a revolution."""
    theirs, laws, begin, end, angles, scales = arcs(model, speeds)
    turned = compiled()
    truth = turned(laws, angles, begin, ARC, FINE)
    apart = lambda found, of: np.max(np.abs(found - truth[of]) / scales[of], axis=-1)
    words = lambda error: f"{np.median(error):.0e}, {np.max(error):.0e}" if np.isfinite(error).all() else "diverges"
    some = np.linspace(0, len(begin) - 1, CHECKED).astype(int)
    exact = np.array([by_scipy(theirs[i], angles[i], begin[i], "DOP853", 1e-11, scales[i]) for i in some])
    rows = [("", "setting", "error, median and largest", "ms a revolution")]
    rows.append(("jaxcage", "tolerance 1e-4", words(apart(end, slice(None))), "as above, exponent with it"))
    for steps in STEPS:
        found, _, spent = measured(lambda steps=steps: turned(laws, angles, begin, ARC, steps))
        error = apart(found, slice(None))
        rows.append(("C, Runge-Kutta", f"{16 * steps} steps", words(error), f"{1e3 * 16 * spent / len(begin):.2f}"))
    for method, tolerances in {"LSODA": TOLERANCES, "Radau": TOLERANCES[1:2]}.items():
        for rtol in tolerances:
            solve = lambda method=method, rtol=rtol: np.array(
                [by_scipy(theirs[i], angles[i], begin[i], method, rtol, scales[i]) for i in some]
            )
            found, _, spent = measured(solve)
            sparse = ", sparse Jacobian" if method == "Radau" else ""
            name = f"SciPy, {method}{sparse}"
            rows.append((name, f"rtol {rtol:.0e}", words(apart(found, some)), f"{1e3 * 16 * spent / len(some):.0f}"))
    print(columns(rows))
    print(
        f"\n{len(begin)} arcs, {len(some)} of them by SciPy; DOP853 is {words(apart(exact, some))} from the reference"
    )


def main() -> None:
    """Read the options and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--whole", action="store_true", help="all speeds, 100 revolutions left out and 200 observed")
    parser.add_argument("--every", type=int, default=2, help="n-th speed")
    parser.add_argument("--discard", type=int, default=2)
    parser.add_argument("--revolutions", type=int, default=10, help=f"observed, a multiple of {BLOCK}")
    given = parser.parse_args()
    jc.enable_x64()
    model, speeds = jc.whole_bearing("nu2310"), np.asarray(jc.rpm(4000.0, 16000.0, SPEEDS))
    if given.whole:
        show_sweep(model, speeds, 100, 200)
    else:
        show_sweep(model, speeds[:: given.every], given.discard, given.revolutions)
    print()
    show_rivals(model, speeds[[0, SPEEDS // 2, SPEEDS - 1]])


if __name__ == "__main__":
    main()
