"""Ways of advancing the cage by revolutions, each with its ladder of settings from cheap to tight."""

import abc
import concurrent.futures
import ctypes
import importlib.util
import math
import multiprocessing
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from typing import Any

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxcage as jc

from .common import FAST_MATH
from .problem import Problem, constants, our_map


class Rival(abc.ABC):
    """A way of advancing lanes by revolutions.

    `settings` are steps per revolution (whole numbers), tolerances, or None for a default, from cheap to tight. With
    the setting `tight` it must agree with the reference to `agree` clearances. A timed call has so many `lanes` and
    `revolutions`.
    """

    agree = 1e-7
    prepared = 0.0
    """Seconds that `prepare` took."""

    def __init__(self, name: str, settings: tuple[Any, ...], tight: Any, lanes: int = 2048, revolutions: int = 20):
        self.name, self.settings, self.tight = name, settings, tight
        self.lanes, self.revolutions, self.cores = lanes, revolutions, 1

    def missing(self) -> str | None:
        """Why it cannot take part, in a word or two."""
        return None

    def prepare(self, cores: int) -> None:
        """Compile and start processes, for so many cores."""
        self.cores = cores

    @abc.abstractmethod
    def on(self, problem: Problem) -> Callable[[int, Any], np.ndarray]:
        """The function (revolutions, setting) -> end states, shape (lanes, 4), for these lanes."""

    def close(self) -> None:
        """End the processes."""


NATIVE = "machine code, "
PAIRS = ("tsit5", "dopri5", "bosh3", "dopri8", "rodas4")
TOLERANCES = (1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7)


class Jaxcage(Rival):
    """The library itself, through `jaxcage.sweep` without exponents.

    A solver `machine code, NAME` is one of `jaxcage.native`, its setting the tolerance.
    """

    def __init__(self, name: str, solver: str, settings: tuple[Any, ...], tight: Any):
        # The error of each lane is measured besides, once: runs are long enough for that to count little.
        super().__init__(f"jaxcage, {name}", settings, tight, revolutions=100 if solver.startswith(NATIVE) else 20)
        self.solver = solver

    def method(self, setting: Any) -> jc.solve.AbstractMethod | None:
        """The library's method; None for its default."""
        if setting is None:
            return None
        if self.solver.startswith(NATIVE):
            return jc.native(setting, error=math.inf, pair=self.solver.removeprefix(NATIVE))
        return jc.method(self.solver, **{"steps" if isinstance(setting, int) else "tolerance": setting})

    def on(self, problem: Problem) -> Callable[[int, Any], np.ndarray]:
        return lambda revolutions, setting: our_map(problem, self.method(setting), revolutions)


