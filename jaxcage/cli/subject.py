"""A case or a TOML file read into a model, with its name, what is published of it, and its speeds."""

import dataclasses
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import jaxcage as jc

from .._bearing_data import cage_speed_ratio, land_radius, require_cage_rpm
from .._errors import InputError
from .options import Range, flag
from .progress import say


if TYPE_CHECKING:
    from ..bearing import PublishedCase
    from ..files import BearingFile, Description, Unknown

RPM = 30 / math.pi
LONGEST = 50
"""Characters of the name of a TOML file that names of output files and titles repeat; systems allow 255 bytes."""


@dataclasses.dataclass(frozen=True)
class Subject:
    """A model with its name and its file."""

    name: str
    """Name of the case, or of the TOML file without its ending and with `_` for characters that no figure can show."""
    model: Any
    file: "BearingFile"
    path: str = ""
    """Path of the file as it was given; empty for a case."""
    bare: Any = None
    """Owner of speeds given as bare numbers, `cage` or `shaft`; None for that of the file or the model."""

    @property
    def own(self) -> Any:
        """Owner of the speed of the model: `cage` or `shaft`."""
        return self.model.speed_text.split()[0]

    @property
    def speeds(self) -> Any:
        """Owner of speeds that are given as bare numbers: `cage` or `shaft`."""
        return self.bare or self.file.speeds

    @property
    def unknowns(self) -> "tuple[Unknown, ...]":
        """Values of which the file knows a range only."""
        return self.file.unknowns

    @property
    def published(self) -> "PublishedCase | None":
        """Data of the paper about the case; None for a file."""
        return None if self.path else jc.bearing.PUBLISHED_CASES.get(self.name)

    @property
    def with_rollers(self) -> bool:
        """True for a bearing with its rollers, whose motion does not repeat and which reports means of it."""
        return self.model.samples > 1

    def usual(self, cage: Any, bearing: Any) -> Any:
        """One of two defaults: of a cage, or of a bearing with its rollers."""
        return bearing if self.with_rollers else cage

    def _other(self, speed: Any) -> Any:
        """The speed that goes with the model's, both in rpm."""
        return np.vectorize(lambda own: float(self.model.other_speed(float(jc.rpm(own)))[1]) * RPM)(speed)

    @property
    def shaft(self) -> float | None:
        """Shaft speed over the model's; None if that is the shaft's itself."""
        return float(self._other(1.0)) if self.own == "cage" else None

    @property
    def beside(self) -> tuple[str, float] | None:
        """The speed that tables show in place of the model's, and its ratio to it; None for the model's."""
        return None if self.shaft is None or self.speeds == self.own else ("shaft", self.shaft)

    def over(self, low: float, high: float) -> str:
        """A range of the model's speed [rad/s] in words."""
        whose, ratio = self.beside or (self.own, 1.0)
        return f"{low * ratio * RPM:.0f} to {high * ratio * RPM:.0f} rpm of the {whose}"

    def both(self, speed: Any) -> dict[str, Any]:
        """Speeds of the model [rad/s] as speeds of cage and shaft [rpm], for a document."""
        own = np.asarray(speed) * RPM
        cage, shaft = (own, self._other(own)) if self.own == "cage" else (self._other(own), own)
        return {"speed_rpm": own, "cage_speed_rpm": cage, "shaft_speed_rpm": shaft}

    def speed_columns(self, speed: Any) -> dict[str, Any]:
        """Speeds of cage and shaft as columns of a file."""
        return {f"{key.removesuffix('_rpm').replace('_', ' ')} [rpm]": x for key, x in self.both(speed).items()}

    def at(self, speed: float) -> str:
        """A speed of the model [rad/s] in words."""
        own, other = speed * RPM, float(self._other(speed * RPM))
        if self.own == "shaft":
            return f"{own:g} rpm of the shaft (cage {other:.0f} rpm in pure rolling)"
        shaft_first = f"{other:g} rpm of the shaft (cage {own:.0f} rpm)"
        return shaft_first if self.beside else f"{own:g} rpm of the cage (shaft {other:.0f} rpm)"

    def rate(self, given: float) -> float:
        """Rate of the model's speed [rad/s^2] from one [rpm/s] of the speed that bare numbers are."""
        slope = 1.0 if self.speeds == self.own else float(self._other(1.0) - self._other(0.0))
        return given / slope / RPM

    def speed(self, given: float | None) -> float:
        """The speed of the model [rad/s] that `--speed` means."""
        return jc.rpm(self.rpm(given, "speed"))

    def rpm(self, given: float | None, option: str, whose: Any = None) -> float:
        """The speed of the model [rpm] that an option means; `whose` owns bare numbers in place of the usual.

        **Raises:** `InputError` for no speed, and for one at which no cage runs.
        """
        if given is None:
            raise InputError(f'Option {flag(option)} must be given, e.g. {flag(option)} "10000 rpm shaft".')
        speed = jc.files.own_rpm(self.model, given, whose or self.speeds)
        if self.own == "shaft" and speed <= 0:
            at_rest = float(self._other(0.0))
            raise InputError(
                f"Option {flag(option)} must be above {at_rest:g} rpm of the cage, which the outer ring makes by "
                f"itself, but {float(given):g} rpm was given."
            )
        cage = speed if self.own == "cage" else abs(float(self._other(speed)))
        require_cage_rpm(flag(option), cage, float(self.model.land_radius))
        return speed

    def range(self, over: Range, count: int) -> Any:
        """Evenly spaced speeds of the model [rad/s], `count` if none are asked for; of one only the first.

        **Raises:** `InputError` for a range that does not ascend.
        """
        low, high, count = self.rpm(over.first, "first"), self.rpm(over.last, "last"), over.count or count
        if count > 1 and high <= low:
            between = self.over(jc.rpm(low), jc.rpm(high))
            raise InputError(f"Option --last must be above --first, but the range is {between}.")
        return jc.rpm(low, high, count)

    def ends(self, over: Range) -> tuple[float, float]:
        """Lowest and highest speed of the model [rad/s] of a range."""
        low, high = self.range(dataclasses.replace(over, count=None), 2)
        return float(low), float(high)

    def under(self, load: float | None) -> "Subject":
        """The bearing under a load [N]; itself without one."""
        return self if load is None else dataclasses.replace(self, model=jc.replace(self.model, load=load))

    def operating(self, given: tuple[float, ...]) -> tuple["Subject", tuple[float, float]]:
        """The subject, whose speeds are shown as those of the owner that an operating range [rpm] names; and the ends
        of the range as speeds of the model [rad/s]."""
        low, high = (jc.rpm(self.rpm(end, "operating")) for end in given)
        return dataclasses.replace(self, bare=getattr(given[0], "whose", self.speeds)), (low, high)

    def about(self, by_ranges: bool) -> tuple[dict[str, Any], list[str]]:
        """Entries of the case in every document, and sentences about it; best guesses only where these were taken."""
        from .._parameters import readings_of  # loads JAX

        left, estimated = self.file.left, self.file.estimated
        guesses = [] if by_ranges else [u.label for u in self.unknowns]
        document: dict[str, Any] = {"readings": {name: way for name, (way, _) in readings_of(self.model).items()}}
        document |= {} if self.shaft is None else {"cage_speed_ratio": 1 / self.shaft}
        document |= {"load_N": float(self.model.load)} if self.with_rollers else {}
        if self.path:
            document |= {"left_as_in_template": left, "estimated": estimated, "best_guesses": guesses}
        notes = {
            "Readings": [*filter(None, [jc.show.readings_words(self.model)])],
            "Lines still as `jaxcage init` wrote them (change or delete the comment of one that is yours)": left,
            "Estimated, as the file does not give them": jc.show.values_words(self.model, estimated),
            "Best guesses of values known within ranges only": guesses,
        }
        return document, [f"{what}: {', '.join(values)}" for what, values in notes.items() if values]


