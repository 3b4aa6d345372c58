"""Rosenbrock methods in C, compiled when the benchmark runs: what the processor can do with these equations."""

import ctypes
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable

import numpy as np

from .problem import Problem, constants
from .tableaux import header


LANES = 16
"""Lanes to a block, as in `rosenbrock.c`."""
FAST_MATH = (
    *("-fno-math-errno", "-ffinite-math-only", "-fno-signed-zeros", "-fno-trapping-math"),
    *("-fassociative-math", "-freciprocal-math", "-fcx-limited-range"),
)
"""All that -ffast-math allows but for the start-up code that it links, which sets numbers below 2.2e-308 to 0 in the
whole process that loads the library."""
FLAGS = (
    *("-O3", "-march=native", "-mprefer-vector-width=512", "-fschedule-insns", "-fsched-pressure"),
    *(*FAST_MATH, "-fopenmp", "-shared", "-fPIC"),
)


class CRosenbrock:
    """Fixed steps, vectors of eight lanes, OpenMP over blocks of two vectors."""

    lanes, revolutions, tight, agree = 2048, 20, 8192, 1e-7

    def __init__(self, method: str, settings: tuple[int, ...]):
        self.name, self.method, self.settings = f"C, {method}", method, settings

    def missing(self) -> str | None:
        if not shutil.which("cc"):
            return "no compiler"
        probe = ["cc", *FLAGS, "-fsyntax-only", "-x", "c", "-"]
        done = subprocess.run(probe, input=b"#include <omp.h>\n", capture_output=True)
        return "no OpenMP" if done.returncode else None

    def prepare(self, cores: int) -> None:
        self.cores = cores
        self.program = getattr(compiled(), self.method)

    def close(self) -> None:
        pass

    def on(self, problem: Problem) -> Callable[[int, int], np.ndarray]:
        lanes, scale = problem.speeds.size, problem.scale
        pad = lambda table: np.ascontiguousarray(np.pad(table, ((0, -lanes % LANES), (0, 0)), mode="edge").T)
        numbers, start = pad(constants(problem.model, problem.speeds)), pad(problem.states / scale)

        def run(revolutions: int, steps: int) -> np.ndarray:
            state = start.copy()
            if self.program(state.shape[1], revolutions, steps, self.cores, numbers, state):
                raise MemoryError("The C program found no memory.")
            return state.T[:lanes] * scale

        return run


def compiled() -> ctypes.CDLL:
    """`rosenbrock.c` as a loaded library; the files are gone once it is loaded."""
    source = pathlib.Path(__file__).with_name("rosenbrock.c")
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "tableaux.h").write_text(header())
        target = pathlib.Path(folder, "rosenbrock.so")
        command = ["cc", *FLAGS, f"-I{folder}", str(source), "-lm", "-o", str(target)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"The C compiler failed:\n{done.stderr}")
        library = ctypes.CDLL(str(target))
    table = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
    for name in ("rodas3", "rodas4", "rk4"):
        function = getattr(library, name)
        function.restype = ctypes.c_int
        function.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_long, ctypes.c_int, table, table]
    return library