class Diffrax(Rival):
    """A solver of diffrax as its documentation shows it: `jit(vmap(diffeqsolve))` over the lanes, PID controller,
    rtol = atol in units of the state's scale.
    """

    BATCH = 256
    """Lanes to a call; each core takes calls in turn. Of 1, 16, 64, 256 and 1024 the quickest for Tsit5, and a third
    slower than the quickest (16) for Kvaerno3."""

    def __init__(self, solver: str, settings: tuple[float, ...], tight: float, lanes: int, revolutions: int):
        super().__init__(f"diffrax {solver}, vmap", settings, tight, lanes, revolutions)
        self.solver = getattr(dfx, solver)

    def on(self, problem: Problem) -> Callable[[int, float], np.ndarray]:
        lanes = problem.speeds.size
        count = min(self.BATCH, -(-lanes // self.cores))
        fill = np.minimum(np.arange(-(-lanes // count) * count), lanes - 1).reshape(-1, count)
        batches = [(jnp.asarray(problem.speeds[i]), jnp.asarray(problem.states[i])) for i in fill]

        def run(revolutions: int, tolerance: float) -> np.ndarray:
            until, bound = jnp.asarray(2 * np.pi * revolutions), jnp.asarray(tolerance)
            one = lambda batch: np.asarray(_advance(problem.model, self.solver, batch[0], batch[1], until, bound))
            with concurrent.futures.ThreadPoolExecutor(self.cores) as pool:
                return np.concatenate(list(pool.map(one, batches)))[:lanes]

        return run


@eqx.filter_jit
def _advance(model: Any, solver: Any, speeds: Any, states: Any, until: Any, tolerance: Any) -> Any:
    """States of all lanes at phase `until`, NaN where a solve fails."""

    def lane(speed: Any, state: Any) -> Any:
        scale = jnp.stack(model.scale(speed))
        field = model.at_speed(speed)
        solution = dfx.diffeqsolve(
            dfx.ODETerm(lambda tau, z, args: jnp.stack(field(tau, tuple(z * scale))) / scale),
            solver(),
            t0=0.0,
            t1=until,
            dt0=None,
            y0=state / scale,
            stepsize_controller=dfx.PIDController(rtol=tolerance, atol=tolerance),
            saveat=dfx.SaveAt(t1=True),
            max_steps=None,
            throw=False,
        )
        assert solution.ys is not None
        return jnp.where(solution.result == dfx.RESULTS.successful, solution.ys[-1] * scale, jnp.nan)

    return jax.vmap(lane)(speeds, states)


class SciPy(Rival):
    """SciPy's LSODA or Radau with compiled right-hand side and Jacobian, lanes shared among worker processes,
    rtol = atol in units of the state's scale.
    """

    PIECES = 8
    """Pieces of work for a process, so that none waits long for another."""

    def __init__(self, solver: str, settings: tuple[float, ...], tight: float, lanes: int, revolutions: int):
        super().__init__(f"SciPy {solver}, numba", settings, tight, lanes, revolutions)
        self.solver = solver

    def missing(self) -> str | None:
        return None if importlib.util.find_spec("numba") else "no numba"

    def prepare(self, cores: int) -> None:
        from .cage_scipy import warm_up

        self.cores = cores
        self.pool = concurrent.futures.ProcessPoolExecutor(cores, multiprocessing.get_context("spawn"))
        list(self.pool.map(warm_up, range(4 * cores)))

    def close(self) -> None:
        self.pool.shutdown()

    def on(self, problem: Problem) -> Callable[[int, float], np.ndarray]:
        from .cage_scipy import advance

        numbers, scale = constants(problem.model, problem.speeds), problem.scale
        start = problem.states / scale
        parts = np.array_split(np.arange(start.shape[0]), min(self.PIECES * self.cores, start.shape[0]))

        def run(revolutions: int, tolerance: float) -> np.ndarray:
            work = [(self.solver, start[i], numbers[i], revolutions, tolerance) for i in parts]
            return np.concatenate(list(self.pool.map(advance, work))) * scale

        return run


class Compiled(Rival):
    """Equal steps in C, compiled when the benchmark runs: what the processor can do with these equations. Vectors of
    eight lanes, OpenMP over blocks of two vectors.
    """

    BLOCK = 16
    """Lanes to a block, as in `rosenbrock.c`."""
    FLAGS = (
        *("-O3", "-march=native", "-mprefer-vector-width=512", "-fschedule-insns", "-fsched-pressure"),
        *(*FAST_MATH, "-fopenmp", "-shared", "-fPIC"),
    )

    def __init__(self, method: str, settings: tuple[int, ...]):
        super().__init__(f"C, {method}", settings, 8192)
        self.method = method

    def missing(self) -> str | None:
        if not shutil.which("cc"):
            return "no compiler"
        probe = ["cc", *self.FLAGS, "-fsyntax-only", "-x", "c", "-"]
        done = subprocess.run(probe, input=b"#include <omp.h>\n", capture_output=True)
        return "no OpenMP" if done.returncode else None

    def prepare(self, cores: int) -> None:
        self.cores = cores
        source = pathlib.Path(__file__).with_name("rosenbrock.c")
        with tempfile.TemporaryDirectory() as folder:
            target = str(pathlib.Path(folder, "rosenbrock.so"))
            subprocess.run(["cc", *self.FLAGS, str(source), "-lm", "-o", target], check=True)
            self.program = getattr(ctypes.CDLL(target), self.method)
        table = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
        self.program.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_long, ctypes.c_int, table, table]

    def on(self, problem: Problem) -> Callable[[int, int], np.ndarray]:
        lanes, scale = problem.speeds.size, problem.scale
        pad = lambda x: np.ascontiguousarray(np.pad(x, ((0, -lanes % self.BLOCK), (0, 0)), mode="edge").T)
        numbers, start = pad(constants(problem.model, problem.speeds)), pad(problem.states / scale)

        def run(revolutions: int, steps: int) -> np.ndarray:
            state = start.copy()
            if self.program(state.shape[1], revolutions, steps, self.cores, numbers, state):
                raise MemoryError("The C program found no memory.")
            return state.T[:lanes] * scale

        return run


def all_rivals() -> list[Rival]:
    """For the full run."""
    return [
        Jaxcage("default", NATIVE, (None,), None),
        *[Jaxcage(f"{NATIVE}{name}", f"{NATIVE}{name}", TOLERANCES, 1e-10) for name in PAIRS],
        Jaxcage("rk4", "rk4", (256, 384, 512), 8192),
        Jaxcage("rodas4", "rodas4", (256, 320, 448), 8192),
        Jaxcage("tsit5 adaptive", "tsit5", (1e-4, 1e-5), 1e-10),
        Diffrax("Kvaerno3", (1e-4, 3e-5, 1e-5, 1e-6), 1e-9, 512, 2),
        Diffrax("Kvaerno5", (1e-3, 3e-4, 1e-4, 1e-5), 1e-9, 512, 2),
        Diffrax("Tsit5", (1e-4, 3e-5, 1e-5, 7e-6, 5e-6, 3e-6, 1e-6), 1e-10, 2048, 4),
        SciPy("LSODA", (1e-4, 1e-5, 3e-6, 2e-6, 1e-6, 1e-7), 1e-12, 1024, 4),
        SciPy("Radau", (1e-4, 3e-5, 1e-5), 1e-9, 64, 1),
        Compiled("rodas4", (128, 192, 256, 320, 384, 448, 512)),
        Compiled("rodas3", (256, 512, 768, 1024)),
        Compiled("rk4", (128, 192, 256, 320, 384, 448, 512)),
    ]


def few_rivals() -> list[Rival]:
    """For `--quick`."""
    return [
        Jaxcage("default", NATIVE, (None,), None),
        Jaxcage(f"{NATIVE}tsit5", f"{NATIVE}tsit5", (1e-5, 1e-6), 1e-10),
        Diffrax("Tsit5", (1e-5, 5e-6, 3e-6), 1e-10, 512, 4),
        SciPy("LSODA", (1e-6,), 1e-12, 128, 4),
        Compiled("rodas4", (256, 448)),
        Compiled("rk4", (256, 384)),
    ]
