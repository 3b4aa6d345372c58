"""`NAME=VALUES` of options read into numbers: a grid, single values, an interval, a tolerance, with units."""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .._errors import ArgumentError, InputError
from .._parameters import parameter_info, parameters, replace, within
from ..lanes import OIL, Between, Spread, Tolerance, with_values
from .options import MOST, read_quantity
from .subject import Subject


SPEED = "speed"
FORMS = "values such as 4000rpm:27500rpm:100, 0.3mm:0.6mm, 20um+-3um or 32,56,78"
GRADES = (2.0, 10000.0)
MOST_CORNERS = 256
"""Combinations of smallest and largest values that are checked beforehand."""
USUAL = {
    "guidance_gap": (0.7, 1.4),
    "eccentricity": (0.2, 2.5),
    "pocket_clearance": (0.7, 1.4),
    "land_width": (0.7, 1.4),
}
"""Parameters that are varied if none is named, and the bounds as parts of their values."""

Vary = dict[str, np.ndarray | Spread]


def read_vary(given: Sequence[str], subject: Subject) -> Vary:
    """Every `NAME=VALUES`, in SI units.

    **Raises:** `InputError`.
    """
    found = read_each("--vary", given, f"NAME=VALUES with {FORMS}", lambda name, text: _read(name, text, subject))
    if SPEED not in found:
        raise InputError("Option --vary must be given for the speed too, e.g. --vary speed=12000rpm.")
    _check_corners(found, subject)
    return found


def read_bounds(given: Sequence[str], subject: Subject, names: Sequence[str] = ()) -> dict[str, tuple[float, float]]:
    """Every `NAME=LOWER:UPPER` of parameters that are to be chosen, in SI units; the usual ones if nothing is given.

    **Raises:** `InputError`, also for a parameter that is not one of `names`, if there are any.
    """
    if not given:
        now = {name: float(value) for name, value in parameters(subject.model).items() if name in USUAL}
        chosen = [name for name in now if now[name] > 0 and (name in names or name in ("guidance_gap", "eccentricity"))]
        return {name: (USUAL[name][0] * now[name], USUAL[name][1] * now[name]) for name in chosen}

    def read(name: str, text: str) -> Between:
        between = None if name in (SPEED, OIL) else _read(name, text, subject)
        if not isinstance(between, Between):
            raise ValueError(f"must be a parameter's NAME=LOWER:UPPER, but is {text}.")
        if names and name not in names:
            raise InputError(f"Option --vary must name one of {', '.join(names)}, but names '{name}'.")
        return between

    found = read_each("--vary", given, "a parameter's NAME=LOWER:UPPER", read)
    _check_corners(found, subject)
    return {name: between.bounds for name, between in found.items()}


def read_scatter(names: Sequence[str], name: str, law: str) -> Callable[[np.ndarray], np.ndarray]:
    """Manufacturing scatter of one of `names`: `10%` (evenly within so much of the value) or `rayleigh`.

    **Raises:** `ValueError` with the words that follow the name.
    """
    from ..design import rayleigh, uniform

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


def no_worse_balance(model: Any, vary: dict[str, tuple[float, float]]) -> list[str]:
    """Lower the upper bound of the eccentricity to its present value. **Returns:** a note about it.

    **Raises:** `InputError` for bounds that do not let it become smaller.
    """
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


def read_each(option: str, given: Sequence[str], form: str, read: Callable[[str, str], Any]) -> dict[str, Any]:
    """What `read` makes of every `NAME=VALUES`, by name; its `ValueError` becomes a sentence about that name."""
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


def _read(name: str, text: str, subject: Subject) -> np.ndarray | Spread:
    number, parts = _number(name, subject), text.split(":")
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
    _check_range(name, found.bounds if isinstance(found, Spread) else found, subject)
    if isinstance(found, np.ndarray) and np.unique(found).size < found.size:
        raise ValueError(f"must have distinct values, but '{text}' was given.")
    return found


def _number(name: str, subject: Subject) -> Callable[[str], float]:
    """The function that reads a number of this parameter: with its unit, or bare in SI units, a speed in rpm."""
    known = parameter_info(subject.model)
    if name == SPEED:
        return lambda text: subject.speed(read_quantity(text.strip(), "rpm"), "vary")
    own = [SPEED, OIL, *known]
    if name not in own:
        raise InputError(f"Option --vary must name one of {', '.join(own)}, but names '{name}'.")
    from ..files import to_si

    return lambda text: to_si(text, "1" if name == OIL else known[name].unit)


def _count(text: str) -> int:
    count = int(text) if text.strip().isdecimal() else 0
    if not 1 <= count <= MOST:
        raise ValueError(f"must have a number of values from 1 to {MOST} at its end, but has '{text}'.")
    return count


def _check_range(name: str, values: Sequence[float] | np.ndarray, subject: Subject) -> None:
    info = parameter_info(subject.model).get(name)
    low, high = (info.lower, info.upper) if info else GRADES if name == OIL else (0.0, math.inf)
    unit = "rad/s" if name == SPEED else "" if info is None or info.unit == "1" else info.unit
    allowed = "above 0" if name == SPEED else f"from {low:g} to {high:g}"
    for value in values:
        if not (within(value, low, high) and math.isfinite(value) and (name != SPEED or value > 0)):
            raise ValueError(f"must stay {allowed} {unit}".rstrip() + f", but holds {value:g}.")


def _check_corners(vary: Vary, subject: Subject) -> None:
    """Check what ranges of single values cannot tell, at the corners of all that is varied."""
    from ..files import check_together

    ends = {
        name: sorted(set(how.bounds if isinstance(how, Spread) else (how.min(), how.max())))
        for name, how in vary.items()
        if name != SPEED
    }
    for values in itertools.islice(itertools.product(*ends.values()), MOST_CORNERS):
        corner = dict(zip(ends, map(float, values), strict=True))
        oil = {name: corner.pop(name) for name in [OIL] if name in corner}
        try:
            check_together(replace(with_values(subject.model, oil), **corner))
        except ValueError as error:
            raise InputError(f"Option --vary: {error}") from error
