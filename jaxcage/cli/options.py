"""Types of options, and groups of options that commands share; nothing heavy is imported here."""

import contextlib
import dataclasses
import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro
from tyro.conf import arg
from tyro.constructors import PrimitiveConstructorSpec

from .. import _errors


if TYPE_CHECKING:
    from .subject import Subject


MOST = 10_000_000
"""Largest count; more lanes, speeds or revolutions exceed memory or never finish."""
LARGEST = {"rpm": 1e6, "N": 1e7}
"""Largest speed and load."""
SIDE = range(2, 10_001)
"""Allowed numbers of points along one side of a map."""
EXAMPLES = {"rpm": '"900 rad/s" or "20000 rpm shaft"', "N": '"4.45 kN"', "m": '"20 um"'}
TO = re.compile(r"\s*(?:-|–|\.\.|\bto\b)\s*")
"""Separates the ends of a range of speed."""


def flag(name: str) -> str:
    """Name of an option as it is written on the command line."""
    return "--" + name.replace("_", "-")


def text(
    must: str = "hold a text",
    holds: Callable[[str], bool] = bool,
    read: Callable[[str], Any] = str,
    metavar: str = "NAME",
) -> Any:
    """Option that takes a text for which `holds` is true, and converts it with `read`."""

    def checked(given: list[str]) -> Any:
        if not holds(given[0]):
            raise ValueError(f"must {must}, but '{given[0]}' was given.")
        return read(given[0])

    shown = lambda x: "unset" if x is None else f"{x:g}" if isinstance(x, float) else str(x)
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=checked,
        is_instance=lambda _: True,
        str_from_instance=lambda x: [shown(x)],
    )


def read_quantity(given: str, unit: str) -> float:
    """Read a number in `unit` unless it names its own; a speed may say whether it is the shaft's or the cage's.
    **Raises:** `ValueError` whose message follows the option's name."""
    with contextlib.suppress(ValueError):
        if unit != "rpm":  # `to_si` refuses 1.500 rpm
            return float(given)
    if not unit:
        raise ValueError(f'must be a number, but is "{given}".')
    from ..files import read_rpm, to_si  # loads pint

    try:
        return read_rpm(given) if unit == "rpm" else to_si(given, unit)
    except ValueError as error:
        example = EXAMPLES[unit]
        raise ValueError(f"must be a number in {unit}, or one with a unit such as {example}, but {error}.") from None


def read_range(given: str) -> tuple[float, ...]:
    """Read a range of speed [rpm] such as `4000-14000 rpm shaft` or `900 to 1500 rad/s`, with the owner of the speeds
    if the text names one. **Raises:** `ValueError` whose message follows the option's name."""
    from ..files import SpeedOf, split_owner, to_si

    try:
        part, whose = split_owner(given)
        ends = TO.split(part, maxsplit=1)
        units = [end.lstrip("0123456789.,e ") for end in ends]
        other = next(filter(None, units), "rpm")
        found = [to_si(end if unit else f"{end} {other}", "rpm") for end, unit in zip(ends, units, strict=True)]
    except ValueError as error:
        raise ValueError(f'must be a range of speed such as "4000-14000 rpm shaft", but "{given}" {error}.') from None
    if not (len(found) == 2 and 0 < found[0] < found[1] < math.inf):
        raise ValueError(f'must be two speeds above 0, the lower one first, but "{given}" was given.')
    return tuple(found) if whose is None else tuple(SpeedOf(end, whose) for end in found)


def number(must: str = "be finite", holds: Callable[[float], bool] = math.isfinite, unit: str = "") -> Any:
    """Option that takes a number, in `unit` or with its own unit, for which `holds` is true."""
    most = LARGEST.get(unit, math.inf)

    def read(given: str) -> float:
        value = read_quantity(given, unit)
        if not (math.isfinite(value) and holds(value) and value <= most):
            allowed = must if value <= most or math.isnan(value) else f"be at most {most:g} {unit}"
            raise ValueError(f"must {allowed}, but {value:g} was given.")
        return value

    return text("be a number", lambda given: True, read, {"": "FLOAT", "rpm": "RPM"}.get(unit, unit))


def count(least: int) -> Any:
    """Option that takes a whole number of at least `least`."""
    fits = lambda given: given.strip().lstrip("+").isdecimal() and len(given) < 9 and int(given) >= least
    return text(f"be an integer of at least {least} and at most {MOST}", fits, int, "INT")


