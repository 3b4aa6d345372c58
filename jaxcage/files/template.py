"""A configuration to start from: every value with its unit, its meaning and where it comes from."""

import contextlib
import functools
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from string import Template
from typing import Any, Literal

from .._errors import InputError
from .._parameters import parameters
from ..models import case, whole_bearing


Subject = Literal["cage", "bearing"]
"""Subject of a file: the cage in its land, or the whole bearing."""
CHOSEN = (
    *("model", "speeds", "clearance_reading", "unbalance", "kind"),
    *("drag_coefficient", "drag_law", "rolling_law", "oil_share", "wear_coefficient"),
)
"""Keys of the templates that are no numbers of the NU2310."""


@functools.cache
def template(subject: Subject = "cage") -> str:
    """The commented TOML text that `jaxcage init` writes; `load_model` accepts it as it is.

    Dimensions stand in the text. Constants that the paper does not print are filled in from those of its cases, and
    derived ones of the whole bearing from them.
    """
    if subject == "cage":
        file, model = "template.toml", case("1a")
    else:
        file, model = "whole_template.toml", whole_bearing("nu2310")
    text = Path(__file__).with_name(file).read_text(encoding="utf-8")
    numbers = parameters(model) | {"land_width_mm": 1e3 * model.film.land_width}
    filled = Template(text).substitute({name: f"{float(value):.4g}" for name, value in numbers.items()})
    return "\n".join(map(_aligned, filled.splitlines())) + "\n"


def left_as_written(table: Mapping[str, Any], subject: Subject = "cage") -> tuple[str, ...]:
    """Dotted names of the values of a nested mapping that are still those of the template, the NU2310's."""
    return tuple(_alike(table, tomllib.loads(template(subject)), ()))


def _alike(given: Mapping[str, Any], written: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    for key, value in given.items():
        other = written.get(key)
        if isinstance(value, Mapping) and isinstance(other, Mapping):
            yield from _alike(value, other, (*path, key))
        elif value == other and key not in CHOSEN:
            yield ".".join((*path, key))


def _aligned(line: str) -> str:
    """`line` with its comment in the same column as the others."""
    value, sign, comment = line[2:].partition(" # ")  # the first two may be the sign of an option
    return f"{(line[:2] + value).rstrip():<34} # {comment}" if sign else line


def write_template(path: str | Path, subject: Subject = "cage") -> Path:
    """Write the template of a cage, or of a whole bearing, to a new file.

    **Raises:** `ValueError`, one sentence, if the name does not end in `.toml`, if the file is there already, or if it
    cannot be written.
    """
    target, text = Path(path), template(subject)
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
