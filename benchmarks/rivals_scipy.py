"""SciPy's LSODA and Radau with compiled right-hand side and Jacobian, lanes shared among worker processes."""

import importlib.util
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from .problem import Problem, constants


PIECES = 8
"""Pieces of work for a process, so that none waits long for another."""


class SciPy:
    """One of SciPy's stiff solvers, rtol = atol in units of the state's scale."""

    agree = 1e-7

    def __init__(self, solver: str, settings: tuple[float, ...], tight: float, lanes: int, revolutions: int):
        self.name, self.solver, self.settings, self.tight = f"SciPy {solver}, numba", solver, settings, tight
        self.lanes, self.revolutions = lanes, revolutions

    def missing(self) -> str | None:
        return None if importlib.util.find_spec("numba") else "no numba"

    def prepare(self, cores: int) -> None:
        from .cage_scipy import warm_up

        self.cores = cores
        self.pool = ProcessPoolExecutor(cores, multiprocessing.get_context("spawn"))
        list(self.pool.map(warm_up, range(4 * cores)))

    def close(self) -> None:
        self.pool.shutdown()

    def on(self, problem: Problem) -> Callable[[int, float], np.ndarray]:
        from .cage_scipy import advance

        numbers, scale = constants(problem.model, problem.speeds), problem.scale
        start = problem.states / scale
        parts = np.array_split(np.arange(start.shape[0]), min(PIECES * self.cores, start.shape[0]))

        def run(revolutions: int, tolerance: float) -> np.ndarray:
            work = [(self.solver, start[i], numbers[i], revolutions, tolerance) for i in parts]
            return np.concatenate(list(self.pool.map(advance, work))) * scale

        return run
