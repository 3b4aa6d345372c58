"""Sweeps.

| module     | responsibility                                     |
|------------|----------------------------------------------------|
| `_engine`  | lanes in chunks, on all cores                      |
| `_speed`   | sweeps over speed from several starts              |
| `_monodromy` | derivatives of the strobe map of many lanes       |
| `_carried` | run-up and run-down with the state carried along   |
"""

from ._carried import Hysteresis as Hysteresis, run_up_down as run_up_down
from ._engine import cores as cores
from ._monodromy import monodromy as monodromy
from ._speed import rpm as rpm, sweep as sweep
