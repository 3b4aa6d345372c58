"""Results and measurements in files. The names of `jaxcage.files` are here as well.

| module          | responsibility                                                            |
|-----------------|---------------------------------------------------------------------------|
| `_measurements` | what was measured on a machine, from CSV                                  |
| `_csv`          | time histories, strobe points and branches as CSV                         |
"""

from ..files import (
    BearingFile as BearingFile,
    ConfigError as ConfigError,
    Range as Range,
    SpeedOf as SpeedOf,
    Subject as Subject,
    Unknown as Unknown,
    Whose as Whose,
    cage_rpm as cage_rpm,
    check_together as check_together,
    check_writable as check_writable,
    configuration as configuration,
    is_range as is_range,
    load_model as load_model,
    load_whole_bearing as load_whole_bearing,
    model_from as model_from,
    read_bearing as read_bearing,
    read_bytes as read_bytes,
    read_range as read_range,
    read_whole_bearing as read_whole_bearing,
    replacing as replacing,
    save_model as save_model,
    shaft_rpm as shaft_rpm,
    split_owner as split_owner,
    subject_of as subject_of,
    sync as sync,
    template as template,
    to_si as to_si,
    toml_text as toml_text,
    whole_bearing_from as whole_bearing_from,
    with_ranges as with_ranges,
    write_template as write_template,
)
from ..files.measurements import Measurement as Measurement, read_measurements as read_measurements
from ._csv import (
    branch_columns as branch_columns,
    read_columns as read_columns,
    strobe_columns as strobe_columns,
    trajectory_columns as trajectory_columns,
    write_columns as write_columns,
)
