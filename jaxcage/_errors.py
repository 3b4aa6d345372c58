"""What goes wrong, in sentences that are shown as they are, by a script and by the command alike."""

from collections.abc import Callable
from typing import Any

import numpy as np


class InputError(ValueError):
    """Bad input, in one sentence that names what was given and what is allowed."""


class ArgumentError(InputError):
    """The same of arguments, by their names: a function's are called `so`, and an option of the command --so."""

    def __init__(self, *names: str, said: str = ""):
        super().__init__(*names)
        self.names, self.said = names, said

    def __str__(self) -> str:
        return self.about("Argument", lambda name: f"`{name}`")

    def about(self, what: str, called: Callable[[str], str]) -> str:
        """The sentence, about arguments that go by other names."""
        *most, last = map(called, self.names)
        return f"{what}s {', '.join(most)} and {last} {self.said}" if most else f"{what} {last} {self.said}"


class NoResult(Exception):
    """A computation without a result, in one sentence that says why."""


def shown(value: Any) -> str:
    """A value as a message shows it."""
    plain = bool | int | float | complex | str
    row = isinstance(value, tuple | list) and all(isinstance(x, plain) for x in value)
    if row or isinstance(value, plain | np.generic):
        try:
            text = repr(value) if row or isinstance(value, str | complex) else str(value)
        except ValueError:  # of thousands of digits
            return f"a very large {type(value).__name__}"
        return text if len(text) < 100 else f"{text[:100]}..."
    if kind_of := getattr(value, "dtype", None):
        kind = "a masked array" if isinstance(value, np.ma.MaskedArray) else "an array"
        return f"{kind} of shape {np.shape(value)} and kind {kind_of}"
    return f"something of kind {type(value).__name__}"
