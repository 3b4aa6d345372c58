"""Exceptions whose messages are complete sentences, shown as they are by scripts and by the command."""

import difflib
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np


class InputError(ValueError):
    """Invalid input; the message names what was given and what is allowed."""


class ConfigError(InputError):
    """A configuration that is refused; the message is one sentence that names the key and what it may be."""


class ArgumentError(InputError):
    """Invalid arguments, by name: shown as `name` for a function and as --name for an option of the command."""

    def __init__(self, *names: str, said: str = ""):
        super().__init__(*names)
        self.names, self.said = names, said

    def __str__(self) -> str:
        return self.about("Argument", lambda name: f"`{name}`")

    def about(self, what: str, called: Callable[[str], str]) -> str:
        """Message that calls the arguments by other names."""
        *most, last = map(called, self.names)
        return f"{what}s {', '.join(most)} and {last} {self.said}" if most else f"{what} {last} {self.said}"


class NoResult(Exception):
    """Computation without a result; the message says why."""


def shown(value: Any) -> str:
    """Text of a value for messages."""
    plain = bool | int | float | complex | str
    row = isinstance(value, tuple | list) and all(isinstance(x, plain) for x in value)
    if row or isinstance(value, plain | np.generic):
        try:
            text = repr(value) if row or isinstance(value, str | complex) else str(value)
        except ValueError:  # an integer with thousands of digits
            return f"a very large {type(value).__name__}"
        return text if len(text) < 100 else f"{text[:100]}..."
    if kind_of := getattr(value, "dtype", None):
        kind = "a masked array" if isinstance(value, np.ma.MaskedArray) else "an array"
        return f"{kind} of shape {np.shape(value)} and kind {kind_of}"
    return f"something of kind {type(value).__name__}"


def parameters_like(given: str, names: Sequence[str]) -> str:
    """Say which parameters to choose instead of an unknown one: those with a similar name, or all of them if they are
    few or none is similar."""
    if not names:
        return "a parameter, of which there are none"
    close = lambda name: given in name or difflib.get_close_matches(given[:100], re.split("[._]", name), 1, 0.7)
    like = [name for name in names if close(name)] or difflib.get_close_matches(given[:100], names)
    if len(names) > FEW and 0 < len(like) <= FEW:
        return f"a parameter (did you mean {' or '.join(like)}?)"
    return f"one of {', '.join(names)}"


FEW = 12
"""Number of names that a message lists."""


class Stop(KeyboardInterrupt):
    """Raised by a progress function to end a run of lanes early; the result is then that of the finished lanes."""
