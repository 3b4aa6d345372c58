"""What `--vary NAME=VALUES` says: a grid, single values, an interval or a tolerance, with units."""

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np

from .._parameters import parameter_info
from ..design import Scatter, rayleigh, uniform
from ..io import configuration, model_from, to_si
from ..models import CageModel
from ..studies import OIL, SPEED, Between, Spread, Tolerance, with_values
from ._errors import MOST, UsageError, refusing
from ._inputs import angular_speed
from ._quantities import read_quantity


FORMS = "4000rpm:27500rpm:100, 0.3mm:0.6mm, 20um+-3um or 32,56,78"
GRADES = (2.0, 10000.0)
MOST_CORNERS = 256
"""Combinations of smallest and largest values that are tried out beforehand."""

Vary = dict[str, np.ndarray | Spread]


def read_vary(given: Sequence[str], model: CageModel) -> Vary:
    """Every `NAME=VALUES`, in SI units.

    **Raises:** `UsageError`.
    """
    found: Vary = {}
    for text in given:
        name, equals, values = text.partition("=")
        name = name.strip()
        if not equals or not values.strip():
            raise UsageError(f"Option --vary must be NAME=VALUES with values such as {FORMS}, but '{text}' was given.")
        if name in found:
            raise UsageError(f"Option --vary must name each parameter once, but {name} was given twice.")
        found[name] = _read(name, values, model)
    if SPEED not in found:
        raise UsageError("Option --vary must be given for the speed too, e.g. --vary speed=12000rpm.")
    _check_corners(found, model)
    return found


def _read(name: str, text: str, model: CageModel) -> np.ndarray | Spread:
    number = _number(name, model)
    if "+-" in text or "±" in text:
        value, deviation = text.replace("±", "+-").split("+-", 1)
        with refusing(f"--vary {name}"):
            spread = Tolerance(number(value), number(deviation, difference=True))
        _check_range(name, spread.bounds, model)
        return spread
    parts = text.split(":")
    if len(parts) == 2:
        with refusing(f"--vary {name}"):
            spread = Between(number(parts[0]), number(parts[1]))
        _check_range(name, spread.bounds, model)
        return spread
    if len(parts) == 3:
        values = np.linspace(number(parts[0]), number(parts[1]), _count(name, parts[2]))
    elif len(parts) == 1:
        values = np.array([number(part) for part in text.split(",")])
    else:
        raise UsageError(f"Option --vary {name} must have values such as {FORMS}, but '{text}' was given.")
    _check_range(name, values.tolist(), model)
    if np.unique(values).size < values.size:
        raise UsageError(f"Option --vary {name} must have distinct values, but '{text}' was given.")
    return values


def _number(name: str, model: CageModel) -> Callable[..., float]:
    """How a number of this parameter is read: with its unit, or bare in SI units, a speed in rpm."""
    known = parameter_info(model)
    if name not in (SPEED, OIL, *known):
        raise UsageError(f"Option --vary must name one of {', '.join([SPEED, OIL, *known])}, but names '{name}'.")
    unit = "1" if name == OIL else "" if name == SPEED else known[name].unit

    def number(text: str, difference: bool = False) -> float:
        del difference
        try:
            if name == SPEED:
                return angular_speed(read_quantity(text.strip(), "rpm"))
            return to_si(text, unit)
        except ValueError as error:
            said = str(error)
            raise UsageError(f"Option --vary {name} {said if said.startswith('must') else f'{said}.'}") from error

    return number


def _count(name: str, text: str) -> int:
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise UsageError(f"Option --vary {name} must have a number of values above 0 at its end, but has '{text}'.")
    if count > MOST:
        raise UsageError(f"Option --vary {name} must have at most {MOST} values, but has '{text}'.")
    return count


def _check_range(name: str, values: Sequence[float], model: CageModel) -> None:
    info = parameter_info(model).get(name)
    low, high = (info.lower, info.upper) if info else GRADES if name == OIL else (0.0, math.inf)
    unit = "rad/s" if name == SPEED else "" if info is None or info.unit == "1" else info.unit
    for value in values:
        inside = low <= value <= high and math.isfinite(value) and (name != SPEED or value > 0)
        if not inside:
            allowed = "above 0" if name == SPEED else f"from {low:g} to {high:g}"
            raise UsageError(f"Option --vary {name} must stay {allowed} {unit}".rstrip() + f", but holds {value:g}.")


def _check_corners(vary: Vary, model: CageModel) -> None:
    """What ranges of single values cannot see, at the corners of all that is varied."""
    ends = {
        name: sorted(set(how.bounds if isinstance(how, Spread) else (how.min(), how.max())))
        for name, how in vary.items()
        if name != SPEED
    }
    for values in itertools.islice(itertools.product(*ends.values()), MOST_CORNERS):
        corner = dict(zip(ends, map(float, values), strict=True))
        with refusing("--vary"):
            model_from(configuration(with_values(model, corner)))  # pyright: ignore[reportArgumentType]


def read_bounds(given: Sequence[str], model: CageModel) -> dict[str, tuple[float, float]]:
    """Every `NAME=LOWER:UPPER` of parameters that are to be chosen, in SI units.

    **Raises:** `UsageError`.
    """
    found: dict[str, tuple[float, float]] = {}
    for text in given:
        name, _, values = text.partition("=")
        if values.count(":") != 1 or name.strip() in (SPEED, OIL):
            raise UsageError(f"Option --vary must be a parameter's NAME=LOWER:UPPER, but '{text}' was given.")
        if name.strip() in found:
            raise UsageError(f"Option --vary must name each parameter once, but {name.strip()} was given twice.")
        spread = _read(name.strip(), values, model)
        assert isinstance(spread, Between)
        found[name.strip()] = spread.bounds
    _check_corners({name: Between(*bounds) for name, bounds in found.items()}, model)
    return found


def read_scatter(given: Sequence[str], names: Sequence[str]) -> dict[str, Scatter]:
    """Every `NAME=10%` (evenly within so much of the value) or `NAME=rayleigh` of the parameters `names`.

    **Raises:** `UsageError`.
    """
    found: dict[str, Scatter] = {}
    for text in given:
        name, _, law = (part.strip() for part in text.partition("="))
        if name not in names:
            raise UsageError(f"Option --scatter must name one of {', '.join(names)}, but '{text}' was given.")
        if name in found:
            raise UsageError(f"Option --scatter must name each parameter once, but {name} was given twice.")
        if law == "rayleigh":
            found[name] = rayleigh()
            continue
        try:
            share = float(law.removesuffix("%")) / 100 if law.endswith("%") else math.nan
        except ValueError:
            share = math.nan
        if not 0 < share < 1:
            raise UsageError(f"Option --scatter must be like {name}=10% or {name}=rayleigh, but '{text}' was given.")
        found[name] = uniform(share)
    return found
