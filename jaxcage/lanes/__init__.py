"""Runs of many lanes (trajectories) on all cores: from a plan and settings to one data set.

| module     | responsibility                                                                  |
|------------|---------------------------------------------------------------------------------|
| `settings` | length, accuracy and results of a run                                           |
| `plan`     | designs, speeds and initial states of the lanes                                 |
| `observe`  | integration of lanes, with what is observed and its errors                      |
| `horizon`  | continuation of lanes until they settle                                         |
| `run`      | from plan and settings to a data set; confirmation of labels; sweeps            |
| `dataset`  | the data set with units, texts and provenance; zarr                             |
| `ramps`    | run-up and run-down                                                             |
| `grid`     | grids and samples of parameters, in chunks                                      |
| `study`    | runs over any parameters, stored chunk by chunk; maps of labels                 |
| `store`    | the zarr folder of a study, consistent at any time                              |
"""

from .._arguments import check_layer
from .._errors import Stop as Stop
from .dataset import load as load, save as save, stored_configuration as stored_configuration
from .grid import Grid as Grid, sobol as sobol, with_values as with_values
from .observe import Progress as Progress, start_tangents as start_tangents
from .plan import Plan as Plan, Speeds as Speeds, States as States, rpm as rpm, states_at as states_at
from .ramps import (
    apart as apart,
    ramp_revolutions as ramp_revolutions,
    ramp_up_down as ramp_up_down,
    stretches_apart as stretches_apart,
)
from .run import run_lanes as run_lanes, sweep as sweep
from .settings import Run as Run
from .store import Store as Store, Study as Study, open_study as open_study
from .study import label_map as label_map, run_study as run_study, study as study


check_layer(globals(), "label_map open_study study sweep")
