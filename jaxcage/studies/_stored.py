"""What a store must know of a study, whatever its lanes are of."""

import abc
import dataclasses
import json
from typing import Any

import numpy as np

from ._plan import Plan


SPEED = "speed"
"""Name of the speed [rad/s] beside those of the system's parameters: the cage's, or a whole bearing's shaft's."""
PENDING = -1
"""Code of a lane that has not been run yet."""

KNOWN = "jaxcage jax jaxlib numpy diffrax equinox lineax optimistix builtins".split()
"""Packages whose code is known by their versions."""

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
    name: str
    version: str
    """Of code of the user's own, which a store cannot recognise by itself."""
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
        """Parameters, lanes, and how they are computed."""

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

    @property
    def own_code(self) -> str | None:
        """A class or function of the user's own that lanes are computed by, None if there is none."""
        return _own_code([getattr(self, field.name) for field in dataclasses.fields(self)])  # pyright: ignore

    def describe(self) -> dict[str, Any]:
        """All that a store is recognised by."""
        return {"name": self.name, "version": self.version, **self.settings()}

    @property
    def description(self) -> str:
        """The same as JSON."""
        return json.dumps(self.describe(), sort_keys=True)


def _own_code(x: Any) -> str | None:
    """The first class or function in a tree that neither this package has nor one that it is built on."""
    if isinstance(x, tuple | list | dict):
        parts = list(x.values() if isinstance(x, dict) else x)
    else:
        module = getattr(x, "__module__", None) or type(x).__module__
        if module.partition(".")[0] not in KNOWN:
            return getattr(x, "__name__", type(x).__name__)
        parts = [getattr(x, f.name, None) for f in dataclasses.fields(x)] if dataclasses.is_dataclass(x) else []
    return next(filter(None, map(_own_code, parts)), None)
