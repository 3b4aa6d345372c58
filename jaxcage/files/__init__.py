"""Configuration files, with units, and files that are written whole or not at all.

| module         | responsibility                                                            |
|----------------|---------------------------------------------------------------------------|
| `units`        | texts with a unit to SI numbers; cage speed or shaft speed                |
| `ranges`       | values that are known within a range only                                 |
| `schema`       | declarations of tables and keys, from the fields of the modules           |
| `description`  | TOML whose keys and values are checked against these, without JAX         |
| `plausibility` | values that must fit together                                             |
| `config`       | a description that passed to `CageModel` or `BearingModel`                |
| `toml`         | a model to nested mapping or TOML; a TOML file with other ranges          |
| `template`     | a commented TOML file to start from                                       |
| `measurements` | values measured on a machine, from CSV                                    |
| `disk`         | whole files or none; is a folder writable                                 |
"""

import importlib as _importlib
from typing import TYPE_CHECKING, Any as _Any

from .description import (
    ConfigError as ConfigError,
    Description as Description,
    declarations as declarations,
    describe as describe,
    read_description as read_description,
)
from .disk import check_writable as check_writable, read_bytes as read_bytes, replacing as replacing, sync as sync
from .measurements import Measurement as Measurement, read_measurements as read_measurements
from .plausibility import check_together as check_together
from .ranges import Range as Range, is_range as is_range, read_range as read_range
from .template import Subject as Subject, template as template, write_template as write_template
from .units import (
    SpeedOf as SpeedOf,
    Whose as Whose,
    own_rpm as own_rpm,
    read_rpm as read_rpm,
    split_owner as split_owner,
    to_si as to_si,
)


if TYPE_CHECKING:
    from .config import (
        BearingFile as BearingFile,
        Unknown as Unknown,
        built as built,
        load_model as load_model,
        model_from as model_from,
        read_bearing as read_bearing,
    )
    from .toml import (
        configuration as configuration,
        save_model as save_model,
        toml_text as toml_text,
        with_ranges as with_ranges,
    )


def __getattr__(name: str) -> _Any:
    """Load what builds models, and JAX with it, with the first of its names: a wrong file is refused without."""
    if not name.startswith("_"):
        for module in ("config", "toml"):
            found = vars(_importlib.import_module(f".{module}", __name__))
            if name in found:
                return found[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
