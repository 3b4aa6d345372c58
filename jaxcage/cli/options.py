"""Types of options, and the groups of options that commands share; nothing heavy is imported here."""

import contextlib
import dataclasses
import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro
from tyro.conf import arg
from tyro.constructors import PrimitiveConstructorSpec

from .progress import Say, progress


if TYPE_CHECKING:
    from ..solve import AbstractMethod

MOST = 10_000_000
"""Largest count: more lanes, speeds or revolutions end in no memory, or in no lifetime."""
LARGEST = {"rpm": 1e6, "N": 1e7}
"""Largest speed and load."""
LONGEST = 200
"""Bytes in the name of a store; file systems allow 255, and temporary names are longer."""
SIDE = range(2, 10_001)
"""Points along one side of a map."""
EXAMPLES = {"rpm": '"900 rad/s" or "20000 rpm shaft"', "N": '"4.45 kN"', "ms": '"600 us"'}


def flag(name: str) -> str:
    """An option as it is written."""
    return "--" + name.replace("_", "-")


def _option(metavar: str, read: Callable[[str], Any]) -> Any:
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda given: read(given[0]),
        is_instance=lambda _: True,
        str_from_instance=lambda x: ["by the model" if x is None else f"{x:g}" if isinstance(x, float) else str(x)],
    )


def read_quantity(text: str, unit: str) -> float:
    """The number in a text, in `unit`, which a bare number has already; a speed may say whose it is.

    **Raises:** `ValueError` with the words that follow the option's name.
    """
    with contextlib.suppress(ValueError):
        return float(text)
    from ..files import SpeedOf, split_owner, to_si  # loads pint

    try:
        if unit != "rpm":
            return to_si(text, unit)
        speed, whose = split_owner(text)
        return to_si(speed, unit) if whose is None else SpeedOf(to_si(speed, unit), whose)
    except ValueError as error:
        example = EXAMPLES[unit]
        raise ValueError(f"must be a number in {unit}, or one with a unit such as {example}, but {error}.") from None


def number(must: str = "be finite", holds: Callable[[float], bool] = math.isfinite, unit: str = "") -> Any:
    """An option that is a number, in `unit` or with a unit of its own, for which `holds` is true."""

    def read(text: str) -> float:
        try:
            value = read_quantity(text, unit) if unit else float(text)
        except ValueError as error:
            raise ValueError(str(error) if unit else f'must be a number, but is "{text}".') from None
        if not (math.isfinite(value) and holds(value)):
            raise ValueError(f"must {must}, but {value:g} was given.")
        if value > LARGEST.get(unit, math.inf):
            raise ValueError(f"must be at most {LARGEST[unit]:g} {unit}, but {value:g} was given.")
        return value

    return _option({"": "FLOAT", "rpm": "RPM"}.get(unit, unit), read)