def pair(sign: str, must: str, holds: Callable[[int, int], bool]) -> Any:
    """Option that takes two counts with `sign` between them, for which `holds` is true."""
    split = lambda given: tuple(int(part) for part in given.lower().split(sign))
    form = re.compile(rf"\d{{1,5}}{sign}\d{{1,5}}", re.IGNORECASE)
    return text(must, lambda given: form.fullmatch(given) is not None and holds(*split(given)), split)


_SPEED = number("be a speed above 0 rpm", lambda x: x > 0, "rpm")
_LOAD = number("be above 0 N", lambda x: x > 0, "N")
_NUMBER = number()
_OWN = "Bare numbers are the cage's [rpm], of a bearing with its rollers, or where a file says so, the shaft's"
_SIDES = f"be ACROSSxUPWARDS, each from {SIDE[0]} to {SIDE[-1]}, e.g. 300x300"
_CASE = "A published case (1a, 1b, 2a, 2b, 3a, 3b), a bearing with its rollers (nu2310), or a TOML file."

if TYPE_CHECKING:
    Case = Other = Subject
else:  # a text, which the wrapper replaces by the subject before it runs the command
    Case = Annotated[tyro.conf.Positional[Any], text(metavar="CASE"), arg(help=_CASE)]
    Other = Annotated[tyro.conf.Positional[Any], text(metavar="OTHER"), arg(help="The design to compare it with.")]
Speed = Annotated[float, _SPEED, arg(help=f'Speed, e.g. "900 rad/s" or "20000 rpm shaft". {_OWN}.')]
SpeedOrRest = Annotated[float | None, _SPEED, arg(help=f"Speed; at rest if left out. {_OWN}.")]
Operating = Annotated[
    Any,
    text("name a range", read=read_range, metavar="RANGE"),
    arg(help='Range of speed of the machine, e.g. "4000-14000 rpm shaft".'),
]
Load = Annotated[float | None, _LOAD, arg(help='Shaft load of a bearing with its rollers [N], e.g. "4.45 kN".')]
Draws = Annotated[int, count(0), arg(help="Draws from ranges of the file; 0 takes the best guesses.")]
Seed = Annotated[int, count(0), arg(help="Seed of all that is drawn.")]
Quick = Annotated[bool, arg(help="Leave out what takes long, such as gradients.")]
FromZero = Annotated[int, count(0)]
FromOne = Annotated[int, count(1)]
FromTwo = Annotated[int, count(2)]
OptionalCount = Annotated[int | None, count(1)]
OptionalZero = Annotated[int | None, count(0)]
OptionalText = Annotated[str | None, text()]
Texts = Annotated[tuple[str, ...], tyro.conf.UseAppendAction]
Prices = Annotated[Texts, arg(metavar="NAME=NUMBER")]
Points = Annotated[tuple[int, int] | None, pair("x", _SIDES, lambda a, b: a in SIDE and b in SIDE)]
Shard = Annotated[tuple[int, int] | None, pair("/", "be I/N with I from 1 to N, e.g. 1/4", lambda i, n: 1 <= i <= n)]


@dataclasses.dataclass(frozen=True)
class Range:
    """Range of speed."""

    first: Annotated[float, _SPEED] = 2500.0
    """Lowest speed, e.g. "300 rad/s" or "6000 rpm shaft"; bare numbers are in rpm of the cage or, for a bearing with
    its rollers or a file that says so, of the shaft."""
    last: Annotated[float, _SPEED] = 27500.0
    """Highest speed."""
    count: OptionalCount = None
    """Number of speeds."""


@dataclasses.dataclass(frozen=True)
class StepOptions:
    """Options of the integration."""

    solver: OptionalText = None
    """Integration method: rk4, rodas4, tsit5."""
    steps: OptionalCount = None
    """Number of equal steps per revolution."""
    tolerance: Annotated[float | None, _NUMBER] = None
    """Tolerance of adaptive steps."""

    @property
    def method(self) -> Any:
        """Integration method of these options; None leaves the choice to the computation."""
        given = _given(solver=self.solver, steps=self.steps, tolerance=self.tolerance)
        if not given:
            return None
        from ..solve import method, native

        return native(**given) if list(given) == ["tolerance"] else method(**given)


