"""Files in and out, units at the door.

| module          | responsibility                                                            |
|-----------------|---------------------------------------------------------------------------|
| `_units`        | texts with a unit to SI numbers                                           |
| `_schema`       | what a configuration may hold, from the fields of the modules             |
| `_config`       | TOML to `CageModel` or `BearingModel`, with every value checked           |
| `_write_config` | a model to nested mapping or TOML; a TOML file with other ranges          |
| `_ranges`       | values that are known within a range only                                 |
| `_measurements` | what was measured on a machine, from CSV                                  |
| `_tables`       | tables as CSV or Excel                                                    |
| `_speeds`       | cage speed or shaft speed                                                 |
| `_template`     | a commented TOML file to start from                                       |
| `_csv`          | time histories, strobe points and branches as CSV                         |
| `_files`        | whole files or none; is a folder writable                                 |
"""

from ._config import (
    BearingFile as BearingFile,
    Unknown as Unknown,
    check_together as check_together,
    load_model as load_model,
    load_whole_bearing as load_whole_bearing,
    model_from as model_from,
    read_bearing as read_bearing,
    read_whole_bearing as read_whole_bearing,
    subject_of as subject_of,
    whole_bearing_from as whole_bearing_from,
)
from ._csv import (
    branch_columns as branch_columns,
    read_columns as read_columns,
    strobe_columns as strobe_columns,
    trajectory_columns as trajectory_columns,
    write_columns as write_columns,
)
from ._files import (
    check_writable as check_writable,
    read_bytes as read_bytes,
    replacing as replacing,
    sync as sync,
)
from ._measurements import Measurement as Measurement, read_measurements as read_measurements
from ._ranges import Range as Range, is_range as is_range, read_range as read_range
from ._schema import ConfigError as ConfigError
from ._speeds import (
    SpeedOf as SpeedOf,
    Whose as Whose,
    cage_rpm as cage_rpm,
    shaft_rpm as shaft_rpm,
    split_owner as split_owner,
)
from ._template import Subject as Subject, template as template, write_template as write_template
from ._units import to_si as to_si
from ._write_config import (
    configuration as configuration,
    save_model as save_model,
    toml_text as toml_text,
    with_ranges as with_ranges,
)
