"""Both directions of a map."""

from .._errors import InputError
from .._parameters import parameter_info, parameters
from ..io import to_si
from ..models import CageModel
from ..report import RPM, SPEED, Axis, shown_unit
from ..sweeps import rpm
from ._job import Job
from ._options import MapOptions


BELOW, ABOVE = 0.8, 1.25
"""Range of a parameter over its value, unless told otherwise."""


def axes_of(job: Job[MapOptions]) -> tuple[Axis, Axis]:
    """Both directions.

    **Raises:** `InputError` for names the model does not have, and for ranges that make no sense.
    """
    options, model = job.options, job.model
    known = list(parameters(model))
    for option, given, allowed in (("--y", options.y, known), ("--x", options.x, [SPEED, *known])):
        if given not in allowed:
            raise InputError(f"Option {option} must be one of {', '.join(allowed)}, but '{given}' was given.")
    if options.x == options.y:
        raise InputError(f"Options --x and --y must be two different parameters, but both are {options.x}.")
    y = _parameter_axis(model, options.y, options.lower, options.upper)
    if options.x != SPEED:
        return _parameter_axis(model, options.x, None, None), y
    return Axis(SPEED, rpm(options.first), rpm(options.last), "rpm", RPM), y


def _parameter_axis(model: CageModel, name: str, lower: str | None, upper: str | None) -> Axis:
    info, value = parameter_info(model)[name], float(parameters(model)[name])
    default = sorted((BELOW * value, ABOVE * value))
    low = max(default[0], info.lower) if lower is None else _limit("--lower", lower, info.unit)
    high = min(default[1], info.upper) if upper is None else _limit("--upper", upper, info.unit)
    unit = "" if info.unit == "1" else f" {info.unit}"
    for option, given in (("--lower", low), ("--upper", high)):
        if not info.lower <= given <= info.upper:
            raise InputError(
                f"Option {option} must be a value of {name} from {info.lower:g} to {info.upper:g}{unit}, "
                f"but {given:g}{unit} was given."
            )
    if not low < value < high:
        raise InputError(
            f"Options --lower and --upper must have {name} = {value:g}{unit} between them, "
            f"but the range is {low:g} to {high:g}{unit}."
        )
    return Axis(name, low, high, *shown_unit(info.unit, value))


def _limit(option: str, text: str, unit: str) -> float:
    try:
        return to_si(text, unit)
    except ValueError as error:
        raise InputError(f"Option {option} {error}.") from error
