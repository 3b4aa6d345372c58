"""What an edge and its gradient cost: the exit of zone 1, a period doubling of the synchronous orbit."""

import math
import time
from collections.abc import Callable
from typing import Any

import equinox as eqx

import jaxcage as jc
from jaxcage.orbits import edge_speed

from .plain import seconds
from .problem import CASE


EDGE = "zone 1 exit"


def search(lower_rpm: float, upper_rpm: float) -> tuple[jc.orbits.Point, float]:
    """The edge among the synchronous orbits between two speeds, and the seconds it took to find, compiling included."""
    begin = time.perf_counter()
    orbits = jc.synchronous_orbits(jc.case(CASE, "preliminary"), jc.rpm(lower_rpm), jc.rpm(upper_rpm))
    point = jc.loss_zones(orbits).edges[EDGE]
    return point, time.perf_counter() - begin


def twice(name: str, run: Callable[[], Any]) -> dict[str, float]:
    """Seconds of a first call, which compiles, beyond those of a second, and seconds of the second."""
    first, second = seconds(run), seconds(run)
    return {f"{name}_compile": max(first - second, 0.0), name: second}


def solve_and_differentiate(point: jc.orbits.Point) -> dict[str, float]:
    """The edge solved for again, and solved for together with its derivatives by every parameter."""
    model = jc.case(CASE, "preliminary")
    parts = twice("solve", lambda: edge_speed(model, point))
    parts |= twice("gradient", lambda: jc.sensitivity(model, point, EDGE))
    return {**parts, "rpm": float(edge_speed(model, point)) * 30 / math.pi}


def differentiate_bifurcation(state: list[float], speed: float) -> dict[str, float]:
    """The same through the public function of one point and `jax.grad`."""
    model = jc.case(CASE, "preliminary")
    value = lambda m: jc.bifurcation(m, "period-doubling", (tuple(state), speed)).value
    return {**twice("solve", lambda: value(model)), **twice("gradient", lambda: eqx.filter_grad(value)(model))}
