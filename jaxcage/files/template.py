"""A configuration to start from: every value with its unit, its meaning and where it comes from."""

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from .._errors import InputError


Subject = Literal["cage", "bearing"]
"""Subject of a file: the cage in its land, or the whole bearing."""
CHOSEN = (
    *("model", "speeds", "material", "guidance", "clearance_reading", "unbalance", "kind"),
    *("drag_coefficient", "drag_law", "rolling_law", "oil_share", "wear_coefficient"),
)
"""Keys of the templates that are no numbers of the NU2310."""


TABLE = re.compile(r"\s*\[([^\[\]]+)\]\s*(?:#.*)?")
"""Line that begins a table."""


def template(subject: Subject = "cage", short: bool = False) -> str:
    """The commented TOML text that `jaxcage init --full` writes, with every option; or the `short` one of `jaxcage
    init`, with what must be known. `load_model` accepts both as they are.
    """
    file = f"{'short_' * short}{'whole_' * (subject == 'bearing')}template.toml"
    return Path(__file__).with_name(file).read_text(encoding="utf-8")


def left_as_written(text: str, subject: Subject = "cage") -> tuple[str, ...]:
    """Dotted names of the values of a TOML text whose lines, comments included, are still those of a template."""
    written = {found for short in (True, False) for found in _lines(template(subject, short))}
    return tuple(dict.fromkeys(name for name, line in _lines(text) if (name, line) in written))


def _lines(text: str) -> Iterator[tuple[str, str]]:
    """Dotted name and line of every value that is a number of a bearing."""
    table = ""
    for line in text.splitlines():
        if head := TABLE.fullmatch(line):
            table = f"{head[1].strip()}."
        elif (key := line.partition("=")[0].strip()).isidentifier() and key not in CHOSEN:
            yield table + key, line.strip()


def write_template(path: str | Path, subject: Subject = "cage", short: bool = False) -> Path:
    """Write a template, see there, to a new file.

    **Raises:** `ValueError`, one sentence, if the name does not end in `.toml`, if the file is there already, or if it
    cannot be written.
    """
    target, text = Path(path), template(subject, short)
    if target.suffix.lower() != ".toml":
        raise InputError(f"File '{path}' must end in .toml, so that the commands take it for a description.")
    try:
        with open(target, "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"File '{path}' must be a new one, but is there already and is left as it is.") from None
    except OSError as error:
        with contextlib.suppress(OSError):  # a partial file would block the next attempt
            target.unlink()
        raise InputError(f"File '{path}' must be in a folder that can be written to, but: {error.strerror}.") from error
    return target
