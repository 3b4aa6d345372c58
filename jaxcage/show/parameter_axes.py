"""Axes of a stability map, and bifurcations followed over them."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .._errors import ArgumentError
from .._parameters import parameter_info, parameters, within
from ..orbits import Curve, Point, bifurcation, curve
from ..solve import AbstractMethod
from .tables import SHOWN, Column, Table, factor, rows_table


SPEED = "speed"
BELOW, ABOVE = 0.8, 1.25
"""Range of a parameter over its value, unless told otherwise."""
Say = Callable[[str, int, int], None]
"""Takes what is being done, how much of it is done, and of how much."""


@dataclasses.dataclass(frozen=True)
class Axis:
    """One direction of a map."""

    name: str
    lower: float
    """[SI]."""
    upper: float
    unit: str
    """SI unit."""

    @property
    def head(self) -> str:
        """Head of a column of values as they are shown."""
        return Column(self.name, (), self.unit).title

    def shown(self, values: np.ndarray) -> np.ndarray:
        """Values in the unit in which they are shown."""
        return np.asarray(values) * factor(self.unit, SHOWN.get(self.unit, self.unit))

    def told(self, values: np.ndarray) -> np.ndarray:
        """Values for a document: a speed in rpm, all else in SI units."""
        return self.shown(values) if self.name == SPEED else np.asarray(values)

    @property
    def range(self) -> np.ndarray:
        """The ends for a document."""
        return self.told(np.array([self.lower, self.upper]))


def parameter_axis(model: Any, name: str, lower: float | None = None, upper: float | None = None) -> Axis:
    """A parameter between two values [SI], by default a fifth below to a quarter above its own.

    **Raises:** `ArgumentError` for a range that is not allowed, or does not hold the value itself.
    """
    info, value = parameter_info(model)[name], float(parameters(model)[name])
    least = max(info.lower, 1.01 * float(model.eccentricity)) if name == "guidance_gap" else info.lower
    below, above = sorted((BELOW * value, ABOVE * value))
    low, high = max(below, least) if lower is None else lower, min(above, info.upper) if upper is None else upper
    unit = "" if info.unit == "1" else f" {info.unit}"
    for argument, given in (("lower", low), ("upper", high)):
        if not within(given, info.lower, info.upper):
            allowed = f"a value of {name} from {info.lower:g} to {info.upper:g}{unit}"
            raise ArgumentError(argument, said=f"must be {allowed}, but {given:g}{unit} was given.")
    if not low < value < high:
        wanted = f"must have {name} = {value:g}{unit} between them"
        raise ArgumentError("lower", "upper", said=f"{wanted}, but the range is {low:g} to {high:g}{unit}.")
    return Axis(name, low, high, info.unit)


def follow_edges(
    model: Any, edges: Mapping[str, Point], x: Axis, y: Axis, method: AbstractMethod | None, say: Say
) -> tuple[list[Curve], dict[str, str]]:
    """A curve through each named edge, and the reason where there is none."""
    curves, refused = [], {}
    limits: dict[str, Any] = {"lower": y.lower, "upper": y.upper, "x_lower": x.lower, "x_upper": x.upper}
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
            curves.append(curve(model, start, x.name, y.name, **limits, name=name, method=method))
        except ValueError:
            refused[name] = "Newton's method did not find it again"
    say("curves", len(edges), len(edges))
    return curves, refused


def curves_table(title: str, curves: list[Curve], x: Axis, y: Axis) -> Table:
    """The ranges that curves cover, and how they end."""
    rows = [
        {"edge": c.name, "kind": c.kind, "points": int(np.size(c.x_value)), "ends": " / ".join(c.ended)}
        | {"x": x.told(c.x_value), "y": y.told(c.y_value), "genuine": c.genuine}
        | {"x_low": float(np.min(c.x_value)), "x_high": float(np.max(c.x_value))}
        | {"y_low": float(np.min(c.y_value)), "y_high": float(np.max(c.y_value))}
        for c in curves
    ]
    ends = [
        Column(f"{axis.name} from" if end == "low" else "to", (), axis.unit, key=f"{which}_{end}")
        for which, axis in (("x", x), ("y", y))
        for end in ("low", "high")
    ]
    return rows_table(
        title, rows, [Column("edge", ()), Column("kind", ()), *ends, Column("points", ()), Column("ends", ())], "curves"
    )
