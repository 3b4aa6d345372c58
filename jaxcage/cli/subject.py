"""A case or a TOML file read into a model, with its name, what is published of it, and its speeds."""

import dataclasses
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._errors import InputError
from .._parameters import readings_of, replace
from ..bearing import PUBLISHED_CASES, PublishedCase, design_rule_violations
from ..files import BearingFile, Unknown, Whose, read_bearing, read_whole_bearing, subject_of
from ..models import FASTEST, WHOLE_BEARINGS, case, whole_bearing
from .options import flag
from .progress import say


RPM = 30 / math.pi


@dataclasses.dataclass(frozen=True)
class Subject:
    """A model with its name and its file."""

    name: str
    """Name of the case, or of the TOML file without its ending and with `_` for characters that no figure can show."""
    model: Any
    published: PublishedCase | None = None
    file: BearingFile | None = None

    @property
    def own(self) -> str:
        """Whose speed the model's is: `cage` or `shaft`."""
        return self.model.speed_text.split()[0]

    @property
    def speeds(self) -> Whose | str:
        """Whose speeds bare numbers are."""
        return self.own if self.file is None else self.file.speeds

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Values of which the file knows a range only."""
        return () if self.file is None else self.file.unknowns

    @property
    def reports_means(self) -> bool:
        """True for a model that reports quantities of its own, each revolution of which takes long."""
        return bool(self.model.quantities)

    def usual(self, forced: Any, with_rollers: Any) -> Any:
        """One of two defaults: of a forced system, or of a model that reports quantities of its own."""
        return with_rollers if self.reports_means else forced

    def _other(self, speed: Any) -> Any:
        """The speed that goes with the model's, both in rpm."""
        return np.asarray(self.model.other_speed(speed / RPM)[1]) * RPM

    @property
    def shaft(self) -> float | None:
        """Shaft speed over the model's; None if that is the shaft's itself."""
        return float(self._other(1.0)) if self.own == "cage" else None

    @property
    def beside(self) -> tuple[str, float] | None:
        """The speed that tables show beside the model's, and its ratio to it."""
        return None if self.shaft is None else ("shaft", self.shaft)

    @property
    def design_words(self) -> str:
        """Gap and eccentricity, for titles."""
        gap, eccentricity = 1e3 * float(self.model.guidance_gap), 1e6 * float(self.model.eccentricity)
        return f"guidance gap {gap:.3g} mm, eccentricity {eccentricity:.3g} µm"

    def both(self, speed: Any) -> dict[str, Any]:
        """Speeds of the model [rad/s] as speeds of cage and shaft [rpm], for a document."""
        own = np.asarray(speed) * RPM
        cage, shaft = (own, self._other(own)) if self.own == "cage" else (self._other(own), own)
        return {"speed_rpm": own, "cage_speed_rpm": cage, "shaft_speed_rpm": shaft}

    def at(self, speed: float) -> str:
        """A speed of the model [rad/s] in words."""
        other = "shaft" if self.own == "cage" else "cage"
        return f"{speed * RPM:g} rpm of the {self.own} ({other} {float(self._other(speed * RPM)):.0f} rpm)"

    def rate(self, given: float) -> float:
        """Rate of the model's speed [rad/s^2] from one [rpm/s] of the speed that bare numbers are."""
        slope = 1.0 if self.speeds == self.own else float(self._other(1.0) - self._other(0.0))
        return given / slope / RPM

    def speed(self, given: float, option: str = "speed") -> float:
        """The speed of the model [rad/s] that an option means, by the model's own relation of cage and shaft.

        **Raises:** `InputError` for a speed at which no cage runs.
        """
        speed = float(given)
        if getattr(given, "whose", self.speeds) != self.own:
            at_rest = float(self._other(0.0))
            speed = (speed - at_rest) / (float(self._other(1.0)) - at_rest)
            if speed <= 0:
                raise InputError(
                    f"Option {flag(option)} must be above {at_rest:g} rpm of the cage, which the outer ring makes by "
                    f"itself, but {float(given):g} rpm was given."
                )
        cage = speed if self.own == "cage" else float(self._other(speed))
        limit = FASTEST / float(self.model.land_radius) * RPM
        if abs(cage) > limit:
            raise InputError(
                f"Option {flag(option)} must leave the cage at most {limit:.0f} rpm, which is {FASTEST:g} m/s at its "
                f'land, but {cage:g} rpm of the cage were given; speeds of the shaft are written "20000 rpm shaft".'
            )
        return speed / RPM

    def range(self, first: float, last: float, count: int) -> Float[np.ndarray, " count"]:
        """Evenly spaced speeds of the model [rad/s]; of one only the first.

        **Raises:** `InputError` for a range that does not ascend.
        """
        low, high = self.speed(first, "first"), self.speed(last, "last")
        if count > 1 and high <= low:
            raise InputError(
                f"Option --last must be above --first, but the range is {low * RPM:g} to {high * RPM:g} rpm of the "
                f"{self.own}."
            )
        return np.linspace(low, high, count) if count > 1 else np.array([low])

    def loaded(self, load: float | None) -> "Subject":
        """The model under the shaft load of an option [N].

        **Raises:** `InputError` for a cage, whose forces do not follow from it.
        """
        if load is None:
            return self
        if not self.reports_means:
            raise InputError(f"Option --load goes with a bearing with its rollers, but {self.name} is a cage.")
        return dataclasses.replace(self, model=replace(self.model, load=load))

    def require_orbits(self, command: str) -> None:
        """**Raises:** `InputError` for a model whose revolutions do not repeat."""
        if self.model.samples > 1:
            raise InputError(f"Command {command} takes a cage, but {self.name} is a bearing with its rollers.")

    def require_ranges(self) -> None:
        """**Raises:** `InputError` for a model that is known exactly."""
        if not self.unknowns:
            raise InputError(
                f'Case {self.name} must be a TOML file with ranges, such as stiffness = "1e4 .. 1e6 N/m", but has none.'
            )

    @property
    def certain(self) -> "Subject":
        """The same without ranges, for answers that have taken them into account."""
        return (
            self if self.file is None else dataclasses.replace(self, file=dataclasses.replace(self.file, unknowns=()))
        )

    @property
    def document(self) -> dict[str, Any]:
        """What every document says of the case."""
        found: dict[str, Any] = {"readings": {name: chosen for name, (chosen, _) in readings_of(self.model).items()}}
        if self.shaft is not None:
            found["cage_speed_ratio"] = 1 / self.shaft
        if self.reports_means:
            found["load_N"] = float(self.model.load)
        if self.file is not None:
            found |= {"left_as_in_template": self.file.left, "best_guesses": [u.label for u in self.unknowns]}
        return found

    @property
    def notes(self) -> list[str]:
        """The same in sentences."""
        words, readings = self.document, readings_of(self.model).items()
        each = {
            "Readings": [f'{name.replace("_", " ")} {words} ("{chosen}")' for name, (chosen, words) in readings],
            "As the template has them, of another bearing": words.get("left_as_in_template"),
            "Best guesses of values known within ranges only": words.get("best_guesses"),
        }
        return [f"{what}: {', '.join(values)}" for what, values in each.items() if values]


def read_case(given: str, load: float | None = None) -> Subject:
    """A case or TOML file by its name, under a load [N] if one is given.

    A broken design rule and an oil that is too thin are reported on standard error.

    **Raises:** `InputError`.
    """
    if given in PUBLISHED_CASES:
        found = Subject(given, case(given), PUBLISHED_CASES[given])
    elif Path(given).suffix.lower() == ".toml" or os.path.exists(given):
        file = read_bearing(given) if subject_of(given) == "cage" else read_whole_bearing(given)
        name = "".join(c if c.isprintable() and c != "$" else "_" for c in Path(given).stem)
        found = Subject(name, file.model, None, file)
    elif given.lower() in WHOLE_BEARINGS:
        found = Subject(given.lower(), whole_bearing(given))
    else:
        known = ", ".join([*PUBLISHED_CASES, *WHOLE_BEARINGS])
        raise InputError(f"Case '{given}' is unknown: it must be one of {known}, or the path of a TOML file.")
    if broken := design_rule_violations(found.model.bearing, found.model.guidance_gap):
        say("Warning: the design rule T > C_r > G_r is broken: " + " ".join(broken))
    for doubt in found.model.lubricant.doubts():
        say(f"Warning: {doubt}")
    return found.loaded(load)
