"""What `--vary NAME=VALUES` says: a grid, single values, an interval or a tolerance, with units."""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .._errors import ArgumentError, InputError
from .._parameters import parameter_info, replace, within
from ..design import CAGE_PARAMETERS, Scatter, rayleigh, uniform, usual_bounds
from ..io import Whose, cage_rpm, configuration, model_from, to_si, whole_bearing_from
from ..models import BearingModel, CageModel
from ..studies import OIL, SPEED, Between, Spread, Tolerance, with_values
from ..sweeps import rpm
from ._readers import MOST, read_quantity
from ._whole import shaft_rpm_of


FORMS = "values such as 4000rpm:27500rpm:100, 0.3mm:0.6mm, 20um+-3um or 32,56,78"
GRADES = (2.0, 10000.0)
MOST_CORNERS = 256
"""Combinations of smallest and largest values that are tried out beforehand."""

Vary = dict[str, np.ndarray | Spread]


def read_vary(given: Sequence[str], model: CageModel | BearingModel, speeds: Whose = "cage") -> Vary:
    """Every `NAME=VALUES`, in SI units; `speeds` says whose speeds those are that do not say it.

    **Raises:** `InputError`.
    """
    found = _each("--vary", given, f"NAME=VALUES with {FORMS}", lambda name, values: _read(name, values, model, speeds))
    if SPEED not in found:
        raise InputError("Option --vary must be given for the speed too, e.g. --vary speed=12000rpm.")
    _check_corners(found, model)
    return found


def read_bounds(given: Sequence[str], model: CageModel | BearingModel) -> dict[str, tuple[float, float]]:
    """Every `NAME=LOWER:UPPER` of parameters that are to be chosen, in SI units.

    **Raises:** `InputError`.
    """

    def read(name: str, values: str) -> Between:
        between = None if name in (SPEED, OIL) else _read(name, values, model)
        if not isinstance(between, Between):
            raise ValueError(f"must be a parameter's NAME=LOWER:UPPER, but is {values}.")
        return between

    found = _each("--vary", given, "a parameter's NAME=LOWER:UPPER", read)
    _check_corners(found, model)
    return {name: between.bounds for name, between in found.items()}


def read_cage_bounds(given: Sequence[str], model: BearingModel) -> dict[str, tuple[float, float]]:
    """The same of a whole bearing, whose cage alone is to be chosen; the usual bounds if nothing is given.

    **Raises:** `InputError`.
    """
    vary = read_bounds(given, model) if given else usual_bounds(model)
    if wrong := [name for name in vary if name not in CAGE_PARAMETERS]:
        raise InputError(f"Option --vary must name one of {', '.join(CAGE_PARAMETERS)}, but names '{wrong[0]}'.")
    return vary


def read_scatter(given: Sequence[str], names: Sequence[str]) -> dict[str, Scatter]:
    """Every `NAME=10%` (evenly within so much of the value) or `NAME=rayleigh` of the parameters `names`.

    **Raises:** `InputError`.
    """

    def read(name: str, law: str) -> Scatter:
        if name not in names:
            raise InputError(f"Option --scatter must name one of {', '.join(names)}, but '{name}={law}' was given.")
        if law == "rayleigh":
            return rayleigh()
        try:
            share = float(law.removesuffix("%")) / 100 if law.endswith("%") else math.nan
        except ValueError:
            share = math.nan
        if not 0 < share < 1:
            raise ValueError(f"must be a share such as 10% or rayleigh, but '{law}' was given.")
        return uniform(share)

    return _each("--scatter", given, "NAME=10% or NAME=rayleigh", read)


def _each(option: str, given: Sequence[str], form: str, read: Callable[[str, str], Any]) -> dict[str, Any]:
    """What is read from every `NAME=VALUES`, by name; what it may raise is said of that name."""
    found: dict[str, Any] = {}
    for text in given:
        name, _, values = (part.strip() for part in text.partition("="))
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


def _read(name: str, text: str, model: CageModel | BearingModel, speeds: Whose = "cage") -> np.ndarray | Spread:
    number = _number(name, model, speeds)
    parts = text.split(":")
    if "+-" in text or "±" in text:
        found = Tolerance(*map(number, text.replace("±", "+-").split("+-", 1)))
    elif len(parts) == 2:
        found = Between(*map(number, parts))
    elif len(parts) == 3:
        found = np.linspace(number(parts[0]), number(parts[1]), _count(parts[2]))
    elif len(parts) == 1:
        found = np.array([number(part) for part in text.split(",")])
    else:
        raise ValueError(f"must have {FORMS}, but '{text}' was given.")
    _check_range(name, found.bounds if isinstance(found, Spread) else found, model)
    if isinstance(found, np.ndarray) and np.unique(found).size < found.size:
        raise ValueError(f"must have distinct values, but '{text}' was given.")
    return found


def _number(name: str, model: CageModel | BearingModel, speeds: Whose) -> Callable[[str], float]:
    """How a number of this parameter is read: with its unit, or bare in SI units, a speed in rpm."""
    known = parameter_info(model)
    if name == SPEED and isinstance(model, BearingModel):
        return lambda text: rpm(shaft_rpm_of(model, read_quantity(text.strip(), "rpm"), speeds, "--vary"))
    if name == SPEED:
        ratio = float(model.bearing.cage_speed_ratio)
        return lambda text: rpm(cage_rpm(read_quantity(text.strip(), "rpm"), speeds, ratio))
    own = [SPEED, *known] if isinstance(model, BearingModel) else [SPEED, OIL, *known]
    if name not in own:
        raise InputError(f"Option --vary must name one of {', '.join(own)}, but names '{name}'.")
    return lambda text: to_si(text, "1" if name == OIL else known[name].unit)


def _count(text: str) -> int:
    count = int(text) if text.strip().isdecimal() else 0
    if count < 1:
        raise ValueError(f"must have a number of values above 0 at its end, but has '{text}'.")
    if count > MOST:
        raise ValueError(f"must have at most {MOST} values, but has '{text}'.")
    return count


def _check_range(name: str, values: Sequence[float] | np.ndarray, model: CageModel | BearingModel) -> None:
    info = parameter_info(model).get(name)
    low, high = (info.lower, info.upper) if info else GRADES if name == OIL else (0.0, math.inf)
    unit = "rad/s" if name == SPEED else "" if info is None or info.unit == "1" else info.unit
    allowed = "above 0" if name == SPEED else f"from {low:g} to {high:g}"
    for value in values:
        if not (within(value, low, high) and math.isfinite(value) and (name != SPEED or value > 0)):
            raise ValueError(f"must stay {allowed} {unit}".rstrip() + f", but holds {value:g}.")


def _check_corners(vary: Vary, model: CageModel | BearingModel) -> None:
    """What ranges of single values cannot see, at the corners of all that is varied."""
    ends = {
        name: sorted(set(how.bounds if isinstance(how, Spread) else (how.min(), how.max())))
        for name, how in vary.items()
        if name != SPEED
    }
    for values in itertools.islice(itertools.product(*ends.values()), MOST_CORNERS):
        corner = dict(zip(ends, map(float, values), strict=True))
        try:
            if isinstance(model, BearingModel):
                whole_bearing_from(configuration(replace(model, **corner)))
            else:
                model_from(configuration(with_values(model, corner)))  # pyright: ignore[reportArgumentType]
        except ValueError as error:
            raise InputError(f"Option --vary: {error}") from error
