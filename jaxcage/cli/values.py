"""Reading of `NAME=VALUES` options into numbers: grids, single values, intervals and tolerances, with units."""

import itertools
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import jaxcage as jc

from .._errors import ArgumentError, InputError, parameters_like
from .options import MOST, read_quantity
from .subject import Subject


SPEED, OIL = "speed", "oil"
FORMS = "values such as 4000rpm:27500rpm:100, 0.3mm:0.6mm, 20um±3um or 32,56,78"
MOST_CORNERS = 256
"""Largest number of combinations of smallest and largest values that are checked beforehand."""
USUAL = {"guidance_gap": (0.7, 1.4), "eccentricity": (0.2, 2.5)}
"""Parameters that are varied by default, and their bounds relative to the present values."""
WITH_ROLLERS = {"pocket_clearance": (0.7, 1.4), "land_width": (0.7, 1.4)}
"""Further defaults for a bearing with its rollers."""
GRADE = re.compile(r"G\s*(\d+(?:\.\d*)?)", re.IGNORECASE)


def read_vary(given: Sequence[str], subject: Subject) -> dict[str, Any]:
    """Read every `NAME=VALUES` in SI units: an array, or a range to sample from. **Raises:** `InputError`."""
    found = _read_each("--vary", given, f"NAME=VALUES with {FORMS}", lambda name, text: _read(name, text, subject))
    if SPEED not in found:
        raise InputError("Option --vary must be given for the speed too, e.g. --vary speed=12000rpm.")
    _check_corners(found, subject)
    return found


def read_bounds(given: Sequence[str], subject: Subject) -> dict[str, tuple[float, float]]:
    """Read every `NAME=LOWER:UPPER` in SI units; the usual ones if nothing is given. **Raises:** `InputError`."""
    model, names = subject.model, subject.usual(jc.parameter_info(subject.model), jc.design.CAGE_PARAMETERS)
    if not given:
        usual, now = USUAL | subject.usual({}, WITH_ROLLERS), jc.parameters(model)
        found = {name: (low * float(now[name]), high * float(now[name])) for name, (low, high) in usual.items()}
        return {name: bounds for name, bounds in found.items() if bounds[0] > 0}

    def read(name: str, text: str) -> Any:
        if name not in names:
            raise InputError(f"Option --vary must name {parameters_like(name, names)}, but names '{name}'.")
        between = _read(name, text, subject)
        if not isinstance(between, jc.files.Range) or between.is_normal:
            raise ValueError(f"must be a parameter's NAME=LOWER:UPPER, but is {text}.")
        return between

    found = _read_each("--vary", given, "a parameter's NAME=LOWER:UPPER", read)
    _check_corners(found, subject)
    return {name: (between.lower, between.upper) for name, between in found.items()}


def no_worse_balance(model: Any, vary: dict[str, tuple[float, float]]) -> list[str]:
    """Lower the upper bound of the eccentricity to its present value, and return a note if this changes it. **Raises:**
    `InputError` for bounds that do not let it become smaller."""
    (lower, upper), own = vary.get("eccentricity", (0.0, 0.0)), float(model.eccentricity)
    if upper <= own:
        return []
    if lower >= own:
        raise InputError(
            f"Option --vary must let the eccentricity become smaller than its {own:g} m, but its bounds are {lower:g} "
            f"and {upper:g} m; with --worse-balance it may become larger."
        )
    vary["eccentricity"] = lower, own
    return [f"Balance may only get better: eccentricity of at most {own * 1e6:g} um (--worse-balance lifts that)."]


def read_prices(given: Sequence[str], usual: dict[str, float]) -> dict[str, float]:
    """Read every `NAME=NUMBER`, and take the usual ones of the rest. **Raises:** `InputError`."""

    def read(name: str, text: str) -> float:
        if name not in usual:
            raise InputError(f"Option --price must name one of {', '.join(usual)} here, but names '{name}'.")
        value = read_quantity(text, "")
        if not 0 <= value < math.inf:
            raise ValueError(f"must be at least 0, but {value:g} was given.")
        return value

    return usual | _read_each("--price", given, "NAME=NUMBER", read)


