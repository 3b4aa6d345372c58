"""Stability map: edges followed in two parameters, and the largest exponent over speed and a parameter."""

import concurrent.futures
import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

import numpy as np

from .._errors import ArgumentError
from .._parameters import parameter_info, parameters, replace, within
from ..models import BearingModel, CageModel
from ..orbits import Curve, Point, bifurcation, curve
from ..solve import AbstractMethod, cores
from ..sweeps import sweep
from ._table import shown_unit


SPEED = "speed"
RPM = 30 / math.pi
BELOW, ABOVE = 0.8, 1.25
"""Range of a parameter over its value, unless told otherwise."""
Exponents: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Speeds [rpm], values of y [SI], largest exponent at each."""
Values = TypeVar("Values", float, np.ndarray)
Say: TypeAlias = Callable[[str, int, int], None]
"""Told what is done, how much of it, of how much."""


@dataclasses.dataclass(frozen=True)
class Axis:
    """One direction of the map."""

    name: str
    lower: float
    upper: float
    unit: str
    """Unit in which it is shown."""
    factor: float
    """From SI to that unit."""

    @property
    def range(self) -> list[float]:
        """For programs: a speed in rpm, all else in SI units."""
        return [self.told(self.lower), self.told(self.upper)]

    def told(self, value: Values) -> Values:
        """A value for programs."""
        return value * RPM if self.name == SPEED else value

    @property
    def head(self) -> str:
        """Head of a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def cell(self, value: float) -> str:
        """A value for a table."""
        return f"{value * self.factor:.2f}" if self.name == SPEED else f"{value * self.factor:.6g}"


def speed_axis(lower: float, upper: float) -> Axis:
    """Speeds [rad/s], shown in rpm."""
    return Axis(SPEED, lower, upper, "rpm", RPM)


def parameter_axis(
    model: CageModel | BearingModel, name: str, lower: float | None = None, upper: float | None = None
) -> Axis:
    """A parameter between two values [SI], by default a fifth below to a quarter above its own.

    **Raises:** `ArgumentError` for a range that is not allowed, or does not hold the value itself.
    """
    info, value = parameter_info(model)[name], float(parameters(model)[name])
    least = max(info.lower, 1.01 * float(model.eccentricity)) if name == "guidance_gap" else info.lower
    around = sorted((BELOW * value, ABOVE * value))
    low, high = (
        (max(around[0], least) if lower is None else lower),
        (min(around[1], info.upper) if upper is None else upper),
    )
    unit = "" if info.unit == "1" else f" {info.unit}"
    for argument, given in (("lower", low), ("upper", high)):
        if not within(given, info.lower, info.upper):
            allowed = f"a value of {name} from {info.lower:g} to {info.upper:g}{unit}"
            raise ArgumentError(argument, said=f"must be {allowed}, but {given:g}{unit} was given.")
    if not low < value < high:
        wanted = f"must have {name} = {value:g}{unit} between them"
        raise ArgumentError("lower", "upper", said=f"{wanted}, but the range is {low:g} to {high:g}{unit}.")
    return Axis(name, low, high, *shown_unit(info.unit, value))


def follow_edges(
    model: CageModel, edges: Mapping[str, Point], x: Axis, y: Axis, method: AbstractMethod | None, say: Say
) -> tuple[list[Curve], dict[str, str]]:
    """A curve through each named edge, and why where there is none."""
    curves, refused = [], {}
    for done, (name, point) in enumerate(edges.items()):
        say("curves", done, len(edges))
        kind: Any = point.kind
        if kind == "branch-point":
            refused[name] = "a branch point"
            continue
        start: Any = point
        if x.name != SPEED:
            start = bifurcation(model, kind, point, x.name, method=method)
            if not bool(start.converged):
                refused[name] = start.status
                continue
        try:
            found = curve(
                model,
                start,
                x.name,
                y.name,
                lower=y.lower,
                upper=y.upper,
                x_lower=x.lower,
                x_upper=x.upper,
                name=name,
                method=method,
            )
            curves.append(found)
        except ValueError:
            refused[name] = "Newton's method did not find it again"
    say("curves", len(edges), len(edges))
    return curves, refused


def largest_exponents(
    model: CageModel,
    speeds: np.ndarray,
    y: Axis,
    rows: int,
    *,
    starts: int,
    discard: int,
    revolutions: int,
    method: AbstractMethod | None,
    say: Say,
) -> Exponents:
    """Largest exponent per revolution over speed [rad/s] and y, of the first `starts` starts; NaN where all failed."""
    values = np.linspace(y.lower, y.upper, rows)

    def row(value: float) -> np.ndarray:
        changed = replace(model, **{y.name: float(value)})
        states = [[[float(c) for c in start] for start in changed.starts(s)[:starts]] for s in speeds]
        found = sweep(
            changed,
            speeds,
            starts=np.array(states),
            discard=discard,
            revolutions=revolutions,
            blocks=1,
            keep=1,
            method=method,
        )
        finished = np.where(found.failed, -np.inf, found.exponents[..., 0])
        top = np.max(finished, axis=1)
        return np.where(np.isfinite(top), top, np.nan)

    found = []
    with concurrent.futures.ThreadPoolExecutor(cores()) as pool:  # a row alone does not fill two chunks of lanes
        for largest in pool.map(row, values):
            found.append(largest)
            say("exponents", len(found), values.size)
    return speeds * RPM, values, np.array(found).T
