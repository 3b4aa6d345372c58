"""The library itself, through `jaxcage.sweep` without exponents: lanes in chunks, a chunk a core."""

from collections.abc import Callable
from typing import Any

import numpy as np

import jaxcage as jc

from .problem import Problem, our_map


class Jaxcage:
    """A solver by name with settings that are steps (whole numbers), tolerances, or None for the library's default.

    The solver `controlled` is the library's own control of the steps in each revolution, its setting the error; a
    whole number is the fixed number of Runge-Kutta steps that stands for its answer without any error.
    """

    lanes, revolutions, agree = 2048, 20, 1e-7

    def __init__(self, name: str, solver: str | None, settings: tuple[Any, ...], tight: Any):
        self.name, self.solver, self.settings, self.tight = f"jaxcage, {name}", solver, settings, tight

    def missing(self) -> str | None:
        return None

    def prepare(self, cores: int) -> None:
        """The library takes the cores that the process may use: the caller has set them."""

    def close(self) -> None:
        pass

    def method(self, setting: Any) -> jc.integrate.AbstractMethod | None:
        if self.solver is None or setting is None:
            return None
        if self.solver == "controlled":
            return jc.controlled(setting) if isinstance(setting, float) else jc.method("rk4", steps=setting)
        kind = "steps" if isinstance(setting, int) else "tolerance"
        return jc.method(self.solver, **{kind: setting})

    def on(self, problem: Problem) -> Callable[[int, Any], np.ndarray]:
        return lambda revolutions, setting: our_map(problem, self.method(setting), revolutions)
