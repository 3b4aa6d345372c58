"""Sweeps.

| module     | responsibility                                     |
|------------|----------------------------------------------------|
| `_engine`  | lanes in chunks, on all cores                      |
| `_speed`   | sweeps over speed from several starts              |
| `_carried` | run-up and run-down with the state carried along   |
"""

from ._speed import rpm as rpm, sweep as sweep
