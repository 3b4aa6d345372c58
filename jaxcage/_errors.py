"""What goes wrong, in sentences that are shown as they are, by a script and by the command alike."""

from collections.abc import Callable


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
