"""What a store must know of a study, whatever its lanes are of."""

import abc
import dataclasses
import functools
import hashlib
import json
from importlib.metadata import version
from typing import Any

import numpy as np

from ._fingerprint import fingerprint, package_digest, platform_traits
from ._plan import Plan
from ._references import Unknown


SPEED = "speed"
"""Name of the speed [rad/s] beside those of the system's parameters: the cage's, or a whole bearing's shaft's."""
PENDING = -1
"""Code of a lane that has not been run yet."""

Results = dict[str, np.ndarray]
"""Output by name; the lanes are the first axis."""


@dataclasses.dataclass(frozen=True)
class Variable:
    """What is stored of every lane under one name."""

    text: str
    unit: str
    kind: str = "float64"
    names: tuple[str, ...] = ()
    """What the codes 0, 1, ... mean; nothing for numbers that are no codes."""
    within: tuple[str, ...] = ()
    """Axes within a lane."""


class AbstractStudy(abc.ABC):
    """Lanes over any parameters, and what to compute in each of them."""

    system: Any
    """What has the parameters that are varied."""
    plan: Plan
    discard: int
    revolutions: int
    speed_text: str = "cage speed"
    """In words."""

    @property
    @abc.abstractmethod
    def variables(self) -> dict[str, Variable]:
        """What is stored of every lane, by name."""

    @abc.abstractmethod
    def chunk(self, number: int) -> Results:
        """The results of a chunk, laid out as its block of the grid."""

    @abc.abstractmethod
    def settings(self) -> dict[str, Any]:
        """How lanes are computed, as far as it is not their code."""

    @property
    @abc.abstractmethod
    def law(self) -> dict[str, Any]:
        """By name, the objects whose code and numbers the results follow from."""

    @property
    def extents(self) -> dict[str, int]:
        """Lengths of the axes within a lane."""
        return {}

    @property
    def labels_within(self) -> dict[str, np.ndarray]:
        """Coordinates of the axes within a lane."""
        return {}

    @property
    def configuration(self) -> Any:
        """What a TOML file would say of the subject; None where it cannot say it."""
        return None

    def anew(self) -> "AbstractStudy":
        """The same, without what it has worked out."""
        return dataclasses.replace(self)  # pyright: ignore[reportArgumentType]

    def describe(self) -> dict[str, Any]:
        """Everything that the results follow from."""
        return {
            **self.settings(),
            "version_jaxlib": version("jaxlib"),
            "package": package_digest(),
            "platform": platform_traits(),
            "code": {"unknown": self.unknown} if self.unknown else self._code,
        }

    @functools.cached_property
    def _code(self) -> dict[str, str]:
        return fingerprint(**self.law)

    @functools.cached_property
    def unknown(self) -> str:
        """Why it cannot be told whether another study is this one: a reason, or nothing if it can."""
        try:
            return "" if self._code else ""
        except Unknown as error:
            return str(error)

    @functools.cached_property
    def fingerprint(self) -> str:
        """A digest of `describe`: studies that share it have the same results."""
        return hashlib.sha256(json.dumps(self.describe(), sort_keys=True).encode()).hexdigest()
