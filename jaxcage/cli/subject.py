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
    published: "PublishedCase | None" = None
    file: "BearingFile | None" = None
    path: str = ""
    """Path of the file as it was given."""
    bare: Any = None
    """Owner of speeds given as bare numbers, `cage` or `shaft`; None for that of the file or the model."""

    @property
    def own(self) -> Any:
        """Owner of the speed of the model: `cage` or `shaft`."""
        return self.model.speed_text.split()[0]

    @property
    def speeds(self) -> Any:
        """Owner of speeds that are given as bare numbers: `cage` or `shaft`."""
        return self.bare or (self.own if self.file is None else self.file.speeds)

    @property
    def unknowns(self) -> "tuple[Unknown, ...]":
        """Values of which the file knows a range only."""
        return () if self.file is None else self.file.unknowns

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
        other, rolling = ("shaft", "") if self.own == "cage" else ("cage", " in pure rolling")
        return f"{speed * RPM:g} rpm of the {self.own} ({other} {float(self._other(speed * RPM)):.0f} rpm{rolling})"

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

        left, estimated = ((), ()) if self.file is None else (self.file.left, self.file.estimated)
        guesses = [] if by_ranges else [u.label for u in self.unknowns]
        document: dict[str, Any] = {"readings": {name: way for name, (way, _) in readings_of(self.model).items()}}
        document |= {} if self.shaft is None else {"cage_speed_ratio": 1 / self.shaft}
        document |= {"load_N": float(self.model.load)} if self.with_rollers else {}
        document |= (
            {} if self.file is None else {"left_as_in_template": left, "estimated": estimated, "best_guesses": guesses}
        )
        notes = {
            "Readings": [*filter(None, [jc.show.readings_words(self.model)])],
            "Lines still as `jaxcage init` wrote them (change or delete the comment of one that is yours)": left,
            "Estimated, as the file does not give them": jc.show.values_words(self.model, estimated),
            "Best guesses of values known within ranges only": guesses,
        }
        return document, [f"{what}: {', '.join(values)}" for what, values in notes.items() if values]


def _is_file(given: str) -> bool:
    return Path(given).suffix.lower() == ".toml" or os.path.exists(given)


def check_case(given: str, speeds: dict[str, float | None]) -> "Description":
    """Check the name of a case, or the keys and values of a TOML file, and speeds by option, without loading JAX.

    **Returns:** what is described.

    **Raises:** `InputError`.
    """
    from ..files import declarations, describe, read_description

    cases, bearings = (each["bases"] for each in declarations()["subjects"].values())
    listed = given in cases or given.lower() in bearings
    if not listed and not _is_file(given):
        known = ", ".join([*cases, *bearings])
        raise InputError(f"Case '{given}' is unknown: it must be one of {known}, or the path of a TOML file.")
    found = describe({"base": given.lower()}) if listed else read_description(given)
    first, last = speeds.get("first"), speeds.get("last")
    if first and last and last <= first and type(first) is type(last):
        between = f"{first:g} to {last:g} rpm of the {getattr(first, 'whose', found.speeds)}"
        raise InputError(f"Option --last must be above --first, but the range is {between}.")
    n = found.numbers
    if n.get("guidance") == "inner" or "outer_speed" in n:  # `Subject.rpm` knows them
        return found
    for option, speed in speeds.items():
        if speed is not None:
            whose = getattr(speed, "whose", found.speeds)
            ratio = 1.0 if whose == "cage" else cage_speed_ratio(n["inner_raceway_diameter"], n["roller_diameter"])
            require_cage_rpm(flag(option), speed * ratio, land_radius(n["rib_diameter"], n["guidance_gap"]))
    return found


def read_case(given: str) -> Subject:
    """A case or TOML file that passed `check_case`.

    A broken design rule and an oil that is too thin are reported on standard error.

    **Raises:** `InputError`.
    """
    cases = jc.bearing.PUBLISHED_CASES
    if given in cases:
        found = Subject(given, jc.case(given), cases[given])
    elif given.lower() in jc.models.WHOLE_BEARINGS:
        found = Subject(given.lower(), jc.whole_bearing(given))
    else:
        file, name = jc.files.read_bearing(given), Path(given).stem
        name = "".join(c if c.isprintable() and c != "$" else "_" for c in name[:LONGEST])
        found = Subject(name, file.model, None, file, given)
    if broken := jc.bearing.design_rule_violations(found.model.bearing, found.model.guidance_gap):
        estimated = () if found.file is None else found.file.estimated
        if "bearing.pocket_clearance" in estimated and any("T =" in words for words in broken):
            broken.append("T is estimated: give pocket_clearance below [bearing] if you know it.")
        say("Warning: the design rule T > C_r > G_r is broken: " + " ".join(broken))
    for doubt in found.model.lubricant.doubts():
        say(f"Warning: {doubt}")
    material, oil = None if found.file is None else found.file.material, float(found.model.lubricant.temperature)
    if material is not None and oil > material.limit:
        kelvin = 273.15
        say(
            f"Warning: the oil of {oil - kelvin:.0f} degC is hotter than a cage of {material.name} bears, "
            f"{material.limit - kelvin:.0f} degC."
        )
    return found