def read_tolerances(text: str, subject: Subject, fastest: float) -> dict[str, Any]:
    """Read `NAME=±X, NAME=G6.3, ...` in SI units; a grade refers to the `fastest` cage speed [rad/s]. **Raises:**
    `InputError`."""
    info = jc.parameter_info(subject.model)

    def read(name: str, words: str) -> Any:
        if name not in info:
            raise InputError(f"Option --tolerance must name a parameter of the cage, but names '{name}'.")
        if name == "eccentricity" and (grade := GRADE.fullmatch(words)) is not None:
            return jc.Tolerance.balanced(float(grade[1]), fastest)
        if not words.startswith("±"):
            raise ValueError(f"must be ±X with a unit or, for the eccentricity, a grade such as G6.3, but is {words}.")
        half, (lower, upper) = jc.files.to_si(words[1:].strip(), info[name].unit), (info[name].lower, info[name].upper)
        if half > upper - lower:
            raise ValueError(f"must fit between {lower:g} and {upper:g} {info[name].unit}, but is ±{half:g}.")
        return jc.Tolerance(-half, half)

    parts = [part.strip() for part in text.split(",") if part.strip()]
    return _read_each("--tolerance", parts, "NAME=±X or eccentricity=G6.3", read)


def _read_each(option: str, given: Sequence[str], form: str, read: Callable[[str, str], Any]) -> dict[str, Any]:
    """Read every `NAME=VALUES` with `read`, whose `ValueError` becomes a sentence about that name."""
    found: dict[str, Any] = {}
    for text in given:
        name, _, values = (part.strip() for part in text.replace("+-", "±").partition("="))
        if not values:
            raise InputError(f"Option {option} must be {form}, but '{text}' was given.")
        if name in found:
            raise InputError(f"Option {option} must name each parameter once, but {name} was given twice.")
        try:
            found[name] = read(name, values)
        except ArgumentError as error:
            raise InputError(f"Option {option} {name} {error.said}") from error
        except InputError:
            raise
        except ValueError as error:
            raise InputError(f"Option {option} {name} {str(error).rstrip('.')}.") from error
    return found


def _read(name: str, text: str, subject: Subject) -> Any:
    info, parts, tolerance = jc.parameter_info(subject.model), text.split(":"), text.split("±", 1)
    if name not in (names := [SPEED, OIL, *info]):
        raise InputError(f"Option --vary must name {parameters_like(name, names)}, but names '{name}'.")

    def number(part: str) -> float:
        if name == SPEED:
            return jc.rpm(subject.rpm(read_quantity(part.strip(), "rpm"), "vary"))
        return jc.files.to_si(part, info[name].unit if name in info else "1")

    if len(tolerance) == 2:
        value, deviation = map(number, tolerance)
        return jc.files.Range(value - deviation, value + deviation, value, is_normal=True)
    if len(parts) == 2:
        lower, upper = map(number, parts)
        return jc.files.Range(lower, upper)
    if len(parts) > 3:
        raise ValueError(f"must have {FORMS}, but '{text}' was given.")
    if len(parts) == 3:
        if not (parts[2].strip().isdecimal() and 1 <= int(parts[2]) <= MOST):
            raise ValueError(f"must have a number of values from 1 to {MOST} at its end, but has '{parts[2]}'.")
        return np.linspace(number(parts[0]), number(parts[1]), int(parts[2]))
    return np.array([*map(number, text.split(","))])


def _check_corners(vary: dict[str, Any], subject: Subject) -> None:
    """Check that the smallest and largest values of all varied parameters are allowed together."""
    span = lambda how: (how.min(), how.max()) if isinstance(how, np.ndarray) else (how.lower, how.upper)
    ends = {name: span(how) for name, how in vary.items()}
    ends.pop(SPEED, None)
    for values in itertools.islice(itertools.product(*ends.values()), MOST_CORNERS):
        try:
            corner = {name: float(value) for name, value in zip(ends, values, strict=True)}
            oil = {OIL: corner.pop(OIL)} if OIL in corner else {}
            jc.files.check_together(jc.replace(jc.lanes.with_values(subject.model, oil), **corner))
        except ValueError as error:
            named = isinstance(error, ArgumentError)
            said = f" {' and '.join(error.names)} {error.said}" if named else f": {error}"
            raise InputError(f"Option --vary{said}") from error
