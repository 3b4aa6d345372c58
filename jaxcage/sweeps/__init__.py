"""Sweeps.

| module     | responsibility                                     |
|------------|----------------------------------------------------|
| `_lanes`   | lanes of a sweep: settled, observed, their error   |
| `_speed`   | sweeps over speed from several starts              |
| `_bearing` | sweeps of the whole bearing over shaft speed         |
| `_bearing_ramp` | the whole bearing run up and down again     |
| `_monodromy` | monodromy matrices of many lanes                 |
| `_averages` | means and peaks of forces and the like over revolutions |
| `_motion`  | size of the motion and frequency of the whirl      |
| `_carried` | run-up and run-down with the state carried along   |
| `_ramps`   | true ramps of the speed, up and down               |
"""

from .._arguments import check_layer
from ._averages import averages as averages
from ._bearing import (
    require_bearings as require_bearings,
    sweep_bearing as sweep_bearing,
    sweep_bearings as sweep_bearings,
)
from ._bearing_ramp import (
    BearingRamp as BearingRamp,
    BearingUpDown as BearingUpDown,
    bearing_up_down as bearing_up_down,
)
from ._carried import run_up_down as run_up_down
from ._lanes import Progress as Progress, run_lanes as run_lanes
from ._monodromy import monodromy as monodromy
from ._motion import Motion as Motion, motions as motions
from ._ramps import (
    Ramped as Ramped,
    RampUpDown as RampUpDown,
    ramp_revolutions as ramp_revolutions,
    ramp_up_down as ramp_up_down,
)
from ._speed import (
    initial_states as initial_states,
    make_plan as make_plan,
    require_persist as require_persist,
    rpm as rpm,
    settings_of as settings_of,
    sweep as sweep,
    sweep_designs as sweep_designs,
    versions as versions,
)


check_layer(
    globals(),
    "bearing_up_down monodromy run_up_down sweep sweep_bearing sweep_bearings sweep_designs",
)
