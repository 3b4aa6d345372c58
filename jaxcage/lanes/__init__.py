"""Lanes: a plan and settings in, one data set out, on all cores.

| module     | responsibility                                                                  |
|------------|---------------------------------------------------------------------------------|
| `settings` | how long lanes run, what is computed of them, how exactly                       |
| `plan`     | which lanes are run: designs, speeds, initial states                            |
| `observe`  | lanes run and observed, their errors                                            |
| `confirm`  | labels confirmed by finer steps                                                 |
| `horizon`  | lanes followed until they settle                                                |
| `run`      | plan and settings to data set; sweeps over speed                                |
| `dataset`  | the data set with units, words and provenance; zarr                             |
"""

from .._arguments import check_layer
from .confirm import Confirmation as Confirmation
from .dataset import load as load, save as save, settings_of as settings_of, stored_configuration as stored_configuration, versions as versions
from .observe import Progress as Progress
from .plan import Plan as Plan, Speeds as Speeds, States as States, rpm as rpm
from .run import run_lanes as run_lanes, run_up_down as run_up_down, sweep as sweep
from .settings import Run as Run


check_layer(globals(), "run_up_down sweep")