@dataclasses.dataclass(frozen=True)
class RunOptions(StepOptions):
    """Options of the length of a run; the model has values for those that are unset."""

    discard: OptionalZero = None
    """Revolutions discarded at the beginning."""
    revolutions: OptionalCount = None
    """Revolutions observed."""

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of `jaxcage.lanes.Run` that are given; the model has defaults for the others."""
        blocks = None if self.revolutions is None else blocks_of(self.revolutions)
        return _given(discard=self.discard, revolutions=self.revolutions, method=self.method, blocks=blocks)


@dataclasses.dataclass(frozen=True)
class SweepOptions(RunOptions):
    """Options of a sweep and the certainty of its labels; the model has values for those that are unset."""

    horizon: OptionalZero = None
    """Revolutions up to which chaotic trajectories are continued, to see how long chaos lasts; 0 turns this off."""
    no_confirm: bool = False
    """Do not repeat trajectories that are not periodic with finer steps."""
    exponents: OptionalCount = None
    """Number of Lyapunov exponents."""

    @property
    def settings(self) -> dict[str, Any]:
        confirm = False if self.no_confirm else None
        return super().settings | _given(horizon=self.horizon, exponents=self.exponents, confirm=confirm)


@dataclasses.dataclass(frozen=True)
class MeanOptions:
    """Runs at one speed of a bearing with its rollers."""

    speed: Annotated[float | None, _SPEED] = None
    """Speed, e.g. "10000 rpm shaft"."""
    load: Load = None
    initial_states: OptionalCount = None
    """Initial states of each design."""
    discard: OptionalZero = None
    """Revolutions discarded at the beginning."""
    revolutions: OptionalCount = None
    """Revolutions observed, an even number."""

    def length(self, **usual: int) -> dict[str, int]:
        """Number of initial states and revolutions as given, or else the usual ones."""
        return usual | _given(**{name: getattr(self, name) for name in usual})


@dataclasses.dataclass(frozen=True)
class CalmOptions:
    """Requirements on the design of a cage over an operating range."""

    operating: Operating = None
    objective: Literal["cost", "width"] = "cost"
    """The quantity to minimise: cost, or the exact width of the unstable ranges within --operating."""
    margin: Annotated[float, _NUMBER] = 10.0
    """Least distance of both ends of the range from the edges of the stable range, per cent of speed."""
    decay: Annotated[float | None, _NUMBER] = None
    """Largest number of revolutions in which a small disturbance falls to 1/e."""
    least_film: Annotated[float | None, number("be at least 0 m", lambda x: x >= 0, "m")] = None
    """Least distance of cage and land, e.g. "20 um"."""
    land_force: Annotated[float | None, _NUMBER] = None
    """Largest force of the land on the cage in calm motion [N]; 0 forbids contact."""
    grade: Annotated[float | None, _NUMBER] = None
    """Largest balance grade G [mm/s]."""
    drag: Annotated[float | None, _NUMBER] = None
    """Largest power lost by shear of the film [W]."""
    tolerance: OptionalText = None
    """Tolerances within which all of this must hold, e.g. "guidance_gap=+-0.05 mm, eccentricity=G6.3"."""


@dataclasses.dataclass(frozen=True)
class ShowOptions:
    """Output options."""

    out: Annotated[str, text("name a folder")] = "out"
    """Folder for figures and data; it is made if need be."""
    details: bool = False
    """Print all tables and notes, and not only those that decide."""
    json: bool = False
    """Print one JSON document on standard output instead of tables."""
    no_cache: bool = False
    """Compile everything again instead of using cached programs of earlier runs."""


def _given(**options: Any) -> dict[str, Any]:
    """Options that are not None."""
    return {name: value for name, value in options.items() if value is not None}


def blocks_of(revolutions: int) -> int:
    """Number of equal blocks of the observed revolutions, for error bars. **Raises:** `ArgumentError` if they cannot be
    divided."""
    if revolutions % 10 == 0:
        return 10 if revolutions % 20 else 20
    if (found := max(n for n in range(1, 21) if revolutions % n == 0)) == 1:
        said = f"must be a multiple of 10, or of another number up to 20, but {revolutions} was given."
        raise _errors.ArgumentError("revolutions", said=said)
    return found