def count(least: int, of: int = 1) -> Any:
    """An option that is a whole number of at least `least`, and a multiple of `of`."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise ValueError(f'must be an integer, but is "{text}".') from None
        if value < least or value % of or value > MOST:
            allowed = f"a multiple of {of} above 0" if of > 1 else f"at least {least}"
            raise ValueError(f"must be {f'at most {MOST}' if value > MOST else allowed}, but {value} was given.")
        return value

    return _option("INT", read)


def pair(sign: str, what: str, holds: Callable[[int, int], bool]) -> Any:
    """An option of two counts with a sign between them."""

    def read(text: str) -> tuple[int, int]:
        with contextlib.suppress(ValueError):
            first, second = map(int, text.lower().replace("×", "x").split(sign))
            if holds(first, second):
                return first, second
        raise ValueError(f"must be {what}, but '{text}' was given.")

    return _option("NAME", read)


def text(must: str = "hold a text", holds: Callable[[str], bool] = bool) -> Any:
    """An option that is a text for which `holds` is true."""

    def read(given: str) -> str:
        if not holds(given):
            raise ValueError(f"must {must}, but '{given}' was given.")
        return given

    return _option("NAME", read)


def is_within(path: str) -> bool:
    """True if a path leads to a place within the folder that it starts from, by names that a disk takes."""
    parts = Path(path).parts
    short = all(len(os.fsencode(part)) <= LONGEST for part in parts)
    return bool(parts) and short and not Path(path).is_absolute() and ".." not in parts


_SPEED = number("be a speed above 0 rpm", lambda x: x > 0, "rpm")
_LOAD = number("be above 0 N", lambda x: x > 0, "N")
_OWN = "Bare numbers are the cage's [rpm], of a bearing or as a file says the shaft's"

Case = Annotated[
    tyro.conf.Positional[str],
    arg(metavar="CASE", help="A published case (1a, 1b, 2a, 2b, 3a, 3b), a bearing (nu2310), or a TOML file."),
]
First = Annotated[float, _SPEED, arg(help=f'Lowest speed, e.g. "300 rad/s" or "6000 rpm shaft". {_OWN}.')]
Last = Annotated[float, _SPEED, arg(help="Highest speed.")]
Speed = Annotated[float, _SPEED, arg(help=f'Speed, e.g. "900 rad/s" or "20000 rpm shaft". {_OWN}.')]
OptionalSpeed = Annotated[float | None, _SPEED, arg(help="One speed, where the model or the map needs one.")]
Load = Annotated[float | None, _LOAD, arg(help='Shaft load of a bearing with its rollers [N], e.g. "4.45 kN".')]
Count = Annotated[int | None, count(1), arg(help="Number of speeds.")]
Seed = Annotated[int, count(0), arg(help="Seed of all that is drawn.")]
Quick = Annotated[bool, arg(help="Leave out what takes long, such as gradients.")]
Revolutions = Annotated[int | None, count(1), arg(help="Revolutions observed.")]
Discard = Annotated[int | None, count(0), arg(help="Revolutions left out at the beginning.")]
FromZero = Annotated[int, count(0)]
FromOne = Annotated[int, count(1)]
FromTwo = Annotated[int, count(2)]
OptionalCount = Annotated[int | None, count(1)]
OptionalTwo = Annotated[int | None, count(2), arg(help="Number of speeds that are simulated.")]
OptionalText = Annotated[str | None, text()]
Price = Annotated[float | None, number("be at least 0", lambda x: x >= 0)]
Texts = Annotated[tuple[str, ...], tyro.conf.UseAppendAction]
Points = Annotated[
    tuple[int, int] | None,
    pair("x", f"ACROSSxUPWARDS, each from {SIDE[0]} to {SIDE[-1]}, e.g. 300x300", lambda a, b: a in SIDE and b in SIDE),
]
Shard = Annotated[tuple[int, int], pair("/", "I/N with I from 1 to N, e.g. 1/4", lambda i, n: 1 <= i <= n)]
Store = Annotated[str | None, text("name a folder within --out", is_within)]


@dataclasses.dataclass(frozen=True)
class StepOptions:
    """How to integrate."""

    solver: OptionalText = None
    """Integration method: rodas3, rodas4, rk4, newmark, tsit5, kvaerno3, kvaerno5, kencarp4."""
    steps: OptionalCount = None
    """Equal steps per revolution."""
    tolerance: Annotated[float | None, number()] = None
    """Adaptive steps with this tolerance."""

    @property
    def method(self) -> "AbstractMethod | None":
        """The integration method that is asked for; None leaves the choice to what is computed."""
        if self.solver is None and self.steps is None and self.tolerance is None:
            return None
        from ..solve import method, native

        if self.solver is None and self.steps is None:
            return native(tolerance=self.tolerance)
        named = {} if self.solver is None else {"solver": self.solver}
        return method(**named, steps=self.steps, tolerance=self.tolerance)


@dataclasses.dataclass(frozen=True)
class RunOptions(StepOptions):
    """How long to run."""

    discard: Discard = None
    revolutions: Revolutions = None

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of `jaxcage.lanes.Run`; what was not given is None, and the model's own default."""
        found = {"discard": self.discard, "revolutions": self.revolutions, "method": self.method}
        if self.revolutions is not None:
            found["blocks"] = blocks_of(self.revolutions)
        return found


@dataclasses.dataclass(frozen=True)
class SweepOptions(RunOptions):
    """How long to run, and how sure labels are to be."""

    horizon: Annotated[int | None, count(0)] = None
    """Revolutions to which chaos is followed, to tell how long it lasts; 0 turns this off."""
    no_confirm: bool = False
    """Do not run lanes that are not periodic again by finer steps."""
    exponents: OptionalCount = None
    """Number of Lyapunov exponents."""

    @property
    def settings(self) -> dict[str, Any]:
        confirm = False if self.no_confirm else None
        return super().settings | {"horizon": self.horizon, "confirm": confirm, "exponents": self.exponents}


def blocks_of(revolutions: int) -> int:
    """Number of equal blocks of the observed revolutions, from which error bars come.

    **Raises:** `ValueError` for revolutions that cannot be cut.
    """
    if revolutions % 10 == 0:
        return 10 if revolutions % 20 else 20
    found = max(n for n in range(1, 21) if revolutions % n == 0)
    if found == 1:
        from .._errors import InputError

        raise InputError(
            f"Option --revolutions must be a multiple of 10, or of another number up to 20, but {revolutions} was given."
        )
    return found


@dataclasses.dataclass(frozen=True)
class ShowOptions:
    """What is written and printed."""

    out: Annotated[str, text("name a folder")] = "out"
    """Folder for figures and data; it is made if need be."""
    style: Literal["light", "dark", "print"] = "light"
    """Style of the figures: for white pages, dark screens, or black-and-white paper."""
    json: bool = False
    """Print one JSON document on standard output instead of tables."""
    no_cache: bool = False
    """Compile everything anew instead of using programs of earlier runs."""

    @contextlib.contextmanager
    def computing(self, what: str, advice: str = "") -> Iterator[Say]:
        """Around a computation: nothing is computed that cannot be written. Yields the function that takes progress.

        `advice` is what is said to a user who interrupts it.
        """
        from ..files import check_writable

        check_writable(self.out)
        with progress(what, advice) as say:
            yield say