def described(given: str) -> "Description":
    """A published case, a bearing with its rollers or a TOML file, checked without loading JAX.

    **Raises:** `InputError`.
    """
    from ..files import declarations, describe, read_description

    listed = [name for each in declarations()["subjects"].values() for name in each["bases"]]
    if given.lower() in listed:
        return describe({"base": given.lower()})
    if Path(given).suffix.lower() == ".toml" or os.path.exists(given):
        return read_description(given)
    raise InputError(f"Case '{given}' is unknown: it must be one of {', '.join(listed)}, or the path of a TOML file.")


def check_speeds(found: "Description", speeds: dict[str, float | None]) -> None:
    """Check the speeds that options give, by option, without loading JAX. **Raises:** `InputError`."""
    first, last = speeds.get("first"), speeds.get("last")
    owners = {getattr(end, "whose", found.speeds) for end in (first, last)}
    if first and last and last <= first and len(owners) == 1:
        between = f"{first:g} to {last:g} rpm of the {owners.pop()}"
        raise InputError(f"Option --last must be above --first, but the range is {between}.")
    n = found.numbers
    if n.get("guidance") == "inner" or "outer_speed" in n:  # `Subject.rpm` knows them
        return
    for option, speed in speeds.items():
        if speed is not None:
            whose = getattr(speed, "whose", found.speeds)
            ratio = 1.0 if whose == "cage" else cage_speed_ratio(n["inner_raceway_diameter"], n["roller_diameter"])
            require_cage_rpm(flag(option), speed * ratio, land_radius(n["rib_diameter"], n["guidance_gap"]))


def read_case(given: str) -> Subject:
    """A case or a TOML file that was `described`, with its model.

    A broken design rule, an oil that is too thin and one that is too hot for the cage are reported on standard error.

    **Raises:** `InputError`.
    """
    about = described(given)
    if about.base == given.lower():
        found = Subject(given.lower(), (file := jc.files.built(about)).model, file)
    else:
        name = "".join(c if c.isprintable() and c != "$" else "_" for c in Path(given).stem[:LONGEST])
        found = Subject(name, (file := jc.files.read_bearing(given)).model, file, given)
    if broken := jc.bearing.design_rule_violations(found.model.bearing, found.model.guidance_gap):
        if "bearing.pocket_clearance" in file.estimated and any("T =" in words for words in broken):
            broken.append("T is estimated: give pocket_clearance below [bearing] if you know it.")
        say("Warning: the design rule T > C_r > G_r is broken: " + " ".join(broken))
    for doubt in found.model.lubricant.doubts():
        say(f"Warning: {doubt}")
    oil, kelvin = float(found.model.lubricant.temperature), 273.15
    if file.material is not None and oil > (limit := file.material.limit):
        hot = f"the oil of {oil - kelvin:.0f} degC is hotter than a cage of {file.material.name} bears"
        say(f"Warning: {hot}, {limit - kelvin:.0f} degC.")
    return found
