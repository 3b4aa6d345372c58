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


LONGEST = 100
"""Characters of a value that a message shows."""


def visible(text: str) -> str:
    """The text with characters spelt out that move the cursor or turn the direction of writing."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def printable(text: str) -> str:
    """The text for a message: on one line, shortened, without control characters."""
    return visible(text[:LONGEST]) + "..." * (len(text) > LONGEST)


def shown(value: Any) -> str:
    """Any value for a message: arrays by their shape, objects by their kind."""
    if isinstance(value, np.generic):
        value = value.item()
    if kind_of := getattr(value, "dtype", None):
        kind = "a masked array" if isinstance(value, np.ma.MaskedArray) else "an array"
        return f"{kind} of shape {np.shape(value)} and kind {kind_of}"
    if type(value).__module__ not in ("builtins", "datetime"):
        return f"something of kind {type(value).__name__}"
    try:
        return printable(repr(value))
    except (RecursionError, ValueError):  # nested a thousand times, or of thousands of digits
        return f"a very large {type(value).__name__}"


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
